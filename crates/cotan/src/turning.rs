//! The winding of handles that are turned on and on.

use std::f64::consts::{PI, TAU};

use cotan_flow::nearest_rotation;
use cotan_geometry::{Positions, Scalar};
use nalgebra::{Matrix3, Matrix4, Rotation3, UnitQuaternion, Vector3};

use crate::handle_id::HandleId;
use crate::handles::{HandleGroup, Handles, Motion};

impl<T: Scalar> Handles<T> {
    /// Updates the stated turn of a group whose motion was replaced; `before` are the handles
    /// before that. A turn is stated from the first one of more than a quarter turn on: two
    /// handles can then be wound relative to each other.
    pub(crate) fn turn_on(&mut self, id: HandleId, before: &Self, original: &Positions<T>) {
        let turn = |group: &HandleGroup<T>| rotation(group, original);
        let Some(now) = self.get(id).and_then(turn) else {
            return;
        };
        let group = before.get(id);
        let stated = group.and_then(HandleGroup::turn);
        let last = match (stated, group) {
            (Some(stated), _) => stated.map(T::as_f64),
            (None, Some(group)) => turn(group).map_or(Vector3::zeros(), |r| r.scaled_axis()),
            (None, None) => Vector3::zeros(),
        };
        let turn = nearest_vector(&now, &last);
        if stated.is_some() || turn.norm() > 0.5 * PI {
            self.set_turn(id, Some(turn.map(T::of_f64)));
        }
    }
}

/// The rotation of a group's motion; `None` where the targets determine none.
fn rotation<T: Scalar>(
    group: &HandleGroup<T>,
    original: &Positions<T>,
) -> Option<UnitQuaternion<f64>> {
    let rotation = match group.motion() {
        Motion::Stay => Matrix3::identity(),
        Motion::Transform(matrix) => {
            return rotation_of(&matrix.map(T::as_f64));
        }
        Motion::To(targets) => {
            let pairs = group.vertices().iter().zip(targets);
            let pairs: Vec<[Vector3<f64>; 2]> = pairs
                .map(|(v, to)| Some([*original.get(*v)?, *to].map(|p| p.coords.map(T::as_f64))))
                .collect::<Option<_>>()?;
            let n = pairs.len() as f64;
            let mean = |k: usize| pairs.iter().map(|p| p[k]).sum::<Vector3<f64>>() / n;
            let (from, to) = (mean(0), mean(1));
            let covariance: Matrix3<f64> = pairs
                .iter()
                .map(|[a, b]| (b - to) * (a - from).transpose())
                .sum();
            let sizes = covariance.singular_values();
            // Points on a line, or fewer than three, leave a turn about it open.
            let is_determined = pairs.len() >= 3 && sizes[1] > 1e-6 * sizes[0];
            is_determined.then(|| nearest_rotation(&covariance))?
        }
    };
    let rotation = Rotation3::from_matrix_unchecked(rotation);
    Some(UnitQuaternion::from_rotation_matrix(&rotation))
}

/// The rotation of an affine map; `None` if it flattens space.
fn rotation_of(matrix: &Matrix4<f64>) -> Option<UnitQuaternion<f64>> {
    let linear = matrix.fixed_view::<3, 3>(0, 0).into_owned();
    let is_regular = linear.determinant().abs() > 1e-12 * linear.norm().powi(3);
    is_regular.then(|| {
        let rotation = Rotation3::from_matrix_unchecked(nearest_rotation(&linear));
        UnitQuaternion::from_rotation_matrix(&rotation)
    })
}

/// The rotation vector of an affine map in radians: of those that are a whole turn apart, the one
/// nearest to `last`, the rotation vector of an earlier map. A handle that is turned on and on thus
/// keeps its winding, which [`Handles::turned`] states.
///
/// `matrix` acts on columns (x, y, z, 1). If it flattens space, `last` is returned.
pub fn nearest_turn(matrix: &Matrix4<f64>, last: &Vector3<f64>) -> Vector3<f64> {
    rotation_of(matrix).map_or(*last, |rotation| nearest_vector(&rotation, last))
}

/// Of the rotation vectors of a rotation the one nearest to `last`.
fn nearest_vector(rotation: &UnitQuaternion<f64>, last: &Vector3<f64>) -> Vector3<f64> {
    let least = rotation.scaled_axis();
    let on = |axis: Vector3<f64>, angle: f64| {
        let turns = ((last.dot(&axis) - angle) / TAU).round();
        axis * (angle + TAU * turns)
    };
    let about_own = match least.try_normalize(f64::EPSILON) {
        Some(axis) => on(axis, least.norm()),
        None => Vector3::zeros(),
    };
    // Near whole turns the axis of a rotation is rounding, or that of a slight tilt: the turn
    // about the axis before, without the tilt, is then nearer.
    let about_last = last.try_normalize(f64::EPSILON).map(|axis| {
        let twist = 2.0 * rotation.imag().dot(&axis).atan2(rotation.w);
        on(axis, twist)
    });
    let is_small_tilt = |turn: &Vector3<f64>| {
        UnitQuaternion::from_scaled_axis(*turn).angle_to(rotation) < SMALL_TILT
    };
    match about_last.filter(is_small_tilt) {
        Some(turn) if (turn - last).norm() < (about_own - last).norm() => turn,
        _ => about_own,
    }
}

/// Radians. A flow ignores a stated turn that differs by 0.2 from that of the targets.
const SMALL_TILT: f64 = 0.19;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_add_up_beyond_a_whole_turn_and_back() {
        let axis = Vector3::new(1.0, 2.0, -0.5).normalize();
        let mut last = Vector3::zeros();
        let up = (0..=40).map(|k| 25 * k);
        let down = (-20..40).rev().map(|k| 25 * k);
        for degrees in up.chain(down).map(f64::from) {
            let turn = axis * degrees.to_radians();
            last = nearest_vector(&UnitQuaternion::from_scaled_axis(turn), &last);
            assert!((last - turn).norm() < 1e-9, "{degrees}: {last}");
        }
    }

    #[test]
    fn a_tilt_at_a_whole_turn_does_not_unwind_it() {
        let last = Vector3::x() * f64::to_radians(350.0);
        let tilted = UnitQuaternion::from_scaled_axis(Vector3::y() * 0.05);
        let turn = nearest_vector(&tilted, &last);
        assert!((turn - Vector3::x() * TAU).norm() < 1e-9, "{turn}");
        let on = UnitQuaternion::from_scaled_axis(Vector3::x() * f64::to_radians(20.0));
        let turn = nearest_vector(&on, &turn);
        assert!((turn - Vector3::x() * f64::to_radians(380.0)).norm() < 1e-9);
    }
}
