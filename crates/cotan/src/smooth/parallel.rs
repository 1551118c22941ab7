//! Maps filled entry by entry, the same bytes for any number of threads.

use cotan_halfedge::{DenseMap, Id};
use rayon::prelude::*;

/// Sets every entry from its id alone, in parallel.
pub(crate) fn fill_each<I: Id, V: Send>(out: &mut DenseMap<I, V>, value: impl Fn(I) -> V + Sync) {
    out.as_mut_slice()
        .par_iter_mut()
        .enumerate()
        .with_min_len(1 << 9)
        .for_each(|(i, out)| *out = value(I::new(i)));
}

/// A new map of `len` entries, each from its id alone.
pub(crate) fn filled<I: Id, V: Send>(len: usize, value: impl Fn(I) -> V + Sync) -> DenseMap<I, V> {
    let values = (0..len)
        .into_par_iter()
        .with_min_len(1 << 9)
        .map(|i| value(I::new(i)));
    DenseMap::from_vec(values.collect())
}
