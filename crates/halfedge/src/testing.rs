//! Random meshes and random edits for property tests (feature `testing`).
//!
//! All mesh strategies of the workspace build on this module. Meshes have up to about 200 faces
//! and a random vertex and face order, and shrink towards small meshes in natural order.

mod edits;
mod shapes;

use proptest::prelude::*;
use proptest::sample::Index;
use proptest::test_runner::TestCaseError;

use crate::ids::VertexId;
use crate::mesh::HalfedgeMesh;

pub use edits::{Edit, edits};
pub use shapes::{PolygonFaces, TriangleFaces};

/// Triangulated spheres: a platonic solid modified by random splits and flips.
pub fn genus_zero() -> impl Strategy<Value = HalfedgeMesh> {
    genus_zero_faces().prop_map(built)
}

/// The faces of [`genus_zero`].
pub fn genus_zero_faces() -> impl Strategy<Value = TriangleFaces> {
    let solid = prop_oneof![
        Just(TriangleFaces::tetrahedron()),
        Just(TriangleFaces::octahedron()),
        Just(TriangleFaces::icosahedron()),
    ];
    let choices = prop::collection::vec((0..3u8, any::<Index>()), 0..90);
    (solid, choices, any::<u64>()).prop_map(|(solid, choices, seed)| {
        let mut mesh = built(solid);
        for (kind, at) in choices {
            // A flip may be rejected; the mesh is a sphere either way.
            let _ = match kind {
                0 => Edit::FlipEdge(at).apply(&mut mesh),
                1 => Edit::SplitEdge(at).apply(&mut mesh),
                _ => Edit::SplitFace(at).apply(&mut mesh),
            };
        }
        TriangleFaces::of(&mesh).shuffled(seed)
    })
}

/// Closed connected triangle meshes of genus 0 to 3.
pub fn closed_mesh() -> impl Strategy<Value = HalfedgeMesh> {
    closed_faces().prop_map(built)
}

/// The faces of [`closed_mesh`].
pub fn closed_faces() -> impl Strategy<Value = TriangleFaces> {
    let tori = prop::collection::vec((3..6u32, 3..6u32), 1..4);
    let handles = (tori, any::<u64>()).prop_map(|(tori, seed)| {
        let tori = tori
            .into_iter()
            .map(|(rows, columns)| TriangleFaces::torus(rows, columns));
        let sum = tori.reduce(|sum, torus| sum.connected_sum(&torus));
        sum.unwrap_or_else(TriangleFaces::tetrahedron)
            .shuffled(seed)
    });
    prop_oneof![genus_zero_faces(), handles]
}

/// Discs of triangles with up to nine holes.
pub fn disc_with_holes() -> impl Strategy<Value = HalfedgeMesh> {
    disc_faces().prop_map(built)
}

/// The faces of [`disc_with_holes`].
pub fn disc_faces() -> impl Strategy<Value = TriangleFaces> {
    (1..9u32, 1..9u32, any::<u64>(), any::<u64>()).prop_map(|(rows, columns, holes, seed)| {
        TriangleFaces::disc(rows, columns, holes).shuffled(seed)
    })
}

/// Triangle meshes with one to three components, each with or without boundary.
pub fn triangle_mesh() -> impl Strategy<Value = HalfedgeMesh> {
    triangle_faces().prop_map(built)
}

/// The faces of [`triangle_mesh`].
pub fn triangle_faces() -> impl Strategy<Value = TriangleFaces> {
    let component = prop_oneof![closed_faces(), disc_faces()];
    (prop::collection::vec(component, 1..4), any::<u64>()).prop_map(|(components, seed)| {
        let faces = components
            .into_iter()
            .reduce(|all, one| all.disjoint_union(&one));
        faces
            .unwrap_or_else(TriangleFaces::tetrahedron)
            .shuffled(seed)
    })
}

