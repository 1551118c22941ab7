//! Loops over slices, split into chunks of a fixed size.

use std::iter::Sum;

use rayon::prelude::*;

use crate::slices::Slices;

/// A chunk size: the number of entries that one task processes.
///
/// Each chunk has its own partial sum, so a different size rounds sums differently. The size must
/// be a constant; it must never depend on the number of threads.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Chunks(usize);

impl Chunks {
    /// Chunks of `size` entries; the last one may be shorter.
    ///
    /// # Panics
    /// If `size` is 0.
    pub const fn of(size: usize) -> Self {
        assert!(size > 0, "a chunk has at least one entry");
        Self(size)
    }

    /// The number of entries per chunk.
    pub const fn size(self) -> usize {
        self.0
    }

    /// Calls `work` with the index of the first entry and the entries of each chunk, and returns
    /// the results in order. An empty slice has no chunks.
    ///
    /// # Panics
    /// If the slices have different lengths.
    pub fn map<S: Slices, R: Send>(
        self,
        slices: S,
        work: impl Fn(usize, S) -> R + Sync + Send,
    ) -> Vec<R> {
        match slices.num_entries() {
            0 => Vec::new(),
            len if len <= self.0 => vec![work(0, slices)],
            _ => {
                let chunks = self.cut(slices).into_par_iter();
                chunks.map(|(first, chunk)| work(first, chunk)).collect()
            }
        }
    }

    /// Like [`Self::map`], but passes a scratch space that is created about once per thread.
    ///
    /// The results must not depend on what earlier chunks left in the scratch space.
    ///
    /// # Panics
    /// If the slices have different lengths.
    pub fn map_with<S: Slices, W, R: Send>(
        self,
        slices: S,
        scratch: impl Fn() -> W + Sync + Send,
        work: impl Fn(&mut W, usize, S) -> R + Sync + Send,
    ) -> Vec<R> {
        match slices.num_entries() {
            0 => Vec::new(),
            len if len <= self.0 => vec![work(&mut scratch(), 0, slices)],
            _ => {
                let chunks = self.cut(slices).into_par_iter();
                let results =
                    chunks.map_init(scratch, |space, (first, chunk)| work(space, first, chunk));
                results.collect()
            }
        }
    }

    /// Like [`Self::map`], but without results.
    ///
    /// # Panics
    /// If the slices have different lengths.
    pub fn for_each<S: Slices>(self, slices: S, work: impl Fn(usize, S) + Sync + Send) {
        match slices.num_entries() {
            0 => {}
            len if len <= self.0 => work(0, slices),
            _ => {
                let chunks = self.cut(slices).into_par_iter();
                chunks.for_each(|(first, chunk)| work(first, chunk));
            }
        }
    }

    /// Sets `out[i] = value(i)`.
    pub fn fill<A: Send>(self, out: &mut [A], value: impl Fn(usize) -> A + Sync) {
        self.update(out, |i, entry| *entry = value(i));
    }

    /// Returns a vector of `len` entries with `value(i)` at index `i`.
    pub fn filled<A: Send>(self, len: usize, value: impl Fn(usize) -> A + Sync + Send) -> Vec<A> {
        if len <= self.0 {
            return (0..len).map(value).collect();
        }
        let indices = (0..len).into_par_iter().with_min_len(self.0);
        indices.map(value).collect()
    }

    /// Returns the values of `pick(i)` for i < `len` in order, leaving out each `None`.
    pub fn filter_map<A: Send>(
        self,
        len: usize,
        pick: impl Fn(usize) -> Option<A> + Sync + Send,
    ) -> Vec<A> {
        let parts = self.map(0..len, |_, indices| {
            indices.filter_map(&pick).collect::<Vec<A>>()
        });
        let mut parts = parts.into_iter();
        let mut picked = parts.next().unwrap_or_default();
        parts.for_each(|part| picked.extend(part));
        picked
    }

    /// Calls `change(i, entries)` for every index `i`, with the entries of one or more slices at
    /// that index.
    ///
    /// # Panics
    /// If the slices have different lengths.
    pub fn update<S: Slices>(self, slices: S, change: impl Fn(usize, S::Entry) + Sync) {
        self.for_each(slices, |first, chunk| {
            chunk.for_each_entry(|k, entry| change(first + k, entry));
        });
    }

    /// Like [`Self::update`], and returns the sums of the values returned by `change`.
    ///
    /// # Panics
    /// If the slices have different lengths.
    pub fn update_summing<S: Slices, const N: usize>(
        self,
        slices: S,
        change: impl Fn(usize, S::Entry) -> [f64; N] + Sync,
    ) -> [f64; N] {
        let partial = self.map(slices, |first, chunk| {
            let mut sums = [0.0; N];
            chunk.for_each_entry(|k, entry| add(&mut sums, &change(first + k, entry)));
            sums
        });
        total(&partial)
    }

    /// Returns the sum of `term(i)` for i < `len`.
    ///
    /// Sum single-precision values in `f64`: a sum of a million `f32` terms keeps only about four
    /// digits.
    pub fn sum<S: Sum + Send>(self, len: usize, term: impl Fn(usize) -> S + Sync) -> S {
        let partial = self.map(0..len, |_, indices| indices.map(&term).sum::<S>());
        partial.into_iter().sum()
    }

    /// Returns the maximum of zero and all `value(i)`, or NaN if any of them is NaN.
    pub fn max(self, len: usize, value: impl Fn(usize) -> f64 + Sync) -> f64 {
        let greater = |m: f64, x: f64| if x > m || x.is_nan() { x } else { m };
        let partial = self.map(0..len, |_, indices| indices.map(&value).fold(0.0, greater));
        partial.into_iter().fold(0.0, greater)
    }

