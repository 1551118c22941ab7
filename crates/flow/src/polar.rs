//! The rotation nearest to a 3 × 3 matrix.

use nalgebra::{Matrix3, Matrix4, Quaternion, Rotation3, UnitQuaternion, Vector3};

/// The rotation R (determinant +1) that maximises tr(Rᵀ S), for S = Σ w e e⁰ᵀ: the rotation that
/// turns the e⁰ onto the e best in the least-squares sense.
///
/// The unit quaternion of R is the eigenvector of the largest eigenvalue of a symmetric 4 × 4
/// matrix (Horn 1987), found by Jacobi's method: full precision also where S has rank 1 or 2,
/// and no case distinction for the sign of the determinant. Where several rotations are equally
/// good (S = 0, or a point reflection) one of them is returned, the identity if it is among them
/// and S = 0.
pub fn nearest_rotation(s: &Matrix3<f64>) -> Matrix3<f64> {
    let (xx, yy, zz) = (s[(0, 0)], s[(1, 1)], s[(2, 2)]);
    let a = Vector3::new(
        s[(2, 1)] - s[(1, 2)],
        s[(0, 2)] - s[(2, 0)],
        s[(1, 0)] - s[(0, 1)],
    );
    let (xy, yz, zx) = (
        s[(0, 1)] + s[(1, 0)],
        s[(1, 2)] + s[(2, 1)],
        s[(2, 0)] + s[(0, 2)],
    );
    #[rustfmt::skip]
    let horn = Matrix4::new(
        xx + yy + zz, a.x,          a.y,           a.z,
        a.x,          xx - yy - zz, xy,            zx,
        a.y,          xy,           yy - xx - zz,  yz,
        a.z,          zx,           yz,            zz - xx - yy,
    );
    let [w, x, y, z] = largest_eigenvector(horn);
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
        .to_rotation_matrix()
        .into_inner()
}

/// As [`nearest_rotation`], from a guess that is a rotation: a few Newton steps where it is a good
/// one, at a tenth of the cost.
///
/// With A = Rᵀ S, the rotation R exp(ω) is to first order the best for (tr(A) − sym A) ω = axial A.
/// A stationary R is the global maximum exactly where that matrix is positive semi-definite, so a
/// guess that leads elsewhere is noticed, and the fit made from scratch.
pub(crate) fn nearest_rotation_from(s: &Matrix3<f64>, guess: &Matrix3<f64>) -> Matrix3<f64> {
    const MOST_STEPS: usize = 5;
    /// Radians. Convergence is quadratic: the step after one of this size is below rounding.
    const LAST_STEP: f64 = 1e-8;
    const LONGEST_STEP: f64 = 0.5;
    let size = s.norm();
    let mut rotation = *guess;
    for _ in 0..MOST_STEPS {
        let a = rotation.tr_mul(s);
        let axial = Vector3::new(
            a[(2, 1)] - a[(1, 2)],
            a[(0, 2)] - a[(2, 0)],
            a[(1, 0)] - a[(0, 1)],
        );
        let hessian = Matrix3::identity() * a.trace() - (a + a.transpose()) * 0.5;
        // Where two rotations are nearly as good as each other a Newton step is not to be trusted.
        let Some(factor) = hessian.cholesky() else {
            break;
        };
        if factor.l_dirty().diagonal().min().powi(2) < 1e-6 * size {
            break;
        }
        let step = factor.solve(&axial);
        let length = step.norm();
        if !(length < LONGEST_STEP) {
            break;
        }
        rotation *= Rotation3::new(step).into_inner();
        if length < LAST_STEP {
            // Products of rotations drift: one step back to orthogonality.
            let error = rotation.tr_mul(&rotation);
            return rotation * (Matrix3::identity() * 3.0 - error) * 0.5;
        }
    }
    nearest_rotation(s)
}

