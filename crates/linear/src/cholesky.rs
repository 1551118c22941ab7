//! Sparse Cholesky by faer: symbolic once, numeric once, solves without allocation.
//!
//! Kept to the calls that were found right (notes on faer 0.24): AMD ordering, one thread (parallel
//! mode has open reports of silently wrong results, faer-rs issue 273), the lower triangle only,
//! and one check solve after every factorization.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{FaerError, SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};

use nalgebra::Vector3;

use crate::error::LinearError;
use crate::normal::LowerTriangle;

/// Right-hand sides that a solve takes at once: x, y and z.
const COLUMNS: usize = 3;

/// A factorized symmetric positive definite matrix and the memory that its solves need.
pub(crate) struct Cholesky {
    symbolic: Arc<SymbolicCholesky<usize>>,
    values: Vec<f64>,
    scratch: MemBuffer,
    /// Three columns one after the other.
    columns: Vec<f64>,
}

impl Cholesky {
    pub(crate) fn factor(matrix: &LowerTriangle) -> Result<Self, LinearError> {
        Self::factor_by(matrix, CholeskySymbolicParams::default())
    }

    fn factor_by(
        matrix: &LowerTriangle,
        params: CholeskySymbolicParams<'_>,
    ) -> Result<Self, LinearError> {
        let n = matrix.offsets.len() - 1;
        let out_of_memory = |bytes| LinearError::OutOfMemory { unknowns: n, bytes };
        let pattern =
            SymbolicSparseColMatRef::new_checked(n, n, &matrix.offsets, None, &matrix.rows);
        let symbolic =
            factorize_symbolic_cholesky(pattern, Side::Lower, SymmetricOrdering::Amd, params)
                .map_err(|error| match error {
                    FaerError::OutOfMemory => out_of_memory(0),
                    _ => LinearError::NotPositiveDefinite { unknowns: n },
                })?;
        Self::of_pattern(Arc::new(symbolic), matrix)
    }

    /// Factorizes another matrix of the same pattern beside this one; the analysis is shared.
    pub(crate) fn factor_like(&self, matrix: &LowerTriangle) -> Result<Self, LinearError> {
        Self::of_pattern(self.symbolic.clone(), matrix)
    }

    fn of_pattern(
        symbolic: Arc<SymbolicCholesky<usize>>,
        matrix: &LowerTriangle,
    ) -> Result<Self, LinearError> {
        let n = matrix.offsets.len() - 1;
        let out_of_memory = |bytes| LinearError::OutOfMemory { unknowns: n, bytes };
        let len = symbolic.len_val();
        let bytes = len.saturating_mul(size_of::<f64>());
        let mut values = Vec::new();
        values
            .try_reserve_exact(len)
            .map_err(|_| out_of_memory(bytes))?;
        values.resize(len, 0.0);
        let request = symbolic.solve_in_place_scratch::<f64>(COLUMNS, Par::Seq);
        let scratch = MemBuffer::try_new(request).map_err(|_| out_of_memory(bytes))?;
        let mut cholesky = Self {
            symbolic,
            values,
            scratch,
            columns: vec![0.0; COLUMNS * n],
        };
        cholesky.refactor(matrix)?;
        Ok(cholesky)
    }

