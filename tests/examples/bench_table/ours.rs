//! Our measurements, in a separate process. This is the only file here that calls our crates.

use std::error::Error;
use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};

use cotan::geometry::SpatialOrder;
use cotan::linear::{Defect, Method, PreparedSystem};
use cotan::prelude::*;

use crate::job::{Job, Moves};
use crate::measured::Phases;

/// The first word of a child's command line.
pub(crate) const MODE: &str = "--ours";

/// The orientations to compare: one with a single solve per iteration, and the default.
pub(crate) const ORIENTATIONS: [&str; 2] = ["rotation", "hybrid"];

pub(crate) fn run(path: &Path, orientation: &str) -> Result<(), Box<dyn Error>> {
    let job = Job::read(path)?;
    let options = DeformOptions::default().orientation(orientation.parse()?);
    let mut phases = Phases::default();
    whole_job(&job, &options, &mut phases)?;
    let job = in_order(&job);
    let mesh = HalfedgeMesh::from_faces(job.positions.len(), &job.faces)?;
    let mut flow = flow(&mesh, &job, &options)?;
    system(&flow, &mut phases)?;
    iterations(&mut flow, &job.moves, &mut phases)?;
    phases.number("bandwidth", bandwidth());
    println!("{}", phases.to_json());
    Ok(())
}

/// Measures the job from faces and positions to the deformed mesh, and its memory.
fn whole_job(
    job: &Job,
    options: &DeformOptions,
    phases: &mut Phases,
) -> Result<(), Box<dyn Error>> {
    let before = peak_megabytes();
    let mut report = None;
    repeat(|| {
        report = Some(phases.time("job", || {
            let job = in_order(job);
            let handles = handles(&job.moves);
            let mesh = HalfedgeMesh::from_faces(job.positions.len(), &job.faces)?;
            let deformed = deform(
                Surface::assume_checked(&mesh, &job.positions),
                &handles,
                options,
            )?;
            Ok::<_, Box<dyn Error>>(deformed.report)
        }));
    });
    if let Some(report) = report.transpose()? {
        phases.number("num_iterations", report.iterations as f64);
        let is_converged = report.stop == StopReason::Converged;
        phases.number("converged", f64::from(u8::from(is_converged)));
    }
    phases.number("megabytes", peak_megabytes() - before);
    repeat(|| {
        black_box(phases.time("connectivity", || {
            let job = in_order(job);
            HalfedgeMesh::from_faces(job.positions.len(), &job.faces)
        }))
        .ok();
    });
    Ok(())
}

/// Reorders a mesh as loading a file does: scattered vertices are put in a spatial order.
fn in_order(job: &Job) -> Job {
    if !SpatialOrder::is_scattered(job.positions.len(), &job.faces) {
        return job.clone();
    }
    let order = SpatialOrder::of(&job.positions);
    Job {
        positions: order.gather(&job.positions),
        faces: order.faces(&job.faces).0,
        moves: job
            .moves
            .iter()
            .map(|&(v, p)| (order.new_id(v), p))
            .collect(),
    }
}

fn handles(moves: &Moves) -> Handles<f64> {
    moves
        .iter()
        .fold(Handles::new(), |handles, &(v, p)| handles.move_to(v, p))
}

fn flow(
    mesh: &HalfedgeMesh,
    job: &Job,
    options: &DeformOptions,
) -> Result<Flow<f64>, Box<dyn Error>> {
    let held = job.moves.iter();
    let at_rest = held.map(|&(v, _)| (Handle::hard(v), job.positions[v]));
    Ok(options
        .apply(Flow::builder(mesh, &job.positions))
        .handles(at_rest)
        // With tolerance 0 no step takes the shortcut of a converged one.
        .tolerance(0.0)
        .build()?)
}

/// Measures factorization, solve and a change of handles, and faer's own factorization and solve.
fn system(flow: &Flow<f64>, phases: &mut Phases) -> Result<(), Box<dyn Error>> {
    let rest = flow.rest();
    let prepare =
        |handles: &[Handle]| PreparedSystem::prepare(rest.operator(), handles, flow.membrane());
    let mut system = prepare(flow.handles())?;
    repeat(|| {
        if let Ok(fresh) = phases.time("prepare", || prepare(flow.handles())) {
            system = fresh;
        }
    });
    phases.number(
        "columns",
        f64::from(u8::from(system.choice().method == Method::Columns)),
    );
    // Without the columns of the handles: with one handle there are none.
    repeat(|| {
        black_box(phases.time("factor", || prepare(&flow.handles()[..1]))).ok();
    });
    // Exchange one handle for a neighbour, and back.
    let mut changed = flow.handles().to_vec();
    if let Some(handle) = changed.last_mut() {
        let is_free = |v: &VertexId| flow.handles().iter().all(|h| h.vertex != *v);
        let mut ring = rest.mesh().one_ring(handle.vertex);
        handle.vertex = ring.find(is_free).unwrap_or(handle.vertex);
    }
    let mut is_changed = false;
    repeat(|| {
        is_changed = !is_changed;
        let handles = if is_changed { &changed } else { flow.handles() };
        phases
            .time("change a handle", || system.set_handles(handles))
            .ok();
    });

    let n = rest.positions().len();
    let mismatch = rest.laplacian().clone();
    let still = VertexMap::filled(n, Vector3::zeros());
    let mut correction = still.clone();
    repeat(|| {
        phases.time("solve", || {
            let defect = Defect::of_laplacian(black_box(&mismatch)).with_tension(&still);
            system.correct(&defect, &mut correction).ok();
        });
    });
    phases.number("factor_bytes", 8.0 * system.factor_entries() as f64);
    drop(system);
    let matrix = rest.operator().matrix();
    crate::faer_peer::measure(&matrix, phases);
    Ok(())
}

/// Measures single iterations after the handles have moved.
fn iterations(
    flow: &mut Flow<f64>,
    moves: &Moves,
    phases: &mut Phases,
) -> Result<(), Box<dyn Error>> {
    flow.move_handles(moves)?;
    // The first two steps only respond to the move.
    for _ in 0..2 {
        flow.step()?;
    }
    for _ in 0..10 {
        phases.time("iteration", || flow.step())?;
    }
    Ok(())
}

/// Runs `work` at least once, then repeatedly for a while.
pub(crate) fn repeat(mut work: impl FnMut()) {
    let start = Instant::now();
    for _ in 0..MAX_RUNS {
        work();
        if start.elapsed() > ENOUGH {
            break;
        }
    }
}

/// The memory bandwidth of one reading thread, in bytes per second.
fn bandwidth() -> f64 {
    const LEN: usize = 1 << 25;
    let data = vec![1.0f64; LEN];
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let start = Instant::now();
        let mut sums = [0.0; 32];
        for chunk in black_box(&data).chunks_exact(32) {
            for (sum, x) in sums.iter_mut().zip(chunk) {
                *sum += x;
            }
        }
        black_box(sums);
        best = best.min(start.elapsed().as_secs_f64());
    }
    (8 * LEN) as f64 / best
}

/// The peak memory so far, if the system reports it.
fn peak_megabytes() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|rest| {
        rest.trim()
            .trim_end_matches("kB")
            .trim()
            .parse::<f64>()
            .ok()
    });
    kilobytes.unwrap_or(f64::NAN) / 1024.0
}

const MAX_RUNS: usize = 11;
const ENOUGH: Duration = Duration::from_millis(600);
