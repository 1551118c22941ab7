//! Errors of factorizations and iterations.

use thiserror::Error;

/// An error while solving a sparse system.
#[derive(Clone, Copy, PartialEq, Debug, Error)]
#[non_exhaustive]
pub enum SparseError {
    /// The arrays do not form the lower triangle of a matrix.
    #[error(
        "column {column} of the lower triangle is malformed: its rows must ascend from the diagonal, stay below the number of columns, and have one value each"
    )]
    Malformed {
        /// The first invalid column.
        column: usize,
    },
    /// The pattern of the matrix differs from the analysed one.
    #[error("the matrix does not have the pattern that was analysed; analyse it anew")]
    DifferentPattern,
    /// The matrix cannot be factorized.
    #[error(
        "the system of {unknowns} unknowns cannot be factorized: it is not positive definite in double precision"
    )]
    NotPositiveDefinite {
        /// Number of unknowns.
        unknowns: usize,
    },
    /// The factorization does not reproduce its matrix.
    #[error(
        "the factorization of {unknowns} unknowns is not accurate: a check solve left a relative residual of {residual:.1e}"
    )]
    Inaccurate {
        /// Number of unknowns.
        unknowns: usize,
        /// Normwise backward error of the check solve.
        residual: f64,
    },
    /// The iteration did not reach its tolerance.
    #[error(
        "the iteration for {unknowns} unknowns did not converge: a relative residual of {residual:.1e} is left"
    )]
    NotConverged {
        /// Number of unknowns.
        unknowns: usize,
        /// The largest remaining ratio |residual| / |right-hand side|.
        residual: f64,
    },
    /// Not enough memory.
    #[error("not enough memory for a system of {unknowns} unknowns ({bytes} bytes for the factor)")]
    OutOfMemory {
        /// Number of unknowns.
        unknowns: usize,
        /// Size of the factor in bytes.
        bytes: u64,
    },
}
