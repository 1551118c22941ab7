//! Prints the cost of each strategy of the linear system, and the difference of their
//! corrections.
//!
//! ```text
//! cargo run --release -p cotan-tests --example strategy_table [-- HANDLES [RUNS]]
//! ```
//!
//! HANDLES point handles (default 32) are spread over each model. `factor` is analysis and
//! numbers (the time to prepare a system with one handle), `prepare` includes the columns;
//! `exchange` replaces one handle by another; `correct` is one correction. Prints medians, in
//! milliseconds of processor time over all threads, so that other work on the machine matters
//! little. `apart` is the largest difference of the corrections by the two strategies, over the
//! largest correction.

use cotan::flow::Flow;
use cotan::geometry::{Mesh, shapes};
use cotan::laplacian::{Cotangent, LaplacianScheme, Operator, Tutte};
use cotan::linear::{Defect, Membrane, PreparedSystem, Strategy, SystemOptions};
use cotan::prelude::*;
use cotan_tests::shared;

/// The terms of the system.
#[derive(Clone, Copy, PartialEq)]
enum Terms {
    Membrane,
    Cotangent,
    Tutte,
}

fn main() {
    let mut arguments = std::env::args().skip(1).filter_map(|a| a.parse().ok());
    let (handles, runs) = (
        arguments.next().unwrap_or(32),
        arguments.next().unwrap_or(5),
    );
    println!(
        "| model | vertices | terms | strategy | entries | factor | prepare | exchange | correct | apart | auto |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for name in ["dinosaur.obj", "armadillo.ply"] {
        let Some(path) = shared(&format!("meshes/{name}")) else {
            continue;
        };
        let document = cotan_io::load(&path).expect("a model loads");
        let surface = document.surface().expect("a model is a manifold");
        table(name, surface.mesh(), surface.positions(), handles, runs);
    }
    let (mesh, positions) = rough_torus(500, 200).into_parts();
    table("torus", &mesh, &positions, handles, runs);
}

/// A torus with displaced vertices, so that no two triangles are alike.
fn rough_torus(around: usize, across: usize) -> Mesh<f64> {
    let mut shape = shapes::torus::<f64>(1.0, 0.4, around, across);
    for (i, p) in shape.positions_mut().iter_mut().enumerate() {
        let t = i as f64;
        *p += Vector3::new(t.sin(), (1.7 * t).cos(), (2.3 * t).sin()) * 0.002;
    }
    shape
}

fn table(name: &str, mesh: &HalfedgeMesh, positions: &Positions<f64>, handles: usize, runs: usize) {
    let n = positions.len();
    let spread = |k: usize| Handle::hard(VertexId::new((k * (n - 1)) / handles));
    let held: Vec<Handle> = (0..handles).map(spread).collect();
    let mut other = held.clone();
    other[handles / 2] = Handle::hard(VertexId::new(n - 1));
    let flow = Flow::builder(mesh, positions)
        .handles(held.iter().map(|h| (*h, positions[h.vertex])))
        .build()
        .expect("a flow");
    let rest = flow.rest();
    let tutte = Operator::assemble(&Tutte as &dyn LaplacianScheme<f64>, &rest.surface());
    let cotangent = Operator::assemble(&Cotangent::default(), &rest.surface());
    let (tutte, cotangent) = (tutte.expect("weights"), cotangent.expect("weights"));
    let mu = flow.membrane().map_or(0.0, |membrane| membrane.weight);
    let turned = |i: usize| {
        let t = rest.positions().as_slice()[i].coords;
        Vector3::new((3.0 * t.y).sin(), (2.0 * t.z).cos(), t.x * t.y)
    };
    for terms in [Terms::Membrane, Terms::Cotangent, Terms::Tutte] {
        let operator = if terms == Terms::Tutte {
            &tutte
        } else {
            &cotangent
        };
        let membrane = (terms == Terms::Membrane).then_some(Membrane {
            weight: mu,
            weights: rest.membrane_weights(),
        });
        let size = rest
            .laplacian()
            .values()
            .map(|l| l.norm())
            .fold(0.0, f64::max);
        let mismatch = VertexMap::from_fn(n, |v: VertexId| {
            rest.laplacian()[v] + turned(v.index()) * (0.1 * size)
        });
        let tension = VertexMap::from_fn(n, |v: VertexId| {
            let mut sum = Vector3::zeros();
            for (j, k) in rest.graph().row(v.index()) {
                let step = turned(j.index()) - turned(v.index());
                sum += step * (0.5 * rest.membrane_weights()[k]);
            }
            sum
        });
        let zeros = VertexMap::filled(n, Vector3::zeros());
        let mut found = Vec::new();
        for strategy in [Strategy::Normal, Strategy::Columns] {
            let options = SystemOptions::new().strategy(strategy);
            let mut times = [const { Vec::new() }; 4];
            let mut correction = zeros.clone();
            let mut entries = 0;
            for _ in 0..runs {
                let start = processor_seconds();
                let mut system = PreparedSystem::prepare_with(operator, &held, membrane, &options)
                    .expect("a factor");
                times[0].push(processor_seconds() - start);
                entries = system.factor_entries();
                let start = processor_seconds();
                PreparedSystem::prepare_with(operator, &held[..1], membrane, &options)
                    .expect("a factor");
                times[3].push(processor_seconds() - start);
                for handles in [&other, &held] {
                    let start = processor_seconds();
                    system.set_handles(handles).expect("handles");
                    times[1].push(processor_seconds() - start);
                }
                for _ in 0..4 {
                    let start = processor_seconds();
                    let defect = Defect {
                        tension: membrane.map(|_| &tension),
                        ..Defect::of_laplacian(&mismatch)
                    };
                    system
                        .correct(&defect, &mut correction)
                        .expect("a solution");
                    times[2].push(processor_seconds() - start);
                }
            }
            found.push(correction);
            let apart = apart(&found[0], &found[found.len() - 1]);
            let auto = PreparedSystem::prepare(operator, &held, membrane).expect("a factor");
            let [prepare, exchange, correct, factor] = times.map(|t| 1e3 * median(t));
            println!(
                "| {name} | {n} | {} | {strategy} | {:.2} M | {factor:.1} | {prepare:.1} | {exchange:.2} | {correct:.2} | {apart:.1e} | {} |",
                match terms {
                    Terms::Membrane => "cotangent, membrane",
                    Terms::Cotangent => "cotangent",
                    Terms::Tutte => "tutte",
                },
                entries as f64 / 1e6,
                auto.choice().method,
            );
        }
    }
}

fn apart(a: &VertexMap<Vector3<f64>>, b: &VertexMap<Vector3<f64>>) -> f64 {
    let difference = a.values().zip(b.values()).map(|(a, b)| (a - b).norm());
    let size = a.values().map(|a| a.norm()).fold(0.0, f64::max);
    difference.fold(0.0, f64::max) / size
}

/// The processor time used by the threads of this process so far. Linux only; 0 elsewhere.
fn processor_seconds() -> f64 {
    let nanoseconds = |path: std::path::PathBuf| {
        let text = std::fs::read_to_string(path.join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<u64>().ok()
    };
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten();
    let sum: u64 = tasks
        .flatten()
        .filter_map(|task| nanoseconds(task.path()))
        .sum();
    sum as f64 * 1e-9
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
