//! Normals of faces and vertices.

use cotan_halfedge::{FaceId, FaceMap, VertexMap};
use nalgebra::Vector3;

use crate::areas::face_area_vector;
use crate::maps;
use crate::scalar::Scalar;
use crate::surface::Surface;

/// Returns `v` divided by its length, or the zero vector if `v` is zero or not finite.
///
/// Vectors whose squared length underflows or overflows are scaled first, so normals are correct
/// even for a mesh of ångström size stored in metres as `f32`.
///
/// ```
/// use nalgebra::Vector3;
/// assert_eq!(cotan_geometry::unit_or_zero(&Vector3::new(0.0, 3e-30_f32, 0.0)), Vector3::y());
/// assert_eq!(cotan_geometry::unit_or_zero(&Vector3::<f32>::zeros()), Vector3::zeros());
/// ```
#[inline]
pub fn unit_or_zero<T: Scalar>(v: &Vector3<T>) -> Vector3<T> {
    let squared = v.norm_squared();
    if squared > smallest_square() && squared.is_finite() {
        v / squared.sqrt()
    } else {
        scaled_unit_or_zero(v)
    }
}

/// See [`Surface::face_normal`].
#[inline]
pub(crate) fn face_normal<T: Scalar>(surface: &Surface<'_, T>, face: FaceId) -> Vector3<T> {
    unit_or_zero(&face_area_vector(surface, face))
}

/// See [`Surface::face_normals`].
#[must_use]
pub(crate) fn face_normals<T: Scalar>(surface: &Surface<'_, T>) -> FaceMap<Vector3<T>> {
    maps::filled(surface.mesh().num_faces(), |f| face_normal(surface, f))
}

/// [`Surface::face_normals`] into an existing map, which is replaced if its length differs.
pub fn face_normals_into<T: Scalar>(surface: &Surface<'_, T>, out: &mut FaceMap<Vector3<T>>) {
    maps::refill(out, surface.mesh().num_faces(), |f| face_normal(surface, f));
}

/// [`Surface::vertex_normals`] as a function.
#[must_use]
pub fn vertex_normals<T: Scalar>(surface: &Surface<'_, T>) -> VertexMap<Vector3<T>> {
    let mut out = VertexMap::default();
    vertex_normals_into(surface, &mut out);
    out
}

/// [`Surface::vertex_normals`] into an existing map, which is replaced if its length differs.
///
/// Deliberately single-threaded: adding the area vector of each face to its corners reads memory
/// in order and takes a sixth of the time of walking around each vertex.
pub fn vertex_normals_into<T: Scalar>(surface: &Surface<'_, T>, out: &mut VertexMap<Vector3<T>>) {
    vertex_area_vectors_into(surface, out);
    out.values_mut().for_each(|n| *n = unit_or_zero(n));
}

/// The sum of the area vectors of the faces around each vertex. On a closed surface these sums
/// add up to zero, and a third of each is the gradient of the enclosed volume.
///
/// **Shapes**: `n` vertices. **Units**: area.
#[must_use]
pub fn vertex_area_vectors<T: Scalar>(surface: &Surface<'_, T>) -> VertexMap<Vector3<T>> {
    let mut out = VertexMap::default();
    vertex_area_vectors_into(surface, &mut out);
    out
}

/// [`vertex_area_vectors`] into an existing map, which is replaced if its length differs.
pub fn vertex_area_vectors_into<T: Scalar>(
    surface: &Surface<'_, T>,
    out: &mut VertexMap<Vector3<T>>,
) {
    let mesh = surface.mesh();
    maps::clear(out, mesh.num_vertices());
    for f in mesh.faces() {
        let vector = face_area_vector(surface, f);
        for v in mesh.triangle(f) {
            out[v] += vector;
        }
    }
}

