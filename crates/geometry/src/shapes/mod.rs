//! Procedural sample shapes for examples, tests and demonstrations.
//!
//! All are outward-oriented triangle meshes with the same bytes in every run. Coordinates are
//! computed in `f64` and rounded once. Counts that are too small are raised, and counts that
//! would require many millions of vertices are lowered (to 2048 unless a shape names another
//! bound).

mod bar;
mod bipyramid;
mod creature;
mod cylinder;
mod geodesic;
mod irregular;
mod plane;
mod sphere;
mod torus;

use cotan_halfedge::HalfedgeMesh;
use nalgebra::Point3;

use crate::mesh::Mesh;
use crate::scalar::Scalar;

pub use bar::bar;
pub use bipyramid::bipyramid;
pub use creature::{CREATURE_RESOLUTION, Region, creature, creature_regions};
pub use cylinder::cylinder;
pub use irregular::{VertexOrder, irregular};
pub use plane::bumpy_plane;
pub use sphere::{icosphere, tetrahedron};
pub use torus::torus;

/// Rounds `points` to `T` and connects them.
fn connect<T: Scalar>(points: &[Point3<f64>], faces: &[[u32; 3]]) -> Mesh<T> {
    let connectivity = match HalfedgeMesh::from_faces(points.len(), faces) {
        Ok(connectivity) => connectivity,
        // The faces are generated here, so this is a broken invariant of the shape's code.
        Err(error) => panic!("a sample shape is no manifold: {error}"),
    };
    let positions = points.iter().map(|p| p.map(T::of_f64)).collect();
    Mesh::assume_checked(connectivity, positions)
}

/// The largest number of segments along one direction of a shape; more would mean many millions
/// of vertices.
const MAX_SEGMENTS: usize = 2048;

#[cfg(test)]
mod tests {
    use super::*;

    /// Euler characteristic and number of boundary halfedges.
    fn topology(shape: &Mesh<f64>) -> (isize, usize) {
        let mesh = shape.connectivity();
        let chi = (mesh.num_vertices() + mesh.num_faces()) as isize - mesh.num_edges() as isize;
        (
            chi,
            mesh.halfedges()
                .filter(|&h| mesh.is_boundary_halfedge(h))
                .count(),
        )
    }

    fn num_components(mesh: &HalfedgeMesh) -> usize {
        let mut seen = vec![false; mesh.num_vertices()];
        let mut components = 0;
        for start in mesh.vertices() {
            let mut stack = vec![start];
            components += usize::from(!seen[start.index()]);
            while let Some(v) = stack.pop() {
                if !std::mem::replace(&mut seen[v.index()], true) {
                    stack.extend(mesh.one_ring(v));
                }
            }
        }
        components
    }

    fn closed_shapes() -> Vec<(Mesh<f64>, isize)> {
        vec![
            (tetrahedron(), 2),
            (icosphere(0), 2),
            (icosphere(3), 2),
            (bipyramid(3), 2),
            (bipyramid(200), 2),
            (torus(2.0, 0.5, 3, 3), 0),
            (torus(1.0, 0.4, 40, 16), 0),
            (cylinder(0.5, 2.0, 6, 1), 2),
            (cylinder(1.0, 0.1, 24, 5), 2),
            (bar([1.0, 2.0, 3.0], [1, 1, 1]), 2),
            (bar([1.0, 2.0, 3.0], [3, 4, 5]), 2),
        ]
    }

    #[test]
    fn closed_shapes_are_closed_connected_outward_and_have_their_genus() {
        for (shape, chi) in closed_shapes() {
            assert_eq!(topology(&shape), (chi, 0));
            assert_eq!(num_components(shape.connectivity()), 1);
            let surface = shape.surface();
            assert!(surface.volume() > 0.0);
            assert!(surface.degenerate_faces(0.01).is_empty());
        }
    }

    #[test]
    fn the_plane_is_a_disc() {
        let shape = bumpy_plane::<f64>([2.0, 1.0], [8, 5], 0.1);
        assert_eq!(topology(&shape), (1, 2 * (8 + 5)));
        assert_eq!(shape.num_vertices(), 9 * 6);
    }

    #[test]
    fn counts_are_as_documented_and_clamped() {
        assert_eq!(
            icosphere::<f64>(3).connectivity().num_vertices(),
            10 * 64 + 2
        );
        assert_eq!(
            torus::<f64>(1.0, 0.2, 0, 5).connectivity().num_vertices(),
            15
        );
        assert_eq!(
            bar::<f64>([1.0; 3], [0; 3]).connectivity().num_vertices(),
            8
        );
        assert_eq!(
            bumpy_plane::<f64>([1.0; 2], [0, 0], 0.0)
                .connectivity()
                .num_vertices(),
            4
        );
        assert_eq!(cylinder::<f64>(1.0, 1.0, 7, 0), cylinder(1.0, 1.0, 12, 1));
    }

    #[test]
    fn the_cylinder_has_good_triangles() {
        // Equal edge lengths along and around: 2π · 0.5 / 24 wide, with rows of about √3/2 of
        // that.
        let shape = cylinder::<f64>(0.5, 2.0, 24, 18);
        let smallest = shape.surface().angle_statistics().min.to_degrees();
        assert!(smallest > 40.0, "{smallest}");
    }

    #[test]
    fn the_sphere_is_a_sphere_and_the_cylinder_a_cylinder() {
        for p in icosphere::<f64>(4).positions().values() {
            assert!((p.coords.norm() - 1.0).abs() < 1e-15);
        }
        for p in cylinder::<f64>(0.5, 2.0, 12, 6).positions().values() {
            assert!(p.z.abs() <= 1.0 && p.coords.xy().norm() < 0.5 + 1e-12);
        }
    }

    #[test]
    fn f32_is_f64_rounded() {
        let single = torus::<f32>(1.0, 0.25, 12, 8);
        let double = torus::<f64>(1.0, 0.25, 12, 8);
        assert_eq!(single.connectivity(), double.connectivity());
        for (v, p) in single.positions().iter() {
            assert_eq!(*p, double.positions()[v].map(|x| x as f32));
        }
    }
}
