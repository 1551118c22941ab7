//! The one-rings of all vertices, flattened: the graph of every operator built by a scheme.

use std::sync::Arc;

use cotan_halfedge::{HalfedgeId, HalfedgeMap, HalfedgeMesh, VertexId};

use crate::graph::{Graph, RowId};

/// The graph of a mesh: the neighbours of each row in ascending order, with the halfedges that
/// lead to each. A row is a vertex, or all copies of a vertex if the mesh was cut into pieces
/// ([`HalfedgeMesh::row_of`]); then several halfedges may lead to one neighbour.
///
/// Built once per mesh, it replaces the walk around a vertex in everything that runs in every
/// iteration.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct OneRings {
    graph: Arc<Graph>,
    halfedges: Vec<HalfedgeId>,
    /// The first halfedge of each entry, followed by the number of all. `None` if each entry has
    /// exactly one.
    starts: Option<Vec<u32>>,
}

impl OneRings {
    /// Gathers the one-rings of `mesh`.
    pub fn new(mesh: &HalfedgeMesh) -> Self {
        if mesh.has_copies() {
            return Self::of_rows(mesh);
        }
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
            starts: None,
        }
    }

    /// Gathers the one-rings of a mesh with copies of vertices.
    fn of_rows(mesh: &HalfedgeMesh) -> Self {
        let row = |v| RowId::from(mesh.row_of(v));
        let mut all: Vec<(RowId, RowId, HalfedgeId)> = mesh
            .halfedges()
            .map(|h| (row(mesh.origin(h)), row(mesh.target(h)), h))
            .collect();
        all.sort_unstable();
        let mut offsets = vec![0; mesh.num_rows() + 1];
        let (mut neighbours, mut starts) = (Vec::new(), Vec::new());
        for (k, (i, j, _)) in all.iter().enumerate() {
            if k == 0 || (all[k - 1].0, all[k - 1].1) != (*i, *j) {
                offsets[i.index() + 1] += 1;
                neighbours.push(*j);
                starts.push(k as u32);
            }
        }
        starts.push(all.len() as u32);
        for i in 0..mesh.num_rows() {
            offsets[i + 1] += offsets[i];
        }
        Self {
            graph: Arc::new(Graph::from_rows(offsets, neighbours)),
            halfedges: all.into_iter().map(|(_, _, h)| h).collect(),
            starts: Some(starts),
        }
    }

    /// The graph alone.
    pub fn graph(&self) -> &Arc<Graph> {
        &self.graph
    }

    /// Number of rows.
    pub fn num_rows(&self) -> usize {
        self.graph.num_rows()
    }

    /// Returns true if several halfedges may lead to one neighbour.
    pub fn is_shared(&self) -> bool {
        self.starts.is_some()
    }

    /// The neighbours of row `i` in ascending order, each with its entry index.
    #[inline]
    pub fn ring(&self, i: usize) -> impl ExactSizeIterator<Item = (VertexId, usize)> + '_ {
        let row = self.graph.row(i);
        row.map(|(j, k)| (VertexId::new(j.index()), k))
    }

    /// The halfedges of entry `k` of the graph: one, unless copies of vertices share rows.
    #[inline]
    pub fn halfedges_of(&self, k: usize) -> &[HalfedgeId] {
        match &self.starts {
            None => &self.halfedges[k..=k],
            Some(starts) => &self.halfedges[starts[k] as usize..starts[k + 1] as usize],
        }
    }

    /// The halfedges from a row to its neighbours, grouped by entry.
    #[inline]
    pub fn halfedges(&self) -> &[HalfedgeId] {
        &self.halfedges
    }

    /// Converts values in row order to values by halfedge. Halfedges of one entry all get its
    /// value.
    ///
    /// # Panics
    /// If there is not exactly one value per entry.
    pub fn by_halfedge<A: Clone + Default>(&self, rows: &[A]) -> HalfedgeMap<A> {
        assert_eq!(rows.len(), self.graph.num_entries(), "one value per entry");
        let mut out = HalfedgeMap::filled(self.halfedges.len(), A::default());
        for (k, value) in rows.iter().enumerate() {
            for h in self.halfedges_of(k) {
                out[*h] = value.clone();
            }
        }
        out
    }
}
