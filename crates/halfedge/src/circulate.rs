//! Walks around a vertex, a face or a hole, in both directions.
//!
//! Each iterator knows where it ends and carries a step count as a second bound, so that even a
//! broken mesh cannot make one run for ever.

use std::iter::FusedIterator;

use crate::ids::{HalfedgeId, VertexId};
use crate::mesh::HalfedgeMesh;

/// A cyclic walk from a first halfedge to a last one, from either end.
#[derive(Clone, Debug)]
struct Walk<'m> {
    mesh: &'m HalfedgeMesh,
    front: HalfedgeId,
    back: HalfedgeId,
    /// Steps that remain at most; 0 ends the walk.
    remaining: usize,
}

impl<'m> Walk<'m> {
    fn cycle(mesh: &'m HalfedgeMesh, first: HalfedgeId, last: HalfedgeId) -> Self {
        Self { mesh, front: first, back: last, remaining: mesh.num_halfedges() }
    }

    fn forward(
        &mut self,
        step: impl Fn(&HalfedgeMesh, HalfedgeId) -> HalfedgeId,
    ) -> Option<HalfedgeId> {
        if self.remaining == 0 {
            return None;
        }
        let current = self.front;
        self.remaining = if current == self.back { 0 } else { self.remaining - 1 };
        self.front = step(self.mesh, current);
        Some(current)
    }

    fn backward(
        &mut self,
        step: impl Fn(&HalfedgeMesh, HalfedgeId) -> HalfedgeId,
    ) -> Option<HalfedgeId> {
        if self.remaining == 0 {
            return None;
        }
        let current = self.back;
        self.remaining = if current == self.front { 0 } else { self.remaining - 1 };
        self.back = step(self.mesh, current);
        Some(current)
    }
}

/// The outgoing halfedge that follows `h` counter-clockwise around its origin.
fn rotate_ccw(mesh: &HalfedgeMesh, h: HalfedgeId) -> HalfedgeId {
    mesh.prev(h).twin()
}

/// The outgoing halfedge that follows `h` clockwise around its origin.
fn rotate_cw(mesh: &HalfedgeMesh, h: HalfedgeId) -> HalfedgeId {
    mesh.next(h.twin())
}

/// Iterator of [`HalfedgeMesh::outgoing_halfedges`].
#[derive(Clone, Debug)]
pub struct OutgoingHalfedges<'m>(Walk<'m>);

impl<'m> OutgoingHalfedges<'m> {
    #[inline]
    pub(crate) fn new(mesh: &'m HalfedgeMesh, vertex: VertexId) -> Self {
        let h = mesh.vertex_halfedge(vertex);
        if mesh.is_boundary_halfedge(h) {
            // One step counter-clockwise from the boundary halfedge crosses the hole: the fan
            // begins there and ends at h.
            Self(Walk::cycle(mesh, rotate_ccw(mesh, h), h))
        } else {
            Self(Walk::cycle(mesh, h, rotate_cw(mesh, h)))
        }
    }
}

/// Iterator of [`HalfedgeMesh::incoming_halfedges`].
#[derive(Clone, Debug)]
pub struct IncomingHalfedges<'m>(pub(crate) OutgoingHalfedges<'m>);

/// Iterator of [`HalfedgeMesh::face_halfedges`].
#[derive(Clone, Debug)]
pub struct FaceHalfedges<'m>(Walk<'m>);

impl<'m> FaceHalfedges<'m> {
    #[inline]
    pub(crate) fn new(mesh: &'m HalfedgeMesh, first: HalfedgeId) -> Self {
        Self(Walk::cycle(mesh, first, mesh.prev(first)))
    }
}

/// Iterator of [`HalfedgeMesh::boundary_loop`].
#[derive(Clone, Debug)]
pub struct BoundaryLoop<'m>(Walk<'m>);

impl<'m> BoundaryLoop<'m> {
    pub(crate) fn new(mesh: &'m HalfedgeMesh, first: HalfedgeId) -> Self {
        let mut walk = Walk::cycle(mesh, first, mesh.prev(first));
        if !mesh.is_boundary_halfedge(first) {
            walk.remaining = 0;
        }
        Self(walk)
    }
}

macro_rules! walk_iterator {
    ($name:ident, $forward:expr, $backward:expr) => {
        impl Iterator for $name<'_> {
            type Item = HalfedgeId;

            #[inline]
            fn next(&mut self) -> Option<HalfedgeId> {
                self.0.forward($forward)
            }
        }

        impl DoubleEndedIterator for $name<'_> {
            #[inline]
            fn next_back(&mut self) -> Option<HalfedgeId> {
                self.0.backward($backward)
            }
        }

        impl FusedIterator for $name<'_> {}
    };
}

walk_iterator!(OutgoingHalfedges, rotate_ccw, rotate_cw);
walk_iterator!(FaceHalfedges, HalfedgeMesh::next, HalfedgeMesh::prev);
walk_iterator!(BoundaryLoop, HalfedgeMesh::next, HalfedgeMesh::prev);

impl Iterator for IncomingHalfedges<'_> {
    type Item = HalfedgeId;

    #[inline]
    fn next(&mut self) -> Option<HalfedgeId> {
        self.0.next().map(HalfedgeId::twin)
    }
}

impl DoubleEndedIterator for IncomingHalfedges<'_> {
    #[inline]
    fn next_back(&mut self) -> Option<HalfedgeId> {
        self.0.next_back().map(HalfedgeId::twin)
    }
}

impl FusedIterator for IncomingHalfedges<'_> {}
