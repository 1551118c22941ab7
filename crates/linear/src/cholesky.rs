//! Sparse Cholesky by faer: symbolic once, numeric once, solves without allocation.
//!
//! Kept to the calls that were found right (notes on faer 0.24): AMD ordering, one thread (parallel
//! mode has open reports of silently wrong results, faer-rs issue 273), the lower triangle only,
//! and one check solve after every factorization.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{FaerError, SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};

use crate::error::LinearError;
use crate::normal::LowerTriangle;

/// Right-hand sides that a solve takes at once: x, y and z.
pub(crate) const COLUMNS: usize = 3;

/// A factorized symmetric positive definite matrix and the memory that its solves need.
pub(crate) struct Cholesky {
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
    scratch: MemBuffer,
}

impl Cholesky {
    pub(crate) fn factor(matrix: &LowerTriangle) -> Result<Self, LinearError> {
        let n = matrix.offsets.len() - 1;
        if matrix.values.iter().any(|v| !v.is_finite()) {
            return Err(LinearError::NotPositiveDefinite { unknowns: n });
        }
        let out_of_memory = |bytes| LinearError::OutOfMemory { unknowns: n, bytes };
        let pattern =
            SymbolicSparseColMatRef::new_checked(n, n, &matrix.offsets, None, &matrix.rows);
        let symbolic = factorize_symbolic_cholesky(
            pattern,
            Side::Lower,
            SymmetricOrdering::Amd,
            CholeskySymbolicParams::default(),
        )
        .map_err(|error| match error {
            FaerError::OutOfMemory => out_of_memory(0),
            _ => LinearError::NotPositiveDefinite { unknowns: n },
        })?;

        let len = symbolic.len_val();
        let bytes = len.saturating_mul(size_of::<f64>());
        let mut values = Vec::new();
        values.try_reserve_exact(len).map_err(|_| out_of_memory(bytes))?;
        values.resize(len, 0.0);
        let request = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default());
        let mut memory = MemBuffer::try_new(request).map_err(|_| out_of_memory(bytes))?;
        symbolic
            .factorize_numeric_llt(
                &mut values,
                SparseColMatRef::new(pattern, &matrix.values),
                Side::Lower,
                LltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut memory),
                Spec::default(),
            )
            .map_err(|_| LinearError::NotPositiveDefinite { unknowns: n })?;
        drop(memory);

        let request = symbolic.solve_in_place_scratch::<f64>(COLUMNS, Par::Seq);
        let scratch = MemBuffer::try_new(request).map_err(|_| out_of_memory(bytes))?;
        let mut cholesky = Self { symbolic, values, scratch };
        cholesky.check(matrix)?;
        Ok(cholesky)
    }

    /// Number of values stored in the factor.
    pub(crate) fn num_entries(&self) -> usize {
        self.values.len()
    }

    /// Overwrites `rhs`, three columns one after the other, by the solution.
    pub(crate) fn solve_in_place(&mut self, rhs: &mut [f64]) {
        let n = self.symbolic.nrows();
        LltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(rhs, n, COLUMNS),
            Par::Seq,
            MemStack::new(&mut self.scratch),
        );
    }

    /// Solves one right-hand side and measures the backward error |Mx − b| / (|M||x| + |b|).
    fn check(&mut self, matrix: &LowerTriangle) -> Result<(), LinearError> {
        // A stable factorization has a backward error of a few times 1e-16 whatever the condition
        // number; the reported silent failures left 1e-4.
        const WORST: f64 = 1e-10;
        let n = matrix.offsets.len() - 1;
        // A fixed sequence without structure: multiples of the golden ratio, mod 1.
        let b: Vec<f64> = (0..n).map(|i| (i as f64 * 0.618_033_988_749_895).fract() - 0.5).collect();
        let mut x = vec![0.0; COLUMNS * n];
        x[..n].copy_from_slice(&b);
        self.solve_in_place(&mut x);
        let mut product = vec![0.0; n];
        matrix.multiply(&x[..n], &mut product);
        let max_norm = |v: &[f64]| v.iter().fold(0.0f64, |m, a| m.max(a.abs()));
        let error = product.iter().zip(&b).fold(0.0f64, |m, (p, b)| m.max((p - b).abs()));
        let residual = error / (matrix.norm() * max_norm(&x[..n]) + max_norm(&b));
        if n > 0 && !(residual <= WORST && x.iter().all(|v| v.is_finite())) {
            return Err(LinearError::Inaccurate { unknowns: n, residual });
        }
        Ok(())
    }
}
