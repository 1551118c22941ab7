//! Spherical parameterization of generated meshes: no flipped triangle on any topological sphere,
//! and theorems about the map.

use cotan::flow::nearest_rotation;
use cotan::prelude::*;
use cotan::shapes::{creature, icosphere};
use cotan::sphere::{SphereOptions, SphereQuality, Spherical, spherical};
use cotan_geometry::{Mesh, testing};
use nalgebra::{Matrix3, Rotation3};
use proptest::prelude::*;

fn options() -> SphereOptions {
    SphereOptions::default()
}

/// Maps a mesh and checks all invariants of a map.
fn checked(
    mesh: &HalfedgeMesh,
    positions: &Positions<f64>,
    options: &SphereOptions,
) -> Spherical<f64> {
    let done = spherical(Surface::assume_checked(mesh, positions), options).expect("a map");
    let surface = Surface::new(mesh, positions).expect("a surface");
    let quality = SphereQuality::measure(&surface, &done.map);
    assert_eq!(quality.flipped_triangles, 0);
    assert_eq!(quality.degree, 1);
    assert!(quality.sphericity_error < 1e-12);
    done
}

/// An icosphere whose points are moved along their own directions or squeezed.
fn pulled(level: u32, pull: impl Fn(Vector3<f64>) -> Vector3<f64>) -> Mesh<f64> {
    let mut shape = icosphere::<f64>(level);
    for p in shape.positions_mut().iter_mut() {
        p.coords = pull(p.coords);
    }
    shape
}

#[test]
fn needles_pancakes_dumbbells_and_stars_have_no_flip_in_either_precision() {
    let arms: Vec<Vector3<f64>> = icosphere::<f64>(0)
        .positions()
        .values()
        .map(|p| p.coords)
        .collect();
    let star = |u: Vector3<f64>| {
        let nearest = arms.iter().map(|a| a.dot(&u)).fold(-1.0, f64::max);
        u * (1.0 + 6.0 * ((nearest - 0.93) / 0.07).max(0.0))
    };
    let shapes = [
        pulled(4, |u| Vector3::new(u.x, u.y, 50.0 * u.z)),
        pulled(4, |u| Vector3::new(u.x, u.y, 0.02 * u.z)),
        pulled(4, |u| {
            let waist = 0.02 + u.z * u.z;
            Vector3::new(u.x * waist, u.y * waist, 1.5 * u.z)
        }),
        pulled(5, star),
        creature::<f64>(64),
    ];
    for shape in shapes {
        let _ = checked(shape.connectivity(), shape.positions(), &options());
        let single = shape.positions().map(|p| p.map(|x| x as f32));
        let done = spherical(
            Surface::assume_checked(shape.connectivity(), &single),
            &options(),
        );
        assert!(done.is_ok(), "{done:?}");
    }
}

/// The largest distance between two maps after the second is rotated onto the first.
fn distance_up_to_rotation(a: &Positions<f64>, b: &Positions<f64>) -> f64 {
    let mut covariance = Matrix3::zeros();
    for (a, b) in a.values().zip(b.values()) {
        covariance += a.coords * b.coords.transpose();
    }
    let rotation = nearest_rotation(&covariance);
    a.values()
        .zip(b.values())
        .map(|(a, b)| (a.coords - rotation * b.coords).norm())
        .fold(0.0, f64::max)
}

/// Inside out, the map is the same up to a reflection.
#[test]
fn an_inside_out_mesh_is_mapped_as_well() {
    let shape = creature::<f64>(48);
    let done = checked(shape.connectivity(), shape.positions(), &options());
    let reflected = shape.positions().map(|p| -p);
    let inside_out = checked(shape.connectivity(), &reflected, &options());
    assert_eq!(inside_out.report, done.report);
    let far = distance_up_to_rotation(done.map.positions(), inside_out.map.positions());
    assert!(far < 1e-9, "{far}");
}

/// A square seen from both sides: closed, of genus 0, and without volume.
#[test]
fn a_surface_without_volume_is_mapped_too() {
    let shape = pulled(3, |u| Vector3::new(u.x, u.y, 0.0));
    let _ = checked(shape.connectivity(), shape.positions(), &options());
}

/// A thin tube of many rings, closed by a vertex at each end.
///
/// Its conformal map shrinks by a factor of e per radius, far below the smallest representable
/// number.
fn tube(rings: u32, sides: u32) -> Mesh<f64> {
    let mut points = vec![Point3::new(0.0, 0.0, -1.0)];
    for ring in 0..rings {
        for side in 0..sides {
            let angle = f64::from(side) / f64::from(sides) * std::f64::consts::TAU;
            points.push(Point3::new(angle.cos(), angle.sin(), f64::from(ring)));
        }
    }
    points.push(Point3::new(0.0, 0.0, f64::from(rings)));
    let at = |ring: u32, side: u32| 1 + ring * sides + side % sides;
    let last = points.len() as u32 - 1;
    let mut faces = Vec::new();
    for side in 0..sides {
        faces.push([0, at(0, side + 1), at(0, side)]);
        faces.push([last, at(rings - 1, side), at(rings - 1, side + 1)]);
        for ring in 1..rings {
            let (low, high) = (ring - 1, ring);
            faces.push([at(low, side), at(low, side + 1), at(high, side + 1)]);
            faces.push([at(low, side), at(high, side + 1), at(high, side)]);
        }
    }
    Mesh::new(
        HalfedgeMesh::from_faces(points.len(), &faces).expect("a tube"),
        points.into_iter().collect(),
    )
    .expect("a surface")
}

