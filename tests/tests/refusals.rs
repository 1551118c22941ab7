//! Bad input gives one clear error or the right result, never a panic or NaN.

use cotan::prelude::*;
use cotan_geometry::Mesh;

/// The defaults, but no part follows another.
fn options() -> DeformOptions {
    DeformOptions::default().parts(cotan::Parts::Still)
}

/// An icosphere with its lowest vertices fixed and its highest one pulled up.
fn pulled(scale: f64, offset: Vector3<f64>) -> (Mesh<f64>, Handles<f64>) {
    let mut shape = cotan::shapes::icosphere::<f64>(3);
    shape
        .positions_mut()
        .iter_mut()
        .for_each(|p| *p = *p * scale + offset);
    let z = offset.z;
    let surface = shape.surface();
    let low = surface.vertices_where(|p| p.z - z < -0.8 * scale);
    let high = surface.vertices_where(|p| p.z - z > 0.9 * scale);
    let lift = nalgebra::Translation3::new(0.0, 0.0, 0.5 * scale).to_homogeneous();
    let handles = Handles::new().fix(low).transform(high, lift);
    (shape, handles)
}

fn refusal(shape: &Mesh<f64>, handles: &Handles<f64>) -> String {
    match deform(shape.surface(), handles, &options()) {
        Ok(deformed) => panic!("not refused: {:?}", deformed.report),
        Err(error) => error.to_string(),
    }
}

fn assert_says(message: &str, words: &[&str]) {
    for word in words {
        assert!(
            message.contains(word),
            "\"{message}\" does not say \"{word}\""
        );
    }
}

#[test]
fn nan_and_infinite_coordinates() {
    for bad in [f64::NAN, f64::INFINITY] {
        let (mut shape, handles) = pulled(1.0, Vector3::zeros());
        shape.positions_mut()[17].y = bad;
        let error = deform(shape.surface(), &handles, &options())
            .map(|_| ())
            .expect_err("refused")
            .to_string();
        assert_says(&error, &["vertex 17", "not a finite number"]);
    }
}

#[test]
fn an_empty_mesh() {
    let mesh = HalfedgeMesh::default();
    let positions = Positions::<f64>::default();
    let error = deform(
        Surface::assume_checked(&mesh, &positions),
        &Handles::new(),
        &options(),
    )
    .map(|_| ())
    .expect_err("refused")
    .to_string();
    assert_says(&error, &["no faces"]);
}

#[test]
fn a_polygon() {
    let mesh = HalfedgeMesh::from_faces(4, &[[0, 1, 2, 3]]).expect("a quad");
    let positions = (0..4)
        .map(|i| Point3::new(f64::from(i), f64::from(i * i), 0.0))
        .collect();
    let handles = Handles::new().fix([VertexId::new(0)]);
    let error = deform(
        Surface::assume_checked(&mesh, &positions),
        &handles,
        &options(),
    )
    .map(|_| ())
    .expect_err("refused");
    assert_says(&error.to_string(), &["face 0", "4 corners", "triangulate"]);
}

#[test]
fn handles_that_cannot_be() {
    let (shape, handles) = pulled(1.0, Vector3::zeros());
    assert_says(&refusal(&shape, &Handles::new()), &["no handles"]);
    assert_says(
        &refusal(&shape, &handles.clone().fix([VertexId::new(642)])),
        &["handle 2", "vertex 642", "642 vertices"],
    );
    assert_says(
        &refusal(&shape, &handles.clone().fix([])),
        &["handle 2", "no vertex"],
    );
    let moved = handles.vertices().next().expect("a group")[0];
    assert_says(
        &refusal(&shape, &handles.clone().move_to(moved, Point3::origin())),
        &["handles 0 and 2", "contradict", "different positions"],
    );
    assert_says(
        &refusal(
            &shape,
            &handles.clone().add([VertexId::new(5)], Motion::To(vec![])),
        ),
        &["handle 2", "1 vertices", "0 target"],
    );
    let nowhere = Point3::new(0.0, f64::NAN, 0.0);
    let free = VertexId::new(100);
    assert_says(
        &refusal(&shape, &handles.clone().move_to(free, nowhere)),
        &["vertex 100", "not a finite position"],
    );
    let absurd = Point3::new(0.0, 1e300, 0.0);
    assert_says(
        &refusal(&shape, &handles.clone().move_to(free, absurd)),
        &["vertex 100", "units"],
    );
    for weight in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e300] {
        assert_says(
            &refusal(&shape, &handles.clone().fix([free]).soft(weight)),
            &["vertex 100", "positive number"],
        );
    }
}

