//! Theorems of the whole pipeline, as properties on random surfaces.

use std::ops::ControlFlow;

use cotan::flow::Flow;
use cotan::prelude::*;
use cotan::shapes::{bar, icosphere, torus};
use cotan_geometry::Mesh;
use cotan_geometry::testing::{blobs, rigid_motions, rotations, surfaces};
use cotan_laplacian::{LaplacianScheme, Operator};
use cotan_tests::Draw;
use nalgebra::{Isometry3, Rotation3, Translation3};
use proptest::prelude::*;

/// The held vertices: those beyond two planes, at each end of the longest axis. At least four.
fn ends(shape: &Mesh<f64>) -> [Vec<VertexId>; 2] {
    let surface = shape.surface();
    let bounds = surface.bounding_box();
    let axis = bounds.extents().imax();
    let mut order: Vec<VertexId> = shape.connectivity().vertices().collect();
    order.sort_by(|a, b| {
        shape.positions()[*a][axis]
            .total_cmp(&shape.positions()[*b][axis])
            .then(a.cmp(b))
    });
    let held = (order.len() / 8).max(4);
    [order[..held].to_vec(), order[order.len() - held..].to_vec()]
}

fn diagonal(shape: &Mesh<f64>) -> f64 {
    shape.surface().bounding_box().diagonal()
}

fn longest_difference(a: &Positions<f64>, b: &Positions<f64>) -> f64 {
    a.values()
        .zip(b.values())
        .map(|(a, b)| (a - b).norm())
        .fold(0.0, f64::max)
}

/// A moderate bend of the upper end.
fn bend(shape: &Mesh<f64>) -> Handles<f64> {
    let [low, high] = ends(shape);
    let diagonal = diagonal(shape);
    let center = shape.surface().bounding_box().center();
    let turn = Translation3::from(center.coords)
        * Isometry3::rotation(Vector3::new(0.2, 0.3, -0.1))
        * Translation3::from(-center.coords);
    let lift = Translation3::from(Vector3::new(0.02, -0.01, 0.03) * diagonal);
    Handles::new()
        .fix(low)
        .transform(high, (lift * turn).to_homogeneous())
}

/// Runs exactly `iterations` steps.
fn deform_by(shape: &Mesh<f64>, handles: &Handles<f64>, iterations: usize) -> Positions<f64> {
    let options = DeformOptions::default()
        .tolerance(0.0)
        .iteration_limit(iterations);
    deform(shape.surface(), handles, &options)
        .expect("deforms")
        .positions
}

fn orientations() -> impl Strategy<Value = OrientationKind> {
    proptest::sample::select(OrientationKind::ALL)
}

fn schemes() -> impl Strategy<Value = SchemeKind> {
    proptest::sample::select(SchemeKind::ALL)
}

