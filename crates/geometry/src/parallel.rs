//! Filling maps and adding up in parallel, with the same bytes whatever the number of threads.
//!
//! A map entry depends on its own id alone; a sum is cut into chunks of a fixed size whose
//! partial sums are added in order. Neither depends on how rayon shares out the work.

use std::iter::Sum;

use cotan_halfedge::{DenseMap, Id};
use num_traits::Zero;
use rayon::prelude::*;

/// Sets `out` to `value(id)` for the ids below `len`, in parallel if it is long.
pub(crate) fn fill<I: Id, V: Zero + Copy + Send>(
    out: &mut DenseMap<I, V>,
    len: usize,
    value: impl Fn(I) -> V + Sync,
) {
    resize(out, len);
    let fill_chunk = |(chunk, entries): (usize, &mut [V])| {
        for (i, entry) in entries.iter_mut().enumerate() {
            *entry = value(I::new(chunk * CHUNK + i));
        }
    };
    let entries = out.as_mut_slice();
    if len < PARALLEL_FROM {
        entries.chunks_mut(CHUNK).enumerate().for_each(fill_chunk);
    } else {
        entries
            .par_chunks_mut(CHUNK)
            .enumerate()
            .for_each(fill_chunk);
    }
}

/// Sets `out` to `len` zeros.
pub(crate) fn clear<I: Id, V: Zero + Copy>(out: &mut DenseMap<I, V>, len: usize) {
    resize(out, len);
    out.as_mut_slice().fill(V::zero());
}

/// A new map of `len` entries `value(id)`.
pub(crate) fn filled<I: Id, V: Zero + Copy + Send>(
    len: usize,
    value: impl Fn(I) -> V + Sync,
) -> DenseMap<I, V> {
    let mut out = DenseMap::default();
    fill(&mut out, len, value);
    out
}

/// The sum of `term(id)` over the ids below `len`.
///
/// Callers add in `f64`: a sum of a million `f32` terms would keep four digits.
pub(crate) fn sum<I: Id, S: Sum + Send>(len: usize, term: impl Fn(I) -> S + Sync) -> S {
    let sum_chunk = |chunk: usize| -> S {
        let ids = chunk * CHUNK..len.min((chunk + 1) * CHUNK);
        ids.map(|i| term(I::new(i))).sum()
    };
    let num_chunks = len.div_ceil(CHUNK);
    if len < PARALLEL_FROM {
        (0..num_chunks).map(sum_chunk).sum()
    } else {
        let partial: Vec<S> = (0..num_chunks).into_par_iter().map(sum_chunk).collect();
        partial.into_iter().sum()
    }
}

/// Replaces `out` if it has another length.
fn resize<I: Id, V: Zero + Copy>(out: &mut DenseMap<I, V>, len: usize) {
    if out.len() != len {
        *out = DenseMap::filled(len, V::zero());
    }
}

/// Entries a task works on: some ten microseconds of work, well above the cost of handing it over.
const CHUNK: usize = 2048;

/// Below this length waking other threads costs more than they save.
const PARALLEL_FROM: usize = 4 * CHUNK;

#[cfg(test)]
mod tests {
    use cotan_halfedge::{VertexId, VertexMap};

    use super::*;

    #[test]
    fn same_bytes_whatever_the_number_of_threads() {
        let len = 10 * CHUNK + 17;
        let term = |v: VertexId| (v.index() as f64).sin();
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("a thread pool").install(|| {
                let map: VertexMap<f64> = filled(len, term);
                (sum(len, term).to_bits(), map)
            })
        };
        assert_eq!(run(1), run(3));
    }

    #[test]
    fn a_map_of_another_length_is_replaced() {
        let mut map = VertexMap::filled(2, 0.0);
        fill(&mut map, 5, |v: VertexId| v.index() as f64);
        assert_eq!(map.as_slice(), [0.0, 1.0, 2.0, 3.0, 4.0]);
    }
}
