//! Canonical orientation of a sphere map, by the principal axes of the source shape or by
//! landmarks.

use cotan_geometry::{Positions, Scalar, Surface};
use cotan_halfedge::VertexId;
use nalgebra::{Matrix3, Rotation3, SymmetricEigen, Vector3};

use super::error::SphereError;
use super::map::SphereMap;
use super::rotate::rotation_between;

impl<T: Scalar> SphereMap<T> {
    /// Rotates the map so that the directions of the source shape's principal axes become those
    /// of the sphere: the longest axis z (its ends are the poles), the second x, the shortest y.
    ///
    /// The rotation moves the vertices as close as possible, weighted by area in the
    /// least-squares sense, to their coordinates in the frame of these axes, with each axis
    /// scaled to equal spread. The longest and the second axis point to the side where the shape
    /// extends farther (where the third moment is positive), so that the result is invariant
    /// under rigid motions of the source. If the shape is symmetric, they point to where their
    /// largest coordinate is positive.
    ///
    /// **Shapes**: `source` has one position per vertex of this map, the original shape.
    ///
    /// # Errors
    /// [`SphereError::Surface`] if the positions do not form a surface on this mesh;
    /// [`SphereError::Mismatch`] if the shape has no area or lies on a line.
    pub fn orient_principal(&self, source: &Positions<T>) -> Result<Self, SphereError> {
        let surface = Surface::new(self.mesh(), source)?;
        let samples = Samples::of(&surface)?;
        let axes = samples.principal_axes();
        let mut sum = Vec::with_capacity(samples.points.len());
        let spread = samples.spread(&axes);
        for (v, (p, w)) in self.mesh().vertices().zip(&samples.points) {
            let local = axes.tr_mul(p).zip_map(&spread, scaled);
            sum.push((self.direction_of(v)?, local * *w));
        }
        self.rotated(&rotation_between(&sum)?)
    }

    /// Rotates the map so that the first landmark lies at the pole +z and the second on the
    /// meridian of longitude 0 (y = 0, x > 0). The third replaces the second if that lies at the
    /// first landmark or opposite it.
    ///
    /// The first landmark is placed exactly at the pole, so longitude and latitude have a vertex
    /// there.
    ///
    /// # Errors
    /// [`SphereError::Mismatch`] if a landmark is not a vertex, or if all lie on one axis.
    pub fn orient_landmarks(&self, landmarks: [VertexId; 3]) -> Result<Self, SphereError> {
        let [pole, second, third] = landmarks.map(|v| self.direction_of(v));
        let pole = pole?.normalize();
        let away = |d: Vector3<f64>| d - pole * pole.dot(&d);
        let meridian = [away(second?), away(third?)]
            .into_iter()
            .find(|d| d.norm() > NEAREST_TO_AXIS);
        let Some(meridian) = meridian else {
            let message = "the landmarks lie on one axis of the sphere; choose a second or third one elsewhere";
            return Err(SphereError::Mismatch(message.into()));
        };
        let x = meridian.normalize();
        let rows = [x, pole.cross(&x), pole].map(|row| row.transpose());
        let turn = Rotation3::from_matrix_unchecked(Matrix3::from_rows(&rows));
        let turned = self.rotated(&turn)?;
        turned.with_vertex_at(landmarks[0], Vector3::z())
    }

    /// Moves a vertex by its rounding error.
    fn with_vertex_at(&self, vertex: VertexId, place: Vector3<f64>) -> Result<Self, SphereError> {
        let mut positions = self.positions().clone();
        positions[vertex] = place.map(T::of_f64).into();
        self.with_positions(positions)
    }
}

/// The vertices of a shape relative to its centroid, each with its fraction of the area.
struct Samples {
    points: Vec<(Vector3<f64>, f64)>,
}

impl Samples {
    fn of<T: Scalar>(surface: &Surface<'_, T>) -> Result<Self, SphereError> {
        let areas = surface.one_ring_areas();
        let total: f64 = areas.values().map(|a| a.as_f64()).sum();
        if !(total > 0.0 && total.is_finite()) {
            let message = "the shape has no area that could be measured, and so no principal axes";
            return Err(SphereError::Mismatch(message.into()));
        }
        let positions = surface.positions().values();
        let mut points: Vec<(Vector3<f64>, f64)> = positions
            .zip(areas.values())
            .map(|(p, a)| (p.coords.map(T::as_f64), a.as_f64() / total))
            .collect();
        let center: Vector3<f64> = points.iter().map(|(p, w)| p * *w).sum();
        for (p, _) in &mut points {
            *p -= center;
        }
        // Relative to the farthest vertex, so that third moments of huge shapes stay finite.
        let size = points.iter().map(|(p, _)| p.amax()).fold(0.0, f64::max);
        if size > 0.0 {
            points.iter_mut().for_each(|(p, _)| *p /= size);
        }
        Ok(Self { points })
    }

