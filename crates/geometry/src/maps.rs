//! Parallel filling of dense maps, and sums over ids.

use std::iter::Sum;

use cotan_halfedge::{DenseMap, Id};
use cotan_parallel::{self as parallel, Chunks};
use num_traits::Zero;

/// Sets each entry to `value(id)`, with the same result for any number of threads.
pub fn fill<I: Id, V: Send>(out: &mut DenseMap<I, V>, value: impl Fn(I) -> V + Sync) {
    parallel::fill(out.as_mut_slice(), |i| value(I::new(i)));
}

/// Creates a map of `len` entries `value(id)`.
pub fn filled<I: Id, V: Send>(len: usize, value: impl Fn(I) -> V + Sync + Send) -> DenseMap<I, V> {
    DenseMap::from_vec(parallel::filled(len, |i| value(I::new(i))))
}

/// Sets `out` to `value(id)` for the ids below `len`, replacing the map if its length differs.
pub(crate) fn refill<I: Id, V: Zero + Copy + Send>(
    out: &mut DenseMap<I, V>,
    len: usize,
    value: impl Fn(I) -> V + Sync,
) {
    resize(out, len);
    fill(out, value);
}

/// Sets `out` to `len` zeros.
pub(crate) fn clear<I: Id, V: Zero + Copy>(out: &mut DenseMap<I, V>, len: usize) {
    resize(out, len);
    out.as_mut_slice().fill(V::zero());
}

/// Returns the sum of `term(id)` over the ids below `len`.
///
/// Sum in `f64`: a sum of a million `f32` terms keeps only about four digits.
pub(crate) fn sum<I: Id, S: Sum + Send>(len: usize, term: impl Fn(I) -> S + Sync) -> S {
    const CHUNKS: Chunks = Chunks::of(2048);
    CHUNKS.sum(len, |i| term(I::new(i)))
}

/// Replaces `out` if its length differs from `len`.
fn resize<I: Id, V: Zero + Copy>(out: &mut DenseMap<I, V>, len: usize) {
    if out.len() != len {
        *out = DenseMap::filled(len, V::zero());
    }
}

#[cfg(test)]
mod tests {
    use cotan_halfedge::{VertexId, VertexMap};

    use super::*;

    #[test]
    fn a_map_of_another_length_is_replaced() {
        let mut map = VertexMap::filled(2, 0.0);
        refill(&mut map, 5, |v: VertexId| v.index() as f64);
        assert_eq!(map.as_slice(), [0.0, 1.0, 2.0, 3.0, 4.0]);
    }
}
