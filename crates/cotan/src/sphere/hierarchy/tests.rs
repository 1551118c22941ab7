//! Tests that every topological sphere gets a valid map.

use cotan_geometry::shapes::{creature, icosphere, tetrahedron};
use cotan_geometry::testing::blobs;
use cotan_halfedge::testing::genus_zero;
use cotan_halfedge::{FaceId, VertexId};
use proptest::prelude::*;

use super::*;
use crate::sphere::SphereMap;

fn check<T: Scalar>(mesh: &HalfedgeMesh, positions: &Positions<f64>, balance: f64) -> Positions<T> {
    let sphere = embed::<T>(mesh, positions, balance).expect("an embedding");
    SphereMap::new(mesh, sphere)
        .expect("a valid map")
        .into_positions()
}

/// Positions unrelated to the connectivity, many of them equal.
fn scrambled(mesh: &HalfedgeMesh) -> Positions<f64> {
    let coordinate = |v: VertexId, k: usize| ((v.index() * 7 + k * 5) % 11) as f64;
    let point = |v| Point3::new(coordinate(v, 0), coordinate(v, 1), coordinate(v, 2));
    mesh.vertices().map(point).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn any_triangulated_sphere_with_any_positions_is_embedded(
        mesh in genus_zero(),
        balance in 0.0..=1.0_f64,
    ) {
        let positions = scrambled(&mesh);
        check::<f64>(&mesh, &positions, balance);
        check::<f32>(&mesh, &positions, balance);
        let point: Positions<f64> = mesh.vertices().map(|_| Point3::origin()).collect();
        check::<f32>(&mesh, &point, balance);
    }

    #[test]
    fn blobs_keep_their_areas(shape in blobs()) {
        let sphere = check::<f64>(shape.connectivity(), shape.positions(), 1.0);
        let map = SphereMap::new(shape.connectivity(), sphere).expect("valid");
        let surface = shape.surface();
        let total = surface.area();
        let log = |f: FaceId| {
            let share = cotan_geometry::face_area_vector(&surface, f).norm() / total;
            share * (map.solid_angle(f) / (4.0 * std::f64::consts::PI) / share).ln().abs()
        };
        prop_assert!(shape.connectivity().faces().map(log).sum::<f64>() < 0.1);
    }
}

#[test]
fn a_tetrahedron_becomes_a_regular_one() {
    let shape = tetrahedron::<f64>();
    let sphere = check::<f64>(shape.connectivity(), shape.positions(), 0.5);
    let dots = sphere
        .values()
        .map(|p| p.coords.dot(&sphere[VertexId::new(0)].coords));
    assert!(dots.skip(1).all(|d| (d + 1.0 / 3.0).abs() < 1e-3));
}

#[test]
fn needles_pinched_dumbbells_and_creatures_are_embedded() {
    let needle = |p: &Point3<f64>| Point3::new(p.x, p.y, 50.0 * p.z);
    let dumbbell = |p: &Point3<f64>| {
        let waist = 1e-3 + p.z * p.z;
        Point3::new(p.x * waist, p.y * waist, p.z)
    };
    let ball = icosphere::<f64>(4);
    for positions in [ball.positions().map(needle), ball.positions().map(dumbbell)] {
        for balance in [0.0, 1.0] {
            check::<f64>(ball.connectivity(), &positions, balance);
            check::<f32>(ball.connectivity(), &positions, balance);
        }
    }
    let creature = creature::<f64>(40);
    check::<f64>(creature.connectivity(), creature.positions(), 0.0);
    check::<f32>(creature.connectivity(), creature.positions(), 1.0);
}

#[test]
fn a_hub_of_thousands_of_edges_is_embedded() {
    let n = 3000_u32;
    let faces: Vec<[u32; 3]> = (0..n)
        .flat_map(|i| {
            let j = (i + 1) % n;
            [[i, j, n], [j, i, n + 1]]
        })
        .collect();
    let mesh = HalfedgeMesh::from_faces(n as usize + 2, &faces).expect("a double cone");
    let turn = |i: u32| std::f64::consts::TAU * f64::from(i) / f64::from(n);
    let rim = (0..n).map(|i| Point3::new(turn(i).cos(), turn(i).sin(), 0.0));
    let tips = [Point3::new(0.0, 0.0, 1.0), Point3::new(0.0, 0.0, -1.0)];
    let positions: Positions<f64> = rim.chain(tips).collect();
    check::<f64>(&mesh, &positions, 0.5);
    check::<f32>(&mesh, &positions, 0.5);
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let shape = creature::<f64>(40);
    let with = |threads| {
        let run = || embed::<f64>(shape.connectivity(), shape.positions(), 0.7);
        let embedding = cotan_parallel::on_threads(threads, run).expect("threads");
        embedding.expect("an embedding")
    };
    assert_eq!(with(1), with(3));
}