fn single(shape: &Mesh<f64>) -> Mesh<f32> {
    Mesh::new(
        shape.connectivity().clone(),
        shape.positions().map(|p| p.map(|x| x as f32)),
    )
    .expect("a surface")
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn handles_left_in_place_change_nothing(
        shape in surfaces(), orientation in orientations(), scheme in schemes(),
        rescale in any::<bool>(), soft in proptest::option::of(0.5f64..1000.0),
    ) {
        let [low, high] = ends(&shape);
        let mut handles = Handles::new().fix(low).fix(high);
        if let Some(weight) = soft {
            handles = handles.all_held(Hold::Soft(weight));
        }
        let detail_size = if rescale { DetailSize::Rescale } else { DetailSize::Keep };
        let options = DeformOptions::default().orientation(orientation).scheme(scheme).detail_size(detail_size);
        let deformed = deform(shape.surface(), &handles, &options)?;
        prop_assert_eq!(deformed.report.stop, StopReason::Converged);
        let moved = longest_difference(&deformed.positions, shape.positions());
        prop_assert!(moved <= 1e-9 * diagonal(&shape), "{} {moved:e}", orientation.name());
    }

    #[test]
    fn handles_left_in_place_change_nothing_in_single_precision(
        shape in surfaces(), orientation in orientations(),
    ) {
        let [low, high] = ends(&shape);
        let diagonal = diagonal(&shape) as f32;
        let shape = single(&shape);
        let handles = Handles::new().fix(low).fix(high);
        let options = DeformOptions::default().orientation(orientation);
        let deformed = deform(shape.surface(), &handles, &options)?;
        prop_assert_eq!(deformed.report.stop, StopReason::Converged);
        for (a, b) in deformed.positions.values().zip(shape.positions().values()) {
            prop_assert!((a - b).norm() <= 1e-4 * diagonal, "{}", orientation.name());
        }
    }

    #[test]
    fn handles_moved_rigidly_move_the_whole_mesh(
        shape in surfaces(), motion in rigid_motions(),
    ) {
        // The moved mesh is a fixed point of every orientation, but on the coarsest meshes it
        // repels all except the default: rounding errors grow.
        let orientation = OrientationKind::Hybrid;
        let [low, high] = ends(&shape);
        let matrix = motion.to_homogeneous();
        let handles = Handles::new().transform(low, matrix).transform(high, matrix);
        let options = DeformOptions::default().orientation(orientation).tolerance(1e-11);
        let deformed = deform(shape.surface(), &handles, &options)?;
        let expected = shape.positions().map(|p| motion * p);
        let error = longest_difference(&deformed.positions, &expected) / diagonal(&shape);
        prop_assert!(error <= 1e-8, "{} {error:e} {:?}", orientation.name(), deformed.report);
    }

    #[test]
    fn uniform_scaling_commutes(shape in blobs(), exponent in -9f64..9.0) {
        let scale = 10f64.powf(exponent);
        let scaled = Mesh::new(shape.connectivity().clone(), shape.positions().map(|p| p * scale)).expect("a surface");
        let before = deform_by(&shape, &bend(&shape), 6);
        let after = deform_by(&scaled, &bend(&scaled), 6);
        let error = longest_difference(&after, &before.map(|p| p * scale));
        prop_assert!(error <= 1e-9 * scale * diagonal(&shape), "{error:e}");
    }

    #[test]
    fn rotation_of_the_input_commutes(shape in blobs(), rotation in rotations()) {
        let turned = Mesh::new(shape.connectivity().clone(), shape.positions().map(|p| rotation * p)).expect("a surface");
        let [low, high] = ends(&shape);
        let lift = Vector3::new(0.1, 0.2, 0.3) * diagonal(&shape);
        let targets = |positions: &Positions<f64>, lift: Vector3<f64>| {
            Motion::To(high.iter().map(|v| positions[*v] + lift).collect())
        };
        let handles = Handles::new()
            .fix(low.clone())
            .add(high.clone(), targets(shape.positions(), lift));
        let turned_handles = Handles::new()
            .fix(low)
            .add(high.clone(), targets(turned.positions(), rotation * lift));
        let before = deform_by(&shape, &handles, 6);
        let after = deform_by(&turned, &turned_handles, 6);
        let error = longest_difference(&after, &before.map(|p| rotation * p));
        prop_assert!(error <= 1e-8 * diagonal(&shape), "{error:e}");
    }

    #[test]
    fn renumbering_the_vertices_commutes(
        (shape, order) in blobs().prop_flat_map(|shape| {
            let order: Vec<usize> = (0..shape.positions().len()).collect();
            (Just(shape), Just(order).prop_shuffle())
        }),
    ) {
        // Vertex v becomes order[v].
        let faces: Vec<Vec<u32>> = shape
            .connectivity()
            .faces()
            .map(|f| shape.connectivity().face_vertices(f).map(|v| order[v.index()] as u32).collect())
            .collect();
        let mesh = HalfedgeMesh::from_faces(order.len(), &faces)?;
        let mut positions = shape.positions().clone();
        for (v, p) in shape.positions().iter() {
            positions[VertexId::new(order[v.index()])] = *p;
        }
        let [low, high] = ends(&shape);
        let lift = Vector3::new(0.1, 0.2, 0.3) * diagonal(&shape);
        let rename = |region: &[VertexId]| -> Vec<VertexId> {
            region.iter().map(|v| VertexId::new(order[v.index()])).collect()
        };
        let lifted =
            Motion::To(high.iter().map(|v| shape.positions()[*v] + lift).collect::<Vec<_>>());
        let handles = Handles::new().fix(low.clone()).add(high.clone(), lifted.clone());
        let renamed = Handles::new().fix(rename(&low)).add(rename(&high), lifted);
        let before = deform_by(&shape, &handles, 6);
        let after = deform_by(&Mesh::new(mesh, positions).expect("a surface"), &renamed, 6);
        for (v, p) in before.iter() {
            let error = (after[VertexId::new(order[v.index()])] - p).norm();
            prop_assert!(error <= 1e-8 * diagonal(&shape), "{error:e}");
        }
    }

    #[test]
    fn no_accepted_step_raises_the_energy(
        shape in surfaces(), stretch in 0.5f64..2.0, soft in proptest::option::of(0.01f64..100.0),
    ) {
        // Smaller meshes have no free vertex between two ends of four.
        prop_assume!(shape.positions().len() > 8);
        let [low, high] = ends(&shape);
        let options = DeformOptions::default().tolerance(1e-8);
        let matrix = Matrix4::new_nonuniform_scaling(&Vector3::new(stretch, 1.0, 1.0 / stretch))
            * nalgebra::Rotation3::from_euler_angles(0.4, -0.3, 0.5).to_homogeneous();
        let mut handles = Handles::new().fix(low).transform(high, matrix);
        if let Some(weight) = soft {
            handles = handles.soft(weight);
        }
        let mut session = Session::new(shape.surface(), &handles, &options)?;
        let mut energies = Vec::new();
        let report = session.run_observed(|_, step| {
            energies.extend(step.energy.map(|energy| (energy, step.energy_rounding)));
            ControlFlow::Continue(())
        })?;
        prop_assert_eq!(energies.len(), report.iterations);
        for pair in energies.windows(2) {
            let [(before, _), (after, rounding)] = [pair[0], pair[1]];
            prop_assert!(after <= before + rounding, "{after} after {before}");
        }
    }

    #[test]
    fn the_matrix_annihilates_constants_exactly(shape in surfaces(), scheme in schemes()) {
        let surface = shape.surface();
        let matrix = Operator::assemble(&*scheme.scheme::<f64>(), &surface)?.matrix();
        let single = single(&shape);
        let single = Operator::assemble(&*scheme.scheme::<f32>(), &single.surface())?.matrix();
        for row in matrix.row_iter() {
            prop_assert_eq!(row.values().iter().sum::<f64>(), 0.0);
            prop_assert_eq!(row.values().iter().rev().sum::<f64>(), 0.0);
        }
        for row in single.row_iter() {
            prop_assert_eq!(row.values().iter().sum::<f32>(), 0.0);
        }
    }

    #[test]
    fn every_weight_is_finite(shape in surfaces(), scheme in schemes(), collapsed in 0usize..400) {
        // One vertex on top of a neighbour: zero-area faces.
        let mut positions = shape.positions().clone();
        let v = VertexId::new(collapsed % positions.len());
        let neighbour = shape.connectivity().one_ring(v).next().expect("every vertex has a neighbour");
        positions[v] = positions[neighbour];
        let surface = Surface::new(shape.connectivity(), &positions)?;
        let operator = Operator::assemble(&*scheme.scheme::<f64>(), &surface)?;
        prop_assert!(operator.weights().iter().all(|w| w.is_finite()));
    }
}

