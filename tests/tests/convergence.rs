//! The default deformation converges on real models without folding them.

use cotan::prelude::*;
use cotan_tests::{Case, bend_cases, reference_cases};

/// Checks convergence to 1e-4 of the bounding box's diagonal within 60 solves, with no more folds
/// than the reference's converged state (or none without a reference).
fn converges_without_folds(case: &Case) {
    let mesh = case.mesh.mesh();
    let options = DeformOptions::default().iteration_limit(60);
    let deformed = deform(
        Surface::assume_checked(mesh, &case.positions),
        &case.handles,
        &options,
    )
    .expect("the case runs");
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

/// Handles for a shape along x: the low end stays, the high end is moved.
fn ends(shape: &cotan_geometry::Mesh<f64>, reach: f64, motion: Matrix4<f64>) -> Handles<f64> {
    let surface = shape.surface();
    let low = surface.vertices_where(|p| p.x < -reach);
    let high = surface.vertices_where(|p| p.x > reach);
    assert!(low.len() > 3 && high.len() > 3);
    Handles::new().fix(low).transform(high, motion)
}

/// Sample shapes, so that a clone without the models checks something too.
#[test]
fn sample_shapes() {
    let quarter = std::f64::consts::FRAC_PI_2;
    let bend = Isometry3::new(
        Vector3::new(-1.2, 0.0, 1.2),
        Vector3::new(0.0, -quarter, 0.0),
    );
    let twist = Isometry3::rotation(Vector3::new(quarter, 0.0, 0.0));
    let lift = Isometry3::translation(0.0, 0.3, 0.4);
    let shapes = [
        (
            "bar, bent",
            cotan::shapes::bar::<f64>([4.0, 1.0, 1.0], [32, 8, 8]),
            1.8,
            bend,
        ),
        (
            "bar, twisted",
            cotan::shapes::bar::<f64>([4.0, 1.0, 1.0], [32, 8, 8]),
            1.8,
            twist,
        ),
        (
            "torus, sheared",
            cotan::shapes::torus::<f64>(1.0, 0.3, 40, 16),
            1.1,
            lift,
        ),
        (
            "sheet, bent",
            cotan::shapes::bumpy_plane::<f64>([4.0, 2.0], [40, 20], 0.05),
            1.9,
            bend,
        ),
    ];
    for (name, shape, reach, motion) in shapes {
        let handles = ends(&shape, reach, motion.to_homogeneous());
        let options = DeformOptions::default().iteration_limit(60);
        let deformed = deform(shape.surface(), &handles, &options).expect("deforms");
        assert_eq!(deformed.report.stop, StopReason::Converged, "{name}");
        let surface = shape.surface();
        let quality = Quality::measure(&surface, &surface.with_positions(&deformed.positions))
            .expect("the same mesh");
        assert_eq!(
            (quality.flipped_faces, quality.folded_edges),
            (0, 0),
            "{name}"
        );
    }
}

/// If the models are available, all eleven cases are.
#[test]
fn no_case_is_dropped_silently() {
    if cotan_tests::shared("reference/deform.json").is_some() {
        assert_eq!((reference_cases().len(), bend_cases().len()), (9, 2));
    }
}
