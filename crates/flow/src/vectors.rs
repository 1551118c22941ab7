//! Sums over all vertices whose result does not depend on the number of threads.

use nalgebra::Vector3;
use rayon::prelude::*;

/// Entries summed by one task; partial sums are added in order.
const CHUNK: usize = 4096;

/// Σ a_i · b_i.
pub(crate) fn dot(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    a.par_chunks(CHUNK)
        .zip(b.par_chunks(CHUNK))
        .map(|(a, b)| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>())
        .collect::<Vec<_>>()
        .into_iter()
        .sum()
}

/// a += factor · b.
pub(crate) fn add_scaled(a: &mut [Vector3<f64>], factor: f64, b: &[Vector3<f64>]) {
    a.par_iter_mut()
        .with_min_len(CHUNK)
        .zip(b)
        .for_each(|(a, b)| *a += b * factor);
}

/// Σ of plain numbers, in fixed chunks.
pub(crate) fn sum(values: &[f64]) -> f64 {
    values
        .par_chunks(CHUNK)
        .map(|chunk| chunk.iter().sum::<f64>())
        .collect::<Vec<_>>()
        .into_iter()
        .sum()
}

/// The longest vector.
pub(crate) fn max_norm(a: &[Vector3<f64>]) -> f64 {
    // `f64::max` drops a NaN, which must not pass for convergence.
    a.iter()
        .map(Vector3::norm_squared)
        .fold(0.0, |m: f64, x| if x > m || x.is_nan() { x } else { m })
        .sqrt()
}
