//! Deformation, maps to the sphere and smoothing with the weights of the intrinsic Delaunay
//! triangulation.
#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use cotan::flow::StopReason;
use cotan::halfedge::HalfedgeMesh;
use cotan::laplacian::{Cotangent, IntrinsicDelaunay, Operator};
use cotan::prelude::*;
use cotan::smooth::{SmoothMethod, SmoothOptions, smooth};
use cotan::sphere::{SphereOptions, spherical};
use cotan_geometry::testing::{blobs, rigid_motions, surfaces};
use nalgebra::Translation3;
use proptest::prelude::*;

/// A bar whose triangles are sheared into slivers along its length; the surface stays a box.
fn sheared_bar() -> Mesh<f64> {
    let mut bar = cotan::shapes::bar::<f64>([4.0, 1.0, 1.0], [24, 6, 6]);
    let middle = |p: &Point3<f64>| (4.0 - p.x * p.x).max(0.0) * 0.25;
    for p in bar.positions_mut() {
        p.x += 1.5 * middle(p) * (p.y + p.z);
    }
    bar
}

fn ends(bar: &Mesh<f64>, lift: f64) -> Handles<f64> {
    let surface = bar.surface();
    let left = surface.vertices_where(|p| p.x < -1.99);
    let right = surface.vertices_where(|p| p.x > 1.99);
    let lifted = Translation3::new(0.0, 0.0, lift);
    Handles::new()
        .fix(left)
        .transform(right, lifted.to_homogeneous())
}

fn intrinsic() -> DeformOptions {
    DeformOptions::default().scheme(SchemeKind::IntrinsicDelaunay)
}