    /// Factorizes another matrix of the same pattern.
    pub(crate) fn refactor(&mut self, matrix: &LowerTriangle) -> Result<(), LinearError> {
        let n = matrix.offsets.len() - 1;
        if matrix.values.iter().any(|v| !v.is_finite()) {
            return Err(LinearError::NotPositiveDefinite { unknowns: n });
        }
        let pattern =
            SymbolicSparseColMatRef::new_checked(n, n, &matrix.offsets, None, &matrix.rows);
        let request = self
            .symbolic
            .factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default());
        let mut memory = MemBuffer::try_new(request).map_err(|_| LinearError::OutOfMemory {
            unknowns: n,
            bytes: self.values.len().saturating_mul(size_of::<f64>()),
        })?;
        self.symbolic
            .factorize_numeric_llt(
                &mut self.values,
                SparseColMatRef::new(pattern, &matrix.values),
                Side::Lower,
                LltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut memory),
                Spec::default(),
            )
            .map_err(|_| LinearError::NotPositiveDefinite { unknowns: n })?;
        drop(memory);
        self.check(matrix)
    }

    /// Number of values stored in the factor.
    pub(crate) fn num_entries(&self) -> usize {
        self.values.len()
    }

    /// Overwrites right-hand sides by their solutions: x, y and z are three systems.
    pub(crate) fn solve(&mut self, rhs: &mut [Vector3<f64>]) {
        let n = self.symbolic.nrows();
        for (i, b) in rhs.iter().enumerate() {
            for axis in 0..COLUMNS {
                self.columns[axis * n + i] = b[axis];
            }
        }
        LltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut self.columns, n, COLUMNS),
            Par::Seq,
            MemStack::new(&mut self.scratch),
        );
        for (i, x) in rhs.iter_mut().enumerate() {
            *x = Vector3::from_fn(|axis, _| self.columns[axis * n + i]);
        }
    }

    /// Solves one right-hand side and measures the backward error |Mx − b| / (|M||x| + |b|).
    fn check(&mut self, matrix: &LowerTriangle) -> Result<(), LinearError> {
        // A stable factorization has a backward error of a few times 1e-16 whatever the condition
        // number; the reported silent failures left 1e-4.
        const WORST: f64 = 1e-10;
        let n = matrix.offsets.len() - 1;
        // A fixed sequence without structure: multiples of the golden ratio, mod 1.
        let b: Vec<f64> = (0..n)
            .map(|i| (i as f64 * 0.618_033_988_749_895).fract() - 0.5)
            .collect();
        let mut solution: Vec<_> = b.iter().map(|&b| Vector3::new(b, 0.0, 0.0)).collect();
        self.solve(&mut solution);
        let x: Vec<f64> = solution.iter().map(|x| x.x).collect();
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

#[cfg(test)]
mod tests {
    use faer::sparse::linalg::SupernodalThreshold;

    use super::*;

    /// −Δ on a path of n vertices with its ends held, plus 1e-3 on the diagonal.
    fn path(n: usize) -> LowerTriangle {
        let mut matrix = LowerTriangle {
            offsets: vec![0],
            rows: vec![],
            values: vec![],
        };
        for j in 0..n {
            matrix.rows.push(j);
            matrix.values.push(2.001);
            if j + 1 < n {
                matrix.rows.push(j + 1);
                matrix.values.push(-1.0);
            }
            matrix.offsets.push(matrix.rows.len());
        }
        matrix
    }

    fn solves(matrix: &LowerTriangle, threshold: SupernodalThreshold) {
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: threshold,
            ..CholeskySymbolicParams::default()
        };
        let n = matrix.offsets.len() - 1;
        let mut cholesky = Cholesky::factor_by(matrix, params).unwrap();
        let rhs: Vec<Vector3<f64>> = (0..n)
            .map(|i| Vector3::new(i as f64, 2.0 * i as f64, 0.5 - i as f64).map(f64::sin))
            .collect();
        let mut solution = rhs.clone();
        cholesky.solve(&mut solution);
        for axis in 0..COLUMNS {
            let x: Vec<f64> = solution.iter().map(|x| x[axis]).collect();
            let mut product = vec![0.0; n];
            matrix.multiply(&x, &mut product);
            assert!(
                product
                    .iter()
                    .zip(&rhs)
                    .all(|(p, b)| (p - b[axis]).abs() < 1e-10)
            );
        }
    }

    #[test]
    fn simplicial_and_supernodal_solve_alike() {
        for n in [1, 2, 300] {
            solves(&path(n), SupernodalThreshold::FORCE_SIMPLICIAL);
            solves(&path(n), SupernodalThreshold::FORCE_SUPERNODAL);
            solves(&path(n), SupernodalThreshold::AUTO);
        }
    }

    #[test]
    fn indefinite_and_non_finite_matrices_are_refused() {
        let mut indefinite = path(50);
        indefinite.values[20] = -5.0;
        let mut infinite = path(50);
        infinite.values[20] = f64::INFINITY;
        for matrix in [indefinite, infinite] {
            for threshold in [
                SupernodalThreshold::FORCE_SIMPLICIAL,
                SupernodalThreshold::FORCE_SUPERNODAL,
            ] {
                let params = CholeskySymbolicParams {
                    supernodal_flop_ratio_threshold: threshold,
                    ..CholeskySymbolicParams::default()
                };
                let error = Cholesky::factor_by(&matrix, params)
                    .map(|_| ())
                    .unwrap_err();
                assert_eq!(error, LinearError::NotPositiveDefinite { unknowns: 50 });
            }
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
