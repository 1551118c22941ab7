//! Prints the distance of a run's result from the minimum of its energy, and its iterations.
//!
//! ```text
//! cargo run --release -p cotan-tests --example limbs_table [-- part of a case's name ...]
//! ```

use std::time::Instant;

use cotan::prelude::*;
use cotan_tests::{Case, bend_cases, reference_cases, solid_cases};

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    println!("| case | vertices | stiffness | iterations | stop | % off | seconds |");
    println!("|---|---|---|---|---|---|---|");
    let solid = solid_cases().0.into_iter().map(|(case, _)| case);
    for case in reference_cases()
        .into_iter()
        .chain(bend_cases())
        .chain(solid)
    {
        if wanted.is_empty() || wanted.iter().any(|w| case.name.contains(w.as_str())) {
            for (name, stiffness) in [("thin", Stiffness::THIN), ("solid", Stiffness::SOLID)] {
                row(&case, name, stiffness);
            }
        }
    }
}

fn row(case: &Case, name: &str, stiffness: Stiffness) {
    let surface = Surface::assume_checked(case.mesh.mesh(), &case.positions);
    let options = DeformOptions::default().stiffness(stiffness);
    let mut session = Session::new(surface, &case.handles, &options).expect("a session");
    let start = Instant::now();
    let report = session.run().expect("a run");
    let seconds = start.elapsed().as_secs_f64();
    let reached = session.positions();
    // The same run, continued to the minimum.
    let exact = options.tolerance(1e-8).iteration_limit(3_000);
    let minimum = deform(surface, &case.handles, &exact).expect("an edit");
    let farthest = |a: &Positions<f64>| {
        let pairs = a.values().zip(minimum.positions.values());
        pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    };
    let size = cotan::geometry::bounding_box(&surface).longest_side();
    println!(
        "| {} | {} | {name} | {} | {} | {:.3} | {seconds:.3} |",
        case.name,
        reached.len(),
        report.iterations,
        report.stop,
        100.0 * farthest(&reached) / size,
    );
    println!(
        "| | | to the minimum | {} | {} | | |",
        minimum.report.iterations, minimum.report.stop
    );
}