    /// Columns x, y, z of the frame: the second, the shortest and the longest axis, right-handed.
    fn principal_axes(&self) -> Matrix3<f64> {
        let moment: Matrix3<f64> = self
            .points
            .iter()
            .map(|(p, w)| p * p.transpose() * *w)
            .sum();
        let eigen = SymmetricEigen::new(moment);
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let axis = |k: usize| self.pointing(eigen.eigenvectors.column(order[k]).into());
        let (longest, second) = (axis(0), axis(1));
        Matrix3::from_columns(&[second, longest.cross(&second), longest])
    }

    /// The axis or its opposite.
    fn pointing(&self, axis: Vector3<f64>) -> Vector3<f64> {
        let (mut third, mut scale) = (0.0, 0.0);
        for (p, w) in &self.points {
            let x = axis.dot(p);
            third += w * x.powi(3);
            scale += w * x.abs().powi(3);
        }
        let sign = if third.abs() > SYMMETRIC * scale {
            third
        } else {
            axis[axis.iamax()]
        };
        axis * 1.0_f64.copysign(sign)
    }

    /// Root mean squares along the axes.
    fn spread(&self, axes: &Matrix3<f64>) -> Vector3<f64> {
        let squares = |(p, w): &(Vector3<f64>, f64)| axes.tr_mul(p).map(|x| x * x) * *w;
        let sum: Vector3<f64> = self.points.iter().map(squares).sum();
        sum.map(f64::sqrt)
    }
}

/// `x` in units of `spread`; an axis without spread contributes nothing.
fn scaled(x: f64, spread: f64) -> f64 {
    if spread > FLAT { x / spread } else { 0.0 }
}

/// A third moment below this fraction of its absolute counterpart is rounding error, also for
/// `f32` coordinates.
const SYMMETRIC: f64 = 1e-4;
/// Relative to the size of the shape; anything flatter counts as flat.
const FLAT: f64 = 1e-9;
/// A landmark closer than this to the axis of the first one does not determine a meridian.
const NEAREST_TO_AXIS: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use cotan_geometry::icosphere;
    use cotan_geometry::testing::{rigid_motions, rotations};
    use nalgebra::Point3;
    use proptest::prelude::*;

    use super::*;

    /// Longest along x, thinnest along z, elongated towards +x and +y.
    fn egg(p: &Point3<f64>) -> Point3<f64> {
        Point3::new(3.0 * p.x + p.x * p.x, 2.0 * p.y + 0.6 * p.y * p.y, p.z)
    }

    proptest! {
        #[test]
        fn the_pose_of_map_and_source_does_not_matter(turn in rotations(), motion in rigid_motions()) {
            let shape = icosphere::<f64>(3);
            let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
            let source = shape.positions().map(egg);
            let oriented = map.orient_principal(&source).unwrap();
            let moved = source.map(|p| motion * p);
            let again = map.rotated(&turn).unwrap().orient_principal(&moved).unwrap();
            for (p, q) in oriented.positions().values().zip(again.positions().values()) {
                prop_assert!((p - q).norm() < 1e-9, "{}", (p - q).norm());
            }
            // x goes to the poles, y to longitude 0.
            for (p, q) in oriented.positions().values().zip(shape.positions().values()) {
                prop_assert!((p.coords - Vector3::new(q.y, q.z, q.x)).norm() < 0.2);
            }
        }

        #[test]
        fn landmarks_come_to_the_pole_and_the_meridian(turn in rotations(), second in 1..42_usize) {
            let shape = icosphere::<f64>(1);
            let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
            let landmarks = [VertexId::new(0), VertexId::new(second), VertexId::new(12)];
            let map = map.rotated(&turn).unwrap().orient_landmarks(landmarks).unwrap();
            prop_assert_eq!(map.positions()[landmarks[0]], Point3::new(0.0, 0.0, 1.0));
            let is_opposite = map.positions()[landmarks[1]].z < -1.0 + 1e-9;
            let meridian = map.positions()[landmarks[if is_opposite { 2 } else { 1 }]];
            prop_assert!(meridian.y.abs() < 1e-15 && meridian.x > 0.1);
        }
    }

    #[test]
    fn landmarks_on_one_axis_and_missing_ones_are_refused() {
        let shape = icosphere::<f32>(1);
        let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
        for landmarks in [[0, 0, 0], [0, 1, 42]] {
            let refused = map.orient_landmarks(landmarks.map(VertexId::new));
            assert!(matches!(refused, Err(SphereError::Mismatch(_))));
        }
        let flat = shape.positions().map(|_| Point3::origin());
        assert!(matches!(
            map.orient_principal(&flat),
            Err(SphereError::Mismatch(_))
        ));
        let short = Positions::filled(3, Point3::origin());
        assert!(matches!(
            map.orient_principal(&short),
            Err(SphereError::Surface(_))
        ));
    }
}
