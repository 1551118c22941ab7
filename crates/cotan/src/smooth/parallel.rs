//! Parallel filling of maps, with the same bytes for any number of threads.

use cotan_halfedge::{DenseMap, Id};
use cotan_parallel::Chunks;

/// Entries per task. Entries are expensive here.
const GRAIN: Chunks = Chunks::of(512);

/// Sets each entry from its id alone, in parallel.
pub(crate) fn fill_each<I: Id, V: Send>(out: &mut DenseMap<I, V>, value: impl Fn(I) -> V + Sync) {
    GRAIN.fill(out.as_mut_slice(), |i| value(I::new(i)));
}

/// Creates a map of `len` entries, each computed from its id alone.
pub(crate) fn filled<I: Id, V: Send>(
    len: usize,
    value: impl Fn(I) -> V + Sync + Send,
) -> DenseMap<I, V> {
    DenseMap::from_vec(GRAIN.filled(len, |i| value(I::new(i))))
}
