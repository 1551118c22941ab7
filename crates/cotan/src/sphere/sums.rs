//! Sums over all elements whose result does not depend on the number of threads.

use std::ops::Add;

use num_traits::Zero;
use rayon::prelude::*;

/// Σ f(i) for i < n: partial sums of fixed chunks, added in order.
pub(crate) fn sum<V: Zero + Add<Output = V> + Send>(n: usize, f: impl Fn(usize) -> V + Sync) -> V {
    const CHUNK: usize = 4096;
    (0..n.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let range = chunk * CHUNK..n.min((chunk + 1) * CHUNK);
            range.fold(V::zero(), |sum, i| sum + f(i))
        })
        .collect::<Vec<_>>()
        .into_iter()
        .fold(V::zero(), |sum, part| sum + part)
}

/// The greatest f(i) for i < n; NaN if any is.
pub(crate) fn max(n: usize, f: impl Fn(usize) -> f64 + Sync + Send) -> f64 {
    (0..n)
        .into_par_iter()
        .with_min_len(1 << 12)
        .map(f)
        .reduce(|| 0.0, |a, b| if b > a || b.is_nan() { b } else { a })
}
