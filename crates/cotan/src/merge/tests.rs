use cotan_geometry::shapes::{icosphere, torus};
use nalgebra::Rotation3;

use super::*;

fn turned(level: u32, angles: [f64; 3], offset: [f64; 3]) -> Mesh<f64> {
    let sphere = icosphere::<f64>(level);
    let turn = Rotation3::new(Vector3::from(angles));
    let positions = sphere.positions().map(|p| turn * p + Vector3::from(offset));
    sphere.with_positions(positions).unwrap()
}

fn keep(shape: &Mesh<f64>, wanted: impl Fn(&Point3<f64>) -> bool) -> FaceMap<bool> {
    faces_within(&shape.surface(), &shape.positions().map(|p| wanted(p)))
}

fn halves(options: &MergeOptions) -> (Mesh<f64>, Mesh<f64>, Merged<f64>) {
    let a = icosphere::<f64>(4);
    let b = turned(4, [0.3, 0.2, 0.5], [0.0; 3]);
    let (below, above) = (keep(&a, |p| p.z < -0.02), keep(&b, |p| p.z > 0.02));
    let merged = merge(&a, &below, &b, &above, options).unwrap();
    (a, b, merged)
}

#[test]
fn two_halves_of_a_sphere_are_a_sphere() {
    let (a, b, merged) = halves(&MergeOptions::default());
    let mesh = merged.mesh.connectivity();
    assert!(mesh.validate().is_ok() && mesh.is_closed());
    assert_eq!(mesh.euler_characteristic(), 2);
    let worst = merged.mesh.positions().values();
    let worst = worst
        .map(|p| (p.coords.norm() - 1.0).abs())
        .fold(0.0, f64::max);
    let SeamReport {
        dihedral,
        dihedral_elsewhere,
        self_intersections,
        ..
    } = merged.report;
    assert!(worst < 0.01, "{worst}");
    assert!(
        dihedral[0] <= 1.2 * dihedral_elsewhere[0],
        "{dihedral:?} {dihedral_elsewhere:?}"
    );
    assert_eq!(self_intersections, [0, 0]);
    // Outside the band every bit is that of the input.
    let rings = rings_around(mesh, &seam_of(&merged));
    let mut far = 0;
    for v in mesh.vertices().filter(|&v| rings[v] > 4) {
        let of_input = match merged.vertices[v] {
            VertexOrigin::A(of) => a.positions()[of],
            VertexOrigin::B(of) => b.positions()[of],
            VertexOrigin::Seam => unreachable!(),
        };
        assert_eq!(merged.mesh.positions()[v], of_input);
        far += 1;
    }
    assert!(far > 1000);
}

/// The vertices of the faces between the two.
fn seam_of(merged: &Merged<f64>) -> Vec<VertexId> {
    let mesh = merged.mesh.connectivity();
    let faces = mesh
        .faces()
        .filter(|&f| merged.faces[f] == FaceOrigin::Seam);
    faces.flat_map(|f| mesh.triangle(f)).collect()
}

#[test]
fn without_steps_no_vertex_moves() {
    let (.., merged) = halves(&MergeOptions::default().iterations(0_usize));
    assert_eq!(merged.report.moved, 0);
    assert!(merged.mesh.connectivity().is_closed());
}

#[test]
fn a_half_is_fitted_from_any_place() {
    let a = icosphere::<f64>(4);
    let away = turned(4, [0.0; 3], [0.0; 3]);
    let motion = Rotation3::new(Vector3::new(1.0, -2.0, 0.7));
    let moved = away
        .positions()
        .map(|p| motion * p * 3.0 + Vector3::new(5.0, 1.0, -2.0));
    let b = away.with_positions(moved).unwrap();
    let below = keep(&a, |p| p.z < -0.02);
    let above = faces_within(&b.surface(), &away.positions().map(|p| p.z > 0.02));
    let options = MergeOptions::default().placement(Placement::Fit);
    let merged = merge(&a, &below, &b, &above, &options).unwrap();
    assert!(merged.mesh.connectivity().is_closed());
    assert!(
        (merged.placed.scale - 1.0 / 3.0).abs() < 1e-3,
        "{:?}",
        merged.placed
    );
    let worst = merged.mesh.positions().values();
    let worst = worst
        .map(|p| (p.coords.norm() - 1.0).abs())
        .fold(0.0, f64::max);
    // The gap of the cut is .03 wider than the edge that is left between the two.
    assert!(worst < 0.06, "{worst}");
    assert_eq!(merged.report.self_intersections, [0, 0]);
}

