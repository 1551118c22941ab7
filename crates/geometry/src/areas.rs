//! Areas of faces, of one-rings and of the surface.
//!
//! The area vector of a triangle is half the cross product of two of its edges: its length is the
//! area, its direction the normal.

use cotan_halfedge::{FaceId, FaceMap, VertexMap};
use nalgebra::{Point3, Vector3};

use crate::maps;
use crate::scalar::{Scalar, scalar};
use crate::surface::Surface;

/// Area vector ½ (b − a) × (c − a) of a triangle whose corners are counter-clockwise as seen from
/// the outside.
///
/// **Units**: area. Zero if the corners are collinear.
///
/// ```
/// use nalgebra::{Point3, Vector3};
/// let [a, b, c] = [Point3::origin(), Point3::new(2.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)];
/// assert_eq!(cotan_geometry::triangle_area_vector(&a, &b, &c), Vector3::new(0.0, 0.0, 1.0));
/// ```
#[inline]
pub fn triangle_area_vector<T: Scalar>(a: &Point3<T>, b: &Point3<T>, c: &Point3<T>) -> Vector3<T> {
    (b - a).cross(&(c - a)) * scalar::<T>(0.5)
}

/// The area vector of a face.
///
/// **Units**: area.
#[inline]
pub fn face_area_vector<T: Scalar>(surface: &Surface<'_, T>, face: FaceId) -> Vector3<T> {
    let [a, b, c] = surface.mesh().triangle(face).map(|v| surface.position(v));
    triangle_area_vector(&a, &b, &c)
}

/// The area vector of each face.
///
/// They sum to zero on a closed surface.
///
/// **Shapes**: one entry per face. **Units**: area.
#[must_use]
pub fn face_area_vectors<T: Scalar>(surface: &Surface<'_, T>) -> FaceMap<Vector3<T>> {
    maps::filled(surface.mesh().num_faces(), |f| face_area_vector(surface, f))
}

/// [`face_area_vectors`] into an existing map, which is replaced if its length differs.
pub fn face_area_vectors_into<T: Scalar>(surface: &Surface<'_, T>, out: &mut FaceMap<Vector3<T>>) {
    maps::refill(out, surface.mesh().num_faces(), |f| {
        face_area_vector(surface, f)
    });
}

/// See [`Surface::face_areas`].
#[must_use]
pub(crate) fn face_areas<T: Scalar>(surface: &Surface<'_, T>) -> FaceMap<T> {
    maps::filled(surface.mesh().num_faces(), |f| {
        face_area_vector(surface, f).norm()
    })
}

/// [`Surface::face_areas`] into an existing map, which is replaced if its length differs.
pub fn face_areas_into<T: Scalar>(surface: &Surface<'_, T>, out: &mut FaceMap<T>) {
    maps::refill(out, surface.mesh().num_faces(), |f| {
        face_area_vector(surface, f).norm()
    });
}

/// [`Surface::one_ring_areas`] as a function.
#[must_use]
pub fn one_ring_areas<T: Scalar>(surface: &Surface<'_, T>) -> VertexMap<T> {
    let mut out = VertexMap::default();
    one_ring_areas_into(surface, &mut out);
    out
}

/// [`Surface::one_ring_areas`] into an existing map, which is replaced if its length differs.
///
/// Single-threaded, for the same reason as [`vertex_normals_into`](crate::vertex_normals_into).
pub fn one_ring_areas_into<T: Scalar>(surface: &Surface<'_, T>, out: &mut VertexMap<T>) {
    let mesh = surface.mesh();
    maps::clear(out, mesh.num_vertices());
    for f in mesh.faces() {
        let area = face_area_vector(surface, f).norm();
        for v in mesh.triangle(f) {
            out[v] += area;
        }
    }
}

