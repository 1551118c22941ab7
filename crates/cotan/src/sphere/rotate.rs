//! Rotation of a sphere map, and the rotation between two sets of directions.

use cotan_flow::nearest_rotation;
use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::VertexId;
use cotan_parallel as parallel;
use nalgebra::{Matrix3, Point3, Rotation3, Vector3};

use super::error::SphereError;
use super::geometry_image::octahedral_direction;
use super::map::SphereMap;

impl<T: Scalar> SphereMap<T> {
    /// Returns the map followed by a rotation, normalized and checked again.
    ///
    /// If rounding flips triangles of a few units in the last place, rotations up to 1e-12 rad
    /// away are tried, which round differently.
    ///
    /// # Errors
    /// [`SphereError::Flipped`] if each of them flips a triangle, because there are many
    /// triangles thinner than the rounding error.
    pub fn rotated(&self, rotation: &Rotation3<f64>) -> Result<Self, SphereError> {
        let mut result = self.rotated_once(rotation);
        for k in 1..ATTEMPTS {
            if !matches!(result, Err(SphereError::Flipped { .. })) {
                break;
            }
            let axis = octahedral_direction(k % 5, k / 5, 5);
            result = self.rotated_once(&(Rotation3::new(axis * NUDGE) * rotation));
        }
        result
    }

    fn rotated_once(&self, rotation: &Rotation3<f64>) -> Result<Self, SphereError> {
        let positions = self.positions().as_slice();
        let turned = parallel::filled(positions.len(), |i| {
            let turned = rotation * positions[i].coords.map(T::as_f64);
            Point3::from(turned.normalize().map(T::of_f64))
        });
        self.with_positions(Positions::from_vec(turned))
    }

    /// The position of a vertex in `f64`, or an error if there is no such vertex.
    pub(crate) fn direction_of(&self, vertex: VertexId) -> Result<Vector3<f64>, SphereError> {
        let position = self.positions().get(vertex).ok_or_else(|| {
            SphereError::Mismatch(format!(
                "there is no vertex {vertex}: the map has {}",
                self.positions().len()
            ))
        })?;
        Ok(position.coords.map(T::as_f64))
    }
}

/// The rotation R with the least Σ |R from − to|² over pairs of directions (`from`, `to`): the
/// problem of Wahba (1965).
///
/// # Errors
/// [`SphereError::Mismatch`] if the pairs do not determine a rotation: fewer than two, or all on
/// one axis.
pub(crate) fn rotation_between(
    pairs: &[(Vector3<f64>, Vector3<f64>)],
) -> Result<Rotation3<f64>, SphereError> {
    let sum: Matrix3<f64> = pairs.iter().map(|(from, to)| to * from.transpose()).sum();
    let sizes = sum.singular_values();
    if !(sizes[1] > SMALLEST_RANK * sizes[0]) {
        let message = "these landmarks leave a rotation open: give at least two that do not lie on one axis of the sphere";
        return Err(SphereError::Mismatch(message.into()));
    }
    Ok(Rotation3::from_matrix_unchecked(nearest_rotation(&sum)))
}

/// One attempt, plus one for each direction of a small octahedral grid.
const ATTEMPTS: usize = 25;
/// Much larger than the rounding error of `f64`, and much smaller than any use of a rotation
/// requires.
const NUDGE: f64 = 1e-12;
/// Landmarks closer to one axis than this determine the rotation about it to less than single
/// precision.
const SMALLEST_RANK: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use cotan_geometry::icosphere;
    use cotan_geometry::testing::{directions, rotations};
    use proptest::prelude::*;

    use super::*;
    use crate::sphere::testing::splintered;

    proptest! {
        #[test]
        fn the_rotation_between_turned_directions_is_the_turn(
            turn in rotations(), a in directions(), b in directions(),
        ) {
            prop_assume!(a.cross(&b).norm() > 1e-2);
            let pairs = [a, b].map(|d| (d, turn * d));
            let found = rotation_between(&pairs).unwrap();
            prop_assert!((found.matrix() - turn.matrix()).norm() < 1e-10);
        }

        #[test]
        fn turning_there_and_back_is_standing_still(turn in rotations()) {
            let shape = icosphere::<f64>(2);
            let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
            let back = map.rotated(&turn).unwrap().rotated(&turn.inverse()).unwrap();
            for (p, q) in back.positions().values().zip(shape.positions().values()) {
                prop_assert!((p - q).norm() < 1e-14);
            }
            let shape = icosphere::<f32>(2);
            let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
            prop_assert!(map.rotated(&turn).unwrap().sphericity_error() < 3e-7);
        }
    }

    /// The rounding error is half a unit in the last place; slivers several units thick survive
    /// any rotation.
    #[test]
    fn slivers_survive_rotations() {
        let count = |margin: f64| {
            let shape = splintered(margin);
            let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
            let turns =
                (0..20).map(|k| Rotation3::new(Vector3::new(0.1, 0.2, -0.3) * f64::from(k)));
            turns.filter(|turn| map.rotated(turn).is_ok()).count()
        };
        assert_eq!(count(64.0), 20);
    }

    #[test]
    fn one_axis_leaves_a_rotation_open() {
        let (x, z) = (Vector3::x(), Vector3::z());
        assert!(rotation_between(&[]).is_err());
        assert!(rotation_between(&[(x, z)]).is_err());
        assert!(rotation_between(&[(x, z), (-x, -z)]).is_err());
        assert!(rotation_between(&[(x, z), (z, -x)]).is_ok());
    }
}
