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

/// The rotation nearest to a covariance; `None` if the covariance does not determine one.
pub(crate) fn rotation(covariance: &Matrix3<f64>) -> Matrix3<f64> {
    let is_usable = covariance.iter().all(|x| x.is_finite()) && covariance.norm() > 0.0;
    if is_usable {
        nearest_rotation(covariance)
    } else {
        Matrix3::identity()
    }
}
