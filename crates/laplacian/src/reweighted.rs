//! Operators that differ from another in their weights alone.

use cotan_geometry::Scalar;
use cotan_halfedge::VertexId;

use crate::graph::{Graph, RowId};
use crate::operator::Operator;
use crate::scheme::{SchemeError, Symmetry};

impl<T: Scalar> Operator<T> {
    /// The operator with other weights on the same graph: `weight(i, j, w_ij)` for every entry.
    ///
    /// For schemes that change the weights of another scheme, whatever its graph.
    ///
    /// # Errors
    /// [`SchemeError::NonFiniteWeight`], which names `scheme` and the entry.
    pub fn reweighted(
        &self,
        scheme: &str,
        symmetry: Symmetry,
        weight: impl Fn(RowId, RowId, f64) -> f64,
    ) -> Result<Self, SchemeError> {
        let graph = self.graph();
        let of_row = |i: usize| {
            let (row, weight) = (graph.row(i), &weight);
            row.map(move |(j, k)| weight(RowId::new(i), j, self.weights()[k]))
        };
        let weights = (0..graph.num_rows()).flat_map(of_row).collect();
        let other = Self::new(graph.clone(), weights, symmetry);
        let other = other.map_err(|k| not_finite(scheme, graph, k))?;
        Ok(other.with_triangles(self.triangles().cloned()))
    }
}

/// The error for the weight of entry `k`.
pub(crate) fn not_finite(scheme: &str, graph: &Graph, k: usize) -> SchemeError {
    let row = (0..graph.num_rows()).find(|i| graph.range(*i).contains(&k));
    SchemeError::NonFiniteWeight {
        scheme: scheme.into(),
        vertices: [row.unwrap_or_default(), graph.neighbours()[k].index()].map(VertexId::new),
    }
}
