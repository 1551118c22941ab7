//! Sparse Cholesky factorization: multifrontal, with parallel subtrees, and with solves for three
//! right-hand sides that stream the factor.
//!
//! The dense kernels for large fronts are faer's, one thread each. The rest is our own, because
//! faer's sparse factorization processes the supernodes sequentially and its solve stays far
//! below memory bandwidth.

mod dense;
mod numeric;
mod packed;
mod solve;
mod symbolic;
mod tasks;

pub use numeric::Precision;
pub(crate) use numeric::{Factor, FactorError};
pub(crate) use solve::Buffers;
pub use symbolic::Symbolic;

#[cfg(test)]
mod tests;
