//! Enclosed volume, and the centroids of the surface and of the enclosed body.

use cotan_halfedge::FaceId;
use nalgebra::{Point3, Vector3};

use crate::areas::face_area_vector;
use crate::bounds::bounding_box;
use crate::maps;
use crate::scalar::{Scalar, scalar};
use crate::surface::Surface;

/// [`Surface::volume`] as a function.
pub fn volume<T: Scalar>(surface: &Surface<'_, T>) -> T {
    let apex = bounding_box(surface).center();
    T::of_f64(maps::sum(surface.mesh().num_faces(), |f| {
        let (six_volumes, _) = cone(surface, &apex, f);
        six_volumes.as_f64() / 6.0
    }))
}

/// [`Surface::centroid`] as a function.
pub fn surface_centroid<T: Scalar>(surface: &Surface<'_, T>) -> Point3<T> {
    let center = bounding_box(surface).center();
    let moments: nalgebra::Vector4<f64> = maps::sum(surface.mesh().num_faces(), |f| {
        let area = face_area_vector(surface, f).norm();
        let (_, corner_sum) = cone(surface, &center, f);
        let third = corner_sum * scalar::<T>(1.0 / 3.0);
        (third * area).push(area).map(T::as_f64)
    });
    if moments.w > 0.0 {
        return center + (moments.xyz() / moments.w).map(T::of_f64);
    }
    let num_vertices = surface.mesh().num_vertices();
    let sum: Vector3<f64> = maps::sum(num_vertices, |v| {
        (surface.position(v) - center).map(T::as_f64)
    });
    center + (sum / num_vertices as f64).map(T::of_f64)
}

/// See [`Surface::volume_centroid`].
pub(crate) fn volume_centroid<T: Scalar>(surface: &Surface<'_, T>) -> Option<Point3<T>> {
    let bounds = bounding_box(surface);
    let center = bounds.center();
    let moments: nalgebra::Vector4<f64> = maps::sum(surface.mesh().num_faces(), |f| {
        let (six_volumes, corner_sum) = cone(surface, &center, f);
        // The centroid of a tetrahedron is the mean of its corners; the fourth corner is the
        // origin.
        let mean = corner_sum * scalar::<T>(0.25);
        (mean * six_volumes).push(six_volumes).map(T::as_f64)
    });
    // The rounding error of the volume of a body that fills its box.
    let noise = T::default_epsilon().as_f64() * bounds.extents().map(T::as_f64).norm().powi(3);
    (moments.w.abs() > noise).then(|| center + (moments.xyz() / moments.w).map(T::of_f64))
}

/// Six times the signed volume of the cone from `apex` over a face, and the sum of the face's
/// corners relative to `apex`.
#[inline]
fn cone<T: Scalar>(surface: &Surface<'_, T>, apex: &Point3<T>, face: FaceId) -> (T, Vector3<T>) {
    let [a, b, c] = surface
        .mesh()
        .triangle(face)
        .map(|v| surface.position(v) - apex);
    (a.dot(&b.cross(&c)), a + b + c)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{bar, cylinder, icosphere, torus};
    use crate::testing;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    #[test]
    fn the_volume_of_icospheres_converges_quadratically() {
        let errors = [2, 3, 4].map(|s| 4.0 * PI / 3.0 - volume(&icosphere::<f64>(s).surface()));
        assert!(errors[2] > 0.0 && errors[2] < 0.02);
        for pair in errors.windows(2) {
            assert!((pair[0] / pair[1] - 4.0).abs() < 0.2, "{errors:?}");
        }
    }

    #[test]
    fn translation_by_a_million_does_not_matter() {
        let shape = icosphere::<f64>(3);
        let far = shape.positions().map(|p| p + Vector3::new(1e6, -1e6, 1e6));
        let surface = shape.surface();
        // Positions near 1e6 are rounded by 1e-10; the volume must not lose more than that.
        let ratio = volume(&surface.with_positions(&far)) / volume(&surface);
        assert!((ratio - 1.0).abs() < 1e-10);
    }

    #[test]
    fn reversed_faces_enclose_a_negative_volume() {
        let shape = torus::<f64>(1.0, 0.4, 24, 16);
        let mirrored = shape.positions().map(|p| Point3::new(p.x, -p.y, p.z));
        let surface = shape.surface();
        assert!(volume(&surface) > 0.0);
        assert!((volume(&surface.with_positions(&mirrored)) + volume(&surface)).abs() < 1e-13);
    }

    #[test]
    fn a_cylinder_approaches_its_volume() {
        let shape = cylinder::<f64>(0.5, 2.0, 96, 10);
        assert!((volume(&shape.surface()) / (PI * 0.5) - 1.0).abs() < 2e-3);
    }

    #[test]
    fn centroids_of_a_shifted_box() {
        let shape = bar::<f64>([1.0, 2.0, 3.0], [2, 2, 2]);
        let offset = Vector3::new(5.0, -7.0, 11.0);
        let moved = shape.positions().map(|p| p + offset);
        let surface = shape.surface().with_positions(&moved);
        let center = Point3::from(offset);
        assert!((surface_centroid(&surface) - center).norm() < 1e-13);
        let body = volume_centroid(&surface).expect("a box has volume");
        assert!((body - center).norm() < 1e-13);
    }

    #[test]
    fn a_flat_body_has_no_volume_centroid() {
        let shape = icosphere::<f64>(1);
        let flat = shape.positions().map(|p| Point3::new(p.x, p.y, 0.0));
        let point = shape.positions().map(|_| Point3::new(1.0, 2.0, 3.0));
        let surface = shape.surface();
        assert_eq!(volume_centroid(&surface.with_positions(&flat)), None);
        assert_eq!(volume_centroid(&surface.with_positions(&point)), None);
        let centroid = surface_centroid(&surface.with_positions(&point));
        assert!((centroid - Point3::new(1.0, 2.0, 3.0)).norm() < 1e-14);
    }

    proptest! {
        #[test]
        fn rigid_motions_keep_and_scales_cube(
            shape in testing::closed_surfaces(),
            motion in testing::rigid_motions(),
            scale in 0.1..10.0_f64,
        ) {
            let surface = shape.surface();
            let size = crate::bounding_box(&surface).diagonal();
            let before = volume(&surface);
            let moved = shape.positions().map(|p| motion * (p * scale));
            let moved = surface.with_positions(&moved);
            let expected = before * scale.powi(3);
            let tolerance = 1e-10 * (size * scale).powi(3);
            prop_assert!((volume(&moved) - expected).abs() < tolerance);
            let centroid = motion * (surface_centroid(&surface) * scale);
            prop_assert!((surface_centroid(&moved) - centroid).norm() < 1e-10 * scale * size);
        }

        #[test]
        fn volume_is_a_third_of_the_flux_of_position(shape in testing::surfaces()) {
            let surface = shape.surface();
            let center = crate::bounding_box(&surface).center();
            let flux: f64 = surface.mesh().faces().map(|f| {
                let corners = surface.mesh().triangle(f).map(|v| surface.position(v) - center);
                corners.iter().sum::<Vector3<f64>>().dot(&face_area_vector(&surface, f)) / 9.0
            }).sum();
            let size = crate::bounding_box(&surface).diagonal();
            prop_assert!((flux - volume(&surface)).abs() < 1e-11 * size.powi(3));
        }
    }
}