/// Struts do not depend on numbering, rotation or scale where rays are tied: on regular shapes they
/// run into edges and corners of the opposite wall.
#[test]
fn struts_commute_with_numbering_and_similarities_where_rays_are_tied() {
    let mut draw = Draw::new(23);
    let shapes = [
        bar::<f64>([4.0, 1.0, 1.0], [12, 3, 3]),
        torus::<f64>(1.0, 0.4, 20, 10),
        icosphere::<f64>(2),
    ];
    for shape in &shapes {
        let [low, high] = ends(shape);
        let motion = Rotation3::new(Vector3::new(0.9, 0.1, 0.2)).to_homogeneous();
        let run = |shape: &Mesh<f64>, [low, high]: [Vec<VertexId>; 2], motion| {
            let handles = Handles::new().fix(low).transform(high, motion);
            let options = DeformOptions::default()
                .tolerance(1e-9)
                .iteration_limit(2_000);
            let deformed = deform(shape, &handles, &options).expect("an edit");
            assert_eq!(deformed.report.stop, StopReason::Converged);
            deformed.positions
        };
        let before = run(shape, [low.clone(), high.clone()], motion);
        for _ in 0..2 {
            let n = before.len();
            let mut order: Vec<usize> = (0..n).collect();
            (1..n).for_each(|k| order.swap(k, draw.vertex(k + 1).index()));
            let scale = 3.0_f64.powf(draw.number());
            let turn = Rotation3::new(draw.vector() * 3.0);
            let frame = turn.to_homogeneous() * Matrix4::new_scaling(scale);
            let other = renumbered(shape, &order, |p| turn * (p * scale));
            let rename = |region: &[VertexId]| -> Vec<VertexId> {
                let renamed = region.iter().map(|v| VertexId::new(order[v.index()]));
                renamed.collect()
            };
            let back = frame.try_inverse().expect("a similarity");
            let after = run(&other, [rename(&low), rename(&high)], frame * motion * back);
            for (v, p) in before.iter() {
                let expected = turn * (p * scale);
                let error = (after[VertexId::new(order[v.index()])] - expected).norm();
                assert!(error <= 1e-6 * diagonal(&other), "{error:e}");
            }
        }
    }
}

