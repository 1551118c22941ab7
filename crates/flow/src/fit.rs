//! The rotation and the similarity that carry points onto others best.

use nalgebra::{Matrix3, Rotation3, Vector3};

use crate::nearest_rotation::nearest_rotation;

/// A point before and after, and its weight.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair {
    pub(crate) before: Vector3<f64>,
    pub(crate) after: Vector3<f64>,
    pub(crate) weight: f64,
}

impl Pair {
    /// The weighted mean of both ends.
    pub(crate) fn center(pairs: impl Iterator<Item = Self>) -> Self {
        let mut sum = Self {
            before: Vector3::zeros(),
            after: Vector3::zeros(),
            weight: 0.0,
        };
        for pair in pairs {
            sum.before += pair.before * pair.weight;
            sum.after += pair.after * pair.weight;
            sum.weight += pair.weight;
        }
        Self {
            before: sum.before / sum.weight,
            after: sum.after / sum.weight,
            weight: 1.0,
        }
    }
}

/// The fit of a rotation about the centroids, by Kabsch's method.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    pub(crate) rotation: Matrix3<f64>,
    /// The least rotation that carries the main direction of the points onto that of their images.
    pub(crate) least_turn: Matrix3<f64>,
    /// The best scale with the rotation (Umeyama 1991); 1 where there is none.
    pub(crate) scale: f64,
    /// Of the covariance, descending; the last one is negative if the best orthogonal matrix is a
    /// reflection.
    pub(crate) singular_values: [f64; 3],
    /// Mean squared distance from the centroid before the motion.
    pub(crate) spread: f64,
    /// Mean squared distance from the images, by the rotation and the scale.
    pub(crate) residual_squared: f64,
}

impl Fit {
    /// Returns `true` if so many points determine the rotation: points on a line (or one point)
    /// leave the turn about it open.
    pub(crate) fn determines_rotation(&self, num_points: usize) -> bool {
        num_points >= 3 && self.singular_values[1] > 1e-6 * self.spread
    }

    /// Fits at least one pair.
    pub(crate) fn new(pairs: &[Pair]) -> Self {
        let center = Pair::center(pairs.iter().copied());
        let total: f64 = pairs.iter().map(|p| p.weight).sum();
        let (mut covariance, mut spreads) = (Matrix3::zeros(), [0.0; 2]);
        for pair in pairs {
            let (a, b) = (pair.before - center.before, pair.after - center.after);
            let weight = pair.weight / total;
            covariance += b * a.transpose() * weight;
            spreads[0] += weight * a.norm_squared();
            spreads[1] += weight * b.norm_squared();
        }
        let rotation = nearest_rotation(&covariance);
        let svd = covariance.svd(true, true);
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| svd.singular_values[j].total_cmp(&svd.singular_values[i]));
        let mut singular_values = order.map(|i| svd.singular_values[i]);
        if covariance.determinant() < 0.0 {
            singular_values[2] = -singular_values[2];
        }
        let least_turn = match (&svd.u, &svd.v_t) {
            (Some(u), Some(v)) => {
                let to = u.column(order[0]).into_owned();
                let from = v.row(order[0]).transpose();
                // By the tangent: an arc cosine turns the rounding of parallel vectors into 1e-8.
                let (axis, cosine) = (from.cross(&to), from.dot(&to));
                match nalgebra::Unit::try_new(axis, 1e-12) {
                    Some(unit) => {
                        let angle = axis.norm().atan2(cosine);
                        Rotation3::from_axis_angle(&unit, angle).into_inner()
                    }
                    None if cosine > 0.0 => Matrix3::identity(),
                    None => rotation,
                }
            }
            _ => rotation,
        };
        let product = (rotation.transpose() * covariance).trace();
        let scale = if spreads[0] > 0.0 && product > 0.0 {
            product / spreads[0]
        } else {
            1.0
        };
        let residual = spreads[1] + scale * scale * spreads[0] - 2.0 * scale * product;
        Self {
            rotation,
            least_turn,
            scale,
            singular_values,
            spread: spreads[0],
            residual_squared: residual.max(0.0),
        }
    }
}
