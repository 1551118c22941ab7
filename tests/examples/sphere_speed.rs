//! Compares the time of a sphere map with that of its parts and of conformalized mean-curvature
//! flow.
//!
//! ```text
//! cargo run --release -p cotan-tests --example sphere_speed \
//!     [-- RUNS [part of a model's name ...]]
//! ```
//!
//! `unit` is one factorization of the Laplacian (weights, matrix, analysis, numbers) and one
//! solve; `whole` is reading the file, mapping and writing. Prints medians in seconds.

use std::hint::black_box;
use std::time::Instant;

use cotan::laplacian::{Cotangent, Operator};
use cotan::linear::{Defect, PreparedSystem};
use cotan::prelude::*;
use cotan::sphere::{SphereMethod, SphereOptions, spherical};
use cotan_tests::{closed_models, shared};

fn main() {
    let mut arguments = std::env::args().skip(1);
    let runs: usize = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(5);
    let wanted: Vec<String> = arguments.collect();
    println!(
        "| model | vertices | unit | spherical | spherical/unit | whole | whole/unit | cmcf | spherical/cmcf |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for name in closed_models() {
        if wanted.is_empty() || wanted.iter().any(|w| name.contains(w.as_str())) {
            row(name, runs);
        }
    }
}

fn row(name: &str, runs: usize) {
    let Some(path) = shared(&format!("meshes/{name}")) else {
        return;
    };
    let document = cotan_io::load(&path).expect("a model loads");
    let mesh = document.surface().expect("a model is a manifold");
    let (connectivity, positions) = (mesh.mesh(), mesh.positions());
    let robust = SphereOptions::default();
    let cmcf = robust.clone().method(SphereMethod::Cmcf);
    let mut times = [const { Vec::new() }; 4];
    for _ in 0..runs {
        times[0].push(seconds(|| unit(connectivity, positions)));
        times[1].push(seconds(|| {
            black_box(spherical(
                Surface::assume_checked(connectivity, positions),
                &robust,
            ))
            .ok();
        }));
        times[2].push(seconds(|| whole(&path)));
        times[3].push(seconds(|| {
            black_box(spherical(
                Surface::assume_checked(connectivity, positions),
                &cmcf,
            ))
            .ok();
        }));
    }
    let [unit, robust, whole, cmcf] = times.map(median);
    println!(
        "| {name} | {} | {unit:.3} | {robust:.3} | {:.1} | {whole:.3} | {:.1} | {cmcf:.3} | {:.2} |",
        positions.len(),
        robust / unit,
        whole / unit,
        robust / cmcf
    );
}

/// Measures one factorization and one solve.
fn unit(mesh: &HalfedgeMesh, positions: &Positions<f64>) {
    let surface = Surface::new(mesh, positions).expect("a surface");
    let operator = Operator::assemble(&Cotangent::default(), &surface).expect("weights");
    let handle = Handle::hard(VertexId::new(0));
    let mut system = PreparedSystem::prepare(&operator, &[handle], None).expect("a factor");
    let mut correction = VertexMap::filled(positions.len(), Vector3::zeros());
    let rhs = positions.map(|p| p.coords);
    let defect = Defect::of_laplacian(&rhs);
    system
        .correct(&defect, &mut correction)
        .expect("a solution");
    black_box(correction);
}

/// Measures reading the file, mapping and writing.
fn whole(path: &std::path::Path) {
    let mut document = cotan_io::load(path).expect("a model loads");
    let mesh = document.surface().expect("a model is a manifold");
    let done = spherical(mesh.surface(), &SphereOptions::default());
    let done = done.expect("a map");
    document
        .set_positions(&mesh, done.map.positions())
        .expect("positions fit");
    let format = document.format().expect("a format");
    black_box(document.write(format).expect("bytes"));
}

fn seconds(work: impl FnOnce()) -> f64 {
    let clock = Instant::now();
    work();
    clock.elapsed().as_secs_f64()
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
