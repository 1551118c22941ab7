//! Errors of factorizations and iterations.

use thiserror::Error;

/// Why a sparse system could not be solved.
#[derive(Clone, Copy, PartialEq, Debug, Error)]
#[non_exhaustive]
pub enum SparseError {
    /// Arrays that are not the lower triangle of a matrix.
    #[error(
        "column {column} of the lower triangle is malformed: its rows must ascend from the diagonal, stay below the number of columns, and have one value each"
    )]
    Malformed {
        /// The first column at fault.
        column: usize,
    },
    /// A matrix with another pattern than the one that was analysed.
    #[error("the matrix does not have the pattern that was analysed; analyse it anew")]
    DifferentPattern,
    /// A matrix that cannot be factorized.
    #[error(
        "the system of {unknowns} unknowns cannot be factorized: it is not positive definite in double precision"
    )]
    NotPositiveDefinite {
        /// Number of unknowns.
        unknowns: usize,
    },
    /// A factorization that does not reproduce its matrix.
    #[error(
        "the factorization of {unknowns} unknowns is not accurate: a check solve left a relative residual of {residual:.1e}"
    )]
    Inaccurate {
        /// Number of unknowns.
        unknowns: usize,
        /// Normwise backward error of the check solve.
        residual: f64,
    },
    /// An iteration that did not reach its tolerance.
    #[error(
        "the iteration for {unknowns} unknowns did not converge: a relative residual of {residual:.1e} is left"
    )]
    NotConverged {
        /// Number of unknowns.
        unknowns: usize,
        /// The largest |residual| / |right-hand side| that is left.
        residual: f64,
    },
    /// Not enough memory.
    #[error("not enough memory for a system of {unknowns} unknowns ({bytes} bytes for the factor)")]
    OutOfMemory {
        /// Number of unknowns.
        unknowns: usize,
        /// Size of the factor.
        bytes: u64,
    },
}
