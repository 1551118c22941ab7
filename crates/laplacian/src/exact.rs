//! Weights whose sums are exact, so that L·1 = 0.

use cotan_geometry::{Scalar, scalar};
use cotan_halfedge::{EdgeId, HalfedgeMap, HalfedgeMesh};
use rayon::prelude::*;

use crate::rings::OneRings;

/// Rounds every weight to a multiple of a power of two that is coarse enough for all sums around
/// its two ends to be exact in T.
///
/// With q_i = 2^k the unit in the last place of 4 Σ_j |w_ij|, every partial sum of multiples of
/// q_i that stays below 2 Σ |w_ij| is representable. An edge takes the coarser unit of its ends,
/// which keeps symmetric weights symmetric. What is lost is of the order of the rounding error of
/// the row's sum.
pub(crate) fn round_to_exact_sums<T: Scalar>(
    rings: &OneRings,
    mesh: &HalfedgeMesh,
    weights: &mut HalfedgeMap<T>,
) {
    let units = exact_units(rings, weights);
    weights
        .as_mut_slice()
        .par_chunks_exact_mut(2)
        .enumerate()
        .with_min_len(1 << 12)
        .for_each(|(edge, pair)| {
            let [a, b] = mesh
                .edge_vertices(EdgeId::new(edge))
                .map(|v| units[v.index()]);
            pair.iter_mut().for_each(|w| *w = round_to(*w, a.max(b)));
        });
}

/// q_i of every vertex, 0 where all weights are.
pub(crate) fn exact_units<T: Scalar>(rings: &OneRings, weights: &HalfedgeMap<T>) -> Vec<T> {
    let eps = T::default_epsilon();
    let unit = |i| {
        let size = rings
            .ring(i)
            .fold(T::zero(), |sum, (_, h)| sum + weights[h].abs());
        if size > T::zero() {
            eps * scalar(size.as_f64().log2().ceil().exp2() * 4.0)
        } else {
            T::zero()
        }
    };
    (0..rings.num_vertices())
        .into_par_iter()
        .with_min_len(1 << 11)
        .map(unit)
        .collect()
}

/// The nearest multiple of `unit`; the weight itself where that is 0.
pub(crate) fn round_to<T: Scalar>(weight: T, unit: T) -> T {
    if unit > T::zero() {
        (weight / unit).round() * unit
    } else {
        weight
    }
}
