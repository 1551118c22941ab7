//! Prints the distance of the deformations of `shared/reference/solid` from an elastic body, next
//! to the figures of other methods, which do not include dihedral angles and singular values. Then
//! compares the thin shell and the solid body on the drags by which the default orientation was
//! chosen.
//!
//! ```text
//! cargo run --release -p cotan-tests --example solid_table [-- part of an edit's name ...]
//! ```

use std::time::Instant;

use cotan::prelude::*;
use cotan_tests::{Case, bend_cases, reference_cases, solid_cases};

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let (cases, table) = solid_cases();
    println!(
        "| edit | method | distance, % | volume | E_p | E_g | edges, % | folds | intersecting | dihedral, ° | σ1 99 % | 1/σ2 99 % | iterations | seconds |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    let (mut sum, mut count) = (0.0, 0);
    for (case, solid) in &cases {
        if !wanted.is_empty() && !wanted.iter().any(|w| case.name.contains(w.as_str())) {
            continue;
        }
        for (method, values) in table[&case.name].as_object().into_iter().flatten() {
            let value = |key: &str| values[key].as_f64().unwrap_or(f64::NAN);
            println!(
                "| {} | reference: {method} | {:.3} | {:.3} | {:.3} | {:.4} | {:.2} | {} | {} | | | | {} | |",
                case.name,
                value("rms_distance_to_solid_percent"),
                value("vol"),
                value("Ep"),
                value("Eg"),
                value("edge"),
                value("fold"),
                value("sx"),
                value("it"),
            );
        }
        let options = DeformOptions::default();
        let thin = run(
            case,
            solid,
            "thin",
            &options.clone().stiffness(Stiffness::THIN),
        );
        let full = run(case, solid, "solid", &options);
        sum += (full / thin).ln();
        count += 1;
    }
    if count > 0 {
        let mean = (sum / f64::from(count)).exp();
        println!("\ngeometric mean of the distances, solid over thin: {mean:.3}");
    }
    println!("\n| drag | E_g, thin | solid | ratio | E_p, thin | solid | ratio | folds | stop |");
    println!("|---|---|---|---|---|---|---|---|---|");
    for case in reference_cases().into_iter().chain(bend_cases()) {
        if wanted.is_empty() || wanted.iter().any(|w| case.name.contains(w.as_str())) {
            compare(&case);
        }
    }
}

/// Prints the errors of a drag, thin and solid.
fn compare(case: &Case) {
    let surface = Surface::assume_checked(case.mesh.mesh(), &case.positions);
    let [thin, solid] = [Stiffness::THIN, Stiffness::SOLID].map(|stiffness| {
        let options = DeformOptions::default().stiffness(stiffness);
        let deformed = deform(surface, &case.handles, &options).expect("an edit");
        let moved = surface.with_positions(&deformed.positions);
        let quality = Quality::measure(&surface, &moved).expect("one mesh");
        (quality, deformed.report)
    });
    let (g, p) = (
        [thin.0.errors.geometry, solid.0.errors.geometry],
        [
            thin.0.errors.parameterization,
            solid.0.errors.parameterization,
        ],
    );
    let folds = |quality: &Quality| quality.flipped_faces + quality.folded_edges;
    let stop = |report: &Report| format!("{} after {}", report.stop, report.iterations);
    println!(
        "| {} | {:.4} | {:.4} | {:.2} | {:.3} | {:.3} | {:.2} | {}, {} | {}, {} |",
        case.name,
        g[0],
        g[1],
        g[1] / g[0],
        p[0],
        p[1],
        p[1] / p[0],
        folds(&thin.0),
        folds(&solid.0),
        stop(&thin.1),
        stop(&solid.1),
    );
}

/// Runs one edit, prints its row, and returns the distance.
fn run(case: &Case, solid: &Positions<f64>, method: &str, options: &DeformOptions) -> f64 {
    let surface = Surface::assume_checked(case.mesh.mesh(), &case.positions);
    let start = Instant::now();
    let deformed = deform(surface, &case.handles, options).expect("an edit");
    let seconds = start.elapsed().as_secs_f64();
    let moved = surface.with_positions(&deformed.positions);
    let quality = Quality::measure(&surface, &moved).expect("one mesh");
    let held = case.handles.vertices();
    let mut is_free = vec![true; case.positions.len()];
    held.flatten().for_each(|v| is_free[v.index()] = false);
    let (mut sum, mut free) = (0.0, 0);
    for (v, p) in deformed.positions.iter() {
        if is_free[v.index()] {
            sum += (p - solid[v]).norm_squared();
            free += 1;
        }
    }
    let size = cotan::geometry::bounding_box(&surface).longest_side();
    let distance = 100.0 * (sum / f64::from(free)).sqrt() / size;
    println!(
        "| {} | {method} | {distance:.3} | {:.3} | {:.3} | {:.4} | {:.2} | {} | {} | {:.1} | {:.3} | {:.3} | {} {} | {seconds:.2} |",
        case.name,
        quality.volume_ratio.unwrap_or(f64::NAN),
        quality.errors.parameterization,
        quality.errors.geometry,
        100.0 * quality.edge_distortion_rms,
        quality.flipped_faces + quality.folded_edges,
        quality.self_intersecting_faces,
        quality.max_dihedral_change,
        quality.stretch.p99,
        quality.compression.p99,
        deformed.report.iterations,
        deformed.report.stop,
    );
    distance
}
