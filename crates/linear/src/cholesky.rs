//! Factorized matrices: analysed once, factorized and solved as often as asked, and checked.

use std::collections::TryReserveError;
use std::sync::Arc;

use cotan_parallel as parallel;
use nalgebra::Vector3;

use crate::csr::Csr;
use crate::error::LinearError;
use crate::lower::LowerTriangle;
use crate::ordering::{self, Graph};
use crate::sparse::{Buffers, Factor, FactorError, Precision, Symbolic};
use crate::strategy::Strategy;

/// What a factor may take, and how it is stored.
#[derive(Clone, Default)]
pub(crate) struct Storage {
    pub(crate) precision: Precision,
    /// The analysis of the pattern, if it is known.
    pub(crate) analysis: Option<Arc<Symbolic>>,
    /// The most bytes that factors of this pattern may take together, with the memory that the
    /// strategy takes beside them: known exactly once the pattern is analysed.
    pub(crate) limit: Option<Limit>,
}

/// A limit of memory.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limit {
    pub(crate) strategy: Strategy,
    /// How many factors there will be, and bytes that are taken beside them.
    pub(crate) factors: u64,
    pub(crate) beside: u64,
    pub(crate) permitted: u64,
}

/// A factorized symmetric positive definite matrix and the memory that its solves need.
pub(crate) struct Cholesky {
    factor: Factor,
    buffers: Buffers,
    /// For a factor in single precision: what is needed to refine its solutions.
    refinement: Option<Refinement>,
}

/// The matrix, a right-hand side and what a solution leaves of it.
struct Refinement {
    matrix: Csr,
    rhs: Vec<Vector3<f64>>,
    residual: Vec<Vector3<f64>>,
}

impl Cholesky {
    /// Orders, analyses and factorizes a matrix.
    pub(crate) fn factor(matrix: &LowerTriangle) -> Result<Self, LinearError> {
        Self::factor_with(matrix, &Storage::default())
    }

    /// As [`Self::factor`], within a limit of memory.
    pub(crate) fn factor_with(
        matrix: &LowerTriangle,
        storage: &Storage,
    ) -> Result<Self, LinearError> {
        let symbolic = Self::analysed(matrix, storage)?;
        if let Some(limit) = storage.limit {
            let each = symbolic.num_entries() as u64 * storage.precision.bytes()
                + storage.precision.bytes_beside(matrix)
                + symbolic.work_bytes();
            let predicted = limit.factors * each + limit.beside;
            if predicted > limit.permitted {
                return Err(LinearError::MemoryLimit {
                    strategy: limit.strategy,
                    predicted,
                    permitted: limit.permitted,
                });
            }
        }
        Self::with_analysis(symbolic, matrix, storage.precision)
    }

    /// The analysis of a matrix, unless it is at hand.
    pub(crate) fn analysed(
        matrix: &LowerTriangle,
        storage: &Storage,
    ) -> Result<Arc<Symbolic>, LinearError> {
        // Entries are counted in 32 bits, in both triangles.
        if matrix.rows.len() > u32::MAX as usize / 2 {
            return Err(LinearError::OutOfMemory {
                unknowns: matrix.offsets.len() - 1,
                bytes: 8 * matrix.rows.len() as u64,
            });
        }
        let at_hand = storage.analysis.clone();
        Ok(at_hand.unwrap_or_else(|| analyse(matrix)))
    }

    /// Factorizes another matrix of the same pattern beside this one; the analysis is shared.
    pub(crate) fn factor_like(&self, matrix: &LowerTriangle) -> Result<Self, LinearError> {
        let precision = self.factor.precision();
        Self::with_analysis(self.factor.symbolic().clone(), matrix, precision)
    }

