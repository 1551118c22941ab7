//! Matrices with the pattern of L: a vertex and its one-ring.

use cotan_laplacian::Graph;
use cotan_sparse::LowerTriangle;

use crate::error::LinearError;
use crate::weights::Weights;

/// Assembles W + diag(d) over all vertices.
///
/// Ground vertices are cut off: their entries off the diagonal are zeros that stay in the
/// pattern, so that every matrix of a mesh has the same analysis. `diagonal` is given the vertex
/// and Σ_j W_ij and returns the diagonal entry.
pub(crate) fn assemble(
    graph: &Graph,
    weights: &Weights,
    is_ground: impl Fn(usize) -> bool,
    diagonal: impl Fn(usize, f64) -> f64,
) -> Result<LowerTriangle, LinearError> {
    let n = graph.num_rows();
    let entries = graph.num_entries() / 2 + n;
    let mut offsets = Vec::with_capacity(n + 1);
    let mut rows = Vec::with_capacity(entries);
    let mut values = Vec::with_capacity(entries);
    offsets.push(0);
    for i in 0..n {
        let place = values.len();
        rows.push(i as u32);
        values.push(0.0);
        let mut sum = 0.0;
        for k in graph.range(i) {
            let (j, w) = (
                graph.neighbours()[k].index(),
                weights.symmetric(graph, i, k),
            );
            sum += w;
            // The rows are sorted.
            if j > i {
                let is_cut = is_ground(i) || is_ground(j);
                rows.push(j as u32);
                values.push(if is_cut { 0.0 } else { -w });
            }
        }
        values[place] = diagonal(i, sum);
        offsets.push(rows.len());
    }
    Ok(LowerTriangle::new(offsets, rows, values)?)
}
