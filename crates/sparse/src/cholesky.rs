//! Factorized matrices: analysed once, factorized and solved any number of times, and checked.

use std::collections::TryReserveError;
use std::sync::Arc;

use cotan_parallel as parallel;
use nalgebra::Vector3;

use crate::csr::Csr;
use crate::error::SparseError;
use crate::factor::{Buffers, Factor, FactorError, Precision, Symbolic};
use crate::lower::LowerTriangle;
use crate::pool::Pool;

/// A factorized symmetric positive definite matrix.
pub struct Cholesky {
    factor: Factor,
    /// For a factor in single precision: the matrix, for the refinement of solutions.
    matrix: Option<Csr>,
    pool: Pool<Work>,
}

/// The memory of a solve.
struct Work {
    buffers: Buffers,
    /// For a factor in single precision: a right-hand side and its residual.
    rhs: Vec<Vector3<f64>>,
    residual: Vec<Vector3<f64>>,
}

impl std::fmt::Debug for Cholesky {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Cholesky")
            .field("unknowns", &self.factor.symbolic().num_unknowns())
            .field("entries", &self.num_entries())
            .finish_non_exhaustive()
    }
}

impl Cholesky {
    /// Orders, analyses and factorizes a matrix.
    ///
    /// # Errors
    /// [`SparseError`] if the matrix is not positive definite or too large, or if a check solve
    /// finds the factor inaccurate.
    pub fn factor(matrix: &LowerTriangle) -> Result<Self, SparseError> {
        let symbolic = Symbolic::of(matrix)?;
        Self::with_analysis(Arc::new(symbolic), matrix, Precision::Double)
    }

    /// Factorizes a matrix whose pattern has been analysed.
    ///
    /// # Errors
    /// As for [`Self::factor`], and [`SparseError::DifferentPattern`].
    pub fn with_analysis(
        symbolic: Arc<Symbolic>,
        matrix: &LowerTriangle,
        precision: Precision,
    ) -> Result<Self, SparseError> {
        check(&symbolic, matrix)?;
        let unknowns = symbolic.num_unknowns();
        let bytes = symbolic.num_entries() as u64 * precision.bytes() + symbolic.work_bytes();
        check_room(bytes).map_err(|_| SparseError::OutOfMemory { unknowns, bytes })?;
        let factor = Factor::new(symbolic, &matrix.values, precision).map_err(|e| match e {
            FactorError::NotPositive => SparseError::NotPositiveDefinite { unknowns },
            FactorError::OutOfMemory => SparseError::OutOfMemory { unknowns, bytes },
        })?;
        let cholesky = Self {
            factor,
            matrix: (precision == Precision::Single).then(|| Csr::from_lower(matrix)),
            pool: Pool::new(),
        };
        cholesky.check_solve(matrix)?;
        Ok(cholesky)
    }

    /// Factorizes another matrix of the same pattern into a new factor that shares the analysis.
    ///
    /// # Errors
    /// As for [`Self::with_analysis`].
    pub fn factor_like(&self, matrix: &LowerTriangle) -> Result<Self, SparseError> {
        let precision = self.factor.precision();
        Self::with_analysis(self.factor.symbolic().clone(), matrix, precision)
    }

    /// Factorizes another matrix of the same pattern in place.
    ///
    /// After an error the factor is unusable.
    ///
    /// # Errors
    /// As for [`Self::with_analysis`].
    pub fn refactor(&mut self, matrix: &LowerTriangle) -> Result<(), SparseError> {
        check(self.factor.symbolic(), matrix)?;
        self.factor
            .refactor(&matrix.values)
            .map_err(|_| SparseError::NotPositiveDefinite {
                unknowns: matrix.num_unknowns(),
            })?;
        if self.matrix.is_some() {
            self.matrix = Some(Csr::from_lower(matrix));
        }
        self.check_solve(matrix)
    }

    /// Number of values stored in the factor.
    pub fn num_entries(&self) -> usize {
        self.factor.symbolic().num_entries()
    }

    /// Overwrites right-hand sides with their solutions; x, y and z are three systems.
    ///
    /// # Panics
    /// If there is not one entry per unknown.
    pub fn solve(&self, rhs: &mut [Vector3<f64>]) {
        self.solve_between(rhs, |_, b| *b, |_, x| x);
    }

