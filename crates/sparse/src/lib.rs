//! Symmetric positive definite sparse systems A x = b in double precision.
//!
//! - [`Cholesky`]: a factorization. The pattern is analysed once ([`Symbolic`]: nested
//!   dissection, elimination tree, supernodes) and reused for every matrix with that pattern;
//!   solves stream the factor for three right-hand sides at once.
//! - [`Multigrid`]: conjugate gradients preconditioned by smoothed aggregation, for matrices
//!   whose factor would not fit into memory.
//!
//! | modules | content |
//! |---|---|
//! | `lower`, `csr` | matrices: a lower triangle, compressed rows |
//! | `ordering` | nested dissection, and minimum degree in its leaves |
//! | `factor` | analysis of a pattern, numeric factorization, solves |
//! | `cholesky` | the factorization of one matrix |
//! | `multigrid` | smoothed aggregation and conjugate gradients |
//! | `pool`, `error` | reused work space; the errors |
//!
//! Both are solved through `&self`: each solve takes its memory from a pool and returns it, so
//! that nothing of the size of the matrix is allocated after the first one. The results do not
//! depend on the number of threads.
//!
//! ```
//! use cotan_sparse::{Cholesky, LowerTriangle};
//!
//! // [2 −1; −1 2]
//! let matrix = LowerTriangle::new(vec![0, 2, 3], vec![0, 1, 1], vec![2.0, -1.0, 2.0])?;
//! let cholesky = Cholesky::factor(&matrix)?;
//! let mut x = [3.0, 0.0];
//! cholesky.solve_one(&mut x);
//! assert!((x[0] - 2.0).abs() < 1e-12 && (x[1] - 1.0).abs() < 1e-12);
//! # Ok::<(), cotan_sparse::SparseError>(())
//! ```

mod cholesky;
mod csr;
mod error;
mod factor;
mod lower;
mod multigrid;
mod ordering;
mod pool;

pub use cholesky::Cholesky;
pub use error::SparseError;
pub use factor::{Precision, Symbolic};
pub use lower::LowerTriangle;
pub use multigrid::Multigrid;

/// Runs the example of the README as a doc test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;
