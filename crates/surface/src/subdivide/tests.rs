#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::f64::consts::TAU;

use cotan_geometry::{Mesh, icosphere};

use super::*;

const CUBE: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

const CUBE_FACES: [[u32; 4]; 6] = [
    [0, 3, 2, 1],
    [4, 5, 6, 7],
    [0, 1, 5, 4],
    [1, 2, 6, 5],
    [2, 3, 7, 6],
    [3, 0, 4, 7],
];

fn cube() -> (HalfedgeMesh, Positions<f64>) {
    let mesh = HalfedgeMesh::from_faces(8, &CUBE_FACES).unwrap();
    (mesh, CUBE.iter().map(|&p| Point3::from(p)).collect())
}

#[test]
fn catmull_clark_of_a_cube_has_the_known_points() {
    let (mesh, x) = cube();
    let options = SubdivideOptions::new(SubdivisionScheme::CatmullClark);
    let made = subdivide(&mesh, &x, &options).unwrap();
    assert_eq!(
        (
            made.connectivity.num_vertices(),
            made.connectivity.num_faces()
        ),
        (26, 24)
    );
    assert!(
        made.connectivity
            .faces()
            .all(|f| made.connectivity.degree(f) == 4)
    );
    for v in mesh.vertices() {
        assert!((made.positions[v] - Point3::from(x[v].coords * (5.0 / 9.0))).norm() < 1e-15);
    }
    for e in mesh.edges() {
        let [a, b] = mesh.edge_vertices(e);
        let expected = (x[a].coords + x[b].coords) / 2.0 * 0.75;
        assert!((made.positions[edge_vertex(&mesh, e)].coords - expected).norm() < 1e-15);
    }
    made.connectivity.validate().unwrap();
}

#[test]
fn a_cube_of_creases_stays_a_cube() {
    let (mesh, x) = cube();
    let options = SubdivideOptions::new(SubdivisionScheme::CatmullClark)
        .levels(3)
        .creases(mesh.edges());
    let made = subdivide(&mesh, &x, &options).unwrap();
    assert!(
        made.positions
            .values()
            .all(|p| (p.coords.amax() - 1.0).abs() < 1e-15)
    );
    for v in mesh.vertices() {
        assert_eq!(made.positions[v], x[v]);
    }
}

#[test]
fn loop_converges_to_the_limit_of_an_icosahedron() {
    let shape = icosphere::<f64>(0);
    // The limit of a vertex of valence n is (χv + Σ neighbours) / (χ + n) with χ = 3 / 8β.
    let beta = (0.625 - (0.375 + 0.25 * (TAU / 5.0).cos()).powi(2)) / 5.0;
    let chi = 3.0 / (8.0 * beta);
    // The five neighbours of a vertex of the unit icosahedron sum to √5 times the vertex.
    let expected = (chi + 5.0_f64.sqrt()) / (chi + 5.0);
    let mut errors = Vec::new();
    for levels in [2, 4, 6] {
        let options = SubdivideOptions::new(SubdivisionScheme::Loop).levels(levels);
        let made = subdivide(shape.connectivity(), shape.positions(), &options).unwrap();
        assert_eq!(made.connectivity.num_faces(), 20 << (2 * levels));
        let radius = made.positions[VertexId::new(0)].coords.norm();
        errors.push((radius - expected).abs());
    }
    assert!(errors[0] > errors[1] && errors[1] > errors[2], "{errors:?}");
    assert!(errors[2] < 1e-4, "{errors:?}");
}

#[test]
fn every_scheme_reproduces_linear_functions_of_flat_regular_meshes() {
    let flat = cotan_geometry::bumpy_plane::<f64>([1.0, 2.0], [6, 5], 0.0);
    for scheme in [
        SubdivisionScheme::Loop,
        SubdivisionScheme::CatmullClark,
        SubdivisionScheme::Midpoint,
    ] {
        let options = SubdivideOptions::new(scheme).levels(2);
        let made = subdivide(flat.connectivity(), flat.positions(), &options).unwrap();
        let height = flat.positions().map(|p| 2.0 * p.x - p.y + 0.5);
        let height = made.interpolated(&height);
        for (v, p) in made.positions.iter() {
            assert!((height[v] - (2.0 * p.x - p.y + 0.5)).abs() < 1e-12);
        }
    }
}

#[test]
fn midpoint_keeps_the_surface_and_corner_weights_give_the_positions() {
    let shape = icosphere::<f64>(1);
    let options = SubdivideOptions::new(SubdivisionScheme::Midpoint).levels(2);
    let made = subdivide(shape.connectivity(), shape.positions(), &options).unwrap();
    let fine = Mesh::new(made.connectivity.clone(), made.positions.clone()).unwrap();
    let (area, before) = (fine.surface().area(), shape.surface().area());
    assert!((area / before - 1.0).abs() < 1e-12);
    let mut i = 0;
    for f in made.connectivity.faces() {
        let parent = shape.connectivity().triangle(made.parents[f]);
        for v in made.connectivity.face_vertices(f) {
            let terms = made.corners.terms(i);
            let place: Vector3<f64> = terms
                .iter()
                .map(|&(k, w)| shape.positions()[parent[k as usize]].coords * w)
                .sum();
            assert!((place - made.positions[v].coords).norm() < 1e-14);
            i += 1;
        }
    }
}

#[test]
fn too_many_levels_are_refused() {
    let shape = icosphere::<f64>(0);
    let options = SubdivideOptions::new(SubdivisionScheme::Loop).levels(30);
    let error = subdivide(shape.connectivity(), shape.positions(), &options).unwrap_err();
    assert!(matches!(error, TessellationError::TooLarge { .. }));
}
