//! The one-rings of all vertices, flattened: the sparsity pattern of every operator.

use cotan_halfedge::{HalfedgeId, HalfedgeMesh, VertexId};

/// Neighbours of every vertex in ascending order, with the halfedge that leads to each.
///
/// Row `i` is `offsets[i]..offsets[i + 1]` of the two other arrays. It is built once a mesh and
/// replaces the walk around a vertex in everything that runs every iteration.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct OneRings {
    offsets: Vec<u32>,
    neighbours: Vec<VertexId>,
    halfedges: Vec<HalfedgeId>,
}

impl OneRings {
    /// Gathers the one-rings of `mesh`.
    pub fn new(mesh: &HalfedgeMesh) -> Self {
        let mut offsets = Vec::with_capacity(mesh.num_vertices() + 1);
        let mut neighbours = Vec::with_capacity(mesh.num_halfedges());
        let mut halfedges = Vec::with_capacity(mesh.num_halfedges());
        let mut ring = Vec::new();
        offsets.push(0);
        for vertex in mesh.vertices() {
            ring.clear();
            ring.extend(mesh.outgoing_halfedges(vertex).map(|h| (mesh.target(h), h)));
            ring.sort_unstable();
            neighbours.extend(ring.iter().map(|&(v, _)| v));
            halfedges.extend(ring.iter().map(|&(_, h)| h));
            offsets.push(neighbours.len() as u32);
        }
        Self {
            offsets,
            neighbours,
            halfedges,
        }
    }

    /// Number of vertices.
    pub fn num_vertices(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Neighbours of vertex number `i`, ascending, with the halfedges that lead there.
    #[inline]
    pub fn ring(&self, i: usize) -> impl ExactSizeIterator<Item = (VertexId, HalfedgeId)> + '_ {
        let range = self.range(i);
        self.neighbours[range.clone()]
            .iter()
            .copied()
            .zip(self.halfedges[range].iter().copied())
    }

    /// Where row `i` lies in [`Self::neighbours`] and [`Self::halfedges`].
    #[inline]
    pub fn range(&self, i: usize) -> std::ops::Range<usize> {
        self.offsets[i] as usize..self.offsets[i + 1] as usize
    }

    /// The neighbours of all vertices, row after row.
    pub fn neighbours(&self) -> &[VertexId] {
        &self.neighbours
    }

    /// The halfedges to the neighbours of all vertices, row after row.
    pub fn halfedges(&self) -> &[HalfedgeId] {
        &self.halfedges
    }
}