/// See [`Surface::dual_areas`].
#[must_use]
pub(crate) fn dual_areas<T: Scalar>(surface: &Surface<'_, T>) -> VertexMap<T> {
    let mut out = VertexMap::default();
    dual_areas_into(surface, &mut out);
    out
}

/// [`Surface::dual_areas`] into an existing map, which is replaced if its length differs.
pub fn dual_areas_into<T: Scalar>(surface: &Surface<'_, T>, out: &mut VertexMap<T>) {
    one_ring_areas_into(surface, out);
    let third = scalar::<T>(1.0 / 3.0);
    out.values_mut().for_each(|area| *area *= third);
}

/// [`Surface::area`] as a function.
pub fn surface_area<T: Scalar>(surface: &Surface<'_, T>) -> T {
    let num_faces = surface.mesh().num_faces();
    T::of_f64(maps::sum(num_faces, |f| {
        face_area_vector(surface, f).norm().as_f64()
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{bar, bumpy_plane, icosphere, torus};
    use crate::testing;
    use proptest::prelude::*;

    #[test]
    fn the_area_of_icospheres_converges_quadratically_to_four_pi() {
        let error = |subdivisions| {
            let shape = icosphere::<f64>(subdivisions);
            4.0 * std::f64::consts::PI - surface_area(&shape.surface())
        };
        let errors = [error(2), error(3), error(4)];
        assert!(errors[2] > 0.0 && errors[2] < 0.02);
        for pair in errors.windows(2) {
            assert!((pair[0] / pair[1] - 4.0).abs() < 0.2, "{errors:?}");
        }
    }

    #[test]
    fn a_bar_has_the_area_of_its_sides() {
        let shape = bar::<f64>([1.0, 2.0, 3.0], [2, 3, 4]);
        assert!((surface_area(&shape.surface()) - 22.0).abs() < 1e-13);
    }

    #[test]
    fn area_vectors_of_closed_surfaces_sum_to_zero() {
        for shape in [
            icosphere::<f64>(2),
            torus(1.0, 0.4, 20, 12),
            bar([1.0; 3], [3; 3]),
        ] {
            let sum: Vector3<f64> = face_area_vectors(&shape.surface()).values().sum();
            assert!(sum.norm() < 1e-13);
        }
    }

    #[test]
    fn kept_maps_hold_the_same_even_if_they_held_something_else() {
        let shape = bumpy_plane::<f64>([1.0; 2], [9, 7], 0.1);
        let surface = shape.surface();
        let mut areas = VertexMap::filled(3, 7.0);
        for _ in 0..2 {
            one_ring_areas_into(&surface, &mut areas);
            assert_eq!(areas, one_ring_areas(&surface));
            dual_areas_into(&surface, &mut areas);
            assert_eq!(areas, dual_areas(&surface));
        }
    }

    #[test]
    fn f32_agrees_with_f64() {
        let single = surface_area(&torus::<f32>(1.0, 0.4, 40, 20).surface());
        let double = surface_area(&torus::<f64>(1.0, 0.4, 40, 20).surface());
        assert!((f64::from(single) / double - 1.0).abs() < 1e-5);
    }

    proptest! {
        #[test]
        fn vertex_areas_share_out_the_surface(shape in testing::surfaces()) {
            let surface = shape.surface();
            let area = surface_area(&surface);
            let dual: f64 = dual_areas(&surface).values().sum();
            let rings: f64 = one_ring_areas(&surface).values().sum();
            prop_assert!((dual / area - 1.0).abs() < 1e-12);
            prop_assert!((rings / area - 3.0).abs() < 1e-12);
        }

        #[test]
        fn area_scales_with_the_square(shape in testing::surfaces(), scale in 0.01..100.0_f64) {
            let scaled = shape.positions().map(|p| p * scale);
            let surface = shape.surface();
            let ratio = surface_area(&surface.with_positions(&scaled)) / surface_area(&surface);
            prop_assert!((ratio / (scale * scale) - 1.0).abs() < 1e-12);
        }
    }
}