    fn with_analysis(
        symbolic: Arc<Symbolic>,
        matrix: &LowerTriangle,
        precision: Precision,
    ) -> Result<Self, LinearError> {
        check_finite(matrix)?;
        let unknowns = symbolic.num_unknowns();
        let bytes = symbolic.num_entries() as u64 * precision.bytes() + symbolic.work_bytes();
        check_room(bytes).map_err(|_| LinearError::OutOfMemory { unknowns, bytes })?;
        let buffers = Buffers::new(&symbolic);
        let factor = Factor::new(symbolic, &matrix.values, precision).map_err(|e| match e {
            FactorError::NotPositive => LinearError::NotPositiveDefinite { unknowns },
            FactorError::OutOfMemory => LinearError::OutOfMemory { unknowns, bytes },
        })?;
        let refinement = (precision == Precision::Single).then(|| Refinement {
            matrix: Csr::from_lower(matrix),
            rhs: vec![Vector3::zeros(); unknowns],
            residual: vec![Vector3::zeros(); unknowns],
        });
        let mut cholesky = Self {
            factor,
            buffers,
            refinement,
        };
        cholesky.check(matrix)?;
        Ok(cholesky)
    }

    /// Factorizes another matrix of the same pattern in place of this one.
    pub(crate) fn refactor(&mut self, matrix: &LowerTriangle) -> Result<(), LinearError> {
        check_finite(matrix)?;
        self.factor
            .refactor(&matrix.values)
            .map_err(|_| LinearError::NotPositiveDefinite {
                unknowns: matrix.offsets.len() - 1,
            })?;
        if let Some(refinement) = &mut self.refinement {
            refinement.matrix = Csr::from_lower(matrix);
        }
        self.check(matrix)
    }

    /// Number of values stored in the factor.
    pub(crate) fn num_entries(&self) -> usize {
        self.factor.symbolic().num_entries()
    }

    /// Overwrites right-hand sides by their solutions: x, y and z are three systems.
    ///
    /// A factor in single precision is asked twice: its first answer leaves a residual, which it
    /// answers too.
    pub(crate) fn solve(&mut self, rhs: &mut [Vector3<f64>]) {
        self.solve_between(rhs, |_, b| *b, |_, x| x);
    }

    /// As [`Self::solve`], with passes over the vectors before and after: see [`Factor::solve_between`].
    pub(crate) fn solve_between(
        &mut self,
        rhs: &mut [Vector3<f64>],
        before: impl Fn(usize, &Vector3<f64>) -> Vector3<f64> + Sync,
        after: impl Fn(usize, Vector3<f64>) -> Vector3<f64> + Sync,
    ) {
        let Self {
            factor,
            buffers,
            refinement,
        } = self;
        let Some(refinement) = refinement else {
            factor.solve_between(rhs, before, after, buffers);
            return;
        };
        let Refinement {
            matrix,
            rhs: wanted,
            residual,
        } = refinement;
        let x = rhs;
        for (i, (wanted, x)) in wanted.iter_mut().zip(&mut *x).enumerate() {
            *x = before(i, x);
            *wanted = *x;
        }
        factor.solve(x, buffers);
        parallel::fill(residual, |i| wanted[i] - matrix.product(i, x));
        factor.solve(residual, buffers);
        for (i, (x, r)) in x.iter_mut().zip(&*residual).enumerate() {
            *x = after(i, *x + r);
        }
    }

    /// Overwrites one right-hand side by its solution.
    pub(crate) fn solve_one(&mut self, x: &mut [f64]) {
        if self.refinement.is_none() {
            return self.factor.solve_one(x, &mut self.buffers);
        }
        let mut vectors: Vec<_> = x.iter().map(|&x| Vector3::new(x, 0.0, 0.0)).collect();
        self.solve(&mut vectors);
        x.iter_mut().zip(&vectors).for_each(|(x, v)| *x = v.x);
    }