/// Squared lengths below this have lost digits to underflow: the smallest normal number divided
/// by ε.
#[inline]
fn smallest_square<T: Scalar>() -> T {
    T::min_value().map_or_else(T::zero, |lowest| T::one() / -lowest) / T::default_epsilon()
}

#[cold]
fn scaled_unit_or_zero<T: Scalar>(v: &Vector3<T>) -> Vector3<T> {
    let largest = v.amax();
    if largest > T::zero() && v.iter().all(|x| x.is_finite()) {
        (v / largest).normalize()
    } else {
        Vector3::zeros()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{bar, icosphere, torus};
    use crate::testing;
    use cotan_halfedge::VertexId;
    use proptest::prelude::*;

    #[test]
    fn a_cube_corner_points_along_its_diagonal() {
        let shape = bar::<f64>([1.0; 3], [2; 3]);
        let surface = shape.surface();
        let normals = vertex_normals(&surface);
        for (v, p) in shape.positions().iter() {
            if p.iter().all(|x| x.abs() == 0.5) {
                let cosine = normals[v].dot(&p.coords.normalize());
                assert!(cosine > 0.9, "{cosine}");
            }
        }
    }

    #[test]
    fn lengths_that_underflow_still_have_a_direction() {
        for exponent in [-300, -160, -20, 0, 20, 160, 300] {
            let unit = unit_or_zero(&(Vector3::new(1.0, -2.0, 2.0) * 10.0_f64.powi(exponent)));
            assert!(
                (unit - Vector3::new(1.0, -2.0, 2.0) / 3.0).norm() < 1e-15,
                "{exponent}"
            );
        }
        assert_eq!(
            unit_or_zero(&Vector3::new(f64::NAN, 0.0, 1.0)),
            Vector3::zeros()
        );
        assert_eq!(
            unit_or_zero(&Vector3::new(f64::INFINITY, 0.0, 1.0)),
            Vector3::zeros()
        );
    }

    #[test]
    fn a_collapsed_mesh_has_zero_normals() {
        let shape = icosphere::<f32>(1);
        let collapsed = shape
            .positions()
            .map(|_| nalgebra::Point3::new(1.0, 2.0, 3.0));
        let normals = vertex_normals(&shape.surface().with_positions(&collapsed));
        assert!(normals.values().all(|n| *n == Vector3::zeros()));
    }

    #[test]
    fn f32_agrees_with_f64() {
        let single = vertex_normals(&torus::<f32>(1.0, 0.4, 20, 10).surface());
        let double = vertex_normals(&torus::<f64>(1.0, 0.4, 20, 10).surface());
        for (v, n) in single.iter() {
            assert!((n.map(f64::from) - double[v]).norm() < 1e-5);
        }
    }

    proptest! {
        #[test]
        fn normals_turn_with_the_surface(
            shape in testing::surfaces(),
            rotation in testing::rotations(),
        ) {
            let surface = shape.surface();
            let turned = shape.positions().map(|p| rotation * p);
            let after = vertex_normals(&surface.with_positions(&turned));
            for (v, n) in vertex_normals(&surface).iter() {
                prop_assert!((rotation * n - after[v]).norm() < 1e-9);
            }
        }

        #[test]
        fn volume_grows_along_the_area_vectors(shape in testing::closed_surfaces()) {
            // On closed surfaces dV = (1/3) Σ N_i · dx_i, and a translation does not change the
            // volume.
            let surface = shape.surface();
            let v = VertexId::new(shape.positions().len() / 2);
            let step = Vector3::new(0.3, -0.2, 0.5) * 1e-3;
            let mut moved = shape.positions().clone();
            moved[v] += step;
            let change = crate::volume(&surface.with_positions(&moved)) - crate::volume(&surface);
            let predicted = vertex_area_vectors(&surface)[v].dot(&step) / 3.0;
            let scale = crate::surface_area(&surface) * step.norm();
            prop_assert!((change - predicted).abs() < 1e-10 * scale.max(1.0));
        }
    }
}
