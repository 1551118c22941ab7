//! The one-rings of all vertices, flattened: the graph of every operator built by a scheme.

use std::sync::Arc;

use cotan_halfedge::{HalfedgeId, HalfedgeMap, HalfedgeMesh, VertexId};

use crate::graph::{Graph, RowId};

/// The graph of a mesh: the neighbours of each vertex in ascending order, with the halfedge that
/// leads to each.
///
/// Built once per mesh, it replaces the walk around a vertex in everything that runs in every
/// iteration.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct OneRings {
    graph: Arc<Graph>,
    halfedges: Vec<HalfedgeId>,
}

impl OneRings {
    /// Gathers the one-rings of `mesh`.
    pub fn new(mesh: &HalfedgeMesh) -> Self {
        let n = mesh.num_vertices();
        let mut offsets = vec![0; n + 1];
        for h in mesh.halfedges() {
            offsets[mesh.origin(h).index() + 1] += 1;
        }
        for i in 0..n {
            offsets[i + 1] += offsets[i];
        }
        // Visiting the vertices in ascending order and appending each to the rings of its
        // neighbours leaves the rings sorted.
        let mut ends = offsets.clone();
        let mut neighbours = vec![RowId::new(0); mesh.num_halfedges()];
        let mut halfedges = vec![HalfedgeId::new(0); mesh.num_halfedges()];
        for vertex in mesh.vertices() {
            for h in mesh.outgoing_halfedges(vertex) {
                let end = &mut ends[mesh.target(h).index()];
                let place = *end as usize;
                *end += 1;
                neighbours[place] = vertex.into();
                halfedges[place] = h.twin();
            }
        }
        Self {
            graph: Arc::new(Graph::from_rows(offsets, neighbours)),
            halfedges,
        }
    }

    /// The graph alone, with one row per vertex.
    pub fn graph(&self) -> &Arc<Graph> {
        &self.graph
    }

    /// Number of vertices.
    pub fn num_vertices(&self) -> usize {
        self.graph.num_rows()
    }

    /// The neighbours of vertex `i` in ascending order, with the halfedges that lead to them.
    #[inline]
    pub fn ring(&self, i: usize) -> impl ExactSizeIterator<Item = (VertexId, HalfedgeId)> + '_ {
        let row = self.graph.row(i);
        row.map(|(j, k)| (VertexId::new(j.index()), self.halfedges[k]))
    }

    /// The halfedges to the neighbours of all vertices, row by row: one per entry of the graph.
    #[inline]
    pub fn halfedges(&self) -> &[HalfedgeId] {
        &self.halfedges
    }

    /// Converts values in row order to values by halfedge.
    ///
    /// # Panics
    /// If there is not exactly one value per entry.
    pub fn by_halfedge<A: Clone + Default>(&self, rows: &[A]) -> HalfedgeMap<A> {
        assert_eq!(rows.len(), self.halfedges.len(), "one value per entry");
        let mut out = HalfedgeMap::filled(rows.len(), A::default());
        for (h, value) in self.halfedges.iter().zip(rows) {
            out[*h] = value.clone();
        }
        out
    }

    /// Converts values by halfedge to values in row order.
    pub fn by_row<A: Clone>(&self, halfedges: &HalfedgeMap<A>) -> Vec<A> {
        self.halfedges
            .iter()
            .map(|&h| halfedges[h].clone())
            .collect()
    }
}
