//! One level of the hierarchy.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::aggregate::aggregate;
use crate::csr::Csr;
use crate::stretched::HIGH_VALENCE;

/// A matrix, how it is smoothed, and the way to the next coarser level.
pub(super) struct Level {
    matrix: Csr,
    /// 1 / a_ii.
    inverse_diagonal: Vec<f64>,
    /// A bound of the eigenvalues of D⁻¹A.
    radius: f64,
    prolongation: Csr,
    restriction: Csr,
}

/// Degree of the smoothing polynomial.
const DEGREE: usize = 3;
/// The part of the spectrum that is smoothed: from radius / RANGE upwards.
const RANGE: f64 = 12.0;

impl Level {
    /// The level of `matrix` and the matrix of the next; `None` if a diagonal entry is not positive or
    /// there is nothing to join.
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

    /// Number of values of the matrix and of the ways to the next level.
    pub(super) fn num_entries(&self) -> usize {
        self.matrix.values.len() + 2 * self.prolongation.values.len()
    }

    /// Improves x by a Chebyshev polynomial in D⁻¹A that damps the upper part of the spectrum.
    pub(super) fn smooth(&self, b: &[Vector3<f64>], x: &mut [Vector3<f64>]) {
        let (high, low) = (self.radius, self.radius / RANGE);
        let (center, half) = (0.5 * (high + low), 0.5 * (high - low));
        let sigma = center / half;
        let mut rho = 1.0 / sigma;
        let mut step = self.scaled_residual(b, x);
        step.par_iter_mut().for_each(|s| *s /= center);
        for degree in 0..DEGREE {
            x.par_iter_mut()
                .zip(&step)
                .with_min_len(CHUNK)
                .for_each(|(x, s)| *x += s);
            if degree + 1 == DEGREE {
                break;
            }
            let next = 1.0 / (2.0 * sigma - rho);
            let residual = self.scaled_residual(b, x);
            let (keep, add) = (next * rho, 2.0 * next / half);
            step.par_iter_mut()
                .zip(&residual)
                .with_min_len(CHUNK)
                .for_each(|(s, r)| *s = *s * keep + r * add);
            rho = next;
        }
    }

    /// D⁻¹(b − Ax).
    fn scaled_residual(&self, b: &[Vector3<f64>], x: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        (0..b.len())
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|i| (b[i] - self.matrix.product(i, x)) * self.inverse_diagonal[i])
            .collect()
    }

    /// Pᵀ(b − Ax).
    pub(super) fn restrict(&self, b: &[Vector3<f64>], x: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let residual: Vec<Vector3<f64>> = (0..b.len())
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|i| b[i] - self.matrix.product(i, x))
            .collect();
        let mut out = vec![Vector3::zeros(); self.restriction.num_rows()];
        self.restriction.multiply(&residual, &mut out);
        out
    }

    /// x ← x + P c.
    pub(super) fn prolong(&self, correction: &[Vector3<f64>], x: &mut [Vector3<f64>]) {
        x.par_iter_mut()
            .enumerate()
            .with_min_len(CHUNK)
            .for_each(|(i, x)| *x += self.prolongation.product(i, correction));
    }
}

const CHUNK: usize = 2048;

/// A bound of the eigenvalues of D⁻¹A: the lesser of Gershgorin's and a safe multiple of what a power
/// iteration finds.
fn radius(matrix: &Csr, inverse_diagonal: &[f64]) -> f64 {
    const STEPS: usize = 12;
    const SAFETY: f64 = 1.1;
    let n = matrix.num_rows();
    let gershgorin = (0..n)
        .into_par_iter()
        .map(|i| inverse_diagonal[i] * matrix.row(i).map(|(_, v)| v.abs()).sum::<f64>())
        .reduce(|| 0.0, f64::max);
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

/// P = (I − ω D⁻¹A) T, T the groups' indicators. Rows of vertices of high valence are those of
/// T: all their groups would enter the row of every neighbour.
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
        if matrix.row(i).len() <= HIGH_VALENCE + 1 {
            for (j, value) in matrix.row(i) {
                add(groups[j], -omega * inverse_diagonal[i] * value);
            }
        }
        out.offsets.push(out.columns.len());
    }
    out
}
