//! Prints the table by which the default orientation was chosen (`docs/decisions`): every
//! orientation on every reference drag and on the bend benchmarks.
//!
//! ```text
//! cargo run --release -p cotan-tests --example orientation_table [-- part of a case's name ...]
//! ```
//!
//! If the variable `RESULTS` names a folder with meshes produced by other programs, named after
//! the cases (`spot_twist.obj`), these are measured too.

use std::path::Path;
use std::time::Instant;

use cotan::prelude::*;
use cotan_tests::{Case, arap_energy_by_edges, bend_cases, reference_cases};

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    println!(
        "| case | method | solves | stop | E_p | E_g | ARAP | edges | volume | folded edges | seconds |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for case in reference_cases().into_iter().chain(bend_cases()) {
        if wanted.is_empty() || wanted.iter().any(|w| case.name.contains(w.as_str())) {
            rows(&case);
        }
    }
}

fn rows(case: &Case) {
    let default = DeformOptions::default();
    for &orientation in OrientationKind::ALL {
        run(
            case,
            orientation.name(),
            &default.clone().orientation(orientation),
        );
    }
    run(case, "the paper's settings", &DeformOptions::paper());
    let detail_size = DetailSize::Rescale;
    run(
        case,
        "hybrid, rescaled",
        &default.clone().detail_size(detail_size),
    );
    let limited = OrientationKind::Limited;
    run(
        case,
        "limited, rescaled",
        &default
            .clone()
            .detail_size(detail_size)
            .orientation(limited),
    );
    if let Ok(folder) = std::env::var("RESULTS") {
        let stem = case
            .name
            .replace(".obj", "")
            .replace(".ply", "")
            .replace(' ', "_");
        let path = Path::new(&folder).join(stem).with_extension("obj");
        if let Ok(document) = cotan_io::load(&path) {
            let positions = document.positions().iter().copied().collect();
            print_row(case, "libigl ARAP", "", &positions, f64::NAN);
        }
    }
}

fn run(case: &Case, method: &str, options: &DeformOptions) {
    let start = Instant::now();
    match deform(
        Surface::assume_checked(case.mesh.mesh(), &case.positions),
        &case.handles,
        options,
    ) {
        Ok(Deformed {
            positions, report, ..
        }) => {
            let ended = format!("{} | {}", report.iterations, report.stop);
            print_row(
                case,
                method,
                &ended,
                &positions,
                start.elapsed().as_secs_f64(),
            );
        }
        Err(error) => println!("| {} | {method} | {error} |", case.name),
    }
}

fn print_row(case: &Case, method: &str, ended: &str, positions: &Positions<f64>, seconds: f64) {
    let rest = Surface::new(case.mesh.mesh(), &case.positions).expect("a surface");
    let moved = rest.with_positions(positions);
    let quality = match Quality::measure(&rest, &moved) {
        Ok(quality) => quality,
        Err(error) => return println!("| {} | {method} | {error} |", case.name),
    };
    let ended = if ended.is_empty() { "– | –" } else { ended };
    let volume = quality
        .volume_ratio
        .map_or("open".into(), |v| format!("{v:.3}"));
    println!(
        "| {} | {method} | {ended} | {:.3} | {:.4} | {:.5} | {:.1} % | {volume} | {} | {seconds:.2} |",
        case.name,
        quality.errors.parameterization,
        quality.errors.geometry,
        // As defined by libigl and the reference figures.
        arap_energy_by_edges(&rest, &moved),
        100.0 * quality.edge_distortion_rms,
        quality.folded_edges,
    );
}
