//! The entry of the priority queue of a search along a surface.

use std::cmp::Ordering;

use cotan_halfedge::VertexId;

/// A vertex in the queue. The closest comes first, then the lowest index.
#[derive(PartialEq)]
pub(crate) struct Reached {
    pub(crate) distance: f64,
    pub(crate) vertex: VertexId,
}

impl Reached {
    pub(crate) fn at(vertex: VertexId, distance: f64) -> Self {
        Self { distance, vertex }
    }
}

impl Eq for Reached {}

impl Ord for Reached {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_distance = other.distance.total_cmp(&self.distance);
        by_distance.then(other.vertex.cmp(&self.vertex))
    }
}

impl PartialOrd for Reached {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