fn farthest(a: &Positions<f64>, b: &Positions<f64>) -> f64 {
    let pairs = a.values().zip(b.values());
    pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

#[test]
fn slivers_have_negative_cotangents_and_no_negative_intrinsic_weight() {
    let bar = sheared_bar();
    let least =
        |operator: &Operator<f64>| operator.weights().iter().fold(0.0_f64, |m, w| m.min(*w));
    let surface = bar.surface();
    let cotangent = Operator::assemble(&Cotangent::default(), &surface).unwrap();
    let own = Operator::assemble(&IntrinsicDelaunay::default(), &surface).unwrap();
    assert_ne!(own.graph(), cotangent.graph());
    assert!(least(&cotangent) < -0.5);
    assert_eq!(least(&own), 0.0);
}

#[test]
fn a_deformation_meets_its_handles_and_stays_where_nothing_moves() {
    let bar = sheared_bar();
    for &orientation in OrientationKind::ALL {
        let options = intrinsic().orientation(orientation).iteration_limit(30);
        let still = deform(&bar, &ends(&bar, 0.0), &options).unwrap();
        assert!(
            farthest(&still.positions, bar.positions()) < 1e-9,
            "{orientation:?}"
        );
        let bent = deform(&bar, &ends(&bar, 0.5), &options).unwrap();
        for (v, p) in bent.positions.iter() {
            assert!(p.iter().all(|x| x.is_finite()), "{orientation:?}");
            if bar.positions()[v].x > 1.99 {
                let target = bar.positions()[v] + Vector3::new(0.0, 0.0, 0.5);
                assert!((p - target).norm() < 1e-12, "{orientation:?} {v}");
            }
        }
    }
}

/// Walls that are long from end to end.
#[test]
fn a_long_thin_tube_converges() {
    let tube = cotan::shapes::cylinder::<f64>(0.05, 4.0, 6, 4);
    let surface = tube.surface();
    let [low, high] = [
        surface.vertices_where(|p| p.z < surface.bounding_box().min.z + 1e-6),
        surface.vertices_where(|p| p.z > surface.bounding_box().max.z - 1e-6),
    ];
    let lifted = Translation3::new(0.4, 0.0, -0.3);
    let handles = Handles::new()
        .fix(low)
        .transform(high, lifted.to_homogeneous());
    let bent = deform(&tube, &handles, &intrinsic()).unwrap();
    assert!(
        bent.report.stop == StopReason::Converged,
        "{:?}",
        bent.report
    );
}

#[test]
fn on_a_delaunay_mesh_every_job_is_that_of_the_cotangents() {
    let ball = cotan::shapes::icosphere::<f64>(3);
    let surface = ball.surface();
    let [low, high] = [
        surface.vertices_where(|p| p.z < -0.9),
        surface.vertices_where(|p| p.z > 0.9),
    ];
    let lifted = Translation3::new(0.3, 0.0, 0.5);
    let handles = Handles::new()
        .fix(low)
        .transform(high, lifted.to_homogeneous());
    let both = [SchemeKind::Cotangent, SchemeKind::IntrinsicDelaunay];
    for &orientation in OrientationKind::ALL {
        let [a, b] = both.map(|scheme| {
            let options = DeformOptions::default()
                .scheme(scheme)
                .orientation(orientation)
                .tolerance(0.0)
                .iteration_limit(5);
            deform(&ball, &handles, &options).unwrap().positions
        });
        assert!(farthest(&a, &b) < 1e-9, "{orientation:?}");
    }
    let dented = ball
        .positions()
        .map(|p| Point3::from(p.coords * (1.0 + 0.02 * (9.0 * p.x).sin())));
    for method in [
        SmoothMethod::Anchored,
        SmoothMethod::Paper,
        SmoothMethod::Implicit,
    ] {
        let [a, b] = both.map(|scheme| {
            let options = SmoothOptions::default()
                .method(method)
                .scheme(scheme)
                .iterations(3);
            let dented = surface.with_positions(&dented);
            smooth(dented, &Handles::new(), &options).unwrap().positions
        });
        assert!(farthest(&a, &b) < 1e-9, "{method:?}");
    }
    let [a, b] = both.map(|scheme| {
        let dented = surface.with_positions(&dented);
        let options = SphereOptions::default().scheme(scheme);
        spherical(dented, &options).unwrap().map.positions().clone()
    });
    assert!(farthest(&a, &b) < 1e-9);
}

#[test]
fn a_map_of_slivers_to_the_sphere_flips_no_triangle() {
    let bar = sheared_bar();
    let options = SphereOptions::default().scheme(SchemeKind::IntrinsicDelaunay);
    // Checked by exact predicates before it is returned.
    let map = spherical(&bar, &options).unwrap();
    for p in map.map.positions().values() {
        assert!((p.coords.norm() - 1.0).abs() < 1e-12);
    }
}

/// Cotangents of slivers are large and of both signs, and steps with them overshoot; weights that
/// are never negative keep every coordinate of a step within those of the surface.
#[test]
fn a_step_of_the_curvature_flow_keeps_within_the_surface() {
    let bar = sheared_bar();
    let options = SmoothOptions::default()
        .method(SmoothMethod::Implicit)
        .scheme(SchemeKind::IntrinsicDelaunay)
        .iterations(1);
    let smoothed = smooth(&bar, &Handles::new(), &options).unwrap();
    let bounds = bar.surface().bounding_box();
    for p in smoothed.positions.values() {
        for axis in 0..3 {
            assert!(p[axis] > bounds.min[axis] - 1e-9 && p[axis] < bounds.max[axis] + 1e-9);
        }
    }
}

#[test]
fn a_mesh_that_was_cut_into_pieces_is_refused_by_name() {
    // Three triangles at an edge.
    let positions = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, -1.0, 0.2],
    ];
    let mesh = HalfedgeMesh::from_faces_in_pieces(5, &[[0, 1, 2], [0, 1, 3], [0, 1, 4]]).unwrap();
    let positions: Positions<f64> = positions.iter().map(|p| Point3::from(*p)).collect();
    let positions = mesh.to_vertices(positions);
    let surface = Surface::new(&mesh, &positions).unwrap();
    let handles = Handles::new().fix([VertexId::new(0), VertexId::new(1), VertexId::new(2)]);
    let error = deform(surface, &handles, &intrinsic()).unwrap_err();
    assert!(error.to_string().contains("intrinsic Delaunay"), "{error}");
}

