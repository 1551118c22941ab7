//! The barycentric coordinates of the point at which a direction pierces a flat triangle, also
//! for slivers.
//!
//! The weights are the determinants det(d, b, c), …, computed from the differences q = p − d, so
//! that they keep their digits in small triangles. In a sliver of length L and height h the error
//! is still L/h times the rounding error. Since Σ w q can be computed accurately enough, it is
//! used to correct the weights, as in the iterative refinement of a linear system. If even that
//! does not help, h is a few units in the last place, and the nearest point of an edge is equally
//! accurate.

use nalgebra::Vector3;

/// Weights w ≥ 0 with sum 1 and Σ w_k p_k ∥ d, for a unit vector d inside the cone of the corners
/// p. The central projection of Σ w_k p_k is d up to a few units in the last place of the
/// triangle's length.
pub(crate) fn barycentric(corners: &[Vector3<f64>; 3], d: &Vector3<f64>) -> [f64; 3] {
    // Projected along d, because components along d do not change the central projection.
    let q = corners.map(|p| {
        let q = p - d;
        q - d * d.dot(&q)
    });
    let length = q.iter().map(Vector3::norm).fold(0.0, f64::max);
    let close = CLOSE * length;
    let mut weights = by_areas(&q, d);
    for _ in 0..REFINEMENTS {
        let Some(w) = weights.filter(|w| !(miss(&q, w) <= close)) else {
            break;
        };
        weights = refined(&q, &w, d);
    }
    let inside = weights.map(clamped);
    if let Some(w) = inside.filter(|w| miss(&q, w) <= close) {
        return w;
    }
    let edges = [0, 1, 2].map(|k| on_edge(&q, k));
    let mut best = edges[0];
    for w in edges.into_iter().chain(inside) {
        if miss(&q, &w) < miss(&q, &best) {
            best = w;
        }
    }
    best
}

/// d · (u × v): twice the area between u and v as seen along d.
fn area(d: &Vector3<f64>, u: &Vector3<f64>, v: &Vector3<f64>) -> f64 {
    d.dot(&u.cross(v))
}

/// The area fractions of the three parts of the triangle around d, or `None` if it has no area.
fn by_areas([a, b, c]: &[Vector3<f64>; 3], d: &Vector3<f64>) -> Option<[f64; 3]> {
    let parts = [area(d, b, c), area(d, c, a), area(d, a, b)];
    let sum: f64 = parts.iter().sum();
    (sum > 0.0).then(|| parts.map(|part| part / sum))
}

/// Σ w q: the residual of the weights.
fn offset(q: &[Vector3<f64>; 3], w: &[f64; 3]) -> Vector3<f64> {
    q[0] * w[0] + q[1] * w[1] + q[2] * w[2]
}

fn miss(q: &[Vector3<f64>; 3], w: &[f64; 3]) -> f64 {
    offset(q, w).norm()
}

/// The weights after a step of Cramer's rule that removes the residual.
fn refined(q: &[Vector3<f64>; 3], w: &[f64; 3], d: &Vector3<f64>) -> Option<[f64; 3]> {
    let (e, f) = (q[1] - q[0], q[2] - q[0]);
    let r = offset(q, w);
    let whole = area(d, &e, &f);
    let (v, w) = (
        w[1] - area(d, &r, &f) / whole,
        w[2] - area(d, &e, &r) / whole,
    );
    (whole > 0.0).then_some([1.0 - v - w, v, w])
}

/// Sets negative weights to 0 and normalizes the sum to 1.
fn clamped(w: [f64; 3]) -> [f64; 3] {
    let w = w.map(|x| x.max(0.0));
    let sum: f64 = w.iter().sum();
    w.map(|x| (x / sum).min(1.0))
}

/// Weights of the point closest to d, as seen along d, on the edge from corner k to the next.
fn on_edge(q: &[Vector3<f64>; 3], k: usize) -> [f64; 3] {
    let (from, to) = (q[k], q[(k + 1) % 3]);
    let along = to - from;
    let squared = along.norm_squared();
    let share = if squared > 0.0 {
        (-from.dot(&along) / squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let mut weights = [0.0; 3];
    weights[k] = 1.0 - share;
    weights[(k + 1) % 3] = share;
    weights
}

/// Rounding of a sum of three products, relative to the triangle's length.
const CLOSE: f64 = 4.0 * f64::EPSILON;
/// Each refinement gains the digits by which h/L exceeds the rounding error. If these do not
/// suffice, h is a few units in the last place.
const REFINEMENTS: usize = 10;

#[cfg(test)]
mod tests {
    use cotan_geometry::testing::directions;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn weights_hit_the_direction_however_thin_the_triangle(
            a in directions(), side in directions(), length in 1e-8..1.0_f64,
            exponent in 0.0..17.0_f64, along in 0.0..1.0_f64, [s, t] in [0.01..0.49_f64, 0.01..0.49],
        ) {
            prop_assume!(a.cross(&side).norm() > 0.1);
            let x = a.cross(&side).normalize();
            let y = a.cross(&x);
            let height = length * 10.0_f64.powf(-exponent);
            let at = |u: f64, v: f64| (a + x * (u * length) + y * (v * height)).normalize();
            let corners = [a, at(1.0, 0.0), at(along, 1.0)];
            let d = (corners[0] * (1.0 - s - t) + corners[1] * s + corners[2] * t).normalize();
            let w = barycentric(&corners, &d);
            prop_assert!(w.iter().all(|w| (0.0..=1.0).contains(w)));
            prop_assert!((w.iter().sum::<f64>() - 1.0).abs() < 1e-15);
            let p = corners[0] * w[0] + corners[1] * w[1] + corners[2] * w[2];
            prop_assert!((p.normalize() - d).norm() < 4e-15, "{:e}", (p.normalize() - d).norm());
            // The weights of well-shaped triangles are accurate as well.
            if exponent < 2.0 && length > 1e-3 {
                prop_assert!((w[1] - s).abs() < 1e-9 && (w[2] - t).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn corners_and_points_have_their_weights() {
        let corners = [Vector3::x(), Vector3::y(), Vector3::z()];
        assert_eq!(barycentric(&corners, &corners[1]), [0.0, 1.0, 0.0]);
        let one = [Vector3::x(); 3];
        let weights = barycentric(&one, &Vector3::x());
        assert_eq!(weights.iter().sum::<f64>(), 1.0);
    }
}
