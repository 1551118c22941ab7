//! The affine map from a triangle to its deformed shape, and the amounts by which it stretches
//! and compresses.

use cotan_halfedge::{FaceId, FaceMap};
use nalgebra::{Point3, Vector3};

use crate::degenerate::relative_height;
use crate::maps;
use crate::scalar::Scalar;
use crate::surface::{Positions, Surface, SurfaceError};

/// The affine map from the plane of a triangle to that of its deformed shape.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TriangleMap {
    /// Two orthogonal unit vectors in the triangle's plane.
    pub axes: [Vector3<f64>; 2],
    /// The images of the two directions: the derivative of the map.
    pub images: [Vector3<f64>; 2],
    /// The area of the triangle before the deformation. **Units**: area.
    pub area: f64,
}

impl TriangleMap {
    /// Computes the map between two triangles. Returns `None` if the first has almost no area,
    /// that is, a relative height of at most 1e-9.
    pub fn new<T: Scalar>(before: [Point3<T>; 3], after: [Point3<T>; 3]) -> Option<Self> {
        let [before, after] = [before, after].map(|t| t.map(|p| p.map(T::as_f64)));
        if relative_height(&before[0], &before[1], &before[2]) <= MIN_HEIGHT {
            return None;
        }
        // Based on the longest edge, which minimizes the rounding error of the height.
        let square = |k: usize| (before[(k + 1) % 3] - before[k]).norm_squared();
        let first = (0..3).max_by(|&i, &j| square(i).total_cmp(&square(j)))?;
        let edges = |t: &[Point3<f64>; 3]| {
            let [a, b, c] = [0, 1, 2].map(|k| t[(first + k) % 3]);
            [b - a, c - a]
        };
        let ([e, f], [e_new, f_new]) = (edges(&before), edges(&after));
        let length = e.norm();
        let x = e / length;
        let along = f.dot(&x);
        let height = (f - x * along).norm();
        let y = (f - x * along) / height;
        let x_new = e_new / length;
        let y_new = (f_new - x_new * along) / height;
        let is_finite = x_new.iter().chain(&y_new).chain(&y).all(|x| x.is_finite());
        is_finite.then_some(Self {
            axes: [x, y],
            images: [x_new, y_new],
            area: 0.5 * length * height,
        })
    }

    /// The singular values σ1 ≥ σ2 ≥ 0: the largest and the smallest factor by which the map
    /// stretches a direction.
    pub fn singular_values(&self) -> [f64; 2] {
        let [x, y] = self.images;
        let p = x.norm();
        if p == 0.0 {
            return [y.norm(), 0.0];
        }
        // In a frame whose first axis is along the first image, the map is (p q; 0 r).
        let (q, r) = (x.dot(&y) / p, x.cross(&y).norm() / p);
        let largest = 0.5 * ((p + r).hypot(q) + (p - r).hypot(q));
        [largest, p * r / largest]
    }
}

/// The singular values σ1 ≥ σ2 of the map of each face onto its deformed shape. `None` for a face
/// with almost no area at rest (a relative height of at most 1e-9).
///
/// Both are 1 for rigid motions, and s for a scaling by s. σ2 is 0 where a face has collapsed.
///
/// **Shapes**: one entry per face. **Units**: dimensionless.
///
/// # Errors
/// [`SurfaceError`] if `deformed` does not embed the mesh.
///
/// ```
/// use cotan_geometry::{icosphere, singular_values};
/// use nalgebra::Point3;
/// let shape = icosphere::<f64>(2);
/// let long = shape.positions().map(|p| Point3::new(2.0 * p.x, p.y, p.z));
/// for values in singular_values(&shape.surface(), &long)?.values() {
///     let [most, least] = values.expect("an area");
///     assert!(most < 2.0 + 1e-12 && least > 1.0 - 1e-12);
/// }
/// # Ok::<(), cotan_geometry::SurfaceError>(())
/// ```
pub fn singular_values<T: Scalar>(
    rest: &Surface<'_, T>,
    deformed: &Positions<T>,
) -> Result<FaceMap<Option<[f64; 2]>>, SurfaceError> {
    let deformed = Surface::new(rest.mesh(), deformed)?;
    Ok(maps::filled(rest.mesh().num_faces(), |f| {
        let map = face_map(rest, &deformed, f)?;
        Some(map.singular_values())
    }))
}

