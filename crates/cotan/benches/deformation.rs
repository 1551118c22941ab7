//! Cost of an interactive edit, phase by phase, at two mesh sizes.
//!
//! `cargo bench -p cotan --bench deformation` takes a minute or two. Everything up to the
//! factorization is paid once per mesh and set of handles, while the solve and the iteration are
//! paid repeatedly. The difference is the saving from keeping a `Session`.

use std::hint::black_box;
use std::time::{Duration, Instant};

use cotan::geometry::{Mesh, shapes};
use cotan::laplacian::{Cotangent, Operator};
use cotan::linear::{Defect, Handle, PreparedSystem};
use cotan::prelude::*;
use criterion::{Criterion, SamplingMode, Throughput, criterion_group, criterion_main};

/// The fraction of vertices that are held: half of them fixed, half of them moved.
const HANDLE_SHARE: f64 = 0.05;
/// Iterations after each move of the handles, about as many as an edit takes.
const STEPS_PER_MOVE: usize = 10;

fn deformation(criterion: &mut Criterion) {
    phases(criterion, &shapes::creature(103));
    // The largest creature has 87,000 vertices.
    phases(criterion, &bumpy_torus(510, 255));
}

fn phases(criterion: &mut Criterion, shape: &Mesh<f64>) {
    let n = shape.num_vertices();
    let mut group = criterion.benchmark_group(format!("{n} vertices"));
    // On a shared machine, ten runs of a second each are as informative as a hundred.
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    group
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(4));
    group.throughput(Throughput::Elements(n as u64));

    let faces: Vec<[u32; 3]> = shape
        .connectivity()
        .faces()
        .map(|f| shape.connectivity().triangle(f).map(|v| v.index() as u32))
        .collect();
    group.bench_function("half-edge build", |b| {
        b.iter(|| HalfedgeMesh::from_faces(n, black_box(&faces)));
    });

    let surface = shape.surface();
    group.bench_function("assembly", |b| {
        b.iter(|| Operator::assemble(&Cotangent::default(), &surface).map(|op| op.matrix()));
    });

    let ends = Ends::of(shape);
    let mut flow = ends.flow(shape);
    group.bench_function("factorization", |b| b.iter(|| prepare(&flow)));

    let mut system = prepare(&flow);
    let mismatch = flow.rest().laplacian().clone();
    let still = VertexMap::filled(n, Vector3::zeros());
    let mut correction = still.clone();
    group.bench_function("solve (3 right-hand sides)", |b| {
        b.iter(|| {
            let defect = Defect::of_laplacian(black_box(&mismatch)).with_tension(&still);
            system.correct(&defect, &mut correction)
        });
    });

    // The cost of a step depends on its position between a move and convergence, so whole runs of
    // steps are timed. One iteration takes a tenth of the result.
    let mut poses = [0.8, 0.4]
        .map(|angle| ends.turned(shape, angle))
        .into_iter()
        .cycle();
    group.bench_function(format!("{STEPS_PER_MOVE} iterations after a move"), |b| {
        b.iter_custom(|runs| {
            let mut spent = Duration::ZERO;
            for pose in poses.by_ref().take(runs as usize) {
                flow.move_handles(&pose).expect("these are handles");
                let start = Instant::now();
                for _ in 0..STEPS_PER_MOVE {
                    black_box(flow.step()).expect("built-in updaters do not fail");
                }
                spent += start.elapsed();
            }
            spent
        });
    });
    group.finish();
}

/// Factorizes the system of a flow again, as `FlowBuilder::build` does at the end.
fn prepare(flow: &Flow<f64>) -> PreparedSystem {
    PreparedSystem::prepare(flow.rest().operator(), flow.handles(), flow.membrane())
        .expect("held at both ends")
}

/// The vertices at the two ends along x.
struct Ends {
    fixed: Vec<VertexId>,
    moved: Vec<VertexId>,
}

impl Ends {
    fn of(shape: &Mesh<f64>) -> Self {
        let mut by_x: Vec<VertexId> = shape.connectivity().vertices().collect();
        by_x.sort_by(|&a, &b| shape.positions()[a].x.total_cmp(&shape.positions()[b].x));
        let count = (by_x.len() as f64 * HANDLE_SHARE / 2.0) as usize;
        let moved = by_x.split_off(by_x.len() - count);
        by_x.truncate(count);
        Self { fixed: by_x, moved }
    }

    fn flow(&self, shape: &Mesh<f64>) -> Flow<f64> {
        let held = self.fixed.iter().chain(&self.moved);
        Flow::builder(shape.connectivity(), shape.positions())
            .handles(held.map(|&v| (Handle::hard(v), shape.positions()[v])))
            // A zero tolerance keeps a converged step from being cut short.
            .tolerance(0.0)
            .build()
            .expect("a closed surface with handles")
    }

    /// The moved end, rotated about the z axis.
    fn turned(&self, shape: &Mesh<f64>, angle: f64) -> Vec<(VertexId, Point3<f64>)> {
        let turn = Isometry3::rotation(Vector3::z() * angle);
        self.moved
            .iter()
            .map(|&v| (v, turn * shape.positions()[v]))
            .collect()
    }
}

/// A torus with bumps. The details of a smooth one would be too easy.
fn bumpy_torus(around: usize, across: usize) -> Mesh<f64> {
    let mut shape = shapes::torus::<f64>(1.0, 0.4, around, across);
    for p in shape.positions_mut().iter_mut() {
        let bump: f64 = (31.0 * p.x).sin() * (29.0 * p.y).sin() * (23.0 * p.z).cos();
        *p += p.coords * (0.01 * bump);
    }
    shape
}

criterion_group!(benches, deformation);
criterion_main!(benches);
