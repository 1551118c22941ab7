//! The one-ring matrix itself, where one vertex holds the whole mesh.
//!
//! With a symmetric L, one hard handle and nothing else, min |L(x + δ) − ℓ|² is solved exactly by
//! L δ = y − mean(y), y = ℓ − Lx, δ = 0 at the handle: the columns of L sum to zero, so a right-hand
//! side can be fulfilled but for its mean. The factor of L has a third to a quarter of the entries
//! of that of LᵀL, and half of its condition number's digits are saved.

use cotan_geometry::Scalar;
use cotan_laplacian::{OneRings, Operator, Symmetry};
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::handles::{Handle, Hold};
use crate::normal::{LowerTriangle, Weights};
use crate::system::Membrane;

/// Whether the one-ring matrix can stand for the normal equations. One handle that holds all means
/// one component, which [`crate::handles::check`] has made sure of.
pub(crate) fn serves<T: Scalar>(
    operator: &Operator<T>,
    handles: &[Handle],
    membrane: Option<Membrane<'_>>,
) -> bool {
    let is_single = matches!(
        handles,
        [Handle {
            hold: Hold::Hard,
            ..
        }]
    );
    is_single
        && operator.symmetry() == Symmetry::Symmetric
        && membrane.is_none_or(|m| m.weight == 0.0)
}

/// Assembles D − L restricted to the free vertices; without D if there is none.
pub(crate) fn assemble(
    rings: &OneRings,
    weights: &Weights,
    free: &[usize],
    free_index: &[Option<usize>],
    diagonal: Option<&[f64]>,
) -> LowerTriangle {
    let mut matrix = LowerTriangle {
        offsets: Vec::with_capacity(free.len() + 1),
        rows: Vec::with_capacity(rings.halfedges().len() / 2 + free.len()),
        values: Vec::with_capacity(rings.halfedges().len() / 2 + free.len()),
    };
    matrix.offsets.push(0);
    for (column, &i) in free.iter().enumerate() {
        let mut row = weights.row(rings, i);
        let own = row.next().map_or(0.0, |(_, d)| -d);
        matrix.rows.push(column);
        matrix.values.push(own + diagonal.map_or(0.0, |d| d[i]));
        // The unknowns ascend with the vertices, and the rings are sorted.
        for (j, w) in row {
            if let Some(unknown) = free_index[j]
                && unknown > column
            {
                matrix.rows.push(unknown);
                matrix.values.push(-w);
            }
        }
        matrix.offsets.push(matrix.rows.len());
    }
    matrix
}

/// The mean, by partial sums in a fixed order.
pub(crate) fn mean(values: &[Vector3<f64>]) -> Vector3<f64> {
    let sums: Vec<Vector3<f64>> = values
        .par_chunks(4096)
        .map(|chunk| chunk.iter().sum())
        .collect();
    sums.iter().sum::<Vector3<f64>>() / values.len().max(1) as f64
}
