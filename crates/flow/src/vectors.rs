//! Vectors as the flat arrays of their coordinates, and sums over them.

use cotan_parallel::{self as parallel, Chunks};
use nalgebra::Vector3;

/// Entries that one task works on, and that a partial sum is of.
pub(crate) const CHUNKS: Chunks = Chunks::of(1024);

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
    let partial = CHUNKS.map((flat(a), flat(b)), |_, (a, b)| dots(a, [b])[0]);
    partial.into_iter().sum()
}

/// a += factor · b.
pub(crate) fn add_scaled(a: &mut [Vector3<f64>], factor: f64, b: &[Vector3<f64>]) {
    parallel::update((a, b), |_, (a, b)| *a += b * factor);
}
