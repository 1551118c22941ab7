//! The as-rigid-as-possible energy of a deformation, computed per triangle.

use cotan_flow::nearest_rotation;
use cotan_geometry::{Scalar, Surface, TriangleMap, face_map};
use cotan_halfedge::VertexId;
use cotan_parallel::Chunks;
use nalgebra::Matrix3;

/// Σ_i Σ_{T at i} Σ_{e of T} 1/12 cot_e |e − R_i e⁰|² over the original area, with the cotangents
/// of the original. Returns 0 for a mesh without area.
///
/// The rotation R_i is the best fit to the triangles around vertex i ("spokes and rims"). The
/// inner sum is 2 A |F − R_i|², where A is the area of the triangle and F the derivative of its
/// map, so no term is negative regardless of the signs of the cotangents. The energy is half of
/// the integral of the mean of |F − R_i|² over the three corners. Triangles with almost no
/// original area are ignored.
///
/// **Units**: dimensionless.
pub(crate) fn arap_energy<T: Scalar>(original: &Surface<'_, T>, deformed: &Surface<'_, T>) -> f64 {
    let mesh = original.mesh();
    let around = |v: VertexId| {
        let faces = mesh.vertex_faces(v);
        faces.filter_map(|f| face_map(original, deformed, f))
    };
    let energy: f64 = CHUNKS.sum(mesh.num_vertices(), |v| {
        let v = VertexId::new(v);
        let moment: Matrix3<f64> = around(v).map(|map| covariance(&map)).sum();
        let rotation = nearest_rotation(&moment);
        around(v)
            .map(|map| map.area * misfit(&map, &rotation))
            .sum::<f64>()
    });
    let area = original.area().as_f64();
    // Half of the mean over three corners.
    if area > 0.0 {
        energy / (6.0 * area)
    } else {
        0.0
    }
}

/// A F: the contribution of a triangle to the matrix that a rotation is fitted to.
fn covariance(map: &TriangleMap) -> Matrix3<f64> {
    let pairs = map.images.iter().zip(&map.axes);
    pairs
        .map(|(image, axis)| image * axis.transpose() * map.area)
        .sum()
}

/// |F − R|² within the plane of the triangle.
fn misfit(map: &TriangleMap, rotation: &Matrix3<f64>) -> f64 {
    let pairs = map.images.iter().zip(&map.axes);
    pairs
        .map(|(image, axis)| (image - rotation * axis).norm_squared())
        .sum()
}

/// Vertices per partial sum.
const CHUNKS: Chunks = Chunks::of(1024);

#[cfg(test)]
mod tests {
    use super::*;
    use cotan_geometry::testing;
    use nalgebra::{Point3, Vector3};
    use proptest::prelude::*;

    /// The formula as written, by edges with signed cotangents, for given rotations.
    fn by_edges(original: &Surface<'_, f64>, deformed: &Surface<'_, f64>) -> f64 {
        let mesh = original.mesh();
        let cotangents = original.opposite_cotangents();
        let terms = |v: VertexId| {
            let faces = mesh.vertex_faces(v);
            let edges = faces.flat_map(|f| mesh.face_halfedges(f));
            edges.map(|h| {
                let vector = |s: &Surface<'_, f64>| s.halfedge_vector(h);
                (cotangents[h], vector(original), vector(deformed))
            })
        };
        let mut energy = 0.0;
        for v in mesh.vertices() {
            let moment = terms(v).map(|(w, a, b)| b * a.transpose() * w).sum();
            let rotation = nearest_rotation(&moment);
            let sum: f64 = terms(v)
                .map(|(w, a, b)| w * (b - rotation * a).norm_squared())
                .sum();
            energy += sum / 12.0;
        }
        energy / original.area()
    }

    proptest! {
        #[test]
        fn it_is_the_sum_over_signed_edges_and_never_negative(
            shape in testing::surfaces(),
            bend in -0.5..0.5_f64,
            stretch in 0.2..3.0_f64,
        ) {
            let original = shape.surface();
            let size = original.bounding_box().longest_side();
            let deformed = shape.positions().map(|p| {
                Point3::new(p.x * stretch, p.y + bend * p.x * p.x / size, p.z)
            });
            let deformed = original.with_positions(&deformed);
            let energy = arap_energy(&original, &deformed);
            let expected = by_edges(&original, &deformed);
            prop_assert!(energy >= 0.0);
            prop_assert!((energy - expected).abs() < 1e-7 * (1.0 + expected), "{energy} {expected}");
        }

        #[test]
        fn rigid_motions_cost_nothing(
            shape in testing::surfaces(),
            motion in testing::rigid_motions(),
        ) {
            let moved = shape.positions().map(|p| motion * p);
            let surface = shape.surface();
            let energy = arap_energy(&surface, &surface.with_positions(&moved));
            prop_assert!((0.0..1e-16).contains(&energy), "{energy}");
        }
    }

    /// For a scaling by s, F − R is (s − 1) times a rotation, so |F − R|² = 2 (s − 1)²
    /// everywhere.
    #[test]
    fn a_scaling_has_its_closed_form() {
        let shape = cotan_geometry::icosphere::<f64>(2);
        let scaled = shape.positions().map(|p| p * 1.5 + Vector3::x());
        let surface = shape.surface();
        let energy = arap_energy(&surface, &surface.with_positions(&scaled));
        assert!((energy - 0.25).abs() < 1e-12, "{energy}");
    }
}
