//! The rotation nearest to a 3 × 3 matrix.

use nalgebra::{Matrix3, Matrix4, Quaternion, UnitQuaternion, Vector3};

use crate::four::{Four, Mat3, flat};

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

/// Four matrices, entry by entry.
type FourMatrices = [Four; 9];

/// As [`nearest_rotation`] for four matrices side by side, from guesses that are rotations: a few
/// Newton steps where they are good ones, at a small part of the cost.
///
/// With A = Rᵀ S, the rotation R exp(ω) is to first order the best for (tr(A) − sym A) ω = axial A.
/// A stationary R is the global maximum exactly where that matrix is positive semi-definite, so a
/// guess that leads elsewhere is noticed, and the fit made from scratch.
///
/// About the axis ω the best angle is atan |ω|: its sine and cosine need no trigonometry, and the
/// step never goes too far.
///
/// Each of the four comes out as it would alone: it takes no further part once it is found.
#[inline(always)]
pub(crate) fn nearest_rotations_from(matrices: &[Mat3; 4], rotations: &mut [Mat3; 4]) {
    const MAX_STEPS: usize = 6;
    /// Radians. The terms of third order are as small as the axial vector is, so that convergence
    /// is cubic: the step after one of this size is below rounding.
    const LAST_STEP: f64 = 1e-5;
    const LONGEST_STEP: f64 = 0.5;
    let s = side_by_side(matrices);
    let least_pivot = Four::all(1e-6) * sum_of_squares(&s).sqrt();
    let mut r = side_by_side(rotations);
    let (mut is_open, mut is_found) = ([true; 4], [false; 4]);
    for _ in 0..MAX_STEPS {
        // Where two rotations are nearly as good as each other a Newton step is not to be trusted.
        let (step, is_safe) = newton_step(&transpose_product(&r, &s), least_pivot);
        let squared = step[0] * step[0] + step[1] * step[1] + step[2] * step[2];
        let next = product(&r, &turn(&step, squared));
        for lane in 0..4 {
            let is_short = squared.0[lane] < LONGEST_STEP * LONGEST_STEP;
            is_open[lane] &= is_safe[lane] & is_short;
        }
        for k in 0..9 {
            for lane in 0..4 {
                r[k].0[lane] = if is_open[lane] {
                    next[k].0[lane]
                } else {
                    r[k].0[lane]
                };
            }
        }
        for lane in 0..4 {
            let is_last = is_open[lane] & (squared.0[lane] < LAST_STEP * LAST_STEP);
            is_found[lane] |= is_last;
            is_open[lane] &= !is_last;
        }
        if !(is_open[0] | is_open[1] | is_open[2] | is_open[3]) {
            break;
        }
    }
    let r = orthonormalized(&r);
    for lane in 0..4 {
        if is_found[lane] {
            for k in 0..9 {
                rotations[lane][k] = r[k].0[lane];
            }
        } else {
            rotations[lane] = from_scratch(&matrices[lane]);
        }
    }
}

#[cold]
#[inline(never)]
fn from_scratch(s: &Mat3) -> Mat3 {
    flat(&nearest_rotation(&Matrix3::from_column_slice(s)))
}

#[inline(always)]
fn side_by_side(m: &[Mat3; 4]) -> FourMatrices {
    let mut out = [Four::ZERO; 9];
    for k in 0..9 {
        out[k] = Four([m[0][k], m[1][k], m[2][k], m[3][k]]);
    }
    out
}

#[inline(always)]
fn sum_of_squares(m: &FourMatrices) -> Four {
    let mut sum = Four::ZERO;
    for k in 0..9 {
        sum += m[k] * m[k];
    }
    sum
}

