//! Sparse Cholesky factorization of our own: multifrontal, by subtrees side by side, with solves
//! of three right-hand sides that stream the factor.
//!
//! The dense kernels of large fronts are faer's, one thread each; what is around them is ours,
//! because faer's sparse factorization works through the supernodes one after the other and its
//! solve stays far from the memory's speed.

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