#[test]
fn a_tube_whose_conformal_map_underflows_is_mapped_too() {
    for (rings, sides) in [(40, 8), (1000, 6)] {
        let shape = tube(rings, sides);
        let done = checked(shape.connectivity(), shape.positions(), &options());
        println!("{rings} rings: {:?}", done.report);
        let single = shape.positions().map(|p| p.map(|x| x as f32));
        let done = spherical(
            Surface::assume_checked(shape.connectivity(), &single),
            &options(),
        );
        assert!(done.is_ok(), "{done:?}");
    }
}

#[test]
fn the_sphere_maps_to_itself() {
    let shape = icosphere::<f64>(4);
    let done = checked(shape.connectivity(), shape.positions(), &options());
    assert!(distance_up_to_rotation(shape.positions(), done.map.positions()) < 1e-4);
}

/// One split: the element, its kind, and the position in it.
#[derive(Clone, Debug)]
struct Split {
    pick: usize,
    is_face: bool,
    at: f64,
}

fn splits() -> impl Strategy<Value = Vec<Split>> {
    // Close to a corner or an edge: slivers down to 1e-6 of their neighbours.
    let at = (1.0..6.0f64, any::<bool>()).prop_map(|(digits, far)| {
        if far {
            1.0 - 10f64.powf(-digits)
        } else {
            10f64.powf(-digits)
        }
    });
    let split = (any::<usize>(), any::<bool>(), at).prop_map(|(pick, is_face, at)| Split {
        pick,
        is_face,
        at,
    });
    proptest::collection::vec(split, 0..60)
}

fn refine(shape: &Mesh<f64>, splits: &[Split]) -> Mesh<f64> {
    let (mut mesh, mut positions) = (shape.connectivity().clone(), shape.positions().clone());
    for split in splits {
        if split.is_face {
            let face = FaceId::new(split.pick % mesh.num_faces());
            let [a, b, c] = mesh.triangle(face).map(|v| positions[v].coords);
            let rest = (1.0 - split.at) / 2.0;
            let p = a * split.at + (b + c) * rest;
            mesh.split_face(face).expect("a face can be split");
            positions.push(Point3::from(p));
        } else {
            let edge = cotan::halfedge::EdgeId::new(split.pick % mesh.num_edges());
            let [a, b] = mesh.edge_vertices(edge).map(|v| positions[v].coords);
            mesh.split_edge(edge).expect("an edge can be split");
            positions.push(Point3::from(a * split.at + b * (1.0 - split.at)));
        }
    }
    // Splitting an edge leaves quadrangles or triangles.
    mesh.triangulate()
        .expect("splits leave polygons that can be cut");
    Mesh::new(mesh, positions).expect("a surface")
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn random_subdivisions_with_slivers_have_no_flip(shape in testing::blobs(), splits in splits()) {
        let shape = refine(&shape, &splits);
        let _ = checked(shape.connectivity(), shape.positions(), &options());
        let single = shape.positions().map(|p| p.map(|x| x as f32));
        let _ = spherical(Surface::assume_checked(shape.connectivity(), &single), &options())?;
        let authalic = options().authalic(1.0);
        let _ = checked(shape.connectivity(), shape.positions(), &authalic);
    }

    /// Rigid motion and scaling of the input change the result only by a rotation; renumbering
    /// changes nothing.
    #[test]
    fn motion_scale_and_numbering_change_nothing_but_a_rotation(
        shape in testing::blobs(), turn in prop::array::uniform3(-3.0..3.0f64), scale in 1e-3..1e3f64,
    ) {
        let fine = options().tolerance(1e-9);
        let first = checked(shape.connectivity(), shape.positions(), &fine);
        let rotation = Rotation3::new(Vector3::from(turn));
        let moved = shape.positions().map(|p| rotation * p * scale + Vector3::new(5.0, -3.0, 2.0));
        let second = checked(shape.connectivity(), &moved, &fine);
        let far = distance_up_to_rotation(first.map.positions(), second.map.positions());
        prop_assert!(far < 1e-6, "moved: {}", far);

        // Vertex v becomes n − 1 − v.
        let n = shape.num_vertices();
        let faces: Vec<[u32; 3]> = shape
            .connectivity()
            .faces()
            .map(|f| shape.connectivity().triangle(f).map(|v| (n - 1 - v.index()) as u32))
            .collect();
        let mesh = HalfedgeMesh::from_faces(n, &faces).expect("the same mesh");
        let reversed: Positions<f64> = shape.positions().values().rev().copied().collect();
        let third = checked(&mesh, &reversed, &fine);
        let back: Positions<f64> = third.map.positions().values().rev().copied().collect();
        let far = distance_up_to_rotation(first.map.positions(), &back);
        prop_assert!(far < 1e-6, "renumbered: {}", far);
    }
}