/// Polygon meshes: grids and tori of quads, duals of closed triangle meshes, and prisms.
pub fn polygon_mesh() -> impl Strategy<Value = HalfedgeMesh> {
    let faces = prop_oneof![
        (1..9u32, 1..9u32, any::<u64>())
            .prop_map(|(rows, columns, holes)| PolygonFaces::grid(rows, columns, holes)),
        (3..9u32, 3..9u32).prop_map(|(rows, columns)| PolygonFaces::torus(rows, columns)),
        (3..20u32).prop_map(PolygonFaces::prism),
        closed_mesh().prop_map(|mesh| PolygonFaces::dual(&mesh)),
    ];
    (faces, any::<u64>()).prop_map(|(faces, seed)| built_polygons(&faces.shuffled(seed)))
}

/// Any mesh: triangles or polygons, some of them after random edits.
pub fn arbitrary_mesh() -> impl Strategy<Value = HalfedgeMesh> {
    let fresh = prop_oneof![triangle_mesh(), polygon_mesh()];
    (fresh, prop_oneof![2 => Just(Vec::new()), 1 => edits(12)]).prop_map(|(mesh, edits)| {
        let mut edited = mesh.clone();
        for edit in edits {
            let _ = edit.apply(&mut edited);
        }
        // Deletion may leave an empty mesh.
        if edited.num_faces() == 0 {
            mesh
        } else {
            edited
        }
    })
}

/// Checks that V − E + F = 2c − 2g − b holds in every component for some integer g ≥ 0.
///
/// # Errors
/// If the formula does not hold.
pub fn check_euler(mesh: &HalfedgeMesh) -> Result<(), TestCaseError> {
    let topology = mesh.topology();
    let mut sum = 0;
    for part in &topology {
        let chi = part.euler_characteristic();
        let twice_genus = 2 - chi - part.num_boundary_loops as i64;
        prop_assert!(twice_genus >= 0 && twice_genus % 2 == 0, "{:?}", part);
        prop_assert_eq!(part.genus() as i64, twice_genus / 2);
        sum += chi;
    }
    prop_assert_eq!(sum, mesh.euler_characteristic());
    prop_assert_eq!(
        mesh.is_closed(),
        topology.iter().all(|part| part.is_closed())
    );
    Ok(())
}

#[allow(
    clippy::expect_used,
    reason = "the generators of this module make manifold meshes"
)]
fn built(faces: TriangleFaces) -> HalfedgeMesh {
    faces
        .mesh()
        .expect("a generator of test meshes makes manifold ones")
}

#[allow(
    clippy::expect_used,
    reason = "the generators of this module make manifold meshes"
)]
fn built_polygons(faces: &PolygonFaces) -> HalfedgeMesh {
    faces
        .mesh()
        .expect("a generator of test meshes makes manifold ones")
}

/// The SplitMix64 generator, for shuffles determined by a seed.
struct SplitMix(u64);

impl SplitMix {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % bound.max(1) as u64) as usize
    }

    fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, self.below(i + 1));
        }
    }
}

/// The faces around each vertex in counter-clockwise order: the polygons of the dual mesh.
fn fans(mesh: &HalfedgeMesh) -> Vec<Vec<u32>> {
    let fan = |v: VertexId| mesh.vertex_faces(v).map(|f| f.0).collect();
    mesh.vertices().map(fan).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    proptest! {
        #[test]
        fn random_meshes_have_the_promised_properties(
            sphere in genus_zero(),
            closed in closed_mesh(),
            disc in disc_with_holes(),
            triangles in triangle_mesh(),
            polygons in polygon_mesh(),
        ) {
            prop_assert!(sphere.is_triangle_mesh() && sphere.is_closed());
            prop_assert!(closed.is_triangle_mesh() && closed.is_closed());
            prop_assert_eq!(closed.components().count(), 1);
            prop_assert!(disc.is_triangle_mesh() && !disc.is_closed());
            prop_assert_eq!((disc.components().count(), disc.genus()), (1, 0));
            prop_assert!(triangles.is_triangle_mesh());
            for mesh in [&sphere, &closed, &disc, &triangles, &polygons] {
                prop_assert_eq!(mesh.validate(), Ok(()));
                prop_assert!(mesh.num_faces() < 700);
            }
        }
    }
}