/// A shape made thin, whose triangles are slivers.
fn thin(shape: &Mesh<f64>, factor: f64) -> Mesh<f64> {
    let squeezed = shape
        .positions()
        .map(|p| Point3::new(p.x, p.y, p.z * factor));
    Mesh::new(shape.connectivity().clone(), squeezed).unwrap()
}

/// One implicit step: in the methods of the paper a coordinate of length zero has the direction of
/// its rounding error.
fn smoothed(shape: &Mesh<f64>) -> Positions<f64> {
    let options = SmoothOptions::default()
        .method(SmoothMethod::Implicit)
        .scheme(SchemeKind::IntrinsicDelaunay)
        .iterations(2);
    smooth(shape, &Handles::new(), &options).unwrap().positions
}

fn deformed(shape: &Mesh<f64>, number: &dyn Fn(usize) -> usize) -> Positions<f64> {
    let n = shape.positions().len();
    let vertex = |i: usize| VertexId::new(number(i));
    let held = (0..3).map(vertex);
    let moved = vertex(n - 1);
    let middle = shape.positions()[vertex(0)];
    let target = middle + (shape.positions()[moved] - middle) * 1.2;
    let handles = Handles::new().fix(held).move_to(moved, target);
    let options = intrinsic().tolerance(0.0).iteration_limit(3);
    deform(shape, &handles, &options).unwrap().positions
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn rigid_motions_and_scale_commute(
        shape in surfaces(), factor in 0.3..1.0_f64, motion in rigid_motions(), scale in 0.1..10.0_f64,
    ) {
        let shape = thin(&shape, factor);
        let move_it = |p: &Point3<f64>| Point3::from((motion * p).coords * scale);
        let moved = Mesh::new(
            shape.connectivity().clone(),
            shape.positions().map(move_it),
        ).unwrap();
        let size = moved.surface().bounding_box().diagonal();
        let same = |i: usize| i;
        let off = farthest(&smoothed(&shape).map(move_it), &smoothed(&moved));
        prop_assert!(off < 1e-6 * size, "smoothing {off:e}");
        let off = farthest(&deformed(&shape, &same).map(move_it), &deformed(&moved, &same));
        prop_assert!(off < 1e-6 * size, "deforming {off:e}");
    }

    #[test]
    fn renumbering_commutes(shape in blobs(), factor in 0.3..1.0_f64, by in 1..1000_usize) {
        let shape = thin(&shape, factor);
        let (n, mesh) = (shape.positions().len(), shape.connectivity());
        let number = |i: usize| (i + by) % n;
        let faces: Vec<[u32; 3]> = mesh
            .faces()
            .map(|f| mesh.triangle(f).map(|v| number(v.index()) as u32))
            .collect();
        let mut positions = shape.positions().clone();
        for (v, p) in shape.positions().iter() {
            positions[VertexId::new(number(v.index()))] = *p;
        }
        let other = Mesh::new(HalfedgeMesh::from_faces(n, &faces).unwrap(), positions).unwrap();
        let size = shape.surface().bounding_box().diagonal();
        let back = |x: Positions<f64>| -> Positions<f64> {
            (0..n).map(|i| x[VertexId::new(number(i))]).collect()
        };
        let off = farthest(&smoothed(&shape), &back(smoothed(&other)));
        prop_assert!(off < 1e-6 * size, "smoothing {off:e}");
        let off = farthest(&deformed(&shape, &|i| i), &back(deformed(&other, &number)));
        prop_assert!(off < 1e-6 * size, "deforming {off:e}");
    }
}
