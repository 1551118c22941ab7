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
        let n = mesh.num_vertices();
        let mut offsets = vec![0; n + 1];
        for h in mesh.halfedges() {
            offsets[mesh.origin(h).index() + 1] += 1;
        }
        for i in 0..n {
            offsets[i + 1] += offsets[i];
        }
        // Whoever comes in ascending order to the rings of all its neighbours leaves them sorted.
        let mut ends = offsets.clone();
        let mut neighbours = vec![VertexId::new(0); mesh.num_halfedges()];
        let mut halfedges = vec![HalfedgeId::new(0); mesh.num_halfedges()];
        for vertex in mesh.vertices() {
            for h in mesh.outgoing_halfedges(vertex) {
                let end = &mut ends[mesh.target(h).index()];
                neighbours[*end as usize] = vertex;
                halfedges[*end as usize] = h.twin();
                *end += 1;
            }
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
    #[inline(always)]
    pub fn range(&self, i: usize) -> std::ops::Range<usize> {
        self.offsets[i] as usize..self.offsets[i + 1] as usize
    }

    /// The neighbours of all vertices, row after row.
    #[inline(always)]
    pub fn neighbours(&self) -> &[VertexId] {
        &self.neighbours
    }

    /// The halfedges to the neighbours of all vertices, row after row.
    pub fn halfedges(&self) -> &[HalfedgeId] {
        &self.halfedges
    }
}