/// (tr(A) − sym A)⁻¹ axial A by cofactors; not safe where a pivot is below the least.
#[inline(always)]
fn newton_step(a: &FourMatrices, least_pivot: Four) -> ([Four; 3], [bool; 4]) {
    let half = Four::all(-0.5);
    let axial = [a[5] - a[7], a[6] - a[2], a[1] - a[3]];
    let (xx, yy, zz) = (a[4] + a[8], a[0] + a[8], a[0] + a[4]);
    let (xy, yz, zx) = (
        half * (a[1] + a[3]),
        half * (a[5] + a[7]),
        half * (a[2] + a[6]),
    );
    let (c_xx, c_yy, c_zz) = (yy * zz - yz * yz, xx * zz - zx * zx, xx * yy - xy * xy);
    let (c_xy, c_zx, c_yz) = (zx * yz - xy * zz, xy * yz - zx * yy, xy * zx - xx * yz);
    let determinant = xx * c_xx + xy * c_xy + zx * c_zx;
    // The pivots are xx, minor / xx and determinant / minor, the minor being that of x and y.
    let least = [least_pivot, least_pivot * xx, least_pivot * c_zz];
    let mut is_safe = [false; 4];
    for lane in 0..4 {
        is_safe[lane] = (xx.0[lane] > 0.0)
            & (xx.0[lane] >= least[0].0[lane])
            & (c_zz.0[lane] >= least[1].0[lane])
            & (determinant.0[lane] >= least[2].0[lane]);
    }
    let over = Four::all(1.0).over(determinant);
    let step = [
        (c_xx * axial[0] + c_xy * axial[1] + c_zx * axial[2]) * over,
        (c_xy * axial[0] + c_yy * axial[1] + c_yz * axial[2]) * over,
        (c_zx * axial[0] + c_yz * axial[1] + c_zz * axial[2]) * over,
    ];
    (step, is_safe)
}

/// The rotation about ω by atan |ω|.
#[inline(always)]
fn turn(omega: &[Four; 3], squared: Four) -> FourMatrices {
    let one = Four::all(1.0);
    let cosine = one.over((one + squared).sqrt());
    let b = (cosine * cosine).over(one + cosine);
    let [x, y, z] = *omega;
    let (cx, cy, cz) = (cosine * x, cosine * y, cosine * z);
    let (bxy, byz, bzx) = (b * x * y, b * y * z, b * z * x);
    [
        cosine + b * x * x,
        bxy + cz,
        bzx - cy,
        bxy - cz,
        cosine + b * y * y,
        byz + cx,
        bzx + cy,
        byz - cx,
        cosine + b * z * z,
    ]
}

/// Products of rotations drift: one step back to orthogonality, ½ R (3 − RᵀR).
#[inline(always)]
fn orthonormalized(rotation: &FourMatrices) -> FourMatrices {
    let mut correction = transpose_product(rotation, rotation);
    for entry in &mut correction {
        *entry = *entry * Four::all(-0.5);
    }
    for k in [0, 4, 8] {
        correction[k] += Four::all(1.5);
    }
    product(rotation, &correction)
}

/// A B.
#[inline(always)]
fn product(a: &FourMatrices, b: &FourMatrices) -> FourMatrices {
    let mut out = [Four::ZERO; 9];
    for c in 0..3 {
        for r in 0..3 {
            out[3 * c + r] = a[r] * b[3 * c] + a[3 + r] * b[3 * c + 1] + a[6 + r] * b[3 * c + 2];
        }
    }
    out
}

/// Aᵀ B.
#[inline(always)]
fn transpose_product(a: &FourMatrices, b: &FourMatrices) -> FourMatrices {
    let mut out = [Four::ZERO; 9];
    for c in 0..3 {
        for r in 0..3 {
            out[3 * c + r] =
                a[3 * r] * b[3 * c] + a[3 * r + 1] * b[3 * c + 1] + a[3 * r + 2] * b[3 * c + 2];
        }
    }
    out
}

/// Unit eigenvector of the largest eigenvalue of a symmetric matrix, by cyclic Jacobi rotations.
fn largest_eigenvector(mut m: Matrix4<f64>) -> [f64; 4] {
    // Six sweeps reach full precision from anywhere; convergence is quadratic at the end.
    const MAX_SWEEPS: usize = 12;
    let scale = m.norm_squared();
    let mut vectors = Matrix4::identity();
    for _ in 0..MAX_SWEEPS {
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
    use nalgebra::Rotation3;
    use proptest::prelude::*;

    use super::*;
    use crate::four::IDENTITY;

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
            let guess = best * Rotation3::new(turn).into_inner();
            // Beside others that are found at once, or not from their guess.
            let mut found = [IDENTITY, flat(&guess), flat(&best), flat(&-guess)];
            nearest_rotations_from(&[IDENTITY, flat(&s), flat(&s), flat(&s)], &mut found);
            prop_assert_eq!(found[0], IDENTITY);
            let found = Matrix3::from_column_slice(&found[1]);
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
