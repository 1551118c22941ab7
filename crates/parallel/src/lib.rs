//! Parallel loops over slices that give the same bytes for any number of threads.
//!
//! Two rules make them deterministic:
//!
//! - an entry is written from its own index and from data that the loop does not change;
//! - a sum is cut into [`Chunks`] of a fixed size, whose partial sums are added in order.
//!
//! Neither depends on how rayon shares out the work. Loops of one chunk run on the calling thread,
//! because waking another one costs more than it saves.
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

/// A vector of `len` entries `value(i)`.
pub fn filled<A: Send>(len: usize, value: impl Fn(usize) -> A + Sync + Send) -> Vec<A> {
    GRAIN.filled(len, value)
}

/// Calls `change(i, entries)` with the entries `i` of one or several slices of the same length.
///
/// # Panics
/// If the slices have different lengths.
pub fn update<S: Slices>(slices: S, change: impl Fn(usize, S::Entry) + Sync) {
    GRAIN.update(slices, change);
}

/// The largest of the numbers `value(i)` and zero; NaN if any of them is NaN.
///
/// `f64::max` ignores a NaN, which a test for convergence must not.
pub fn max(len: usize, value: impl Fn(usize) -> f64 + Sync) -> f64 {
    GRAIN.max(len, value)
}

/// Whether `holds(i)` for all i < `len`.
pub fn all(len: usize, holds: impl Fn(usize) -> bool + Sync + Send) -> bool {
    GRAIN.all(len, holds)
}

/// The values of `pick(i)` for i < `len`, in order, without the `None`.
pub fn filter_map<A: Send>(len: usize, pick: impl Fn(usize) -> Option<A> + Sync + Send) -> Vec<A> {
    GRAIN.filter_map(len, pick)
}

/// Sorts the entries. Equal ones may change places, so they should be the same in all that counts.
pub fn sort_unstable<A: Ord + Send>(entries: &mut [A]) {
    entries.par_sort_unstable();
}

/// Runs `a` and `b`, perhaps at the same time, and returns both results.
pub fn join<A: Send, B: Send>(
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (A, B) {
    rayon::join(a, b)
}

/// Runs `work` on every item, each as a task of its own, and returns the results in order.
pub fn tasks<A: Send, R: Send>(items: Vec<A>, work: impl Fn(A) -> R + Sync + Send) -> Vec<R> {
    items.into_par_iter().with_max_len(1).map(work).collect()
}

/// Entries per task where the result does not depend on it: about ten microseconds of work.
const GRAIN: Chunks = Chunks::of(2048);

/// Runs the example of the README as a doc test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;