    /// Like [`Self::solve`], but applies `before` to the index and value of every entry to get
    /// the right-hand side, and `after` to the solution to get the output.
    ///
    /// This saves passes over the vectors.
    ///
    /// # Panics
    /// If there is not one entry per unknown.
    pub fn solve_between(
        &self,
        rhs: &mut [Vector3<f64>],
        before: impl Fn(usize, &Vector3<f64>) -> Vector3<f64> + Sync,
        after: impl Fn(usize, Vector3<f64>) -> Vector3<f64> + Sync,
    ) {
        self.check_len(rhs.len());
        self.pool.with(
            || self.work(),
            |work| match &self.matrix {
                None => self
                    .factor
                    .solve_between(rhs, before, after, &mut work.buffers),
                Some(matrix) => {
                    parallel::update(&mut *rhs, |i, x| *x = before(i, x));
                    self.solve_refined(rhs, matrix, work);
                    parallel::update(rhs, |i, x| *x = after(i, *x));
                }
            },
        );
    }

    /// Overwrites one right-hand side with its solution.
    ///
    /// # Panics
    /// If there is not one entry per unknown.
    pub fn solve_one(&self, x: &mut [f64]) {
        self.check_len(x.len());
        if self.matrix.is_none() {
            let solve = |work: &mut Work| self.factor.solve_one(x, &mut work.buffers);
            return self.pool.with(|| self.work(), solve);
        }
        let mut vectors: Vec<_> = x.iter().map(|&x| Vector3::new(x, 0.0, 0.0)).collect();
        self.solve(&mut vectors);
        x.iter_mut().zip(&vectors).for_each(|(x, v)| *x = v.x);
    }

    /// Solves with one step of iterative refinement, for a factor in single precision.
    fn solve_refined(&self, x: &mut [Vector3<f64>], matrix: &Csr, work: &mut Work) {
        let Work {
            buffers,
            rhs,
            residual,
        } = work;
        rhs.copy_from_slice(x);
        self.factor.solve(x, buffers);
        parallel::fill(residual, |i| rhs[i] - matrix.product(i, x));
        self.factor.solve(residual, buffers);
        parallel::update((x, &residual[..]), |_, (x, r)| *x += r);
    }

    fn work(&self) -> Work {
        let symbolic = self.factor.symbolic();
        let len = self.matrix.as_ref().map_or(0, |_| symbolic.num_unknowns());
        Work {
            buffers: Buffers::new(symbolic),
            rhs: vec![Vector3::zeros(); len],
            residual: vec![Vector3::zeros(); len],
        }
    }

    fn check_len(&self, len: usize) {
        let unknowns = self.factor.symbolic().num_unknowns();
        assert_eq!(len, unknowns, "one entry per unknown");
    }

    /// Solves one right-hand side and checks the backward error |Mx − b| / (|M||x| + |b|).
    fn check_solve(&self, matrix: &LowerTriangle) -> Result<(), SparseError> {
        // A stable factorization has a backward error of a few times 1e-16, whatever the
        // condition number.
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
            return Err(SparseError::Inaccurate {
                unknowns: n,
                residual,
            });
        }
        Ok(())
    }
}

/// Checks that the system can provide this much memory.
fn check_room(bytes: u64) -> Result<(), TryReserveError> {
    let bytes = usize::try_from(bytes).unwrap_or(usize::MAX);
    Vec::<u8>::new().try_reserve_exact(bytes)
}

/// Checks that the matrix has the analysed pattern and finite values.
///
/// # Errors
/// [`SparseError::DifferentPattern`], and [`SparseError::NotPositiveDefinite`] if a value is not
/// finite.
fn check(symbolic: &Symbolic, matrix: &LowerTriangle) -> Result<(), SparseError> {
    if !symbolic.is_of(matrix) {
        return Err(SparseError::DifferentPattern);
    }
    matrix.check_finite()
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
            assert_eq!(error, SparseError::NotPositiveDefinite { unknowns: 50 });
        }
    }

    #[test]
    fn a_factor_of_another_matrix_fails_the_check_solve() {
        let cholesky = Cholesky::factor(&path(40)).unwrap();
        let mut other = path(40);
        other.values[12] *= 1.001;
        assert!(matches!(
            cholesky.check_solve(&other),
            Err(SparseError::Inaccurate { .. })
        ));
    }
}