    /// Solves one right-hand side and measures the backward error |Mx − b| / (|M||x| + |b|).
    fn check(&mut self, matrix: &LowerTriangle) -> Result<(), LinearError> {
        // A stable factorization has a backward error of a few times 1e-16 whatever the condition
        // number.
        const WORST: f64 = 1e-10;
        let n = matrix.offsets.len() - 1;
        // A fixed sequence without structure: multiples of the golden ratio, mod 1.
        let b: Vec<f64> = (0..n)
            .map(|i| (i as f64 * 0.618_033_988_749_895).fract() - 0.5)
            .collect();
        let mut x = b.clone();
        self.solve_one(&mut x);
        let mut product = vec![0.0; n];
        matrix.multiply(&x, &mut product);
        let max_norm = |v: &[f64]| v.iter().fold(0.0f64, |m, a| m.max(a.abs()));
        let error = product
            .iter()
            .zip(&b)
            .fold(0.0f64, |m, (p, b)| m.max((p - b).abs()));
        let residual = error / (matrix.norm() * max_norm(&x) + max_norm(&b));
        if n > 0 && !(residual <= WORST && x.iter().all(|v| v.is_finite())) {
            return Err(LinearError::Inaccurate {
                unknowns: n,
                residual,
            });
        }
        Ok(())
    }
}

/// Whether the system has so much memory to give.
fn check_room(bytes: u64) -> Result<(), TryReserveError> {
    let bytes = usize::try_from(bytes).unwrap_or(usize::MAX);
    Vec::<u8>::new().try_reserve_exact(bytes)
}

fn check_finite(matrix: &LowerTriangle) -> Result<(), LinearError> {
    if matrix.values.iter().any(|v| !v.is_finite()) {
        return Err(LinearError::NotPositiveDefinite {
            unknowns: matrix.offsets.len() - 1,
        });
    }
    Ok(())
}

/// Orders and analyses a matrix.
pub(crate) fn analyse(matrix: &LowerTriangle) -> Arc<Symbolic> {
    Arc::new(Symbolic::analyse(matrix, order(matrix)))
}

/// A fill-reducing order for the matrix.
pub(crate) fn order(matrix: &LowerTriangle) -> Vec<u32> {
    let n = matrix.offsets.len() - 1;
    let entries = || {
        (0..n).flat_map(|j| {
            let rows = &matrix.rows[matrix.offsets[j]..matrix.offsets[j + 1]];
            rows.iter()
                .map(move |&i| (i as usize, j))
                .filter(|&(i, j)| i != j)
        })
    };
    let mut offsets = vec![0u32; n + 1];
    for (i, j) in entries() {
        offsets[i + 1] += 1;
        offsets[j + 1] += 1;
    }
    for k in 0..n {
        offsets[k + 1] += offsets[k];
    }
    let mut next = offsets.clone();
    let mut neighbours = vec![0u32; offsets[n] as usize];
    for (i, j) in entries() {
        for (from, to) in [(i, j), (j, i)] {
            neighbours[next[from] as usize] = to as u32;
            next[from] += 1;
        }
    }
    ordering::order(&Graph {
        offsets: &offsets,
        neighbours: &neighbours,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// −Δ on a path of n vertices with its ends held, plus 1e-3 on the diagonal.
    fn path(n: usize) -> LowerTriangle {
        let mut matrix = LowerTriangle {
            offsets: vec![0],
            rows: vec![],
            values: vec![],
        };
        for j in 0..n {
            matrix.rows.push(j as u32);
            matrix.values.push(2.001);
            if j + 1 < n {
                matrix.rows.push(j as u32 + 1);
                matrix.values.push(-1.0);
            }
            matrix.offsets.push(matrix.rows.len());
        }
        matrix
    }

    #[test]
    fn indefinite_and_non_finite_matrices_are_refused() {
        let mut indefinite = path(50);
        indefinite.values[20] = -5.0;
        let mut infinite = path(50);
        infinite.values[20] = f64::INFINITY;
        for matrix in [indefinite, infinite] {
            let error = Cholesky::factor(&matrix).map(|_| ()).unwrap_err();
            assert_eq!(error, LinearError::NotPositiveDefinite { unknowns: 50 });
        }
    }

    #[test]
    fn a_factor_of_another_matrix_fails_the_check_solve() {
        let mut cholesky = Cholesky::factor(&path(40)).unwrap();
        let mut other = path(40);
        other.values[12] *= 1.001;
        assert!(matches!(
            cholesky.check(&other),
            Err(LinearError::Inaccurate { .. })
        ));
    }
}
