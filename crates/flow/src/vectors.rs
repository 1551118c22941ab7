//! Passes over all vertices whose result does not depend on the number of threads: entries depend
//! on their own number alone, and sums are cut into chunks of a fixed size, added in order.

use nalgebra::Vector3;
use rayon::prelude::*;

/// Entries that one task works on.
pub(crate) const CHUNK: usize = 1024;

/// out_i = value(i).
pub(crate) fn fill<A: Send>(out: &mut [A], value: impl Fn(usize) -> A + Sync) {
    update(out, |i, entry| *entry = value(i));
}

/// Calls `change` with the number and the value of every entry.
pub(crate) fn update<A: Send>(out: &mut [A], change: impl Fn(usize, &mut A) + Sync) {
    let [] = update_summing(out, |i, entry| {
        change(i, entry);
        []
    });
}

/// As [`update`]; the sums of what `change` returns.
pub(crate) fn update_summing<A: Send, const N: usize>(
    out: &mut [A],
    change: impl Fn(usize, &mut A) -> [f64; N] + Sync,
) -> [f64; N] {
    let of_chunk = |(chunk, entries): (usize, &mut [A])| {
        let mut sums = [0.0; N];
        for (k, entry) in entries.iter_mut().enumerate() {
            add(&mut sums, &change(chunk * CHUNK + k, entry));
        }
        sums
    };
    let partial: Vec<[f64; N]> = out
        .par_chunks_mut(CHUNK)
        .enumerate()
        .map(of_chunk)
        .collect();
    let mut sums = [0.0; N];
    partial.iter().for_each(|part| add(&mut sums, part));
    sums
}

/// Calls `change` with the number and the entries of two slices of one length.
pub(crate) fn update_both<A: Send, B: Send>(
    a: &mut [A],
    b: &mut [B],
    change: impl Fn(usize, &mut A, &mut B) + Sync,
) {
    a.par_chunks_mut(CHUNK)
        .zip(b.par_chunks_mut(CHUNK))
        .enumerate()
        .for_each(|(chunk, (a, b))| {
            for (k, (a, b)) in a.iter_mut().zip(b).enumerate() {
                change(chunk * CHUNK + k, a, b);
            }
        });
}

fn add<const N: usize>(sums: &mut [f64; N], terms: &[f64; N]) {
    for (sum, term) in sums.iter_mut().zip(terms) {
        *sum += term;
    }
}

/// All coordinates, one vector after another.
pub(crate) fn flat(vectors: &[Vector3<f64>]) -> &[f64] {
    bytemuck::cast_slice(vectors)
}

/// All coordinates, one vector after another, to change.
pub(crate) fn flat_mut(vectors: &mut [Vector3<f64>]) -> &mut [f64] {
    bytemuck::cast_slice_mut(vectors)
}

/// The inner products of `a` with others, read once: for the chunks of a longer vector.
#[inline]
pub(crate) fn dots<const N: usize>(a: &[f64], others: [&[f64]; N]) -> [f64; N] {
    /// Partial sums that do not wait for each other.
    const LANES: usize = 4;
    let mut sums = [[0.0; LANES]; N];
    let (whole, last) = a.as_chunks::<LANES>();
    let others = others.map(|b| b[..a.len()].as_chunks::<LANES>());
    for (at, a) in whole.iter().enumerate() {
        for (sum, (b, _)) in sums.iter_mut().zip(&others) {
            for k in 0..LANES {
                sum[k] += a[k] * b[at][k];
            }
        }
    }
    for (sum, (_, b)) in sums.iter_mut().zip(&others) {
        for (a, b) in last.iter().zip(*b) {
            sum[0] += a * b;
        }
    }
    sums.map(|sum| sum.iter().sum())
}

/// The sums of lists of one length, entry by entry, in their order.
pub(crate) fn total(lists: Vec<Vec<f64>>) -> Vec<f64> {
    lists
        .into_iter()
        .reduce(|mut sums, list| {
            sums.iter_mut().zip(list).for_each(|(sum, x)| *sum += x);
            sums
        })
        .unwrap_or_default()
}

/// Σ a_i · b_i.
pub(crate) fn dot(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    let chunks = flat(a).par_chunks(CHUNK).zip(flat(b).par_chunks(CHUNK));
    let partial: Vec<f64> = chunks.map(|(a, b)| dots(a, [b])[0]).collect();
    partial.into_iter().sum()
}

/// a += factor · b.
pub(crate) fn add_scaled(a: &mut [Vector3<f64>], factor: f64, b: &[Vector3<f64>]) {
    update(a, |i, a| *a += b[i] * factor);
}

/// The greatest of some lengths.
pub(crate) fn longest(n: usize, length: impl Fn(usize) -> f64 + Sync) -> f64 {
    // `f64::max` drops a NaN, which must not pass for convergence.
    let greater = |m: f64, x: f64| if x > m || x.is_nan() { x } else { m };
    let of_chunk = |chunk: usize| {
        let entries = chunk * CHUNK..n.min((chunk + 1) * CHUNK);
        entries.map(&length).fold(0.0, greater)
    };
    let chunks = (0..n.div_ceil(CHUNK)).into_par_iter().map(of_chunk);
    chunks.reduce(|| 0.0, greater)
}