#[test]
fn settings_out_of_range() {
    let (shape, handles) = pulled(1.0, Vector3::zeros());
    let refused = |options: DeformOptions| {
        deform(shape.surface(), &handles, &options)
            .map(|_| ())
            .expect_err("refused")
            .to_string()
    };
    assert_says(
        &refused(options().tolerance(f64::NAN)),
        &["tolerance", "at least 0"],
    );
    assert_says(
        &refused(options().schedule(Schedule::Constant(0.0))),
        &["updating ratio", "above 0"],
    );
    for bending_length in [0.0, -1.0, f64::NAN] {
        assert_says(
            &refused(options().bending_length(bending_length)),
            &["bending length", "above 0"],
        );
    }
}

#[test]
fn a_component_without_a_handle() {
    let one = cotan::shapes::icosphere::<f64>(1);
    let n = one.positions().len();
    let mut faces = one.connectivity().to_faces();
    let shifted: Vec<Vec<u32>> = faces
        .iter()
        .map(|f| f.iter().map(|v| v + n as u32).collect())
        .collect();
    faces.extend(shifted);
    let mesh = HalfedgeMesh::from_faces(2 * n, &faces).expect("two spheres");
    let far = Vector3::new(5.0, 0.0, 0.0);
    let positions: Positions<f64> = one
        .positions()
        .values()
        .copied()
        .chain(one.positions().values().map(|p| p + far))
        .collect();
    let shape = Mesh::new(mesh, positions).expect("a surface");
    let handles = Handles::new().fix([VertexId::new(0), VertexId::new(1)]);
    assert_says(
        &refusal(&shape, &handles),
        &[
            &format!("vertex {n} "),
            &format!("{n} vertices"),
            "no handle",
            "fix or move",
        ],
    );
    // With a handle each, both move.
    let handles = handles.move_to(VertexId::new(n), shape.positions()[VertexId::new(n)] + far);
    let deformed = deform(shape.surface(), &handles, &options()).expect("deforms");
    assert_eq!(deformed.report.stop, StopReason::Converged);
    let v = VertexId::new(n + 7);
    assert!((deformed.positions[v] - shape.positions()[v] - far).norm() < 1e-3);
}

#[test]
fn all_vertices_at_one_point() {
    let (mut shape, _) = pulled(1.0, Vector3::zeros());
    shape
        .positions_mut()
        .iter_mut()
        .for_each(|p| *p = Point3::new(1.0, 2.0, 3.0));
    let handles = Handles::new().fix([VertexId::new(0)]);
    let error = deform(shape.surface(), &handles, &options())
        .map(|_| ())
        .expect_err("refused");
    assert_says(&error.to_string(), &["same point"]);
}

#[test]
fn zero_area_faces_are_carried_along() {
    let (mut shape, handles) = pulled(1.0, Vector3::zeros());
    let free = shape.surface().vertices_where(|p| p.z.abs() < 0.1);
    for &v in free.iter().step_by(7) {
        let neighbour = shape
            .connectivity()
            .one_ring(v)
            .next()
            .expect("a neighbour");
        shape.positions_mut()[v.index()] = shape.positions()[neighbour];
    }
    let deformed = deform(shape.surface(), &handles, &options()).expect("deforms");
    assert!(
        deformed
            .positions
            .values()
            .all(|p| p.iter().all(|x| x.is_finite()))
    );
    assert_eq!(deformed.report.stop, StopReason::Converged);
    let tallest = deformed
        .positions
        .values()
        .map(|p| p.z)
        .fold(f64::MIN, f64::max);
    assert!((1.4..1.6).contains(&tallest), "{tallest}");
}

#[test]
fn zero_length_laplacian_coordinates() {
    // A flat sheet: ℓ = 0 at every inner vertex.
    let shape = cotan::shapes::bumpy_plane::<f64>([2.0, 2.0], [16, 16], 0.0);
    let surface = shape.surface();
    let left = surface.vertices_where(|p| p.x < -0.99);
    let right = surface.vertices_where(|p| p.x > 0.99);
    assert!(!left.is_empty() && !right.is_empty());
    let turn = nalgebra::Isometry3::new(Vector3::new(0.0, 0.0, 0.5), Vector3::new(0.6, 0.0, 0.0));
    let handles = Handles::new()
        .fix(left)
        .transform(right, turn.to_homogeneous());
    for &orientation in OrientationKind::ALL {
        let options = options().orientation(orientation);
        let deformed = deform(shape.surface(), &handles, &options).expect("deforms");
        assert!(
            deformed
                .positions
                .values()
                .all(|p| p.iter().all(|x| x.is_finite())),
            "{}",
            orientation.name()
        );
        let quality =
            Quality::measure(&surface, &surface.with_positions(&deformed.positions)).expect("same");
        assert_eq!(quality.flipped_faces, 0, "{}", orientation.name());
    }
}

