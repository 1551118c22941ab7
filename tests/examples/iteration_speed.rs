//! Prints the cost of an iteration in nanoseconds per vertex, for every orientation: the whole
//! step, its solve, and the rest.
//!
//! ```text
//! RAYON_NUM_THREADS=1 cargo run --release -p cotan-tests --example iteration_speed \
//!     [-- part of a mesh's name ...]
//! ```
//!
//! Prints medians over the steps of one drag; run it on an idle machine. The solve is timed on a
//! separate system, prepared in the same way. Real models are skipped if they are not next to the
//! project. The time to assemble the operator, in nanoseconds per face, comes before the table.

use std::time::Instant;

use cotan::flow::{
    BestRotation, Flow, FlowBuilder, Hybrid, Limited, Reflect, ReflectFirst, RescaleByArea,
};
use cotan::linear::{Defect, PreparedSystem};
use cotan::prelude::*;
use cotan_geometry::shapes::icosphere;
use cotan_laplacian::{Cotangent, Operator};

const STEPS: usize = 21;

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let is_wanted =
        |name: &str| wanted.is_empty() || wanted.iter().any(|w| name.contains(w.as_str()));
    for name in ["dinosaur.obj", "igea.ply", "armadillo.ply"] {
        if is_wanted(name)
            && let Some(mesh) = cotan_tests::model(name)
        {
            table(name, mesh.mesh(), mesh.positions());
        }
    }
    for level in [6, 7] {
        let name = format!("icosphere {level}");
        if is_wanted(&name) {
            let shape = icosphere::<f64>(level);
            table(&name, shape.connectivity(), shape.positions());
        }
    }
}

fn table(name: &str, mesh: &HalfedgeMesh, positions: &Positions<f64>) {
    let per_face = assembly(mesh, positions) / mesh.num_faces() as f64 * 1e9;
    println!(
        "\n{name}: {} vertices, assembly {per_face:.0} ns a face\n",
        positions.len()
    );
    println!("| orientation | step | solve | rest of the step |");
    println!("|---|---|---|---|");
    let flow = || Flow::builder(mesh, positions);
    let rescaled = || flow().updater(RescaleByArea);
    let row = |method: &str, builder| print_row(positions, method, builder);
    row("hybrid", flow().energy(Hybrid::default()));
    row("limited", flow().orientation(Limited::new()));
    row("rotation", flow().orientation(BestRotation::new()));
    row("reflect", flow().orientation(Reflect::new()));
    row("reflect first", flow().orientation(ReflectFirst::new(10)));
    row("hybrid, rescaled", rescaled().energy(Hybrid::default()));
    row("limited, rescaled", rescaled().orientation(Limited::new()));
}

/// Seconds to assemble the operator: weights, one-rings, rounding.
fn assembly(mesh: &HalfedgeMesh, positions: &Positions<f64>) -> f64 {
    let surface = Surface::new(mesh, positions).expect("a surface");
    median(9, || {
        Operator::assemble(&Cotangent::default(), &surface).expect("an operator");
    })
}

fn print_row(positions: &Positions<f64>, method: &str, builder: FlowBuilder<f64>) {
    let mut flow = builder
        .handles(drag(positions))
        .tolerance(0.0)
        .build()
        .expect("a flow");
    let step = median(STEPS, || {
        flow.step().expect("a step");
    });
    let solve = solve(&flow);
    let per_vertex = |seconds: f64| seconds / positions.len() as f64 * 1e9;
    println!(
        "| {method} | {:.0} | {:.0} | {:.0} |",
        per_vertex(step),
        per_vertex(solve),
        per_vertex(step - solve),
    );
}

/// The lowest vertex and three others are fixed, and the highest is moved sideways.
///
/// The move is so small that a line search accepts its first trial; each further trial would cost
/// another update of the rotations.
fn drag(positions: &Positions<f64>) -> Vec<(Handle, Point3<f64>)> {
    let mut by_height: Vec<VertexId> = positions.iter().map(|(v, _)| v).collect();
    by_height.sort_by(|a, b| positions[*a].z.total_cmp(&positions[*b].z));
    let last = by_height.len() - 1;
    let size = positions[by_height[last]].z - positions[by_height[0]].z;
    let mut handles: Vec<_> = [0, last / 8, last / 4, last / 2]
        .map(|place| by_height[place])
        .map(|v| (Handle::hard(v), positions[v]))
        .to_vec();
    let top = by_height[last];
    let sideways = Vector3::new(0.02 * size, 0.0, 0.0);
    handles.push((Handle::hard(top), positions[top] + sideways));
    handles
}

/// Seconds for one correction of a system like the flow's.
fn solve(flow: &Flow<f64>) -> f64 {
    let rest = flow.rest();
    let n = rest.positions().len();
    let has_membrane = flow.membrane().is_some();
    let mut system = PreparedSystem::prepare(rest.operator(), flow.handles(), flow.membrane())
        .expect("a system");
    let mismatch = rest.laplacian();
    let zeros = VertexMap::filled(n, Vector3::zeros());
    let mut correction = zeros.clone();
    median(STEPS, || {
        let defect = Defect {
            tension: has_membrane.then_some(&zeros),
            ..Defect::of_laplacian(mismatch)
        };
        system
            .correct(&defect, &mut correction)
            .expect("a solution");
    })
}

/// The median of several measurements, in seconds.
fn median(repetitions: usize, mut run: impl FnMut()) -> f64 {
    let mut times: Vec<f64> = (0..repetitions)
        .map(|_| {
            let start = Instant::now();
            run();
            start.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
