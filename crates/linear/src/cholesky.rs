//! Factorized matrices: analysed once, factorized and solved as often as asked, and checked.

use std::sync::Arc;

use nalgebra::Vector3;

use crate::error::LinearError;
use crate::normal::LowerTriangle;
use crate::ordering::{self, Graph};
use crate::sparse::{Buffers, Factor, FactorError, Precision, Symbolic};

/// A factorized symmetric positive definite matrix and the memory that its solves need.
pub(crate) struct Cholesky {
    factor: Factor,
    buffers: Buffers,
}

impl Cholesky {
    /// Orders, analyses and factorizes a matrix.
    pub(crate) fn factor(matrix: &LowerTriangle) -> Result<Self, LinearError> {
        let symbolic = Symbolic::analyse(matrix, order(matrix));
        Self::with_analysis(Arc::new(symbolic), matrix)
    }

    /// Factorizes another matrix of the same pattern beside this one; the analysis is shared.
    pub(crate) fn factor_like(&self, matrix: &LowerTriangle) -> Result<Self, LinearError> {
        Self::with_analysis(self.factor.symbolic().clone(), matrix)
    }

    fn with_analysis(symbolic: Arc<Symbolic>, matrix: &LowerTriangle) -> Result<Self, LinearError> {
        check_finite(matrix)?;
        let bytes = symbolic.num_entries().saturating_mul(size_of::<f64>());
        let buffers = Buffers::new(&symbolic);
        let factor = Factor::new(symbolic, &matrix.values, Precision::Double)
            .map_err(|error| refusal(error, matrix, bytes))?;
        let mut cholesky = Self { factor, buffers };
        cholesky.check(matrix)?;
        Ok(cholesky)
    }

    /// Factorizes another matrix of the same pattern in place of this one.
    pub(crate) fn refactor(&mut self, matrix: &LowerTriangle) -> Result<(), LinearError> {
        check_finite(matrix)?;
        let bytes = self.factor.bytes();
        self.factor
            .refactor(&matrix.values)
            .map_err(|error| refusal(error, matrix, bytes))?;
        self.check(matrix)
    }

    /// Number of values stored in the factor.
    pub(crate) fn num_entries(&self) -> usize {
        self.factor.symbolic().num_entries()
    }

    /// Overwrites right-hand sides by their solutions: x, y and z are three systems.
    pub(crate) fn solve(&mut self, rhs: &mut [Vector3<f64>]) {
        self.factor.solve(rhs, &mut self.buffers);
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

fn check_finite(matrix: &LowerTriangle) -> Result<(), LinearError> {
    if matrix.values.iter().any(|v| !v.is_finite()) {
        return Err(LinearError::NotPositiveDefinite {
            unknowns: matrix.offsets.len() - 1,
        });
    }
    Ok(())
}

fn refusal(error: FactorError, matrix: &LowerTriangle, bytes: usize) -> LinearError {
    let unknowns = matrix.offsets.len() - 1;
    match error {
        FactorError::NotPositive => LinearError::NotPositiveDefinite { unknowns },
        FactorError::OutOfMemory => LinearError::OutOfMemory { unknowns, bytes },
    }
}

/// A fill-reducing order for the matrix.
pub(crate) fn order(matrix: &LowerTriangle) -> Vec<u32> {
    let n = matrix.offsets.len() - 1;
    let entries = || {
        (0..n).flat_map(|j| {
            let rows = &matrix.rows[matrix.offsets[j]..matrix.offsets[j + 1]];
            rows.iter().filter(move |&&i| i != j).map(move |&i| (i, j))
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