#[test]
fn tiny_huge_and_distant_meshes() {
    let (shape, handles) = pulled(1.0, Vector3::zeros());
    let reference = deform(shape.surface(), &handles, &options()).expect("deforms");
    let cases = [
        (1e-9, Vector3::zeros(), 1e-9),
        (1e9, Vector3::zeros(), 1e-9),
        // Coordinates near 1e6 have a precision of 1e-10.
        (1.0, Vector3::new(1e6, -1e6, 1e6), 1e-7),
    ];
    for (scale, offset, tolerance) in cases {
        let (shape, handles) = pulled(scale, offset);
        let deformed = deform(shape.surface(), &handles, &options()).expect("deforms");
        assert_eq!(deformed.report.stop, StopReason::Converged);
        for (moved, expected) in deformed
            .positions
            .values()
            .zip(reference.positions.values())
        {
            let back = (moved - offset).coords / scale;
            assert!(
                (back - expected.coords).norm() < tolerance,
                "{scale} {offset:?}"
            );
        }
    }
}

#[test]
fn single_precision_agrees_with_double() {
    let (shape, handles) = pulled(1.0, Vector3::zeros());
    let double = deform(shape.surface(), &handles, &options()).expect("deforms");
    let positions = shape.positions().map(|p| p.map(|x| x as f32));
    let mut single_handles = Handles::<f32>::new();
    for (vertices, lift) in handles.vertices().zip([0.0, 0.5]) {
        let targets = vertices
            .iter()
            .map(|v| positions[*v] + Vector3::new(0.0, 0.0, lift))
            .collect();
        single_handles = single_handles.add(vertices.to_vec(), Motion::To(targets));
    }
    let single = deform(
        Surface::assume_checked(shape.connectivity(), &positions),
        &single_handles,
        &options(),
    )
    .expect("deforms");
    assert_eq!(single.report.stop, StopReason::Converged);
    let size = shape.surface().bounding_box().diagonal();
    for (a, b) in single.positions.values().zip(double.positions.values()) {
        assert!((a.map(f64::from) - b).norm() < 1e-3 * size);
    }
}

#[test]
fn soft_handles_approach_hard_ones() {
    let (shape, handles) = pulled(1.0, Vector3::zeros());
    let hard = deform(shape.surface(), &handles, &options()).expect("deforms");
    let miss = |weight: f64| {
        let soft = handles.clone().all_held(Hold::Soft(weight));
        let soft = deform(shape.surface(), &soft, &options()).expect("deforms");
        assert_eq!(soft.report.stop, StopReason::Converged, "weight {weight}");
        let worst = hard.positions.values().zip(soft.positions.values());
        worst.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    };
    let (loose, firm) = (miss(1.0), miss(1000.0));
    for weight in [0.01, 0.1, 10.0] {
        miss(weight);
    }
    assert!(firm < 1e-3 && firm < loose, "{loose} {firm}");
}

#[test]
fn groups_that_share_a_vertex_move_together_or_not_at_all() {
    let (shape, _) = pulled(1.0, Vector3::zeros());
    let [a, b, c] = [3, 4, 5].map(VertexId::new);
    let lift = nalgebra::Translation3::new(0.0, 0.0, 0.3).to_homogeneous();
    let handles = Handles::new().fix([a, b]).add([b, c], Motion::Stay);
    let mut session = Session::new(shape.surface(), &handles, &options()).expect("a session");
    let error = session
        .transform_handle(1, lift)
        .expect_err("refused")
        .to_string();
    assert_says(
        &error,
        &["handles 0 and 1", "vertex 4", "different positions"],
    );
    let up = Motion::Transform(lift);
    session
        .move_handles(&[(0, up.clone()), (1, up.clone())])
        .expect("both move");
    let report = session.run().expect("runs");
    assert_eq!(report.stop, StopReason::Converged);
    // Setting the same targets again changes nothing: the next step still finds the shape
    // converged.
    session.move_handles(&[(0, up)]).expect("nothing new");
    assert!(session.step().expect("steps").converged);
    assert_says(
        &session
            .move_handle(2, &Motion::Stay)
            .expect_err("refused")
            .to_string(),
        &["handle 2 does not exist", "has 2"],
    );
}
