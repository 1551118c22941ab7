//! Rounding of weights so that their sums are exact and L·1 = 0 holds.

use cotan_geometry::{Scalar, scalar};
use cotan_halfedge::{EdgeId, HalfedgeMap};
use cotan_parallel as parallel;

use crate::graph::Graph;

/// Rounds each weight to a multiple of a power of two that is coarse enough to make all sums
/// around both of its ends exact in T. `weights` are stored row by row.
///
/// With q_i = 2^k the unit in the last place of 4 Σ_j |w_ij|, every partial sum of multiples of
/// q_i below 2 Σ |w_ij| is representable. An edge takes the coarser unit of its ends, which keeps
/// symmetric weights symmetric. The loss is of the order of the rounding error of the row sum.
pub(crate) fn round_to_exact_sums<T: Scalar>(graph: &Graph, weights: &mut [T]) {
    let units = exact_units(graph, weights);
    let mut left = weights;
    let mut blocks = Vec::with_capacity(graph.num_rows().div_ceil(ROWS));
    for first in (0..graph.num_rows()).step_by(ROWS) {
        let rows = first..graph.num_rows().min(first + ROWS);
        let num_entries = rows.clone().map(|i| graph.range(i).len()).sum();
        let (block, after) = std::mem::take(&mut left).split_at_mut(num_entries);
        left = after;
        blocks.push((rows, block));
    }
    parallel::tasks(blocks, |(rows, block)| {
        let entries = rows.flat_map(|i| graph.row(i).map(move |(j, _)| (i, j.index())));
        for (weight, (i, j)) in block.iter_mut().zip(entries) {
            *weight = round_to(*weight, units[i].max(units[j]));
        }
    });
}

/// Rows per task.
const ROWS: usize = 2048;

/// Calls `change` with the two values of each edge, in parallel.
pub(crate) fn update_edges<T: Send>(
    map: &mut HalfedgeMap<T>,
    change: impl Fn(EdgeId, &mut [T; 2]) + Sync,
) {
    let (pairs, _) = map.as_mut_slice().as_chunks_mut::<2>();
    parallel::update(pairs, |edge, pair| change(EdgeId::new(edge), pair));
}

/// The unit q_i of each row, or 0 if all its weights are 0.
pub(crate) fn exact_units<T: Scalar>(graph: &Graph, weights: &[T]) -> Vec<T> {
    let eps = T::default_epsilon();
    let unit = |i| {
        let row = &weights[graph.range(i)];
        let size = row.iter().fold(T::zero(), |sum, w| sum + w.abs());
        if size > T::zero() {
            eps * scalar(4.0 * power_above(size.as_f64()))
        } else {
            T::zero()
        }
    };
    parallel::filled(graph.num_rows(), unit)
}

/// Returns the smallest power of two that is not below the positive `size`, or `size` itself if
/// it is subnormal.
fn power_above(size: f64) -> f64 {
    const EXPONENT: u64 = 0x7ff << 52;
    let power = f64::from_bits(size.to_bits() & EXPONENT);
    if power == size {
        power
    } else if power > 0.0 {
        2.0 * power
    } else {
        size
    }
}

/// Rounds `weight`, which must be less than `unit` / ε, to the nearest multiple of `unit`.
/// Returns it unchanged if `unit` is 0.
pub(crate) fn round_to<T: Scalar>(weight: T, unit: T) -> T {
    if unit > T::zero() {
        // Numbers as large as `grid` are multiples of `unit`, so the sum is rounded to one.
        let grid = unit * (scalar::<T>(1.5) / T::default_epsilon());
        (weight + grid) - grid
    } else {
        weight
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_of_two_are_found_without_logarithms() {
        for size in [1.0, 1.1, 1.999, 2.0, 3.7e-9, 6.02e23, f64::MIN_POSITIVE] {
            let expected = size.log2().ceil().exp2();
            assert_eq!(power_above(size), expected, "{size}");
        }
        assert_eq!(power_above(f64::INFINITY), f64::INFINITY);
        assert!(power_above(1e-320) > 0.0);
    }

    #[test]
    fn rounds_to_the_nearest_multiple() {
        let unit = 2.0f64.powi(-30);
        for weight in [0.0, 0.3, -0.7, 1e-10, 1e5] {
            let expected = (weight / unit).round_ties_even() * unit;
            assert_eq!(round_to(weight, unit), expected, "{weight}");
        }
        let (weight, unit) = (0.3f32, 2.0f32.powi(-20));
        assert_eq!(
            round_to(weight, unit),
            (weight / unit).round_ties_even() * unit
        );
        assert_eq!(round_to(0.3, 0.0), 0.3);
    }
}