#[test]
fn a_wide_gap_gets_rings_of_vertices() {
    let a = icosphere::<f64>(4);
    let b = turned(3, [0.1, 0.2, 0.3], [0.0, 0.0, 1.5]);
    let (below, above) = (keep(&a, |p| p.z < 0.3), keep(&b, |p| p.z > 1.2));
    let merged = merge(&a, &below, &b, &above, &MergeOptions::default()).unwrap();
    assert!(merged.mesh.connectivity().is_closed());
    assert!(merged.report.vertices > 100, "{:?}", merged.report);
    assert_eq!(merged.report.self_intersections, [0, 0]);
}

#[test]
fn two_halves_of_a_torus_are_joined_along_both_cuts() {
    let a = torus::<f64>(1.0, 0.4, 64, 32);
    let turn = Rotation3::new(Vector3::z() * 0.05);
    let b = a.with_positions(a.positions().map(|p| turn * p)).unwrap();
    let (left, right) = (keep(&a, |p| p.x < -0.08), keep(&b, |p| p.x > 0.08));
    let merged = merge(&a, &left, &b, &right, &MergeOptions::default()).unwrap();
    assert_eq!(merged.report.loops, 2);
    assert!(merged.mesh.connectivity().is_closed());
    assert_eq!(merged.mesh.connectivity().euler_characteristic(), 0);
    // The other way round the loops cross.
    let crossed = MergeOptions::default().loops(vec![[0, 0], [1, 0]]);
    let error = merge(&a, &left, &b, &right, &crossed).err();
    assert_eq!(error, Some(MergeError::LoopPairs { loops: 2 }));
    // One loop against two.
    let ball = icosphere::<f64>(3);
    let half = keep(&ball, |p| p.x > 0.1);
    let error = merge(&a, &left, &ball, &half, &MergeOptions::default()).err();
    assert_eq!(error, Some(MergeError::UnequalLoops { loops: [2, 1] }));
}

#[test]
fn half_a_torus_comes_to_its_place_from_anywhere_by_both_cuts() {
    let a = torus::<f64>(1.0, 0.4, 64, 32);
    let motion = Rotation3::new(Vector3::new(1.0, -2.0, 0.7));
    let moved = a
        .positions()
        .map(|p| motion * p * 3.0 + Vector3::new(5.0, 1.0, -2.0));
    let b = a.with_positions(moved).unwrap();
    let left = keep(&a, |p| p.x < -0.08);
    let right = faces_within(&b.surface(), &a.positions().map(|p| p.x > 0.08));
    let fit = MergeOptions::default().placement(Placement::Fit);
    for options in [fit.clone(), fit.loops(vec![[0, 0], [1, 1]])] {
        let merged = merge(&a, &left, &b, &right, &options).unwrap();
        assert!(merged.mesh.connectivity().is_closed());
        assert_eq!(merged.mesh.connectivity().euler_characteristic(), 0);
        assert_eq!(merged.report.self_intersections, [0, 0]);
        assert!(
            (merged.placed.scale - 1.0 / 3.0).abs() < 0.02,
            "{:?}",
            merged.placed
        );
        // Half a turn about the axis of the torus is as good.
        let worst = merged.mesh.positions().values().map(|p| {
            let across = (p.x.hypot(p.y) - 1.0).hypot(p.z);
            (across - 0.4).abs()
        });
        let worst = worst.fold(0.0, f64::max);
        assert!(worst < 0.1, "{worst}");
    }
}

#[test]
fn surfaces_inside_out_and_cuts_of_different_girth_are_refused() {
    let a = icosphere::<f64>(3);
    let mirrored = a.positions().map(|p| Point3::new(-p.x, p.y, p.z));
    let b = a.with_positions(mirrored).unwrap();
    let (below, above) = (keep(&a, |p| p.z < -0.02), keep(&b, |p| p.z > 0.02));
    let error = merge(&a, &below, &b, &above, &MergeOptions::default()).err();
    let vertex = VertexId::new(0);
    let input = Input::B;
    assert_eq!(error, Some(MergeError::InsideOut { input, vertex }));
    let small = a.with_positions(a.positions().map(|p| p * 0.4)).unwrap();
    let above = keep(&small, |p| p.z > 0.02);
    let error = merge(&a, &below, &small, &above, &MergeOptions::default()).err();
    assert!(
        matches!(error, Some(MergeError::Perimeters { .. })),
        "{error:?}"
    );
}

#[test]
fn single_precision_gives_the_same_surface() {
    let (a, b, merged) = halves(&MergeOptions::default());
    let (a32, b32) = (a.cast::<f32>(), b.cast::<f32>());
    let below = keep(&a, |p| p.z < -0.02);
    let above = keep(&b, |p| p.z > 0.02);
    let single = merge(&a32, &below, &b32, &above, &MergeOptions::default()).unwrap();
    for (p, q) in single
        .mesh
        .positions()
        .values()
        .zip(merged.mesh.positions().values())
    {
        assert!((p.map(f64::from) - q).norm() < 1e-4);
    }
}
