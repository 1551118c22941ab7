//! The rotation of a surface at its points, from positions alone.

use cotan_flow::nearest_rotation;
use nalgebra::{Matrix3, Point3};

use super::contacts::ContactPoint;
use super::model::Model;

/// The covariance of the triangles around a vertex with those at rest, divided by its trace at
/// rest:
///
/// ```text
/// Σ_T ( Σ_{e in T} e e⁰ᵀ + n n⁰ᵀ / |n⁰| ),      n = the cross product of two edges
/// ```
///
/// The normals distinguish a rotation from a reflection. They need no orientation, since both are
/// of the same order of corners.
pub(crate) fn covariance(model: &Model, now: &[Point3<f64>], vertex: u32) -> Matrix3<f64> {
    let rest = model.positions.as_slice();
    let (mut sum, mut trace) = (Matrix3::zeros(), 0.0);
    for triangle in model.fan(vertex) {
        let corners = triangle.map(|v| v as usize);
        let edges = |x: &[Point3<f64>]| {
            let [a, b, c] = corners.map(|v| x[v]);
            [b - a, c - b, a - c]
        };
        let (moved, original) = (edges(now), edges(rest));
        for (e, e0) in moved.iter().zip(&original) {
            sum += e * e0.transpose();
            trace += e0.norm_squared();
        }
        let normal = original[0].cross(&original[1]);
        let length = normal.norm();
        if length > 0.0 {
            sum += moved[0].cross(&moved[1]) * normal.transpose() / length;
            trace += length;
        }
    }
    if trace > 0.0 { sum / trace } else { sum }
}

/// The covariance at a point: the mean of those at its corners.
pub(crate) fn covariance_at(
    model: &Model,
    now: &[Point3<f64>],
    point: &ContactPoint,
) -> Matrix3<f64> {
    let terms = point.terms();
    terms.fold(Matrix3::zeros(), |sum, (v, share)| {
        sum + covariance(model, now, v) * share
    })
}

/// The rotation nearest to a covariance; the identity if there is none.
pub(crate) fn rotation(covariance: &Matrix3<f64>) -> Matrix3<f64> {
    let is_usable = covariance.iter().all(|x| x.is_finite()) && covariance.norm() > 0.0;
    match is_usable {
        true => polar(covariance).unwrap_or_else(|| nearest_rotation(covariance)),
        false => Matrix3::identity(),
    }
}

/// The orthogonal polar factor of a matrix that is far from singular, which is then the nearest
/// rotation: a tenth of the work of the general fit, and less the nearer the matrix is to one.
///
/// **Source**: Higham 1986, X ← ½ (γ X + X⁻ᵀ / γ) with γ² = |X⁻¹| / |X|.
fn polar(matrix: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    const MAX_STEPS: usize = 12;
    /// Of the determinant, over the cube of the norm.
    const LEAST: f64 = 1e-4;
    /// The step after one of this size is below rounding.
    const LAST_STEP: f64 = 1e-8;
    let mut x = *matrix;
    for step in 0..MAX_STEPS {
        let [a, b, c] = [0, 1, 2].map(|k| x.column(k).into_owned());
        let cofactors = Matrix3::from_columns(&[b.cross(&c), c.cross(&a), a.cross(&b)]);
        let determinant = a.dot(&cofactors.column(0));
        if step == 0 && !(determinant > LEAST * x.norm().powi(3)) {
            return None;
        }
        let inverse = cofactors / determinant;
        let scale = (inverse.norm() / x.norm()).sqrt();
        let next = (x * scale + inverse / scale) * 0.5;
        let change = (next - x).norm();
        x = next;
        if change < LAST_STEP {
            return Some(x);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Vector3};

    use super::*;

    #[test]
    fn the_polar_factor_is_the_nearest_rotation() {
        for k in 0..200 {
            let t = f64::from(k);
            let turn =
                Rotation3::new(Vector3::new(t.sin(), (1.3 * t).cos(), (0.7 * t).sin()) * 3.0);
            let axes = Rotation3::new(Vector3::new(t.cos(), (2.1 * t).sin(), 0.3));
            let sizes = Vector3::new(1.0, 0.2 + 0.1 * (t.sin() + 1.0), 0.05 + 0.01 * t);
            let stretch = axes * Matrix3::from_diagonal(&sizes) * axes.inverse();
            let matrix = turn.matrix() * stretch;
            let general = nearest_rotation(&matrix);
            assert!((rotation(&matrix) - general).norm() < 1e-13, "{k}");
            assert!((general - turn.matrix()).norm() < 1e-12, "{k}");
        }
    }

    #[test]
    fn a_mirrored_or_flat_covariance_has_a_rotation() {
        let flat = Matrix3::from_diagonal(&Vector3::new(1.0, 0.5, 0.0));
        assert!((rotation(&flat) - Matrix3::identity()).norm() < 1e-12);
        let mirrored = Matrix3::from_diagonal(&Vector3::new(1.0, 0.5, -0.1));
        assert!((rotation(&mirrored).determinant() - 1.0).abs() < 1e-12);
        assert_eq!(rotation(&Matrix3::zeros()), Matrix3::identity());
        assert_eq!(rotation(&(flat * f64::NAN)), Matrix3::identity());
    }
}
