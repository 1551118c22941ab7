//! Iterators around a vertex, a face or a hole, in both directions.
//!
//! Each iterator has a fixed end and also a step count as a second bound, so that it terminates
//! even on a broken mesh.

use std::iter::FusedIterator;

use crate::ids::{HalfedgeId, VertexId};
use crate::mesh::HalfedgeMesh;

/// A cyclic walk from a first halfedge to a last one, double-ended.
#[derive(Clone, Debug)]
struct Walk<'m> {
    mesh: &'m HalfedgeMesh,
    front: HalfedgeId,
    back: HalfedgeId,
    /// Upper bound of the remaining steps; 0 ends the walk.
    remaining: usize,
}

impl<'m> Walk<'m> {
    fn cycle(mesh: &'m HalfedgeMesh, first: HalfedgeId, last: HalfedgeId) -> Self {
        Self {
            mesh,
            front: first,
            back: last,
            remaining: mesh.num_halfedges(),
        }
    }

    fn forward(
        &mut self,
        step: impl Fn(&HalfedgeMesh, HalfedgeId) -> HalfedgeId,
    ) -> Option<HalfedgeId> {
        if self.remaining == 0 {
            return None;
        }
        let current = self.front;
        self.remaining = if current == self.back {
            0
        } else {
            self.remaining - 1
        };
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
        self.remaining = if current == self.front {
            0
        } else {
            self.remaining - 1
        };
        self.back = step(self.mesh, current);
        Some(current)
    }
}

/// The next outgoing halfedge counter-clockwise around the origin of `h`.
fn rotate_ccw(mesh: &HalfedgeMesh, h: HalfedgeId) -> HalfedgeId {
    mesh.prev(h).twin()
}

/// The next outgoing halfedge clockwise around the origin of `h`.
fn rotate_cw(mesh: &HalfedgeMesh, h: HalfedgeId) -> HalfedgeId {
    mesh.next(h.twin())
}

/// Iterator returned by [`HalfedgeMesh::outgoing_halfedges`].
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

/// Iterator returned by [`HalfedgeMesh::incoming_halfedges`].
#[derive(Clone, Debug)]
pub struct IncomingHalfedges<'m>(pub(crate) OutgoingHalfedges<'m>);

/// Iterator returned by [`HalfedgeMesh::face_halfedges`].
#[derive(Clone, Debug)]
pub struct FaceHalfedges<'m>(Walk<'m>);

impl<'m> FaceHalfedges<'m> {
    #[inline]
    pub(crate) fn new(mesh: &'m HalfedgeMesh, first: HalfedgeId) -> Self {
        Self(Walk::cycle(mesh, first, mesh.prev(first)))
    }
}

/// Iterator returned by [`HalfedgeMesh::boundary_loop`].
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use crate::testing;

    fn forward_is_backward_reversed<T: PartialEq + std::fmt::Debug>(
        walk: impl DoubleEndedIterator<Item = T> + Clone,
    ) -> Result<usize, TestCaseError> {
        let forward: Vec<T> = walk.clone().collect();
        let mut backward: Vec<T> = walk.clone().rev().collect();
        backward.reverse();
        prop_assert_eq!(&forward, &backward);
        // When iterating from both ends at once, each element appears once as well.
        let (mut front, mut back, mut walk) = (Vec::new(), Vec::new(), walk);
        while let Some(first) = walk.next() {
            front.push(first);
            back.extend(walk.next_back());
        }
        prop_assert!(walk.next().is_none() && walk.next_back().is_none());
        front.extend(back.into_iter().rev());
        prop_assert_eq!(&forward, &front);
        Ok(forward.len())
    }

    proptest! {
        #[test]
        fn every_walk_goes_both_ways(mesh in testing::arbitrary_mesh()) {
            let mut corners = 0;
            let mut sides = 0;
            for v in mesh.vertices() {
                let valence = forward_is_backward_reversed(mesh.outgoing_halfedges(v))?;
                prop_assert_eq!(forward_is_backward_reversed(mesh.incoming_halfedges(v))?, valence);
                prop_assert_eq!(forward_is_backward_reversed(mesh.one_ring(v))?, valence);
                let faces = forward_is_backward_reversed(mesh.vertex_faces(v))?;
                prop_assert_eq!(faces + usize::from(mesh.is_boundary_vertex(v)), valence);
                sides += valence;
            }
            prop_assert_eq!(sides, mesh.num_halfedges());
            for f in mesh.faces() {
                corners += forward_is_backward_reversed(mesh.face_halfedges(f))?;
            }
            for h in mesh.boundary_loops() {
                corners += forward_is_backward_reversed(mesh.boundary_loop(h))?;
            }
            prop_assert_eq!(corners, mesh.num_halfedges());
        }

        #[test]
        fn twin_next_and_prev(mesh in testing::arbitrary_mesh()) {
            for h in mesh.halfedges() {
                prop_assert_eq!(h.twin().twin(), h);
                prop_assert_eq!(h.twin().edge(), h.edge());
                prop_assert_eq!(mesh.next(mesh.prev(h)), h);
                prop_assert_eq!(mesh.prev(mesh.next(h)), h);
                prop_assert_eq!(mesh.origin(mesh.next(h)), mesh.target(h));
                prop_assert_eq!(mesh.face(mesh.next(h)), mesh.face(h));
                prop_assert_eq!(mesh.halfedge_between(mesh.origin(h), mesh.target(h)), Some(h));
                if !mesh.is_boundary_halfedge(h) {
                    prop_assert_eq!(mesh.boundary_loop(h).next(), None);
                }
            }
        }

        #[test]
        fn fans_run_from_border_to_border(mesh in testing::arbitrary_mesh()) {
            for v in mesh.vertices() {
                let fan: Vec<_> = mesh.outgoing_halfedges(v).collect();
                for (&h, &after) in fan.iter().zip(&fan[1..]) {
                    // In counter-clockwise order, the face left of one halfedge is right of the
                    // next.
                    prop_assert_eq!(mesh.origin(h), v);
                    prop_assert_eq!(mesh.face(h), mesh.face(after.twin()));
                }
                let ends: Vec<_> =
                    fan.iter().filter(|&&h| mesh.is_boundary_halfedge(h)).collect();
                if mesh.is_boundary_vertex(v) {
                    prop_assert_eq!(ends, [&fan[fan.len() - 1]]);
                    prop_assert_eq!(fan.last(), Some(&mesh.vertex_halfedge(v)));
                    prop_assert!(mesh.is_boundary_halfedge(fan[0].twin()));
                } else {
                    prop_assert!(ends.is_empty());
                    prop_assert_eq!(fan[0], mesh.vertex_halfedge(v));
                }
            }
        }
    }
}
