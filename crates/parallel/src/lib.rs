//! Parallel loops over slices that produce the same bytes for any number of threads.
//!
//! Two rules make them deterministic:
//!
//! - an entry depends only on its own index and on data that the loop does not change;
//! - a sum is split into [`Chunks`] of a fixed size, whose partial sums are added in order.
//!
//! Neither depends on how rayon distributes the work. A loop of a single chunk runs on the
//! calling thread, because waking another thread costs more than it saves.
//!
//! ```
//! use cotan_parallel as parallel;
//!
//! let squares = parallel::filled(10_000, |i| (i * i) as f64);
//! let mut roots = vec![0.0; squares.len()];
//! let mut halves = vec![0.0; squares.len()];
//! parallel::update((&mut roots[..], &mut halves[..]), |i, (root, half)| {
//!     *root = squares[i].sqrt();
//!     *half = 0.5 * squares[i];
//! });
//! let sum: f64 = parallel::Chunks::of(1024).sum(roots.len(), |i| roots[i]);
//! assert_eq!(sum, 9_999.0 * 5_000.0);
//! ```

mod chunks;
mod slices;
mod threads;

pub use chunks::Chunks;
pub use slices::Slices;
pub use threads::{ThreadError, Threads, num_threads, on_threads};

use rayon::prelude::*;

/// Sets `out[i] = value(i)`.
pub fn fill<A: Send>(out: &mut [A], value: impl Fn(usize) -> A + Sync) {
    GRAIN.fill(out, value);
}

/// Returns a vector of `len` entries with `value(i)` at index `i`.
pub fn filled<A: Send>(len: usize, value: impl Fn(usize) -> A + Sync + Send) -> Vec<A> {
    GRAIN.filled(len, value)
}

/// Calls `change(i, entries)` for every index `i`, with the entries of one or more slices of the
/// same length.
///
/// # Panics
/// If the slices have different lengths.
pub fn update<S: Slices>(slices: S, change: impl Fn(usize, S::Entry) + Sync) {
    GRAIN.update(slices, change);
}

/// Returns the maximum of zero and all `value(i)`, or NaN if any of them is NaN.
///
/// `f64::max` ignores NaN, which a convergence test must not do.
pub fn max(len: usize, value: impl Fn(usize) -> f64 + Sync) -> f64 {
    GRAIN.max(len, value)
}

/// Returns true if `holds(i)` for all i < `len`.
pub fn all(len: usize, holds: impl Fn(usize) -> bool + Sync + Send) -> bool {
    GRAIN.all(len, holds)
}

/// Returns the values of `pick(i)` for i < `len` in order, leaving out each `None`.
pub fn filter_map<A: Send>(len: usize, pick: impl Fn(usize) -> Option<A> + Sync + Send) -> Vec<A> {
    GRAIN.filter_map(len, pick)
}

/// Sorts the entries. Equal entries may be reordered, so they should be interchangeable.
pub fn sort_unstable<A: Ord + Send>(entries: &mut [A]) {
    entries.par_sort_unstable();
}

/// Runs `a` and `b`, possibly in parallel, and returns both results.
pub fn join<A: Send, B: Send>(
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (A, B) {
    rayon::join(a, b)
}

/// Runs `work` on each item as a separate task, and returns the results in order.
pub fn tasks<A: Send, R: Send>(items: Vec<A>, work: impl Fn(A) -> R + Sync + Send) -> Vec<R> {
    items.into_par_iter().with_max_len(1).map(work).collect()
}

/// Entries per task for loops whose result does not depend on it: about ten microseconds of work.
const GRAIN: Chunks = Chunks::of(2048);

/// Runs the example of the README as a doc test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;
