//! One level of the hierarchy.

use cotan_parallel as parallel;
use nalgebra::Vector3;

use super::aggregate::aggregate;
use crate::csr::Csr;

/// Maximum number of entries of a row that is smoothed; longer rows would fill the rows of all
/// their neighbours.
const LONG_ROW: usize = 129;

/// A matrix, its smoother, and the transfer to the next coarser level.
pub(super) struct Level {
    matrix: Csr,
    /// 1 / a_ii.
    inverse_diagonal: Vec<f64>,
    /// An upper bound on the eigenvalues of D⁻¹A.
    radius: f64,
    prolongation: Csr,
    restriction: Csr,
}

/// Degree of the smoothing polynomial.
const DEGREE: usize = 3;
/// The part of the spectrum that is smoothed: from radius / RANGE upwards.
const RANGE: f64 = 12.0;

impl Level {
    /// Builds the level of `matrix` and the matrix of the next level; `None` if a diagonal entry
    /// is not positive or nothing can be aggregated.
    pub(super) fn new(matrix: Csr, depth: usize) -> Option<(Self, Csr)> {
        let n = matrix.num_rows();
        let diagonal: Vec<f64> = (0..n)
            .map(|i| matrix.row(i).filter(|&(j, _)| j == i).map(|(_, v)| v).sum())
            .collect();
        if !diagonal.iter().all(|&d| d > 0.0) {
            return None;
        }
        let inverse_diagonal: Vec<f64> = diagonal.iter().map(|d| 1.0 / d).collect();
        let radius = radius(&matrix, &inverse_diagonal);
        let (groups, num_groups) = aggregate(&matrix, &diagonal, depth);
        if num_groups * 10 > n * 9 {
            return None;
        }
        let prolongation = smoothed(&matrix, &inverse_diagonal, &groups, 4.0 / (3.0 * radius));
        let restriction = prolongation.transpose(num_groups);
        let coarse = restriction.times(&matrix.times(&prolongation, num_groups), num_groups);
        let level = Self {
            matrix,
            inverse_diagonal,
            radius,
            prolongation,
            restriction,
        };
        Some((level, coarse))
    }

    pub(super) fn matrix(&self) -> &Csr {
        &self.matrix
    }

    /// Number of values in the matrix and in the transfers to the next level.
    pub(super) fn num_entries(&self) -> usize {
        self.matrix.values.len() + 2 * self.prolongation.values.len()
    }

    /// The memory of a cycle.
    pub(super) fn work(&self) -> LevelWork {
        let coarse = self.restriction.num_rows();
        LevelWork {
            step: vec![Vector3::zeros(); self.matrix.num_rows()],
            rhs: vec![Vector3::zeros(); coarse],
            correction: vec![Vector3::zeros(); coarse],
        }
    }

    /// Improves x by a Chebyshev polynomial in D⁻¹A that damps the upper part of the spectrum.
    pub(super) fn smooth(
        &self,
        b: &[Vector3<f64>],
        x: &mut [Vector3<f64>],
        step: &mut [Vector3<f64>],
    ) {
        let (high, low) = (self.radius, self.radius / RANGE);
        let (center, half) = (0.5 * (high + low), 0.5 * (high - low));
        let sigma = center / half;
        let mut rho = 1.0 / sigma;
        parallel::fill(step, |i| self.scaled_residual(b, x, i) / center);
        for degree in 0..DEGREE {
            parallel::update((&mut *x, &*step), |_, (x, s)| *x += s);
            if degree + 1 == DEGREE {
                break;
            }
            let next = 1.0 / (2.0 * sigma - rho);
            let (keep, add) = (next * rho, 2.0 * next / half);
            parallel::update(&mut *step, |i, s| {
                *s = *s * keep + self.scaled_residual(b, x, i) * add;
            });
            rho = next;
        }
    }

    /// (D⁻¹(b − Ax))_i.
    fn scaled_residual(&self, b: &[Vector3<f64>], x: &[Vector3<f64>], i: usize) -> Vector3<f64> {
        (b[i] - self.matrix.product(i, x)) * self.inverse_diagonal[i]
    }

    /// Writes Pᵀ(b − Ax) to `rhs`.
    pub(super) fn restrict(&self, b: &[Vector3<f64>], x: &[Vector3<f64>], work: &mut LevelWork) {
        parallel::fill(&mut work.step, |i| b[i] - self.matrix.product(i, x));
        self.restriction.multiply(&work.step, &mut work.rhs);
    }

    /// x ← x + P c.
    pub(super) fn prolong(&self, correction: &[Vector3<f64>], x: &mut [Vector3<f64>]) {
        parallel::update(x, |i, x| *x += self.prolongation.product(i, correction));
    }
}

/// The memory of a cycle on one level.
pub(super) struct LevelWork {
    /// One entry per unknown of this level.
    pub(super) step: Vec<Vector3<f64>>,
    /// Right-hand side and solution of the next coarser level.
    pub(super) rhs: Vec<Vector3<f64>>,
    pub(super) correction: Vec<Vector3<f64>>,
}

/// An upper bound on the eigenvalues of D⁻¹A: the smaller of Gershgorin's bound and a safe
/// multiple of the result of a power iteration.
fn radius(matrix: &Csr, inverse_diagonal: &[f64]) -> f64 {
    const STEPS: usize = 12;
    const SAFETY: f64 = 1.1;
    let n = matrix.num_rows();
    let gershgorin = parallel::max(n, |i| {
        inverse_diagonal[i] * matrix.row(i).map(|(_, v)| v.abs()).sum::<f64>()
    });
    // A fixed start without structure.
    let mut x: Vec<Vector3<f64>> = (0..n)
        .map(|i| Vector3::repeat((i as f64 * 0.618_033_988_749_895).fract() - 0.5))
        .collect();
    let mut out = vec![Vector3::zeros(); n];
    let mut estimate = 0.0f64;
    for _ in 0..STEPS {
        matrix.multiply(&x, &mut out);
        let size = |v: &[Vector3<f64>]| v.iter().map(|v| v.x * v.x).sum::<f64>().sqrt();
        out.iter_mut()
            .zip(inverse_diagonal)
            .for_each(|(y, d)| *y *= *d);
        let (before, after) = (size(&x), size(&out));
        if !(before > 0.0 && after > 0.0) {
            break;
        }
        estimate = after / before;
        x.iter_mut().zip(&out).for_each(|(x, y)| *x = y / after);
    }
    gershgorin.min(SAFETY * estimate)
}

/// Computes P = (I − ω D⁻¹A) T, where T are the indicators of the groups.
///
/// Rows of vertices of high valence are those of T: all their groups would otherwise enter the
/// row of every neighbour.
fn smoothed(matrix: &Csr, inverse_diagonal: &[f64], groups: &[u32], omega: f64) -> Csr {
    let mut out = Csr {
        offsets: vec![0],
        columns: Vec::new(),
        values: Vec::new(),
    };
    for (i, &own) in groups.iter().enumerate() {
        let begin = out.columns.len();
        let mut add =
            |group: u32, value: f64| match out.columns[begin..].iter().position(|&g| g == group) {
                Some(k) => out.values[begin + k] += value,
                None => {
                    out.columns.push(group);
                    out.values.push(value);
                }
            };
        add(own, 1.0);
        if matrix.row(i).len() <= LONG_ROW {
            for (j, value) in matrix.row(i) {
                add(groups[j], -omega * inverse_diagonal[i] * value);
            }
        }
        out.offsets.push(out.columns.len());
    }
    out
}