/// The shape with other indices, vertex v having become `order[v]`, and moved positions.
fn renumbered(
    shape: &Mesh<f64>,
    order: &[usize],
    place: impl Fn(&Point3<f64>) -> Point3<f64>,
) -> Mesh<f64> {
    let mesh = shape.connectivity();
    let corners = |f| mesh.triangle(f).map(|v| order[v.index()] as u32);
    let faces: Vec<[u32; 3]> = mesh.faces().map(corners).collect();
    let mut positions = shape.positions().clone();
    for (v, p) in shape.positions().iter() {
        positions[VertexId::new(order[v.index()])] = place(p);
    }
    let mesh = HalfedgeMesh::from_faces(order.len(), &faces).expect("a surface");
    Mesh::new(mesh, positions).expect("a surface")
}

/// On a flat mesh the cotangent Laplacian of a linear function is zero in the interior.
#[test]
fn linear_precision() {
    let shape = cotan::shapes::bumpy_plane::<f64>([2.0, 1.0], [12, 9], 0.0);
    // Bend the grid within the plane, so that the triangles are irregular.
    let positions = shape.positions().map(|p| {
        Point3::new(
            p.x + 0.03 * (7.0 * p.y).sin(),
            p.y + 0.02 * (5.0 * p.x).cos(),
            p.z,
        )
    });
    let surface = Surface::new(shape.connectivity(), &positions).expect("a surface");
    let scheme = cotan_laplacian::Cotangent::default();
    let operator = Operator::assemble(&scheme, &surface).expect("weights");
    assert_eq!(LaplacianScheme::<f64>::name(&scheme), "cotangent");
    let mut ell = VertexMap::filled(positions.len(), Vector3::zeros());
    operator.apply(&positions, &mut ell);
    let worst = ell
        .iter()
        .filter(|(v, _)| !shape.connectivity().is_boundary_vertex(*v))
        .map(|(_, ell)| ell.norm())
        .fold(0.0, f64::max);
    assert!(worst < 1e-13, "{worst}");
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    // Large enough for several chunks of every sum.
    let shape = cotan::shapes::creature::<f64>(96);
    let handles = bend(&shape);
    let run = |threads: usize| {
        cotan_parallel::on_threads(threads, || deform_by(&shape, &handles, 5)).expect("threads")
    };
    let one = run(1);
    assert!(run(2) == one && run(5) == one);
}

/// A flow built directly follows its handles as a session does.
#[test]
fn a_flow_and_a_session_agree() {
    let shape = cotan::shapes::icosphere::<f64>(3);
    let handles = bend(&shape);
    let [low, high] = ends(&shape);
    let targets = deform_by(&shape, &handles, 1);
    let held = low
        .iter()
        .chain(&high)
        .map(|v| (cotan::linear::Handle::hard(*v), targets[*v]));
    let mut flow = Flow::builder(shape.connectivity(), shape.positions())
        .handles(held)
        .build()
        .expect("builds");
    let report = flow.run(|_, _| ControlFlow::Continue(())).expect("runs");
    assert_eq!(report.stop, StopReason::Converged);
    let session = deform(shape.surface(), &handles, &DeformOptions::default()).expect("deforms");
    assert!(longest_difference(&flow.positions(), &session.positions) < 1e-12);
}
