//! The default deformation converges on real models, without folding them.

use cotan::prelude::*;
use cotan_tests::{Case, bend_cases, reference_cases};

/// At 1e-4 of the bounding box's diagonal, within 60 solves, with at most the folds of the
/// reference's converged state (none where there is no reference).
fn converges_without_folds(case: &Case) {
    let mesh = case.mesh.mesh();
    let options = DeformOptions {
        iteration_limit: 60,
        ..DeformOptions::default()
    };
    let deformed = deform(mesh, &case.positions, &case.handles, &options).expect("the case runs");
    assert_eq!(deformed.report.stop, StopReason::Converged, "{}", case.name);
    let rest = Surface::new(mesh, &case.positions).expect("a surface");
    let quality =
        Quality::measure(&rest, &rest.with_positions(&deformed.positions)).expect("same mesh");
    println!(
        "{}: {} solves, E_p {:.4}, E_g {:.4}, volume {:?}, folded edges {}, flipped faces {}",
        case.name,
        deformed.report.iterations,
        quality.errors.parameterization,
        quality.errors.geometry,
        quality.volume_ratio,
        quality.folded_edges,
        quality.flipped_faces,
    );
    let allowed = case
        .reference
        .as_ref()
        .and_then(|entry| entry["limited_converged"]["folds"].as_u64())
        .unwrap_or(0) as usize;
    assert!(
        quality.folded_edges <= allowed,
        "{}: {}",
        case.name,
        quality.folded_edges
    );
    assert_eq!(quality.degenerate_faces, 0, "{}", case.name);
}

#[test]
fn reference_drags() {
    for case in reference_cases() {
        converges_without_folds(&case);
    }
}

#[test]
fn bend_benchmarks() {
    for case in bend_cases() {
        converges_without_folds(&case);
    }
}