/// Unit eigenvector of the largest eigenvalue of a symmetric matrix, by cyclic Jacobi rotations.
fn largest_eigenvector(mut m: Matrix4<f64>) -> [f64; 4] {
    // Six sweeps reach full precision from anywhere; convergence is quadratic at the end.
    const MOST_SWEEPS: usize = 12;
    let scale = m.norm_squared();
    let mut vectors = Matrix4::identity();
    for _ in 0..MOST_SWEEPS {
        let mut off_diagonal = 0.0;
        for q in 1..4 {
            for p in 0..q {
                off_diagonal += m[(p, q)] * m[(p, q)];
            }
        }
        if off_diagonal <= 1e-32 * scale {
            break;
        }
        for q in 1..4 {
            for p in 0..q {
                rotate(&mut m, &mut vectors, p, q);
            }
        }
    }
    let mut best = 0;
    for k in 1..4 {
        if m[(k, k)] > m[(best, best)] {
            best = k;
        }
    }
    std::array::from_fn(|k| vectors[(k, best)])
}

/// Zeroes the entry (p, q) by a rotation of rows and columns p and q.
fn rotate(m: &mut Matrix4<f64>, vectors: &mut Matrix4<f64>, p: usize, q: usize) {
    let entry = m[(p, q)];
    if entry == 0.0 {
        return;
    }
    let theta = (m[(q, q)] - m[(p, p)]) / (2.0 * entry);
    // A theta whose square overflows gives t = 0: nothing to turn.
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for k in 0..4 {
        let (a, b) = (m[(k, p)], m[(k, q)]);
        (m[(k, p)], m[(k, q)]) = (c * a - s * b, s * a + c * b);
        let (a, b) = (vectors[(k, p)], vectors[(k, q)]);
        (vectors[(k, p)], vectors[(k, q)]) = (c * a - s * b, s * a + c * b);
    }
    for k in 0..4 {
        let (a, b) = (m[(p, k)], m[(q, k)]);
        (m[(p, k)], m[(q, k)]) = (c * a - s * b, s * a + c * b);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn entries() -> impl Strategy<Value = [f64; 9]> {
        proptest::array::uniform9(-1.0f64..1.0)
    }

    proptest! {
        #[test]
        fn is_a_rotation_and_no_nearby_rotation_is_better(
            s in entries(), axis in proptest::array::uniform3(-1.0f64..1.0),
        ) {
            let s = Matrix3::from_row_slice(&s);
            let r = nearest_rotation(&s);
            prop_assert!((r.transpose() * r - Matrix3::identity()).norm() < 1e-13);
            prop_assert!((r.determinant() - 1.0).abs() < 1e-13);
            let nearby = Rotation3::new(Vector3::from(axis) * 1e-3) * r;
            prop_assert!((r.transpose() * s).trace() >= (nearby.transpose() * s).trace() - 1e-14);
        }

        /// From any guess, good or bad: the same rotation.
        #[test]
        fn a_guess_changes_nothing(
            s in entries(), axis in proptest::array::uniform3(-1.0f64..1.0), scale in -3.0f64..1.0,
        ) {
            let s = Matrix3::from_row_slice(&s);
            let best = nearest_rotation(&s);
            let turn = Vector3::from(axis) * 10f64.powf(scale);
            let found = nearest_rotation_from(&s, &(best * Rotation3::new(turn).into_inner()));
            prop_assert!((found.transpose() * found - Matrix3::identity()).norm() < 1e-14);
            let gap = (best.transpose() * s).trace() - (found.transpose() * s).trace();
            prop_assert!(gap.abs() <= 1e-13, "{gap:e}");
        }

        #[test]
        fn recovers_a_rotation_from_edges_in_a_plane(
            axis in proptest::array::uniform3(-3.0f64..3.0), edges in entries(),
        ) {
            let turn = Rotation3::new(Vector3::from(axis)).into_inner();
            let mut s = Matrix3::zeros();
            for e in edges.chunks(2).filter(|e| e.len() == 2) {
                let rest = Vector3::new(e[0], e[1], 0.0);
                s += turn * rest * rest.transpose();
            }
            prop_assume!(s.norm() > 1e-3 && s.singular_values()[1] > 1e-3);
            prop_assert!((nearest_rotation(&s) - turn).norm() < 1e-9);
        }
    }

    #[test]
    fn nothing_to_fit_gives_the_identity() {
        assert_eq!(nearest_rotation(&Matrix3::zeros()), Matrix3::identity());
    }
}