/// The map of one face of `rest` onto its shape in `deformed`; see [`TriangleMap::new`].
pub fn face_map<T: Scalar>(
    rest: &Surface<'_, T>,
    deformed: &Surface<'_, T>,
    face: FaceId,
) -> Option<TriangleMap> {
    let corners = rest.mesh().triangle(face);
    TriangleMap::new(
        corners.map(|v| rest.position(v)),
        corners.map(|v| deformed.position(v)),
    )
}

/// Below this relative height, the shape of a triangle is determined by rounding errors.
const MIN_HEIGHT: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use nalgebra::{Matrix3, Vector2};
    use proptest::prelude::*;

    fn flat(points: [[f64; 2]; 3]) -> [Point3<f64>; 3] {
        points.map(|[x, y]| Point3::new(x, y, 0.0))
    }

    const UNIT: [[f64; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];

    #[test]
    fn known_maps_of_the_unit_triangle() {
        let values = |after| TriangleMap::new(flat(UNIT), flat(after)).map(|m| m.singular_values());
        let near = |after, [s, t]: [f64; 2]| {
            let [a, b] = values(after).expect("an area");
            assert!((a - s).abs() < 1e-14 && (b - t).abs() < 1e-14, "{a} {b}");
        };
        near(UNIT, [1.0, 1.0]);
        near([[0.0, 0.0], [3.0, 0.0], [0.0, 0.5]], [3.0, 0.5]);
        near([[1.0, 1.0], [1.0, 3.0], [-1.0, 1.0]], [2.0, 2.0]);
        // A shear by 1: the golden ratio and its inverse.
        let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
        near([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], [golden, 1.0 / golden]);
        // Collapsed to a line, and to a point.
        near([[0.0, 0.0], [1.0, 0.0], [0.5, 0.0]], [1.25_f64.sqrt(), 0.0]);
        near([[2.0, 2.0]; 3], [0.0, 0.0]);
        let line = flat([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]);
        assert_eq!(TriangleMap::new(line, flat(UNIT)), None);
    }

    proptest! {
        #[test]
        fn a_linear_map_of_the_plane_has_its_singular_values(
            m in proptest::array::uniform4(-2.0..2.0_f64),
        ) {
            let matrix = nalgebra::Matrix2::new(m[0], m[1], m[2], m[3]);
            let map = |[x, y]: [f64; 2]| <[f64; 2]>::from(matrix * Vector2::new(x, y));
            let found = TriangleMap::new(flat(UNIT), flat(UNIT.map(map))).expect("an area");
            let [largest, least] = found.singular_values();
            let expected = matrix.singular_values();
            prop_assert!((largest - expected.max()).abs() < 1e-12);
            prop_assert!((least - expected.min()).abs() < 1e-12);
        }

        #[test]
        fn a_similarity_stretches_alike_everywhere(
            shape in testing::surfaces(),
            motion in testing::rigid_motions(),
            scale in 0.1..10.0_f64,
        ) {
            let moved = shape.positions().map(|p| motion * (p * scale));
            let values = singular_values(&shape.surface(), &moved)?;
            for value in values.values() {
                let [largest, least] = value.expect("an area");
                prop_assert!((largest / scale - 1.0).abs() < 1e-9);
                prop_assert!((least / scale - 1.0).abs() < 1e-9);
            }
            // The derivative maps the axes to their images.
            let turned = shape.surface().with_positions(&moved);
            let rotation: Matrix3<f64> = motion.rotation.to_rotation_matrix().into_inner() * scale;
            let map = face_map(&shape.surface(), &turned, FaceId::new(0)).expect("an area");
            for (axis, image) in map.axes.iter().zip(&map.images) {
                prop_assert!((rotation * axis - image).norm() < 1e-9 * scale);
            }
        }
    }
}
