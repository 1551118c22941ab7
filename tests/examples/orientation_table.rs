//! Prints the table by which the default orientation was chosen (`docs/decisions`): every
//! orientation on every reference drag and on the bend benchmarks.
//!
//! `cargo run --release -p cotan-tests --example orientation_table [-- part of a name ...]`

use cotan::prelude::*;
use cotan_tests::{Case, bend_cases, reference_cases};

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    println!("case | orientation | solves | stop | residual | E_p | E_g | ARAP | edge | volume | folded edges | flipped | s");
    for case in reference_cases().into_iter().chain(bend_cases()) {
        if !wanted.is_empty() && !wanted.iter().any(|w| case.name.contains(w.as_str())) {
            continue;
        }
        if let Some(reference) = &case.reference {
            let limited = &reference["limited_converged"];
            println!("{} | reference limited | {} | | {} | {} | | {} | {} | {} | {}", case.name,
                limited["solves_to_1e-3_1e-4_1e-6"], limited["last_residual"], limited["Ep_Eg_Egrms"],
                limited["arap_energy"], limited["edge_distortion_rms"], limited["volume_ratio"], limited["folds"]);
        }
        if let Ok(lengths) = std::env::var("LAMBDA") {
            for bending_length in lengths.split(',').filter_map(|l| l.parse().ok()) {
                print!("{bending_length} ");
                row(&case, DeformOptions { bending_length, ..DeformOptions::default() });
            }
            continue;
        }
        for &orientation in OrientationKind::ALL {
            row(&case, DeformOptions { orientation, ..DeformOptions::default() });
        }
    }
}

fn row(case: &Case, options: DeformOptions) {
    let start = std::time::Instant::now();
    let mesh = case.mesh.mesh();
    let result = deform(mesh, &case.positions, &case.handles, &options);
    let seconds = start.elapsed().as_secs_f64();
    let deformed = match result {
        Ok(deformed) => deformed,
        Err(error) => return println!("{} | {} | {error}", case.name, options.orientation.name()),
    };
    let rest = Surface::new(mesh, &case.positions).expect("a surface");
    let now = rest.with_positions(&deformed.positions);
    let quality = Quality::measure(&rest, &now).expect("the same mesh");
    let report = deformed.report;
    println!(
        "{} | {} | {} | {} | {:.1e} | {:.4} | {:.4} | {:.5} | {:.4} | {:.4} | {} | {} | {seconds:.2}",
        case.name,
        options.orientation.name(),
        report.iterations,
        report.stop,
        report.residual,
        quality.errors.parameterization,
        quality.errors.geometry,
        quality.arap_energy,
        quality.edge_distortion_rms,
        quality.volume_ratio.unwrap_or(f64::NAN),
        quality.folded_edges,
        quality.flipped_faces,
    );
}
