//! Integrated curvature: dihedral angles, the mean curvature derived from them, and the Gaussian
//! curvature from angle defects.
//!
//! Both curvatures are integrals over the surface and exact for the polyhedron itself. Divide by
//! [`Surface::dual_areas`](crate::dual_areas) to get pointwise values.

use cotan_halfedge::{EdgeId, EdgeMap, VertexMap};
use nalgebra::RealField;

use crate::angles::halfedge_corner_angle;
use crate::lengths::edge_length;
use crate::maps;
use crate::normals::face_normal;
use crate::scalar::{Scalar, scalar};
use crate::surface::Surface;

/// The signed angle between the normals of the two faces at an edge, in −π … π.
///
/// Positive where the surface is convex. Zero where it is flat, at the boundary, and where one of
/// the faces has no area.
///
/// **Units**: radians.
pub fn dihedral_angle<T: Scalar>(surface: &Surface<'_, T>, edge: EdgeId) -> T {
    let h = edge.halfedge();
    let mesh = surface.mesh();
    let (Some(left), Some(right)) = (mesh.face(h), mesh.face(h.twin())) else {
        return T::zero();
    };
    let (left, right) = (face_normal(surface, left), face_normal(surface, right));
    let axis = crate::normals::unit_or_zero(&surface.halfedge_vector(h));
    left.cross(&right).dot(&axis).atan2(left.dot(&right))
}

/// See [`Surface::dihedral_angles`].
#[must_use]
pub(crate) fn dihedral_angles<T: Scalar>(surface: &Surface<'_, T>) -> EdgeMap<T> {
    maps::filled(surface.mesh().num_edges(), |e| dihedral_angle(surface, e))
}

/// See [`Surface::integrated_mean_curvatures`].
#[must_use]
pub(crate) fn integrated_mean_curvatures<T: Scalar>(surface: &Surface<'_, T>) -> VertexMap<T> {
    let mesh = surface.mesh();
    let per_edge: EdgeMap<T> = maps::filled(mesh.num_edges(), |e| {
        scalar::<T>(0.25) * dihedral_angle(surface, e) * edge_length(surface, e)
    });
    maps::filled(mesh.num_vertices(), |v| {
        mesh.outgoing_halfedges(v)
            .fold(T::zero(), |sum, h| sum + per_edge[h.edge()])
    })
}

/// See [`Surface::angle_defects`].
#[must_use]
pub(crate) fn angle_defects<T: Scalar>(surface: &Surface<'_, T>) -> VertexMap<T> {
    let mesh = surface.mesh();
    maps::filled(mesh.num_vertices(), |v| {
        let full = if mesh.is_boundary_vertex(v) {
            T::pi()
        } else {
            <T as RealField>::two_pi()
        };
        mesh.outgoing_halfedges(v)
            .fold(full, |defect, h| defect - halfedge_corner_angle(surface, h))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{bar, creature, cylinder, icosphere, tetrahedron, torus};
    use crate::testing;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    fn euler_characteristic<T: Scalar>(surface: &Surface<'_, T>) -> f64 {
        let mesh = surface.mesh();
        let positive = mesh.num_vertices() + mesh.num_faces();
        positive as f64 - mesh.num_edges() as f64
    }

    #[test]
    fn the_sphere_has_total_mean_curvature_four_pi() {
        let shape = icosphere::<f64>(4);
        let total: f64 = integrated_mean_curvatures(&shape.surface()).values().sum();
        assert!((total / (4.0 * PI) - 1.0).abs() < 2e-3, "{total}");
        let single = icosphere::<f32>(4);
        let sum: f32 = integrated_mean_curvatures(&single.surface()).values().sum();
        assert!((f64::from(sum) - total).abs() < 1e-3);
    }

    #[test]
    fn a_box_has_pi_times_its_sides() {
        let shape = bar::<f64>([1.0, 2.0, 3.5], [2, 3, 5]);
        let total: f64 = integrated_mean_curvatures(&shape.surface()).values().sum();
        assert!((total - PI * 6.5).abs() < 1e-12);
    }

    #[test]
    fn a_torus_has_two_pi_squared_times_its_radius() {
        // ∫ H dA = 2π² R for any minor radius.
        let shape = torus::<f64>(1.0, 0.3, 200, 100);
        let total: f64 = integrated_mean_curvatures(&shape.surface()).values().sum();
        assert!((total / (2.0 * PI * PI) - 1.0).abs() < 2e-3, "{total}");
    }

    #[test]
    fn convex_edges_are_positive_and_turning_inside_out_negates() {
        let shape = tetrahedron::<f64>();
        let mirrored = shape
            .positions()
            .map(|p| nalgebra::Point3::new(-p.x, p.y, p.z));
        let surface = shape.surface();
        let outside = dihedral_angles(&surface);
        let inside = dihedral_angles(&surface.with_positions(&mirrored));
        for (e, &theta) in outside.iter() {
            assert!((theta - (PI - (1.0_f64 / 3.0).acos())).abs() < 1e-14);
            assert!((theta + inside[e]).abs() < 1e-14);
        }
    }

    #[test]
    fn gauss_bonnet_on_every_genus() {
        for shape in [
            icosphere::<f64>(2),
            torus(1.0, 0.4, 17, 9),
            cylinder(0.5, 2.0, 12, 7),
            creature(64),
        ] {
            let surface = shape.surface();
            let total: f64 = angle_defects(&surface).values().sum();
            assert!((total - 2.0 * PI * euler_characteristic(&surface)).abs() < 1e-9);
        }
    }

    proptest! {
        #[test]
        fn gauss_bonnet(shape in testing::surfaces()) {
            let surface = shape.surface();
            let total: f64 = angle_defects(&surface).values().sum();
            prop_assert!((total - 2.0 * PI * euler_characteristic(&surface)).abs() < 1e-9);
        }

        #[test]
        fn mean_curvature_scales_with_length(shape in testing::surfaces(), s in 0.1..10.0_f64) {
            let surface = shape.surface();
            let scaled = shape.positions().map(|p| p * s);
            let before = integrated_mean_curvatures(&surface);
            let after = integrated_mean_curvatures(&surface.with_positions(&scaled));
            let size = crate::bounding_box(&surface).diagonal();
            for (v, h) in before.iter() {
                prop_assert!((after[v] - s * h).abs() < 1e-11 * s * size);
            }
        }
    }
}