    /// Returns true if `holds(i)` for all i < `len`.
    pub fn all(self, len: usize, holds: impl Fn(usize) -> bool + Sync + Send) -> bool {
        if len <= self.0 {
            return (0..len).all(holds);
        }
        let indices = (0..len).into_par_iter().with_min_len(self.0);
        indices.all(holds)
    }

    /// The chunks, each with the index of its first entry.
    fn cut<S: Slices>(self, slices: S) -> Vec<(usize, S)> {
        let len = slices.num_entries();
        let mut chunks = Vec::with_capacity(len.div_ceil(self.0));
        let (mut first, mut rest) = (0, slices);
        while len - first > self.0 {
            let (chunk, behind) = rest.split(self.0);
            chunks.push((first, chunk));
            (first, rest) = (first + self.0, behind);
        }
        chunks.push((first, rest));
        chunks
    }
}

/// Adds the partial sums in order.
fn total<const N: usize>(partial: &[[f64; N]]) -> [f64; N] {
    let mut sums = [0.0; N];
    partial.iter().for_each(|part| add(&mut sums, part));
    sums
}

fn add<const N: usize>(sums: &mut [f64; N], terms: &[f64; N]) {
    for (sum, term) in sums.iter_mut().zip(terms) {
        *sum += term;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::on_threads;

    const CHUNKS: Chunks = Chunks::of(64);

    #[test]
    fn same_bytes_for_any_number_of_threads() {
        let len = 10 * CHUNKS.size() + 17;
        let term = |i: usize| (i as f64).sin();
        let run = || {
            let mut both = (vec![0.0; len], vec![0.0; len]);
            let sums = CHUNKS.update_summing((&mut both.0[..], &mut both.1[..]), |i, (a, b)| {
                (*a, *b) = (term(i), term(i).cos());
                [*a, *b]
            });
            let sum: f64 = CHUNKS.sum(len, term);
            (sum.to_bits(), sums.map(f64::to_bits), both)
        };
        assert_eq!(on_threads(1, run).unwrap(), on_threads(3, run).unwrap());
    }

    #[test]
    fn what_is_picked_stays_in_order() {
        for len in [0, 1, 64, 65, 1000] {
            let pick = |i: usize| (i % 7 != 3).then_some(2 * i);
            let picked = on_threads(3, || CHUNKS.filter_map(len, pick)).unwrap();
            assert_eq!(picked, (0..len).filter_map(pick).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_scratch_space_serves_chunk_after_chunk() {
        let len = 10 * CHUNKS.size() + 17;
        let total = |space: &mut Vec<usize>, _, indices: std::ops::Range<usize>| {
            space.clear();
            space.extend(indices);
            space.iter().sum::<usize>()
        };
        let run = || CHUNKS.map_with(0..len, Vec::new, total);
        let expected = CHUNKS.map(0..len, |_, indices| indices.sum::<usize>());
        assert_eq!(on_threads(1, run).unwrap(), expected);
        assert_eq!(on_threads(3, run).unwrap(), expected);
    }

    #[test]
    fn a_sum_is_that_of_its_chunks() {
        let len = 3 * CHUNKS.size() + 5;
        let term = |i: usize| (i as f64).sqrt();
        let expected: f64 = (0..len)
            .collect::<Vec<_>>()
            .chunks(CHUNKS.size())
            .map(|chunk| chunk.iter().map(|&i| term(i)).sum::<f64>())
            .sum();
        assert_eq!(CHUNKS.sum::<f64>(len, term), expected);
    }

    #[test]
    fn chunks_cover_all_entries_once_and_in_order() {
        for len in [0, 1, 63, 64, 65, 128, 1000] {
            let numbers: Vec<usize> = (0..len).collect();
            let mut seen = vec![0; len];
            let firsts = CHUNKS.map(
                (&numbers[..], &mut seen[..], 0..len),
                |first, (numbers, seen, range)| {
                    assert_eq!((numbers.len(), seen.len()), (range.len(), range.len()));
                    seen.iter_mut().for_each(|count| *count += 1);
                    assert_eq!((first, numbers[0]), (range.start, range.start));
                    first
                },
            );
            assert!(seen.iter().all(|&count| count == 1));
            assert!(firsts.is_sorted());
            assert_eq!(firsts.len(), len.div_ceil(CHUNKS.size()));
        }
    }

    #[test]
    fn several_outputs_get_the_entries_of_one_index() {
        let len = 200;
        let (mut a, mut b, mut c, mut d) = (vec![0; len], vec![0; len], vec![0; len], vec![0; len]);
        let outputs = (&mut a[..], &mut b[..], &mut c[..], &mut d[..]);
        CHUNKS.update(outputs, |i, (a, b, c, d)| {
            (*a, *b, *c, *d) = (i, 2 * i, 3 * i, 4 * i);
        });
        for i in 0..len {
            assert_eq!([a[i], b[i], c[i], d[i]], [i, 2 * i, 3 * i, 4 * i]);
        }
    }

    #[test]
    fn a_nan_is_the_largest_number() {
        let value = |i: usize| if i == 70 { f64::NAN } else { i as f64 };
        assert!(CHUNKS.max(200, value).is_nan());
        assert_eq!(CHUNKS.max(70, value), 69.0);
        assert_eq!(CHUNKS.max(0, value), 0.0);
        assert_eq!(CHUNKS.max(10, |_| -1.0), 0.0);
    }

    #[test]
    #[should_panic(expected = "slices of one length")]
    fn slices_of_different_lengths_are_refused() {
        CHUNKS.update((&mut [0; 3][..], &mut [0; 4][..]), |_, _| {});
    }
}
