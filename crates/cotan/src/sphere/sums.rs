//! Sums over all elements whose result does not depend on the number of threads.

use std::iter::Sum;

use cotan_parallel::Chunks;

/// Σ f(i) for i < n: partial sums of fixed chunks, added in order.
pub(crate) fn sum<V: Sum + Send>(n: usize, f: impl Fn(usize) -> V + Sync) -> V {
    Chunks::of(4096).sum(n, f)
}

/// The greatest f(i) for i < n; NaN if any is.
pub(crate) fn max(n: usize, f: impl Fn(usize) -> f64 + Sync) -> f64 {
    cotan_parallel::max(n, f)
}
