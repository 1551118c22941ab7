//! Sums over all elements whose result does not depend on the number of threads.

use std::iter::Sum;

use cotan_parallel::Chunks;

/// Returns Σ f(i) for i < n, as partial sums of fixed chunks added in order.
pub(crate) fn sum<V: Sum + Send>(n: usize, f: impl Fn(usize) -> V + Sync) -> V {
    Chunks::of(4096).sum(n, f)
}

/// Returns the largest f(i) for i < n, or NaN if any of them is NaN.
pub(crate) fn max(n: usize, f: impl Fn(usize) -> f64 + Sync) -> f64 {
    cotan_parallel::max(n, f)
}
