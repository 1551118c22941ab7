//! Checks shared by several edits.

use super::error::EditError;
use crate::ids::{EdgeId, FaceId, HalfedgeId, VertexId};
use crate::mesh::HalfedgeMesh;

impl HalfedgeMesh {
    pub(super) fn check_edge(&self, edge: EdgeId) -> Result<(), EditError> {
        let num_edges = self.num_edges();
        (edge.index() < num_edges)
            .then_some(())
            .ok_or(EditError::NoSuchEdge { edge, num_edges })
    }

    pub(super) fn check_halfedge(&self, halfedge: HalfedgeId) -> Result<(), EditError> {
        let num_halfedges = self.num_halfedges();
        (halfedge.index() < num_halfedges)
            .then_some(())
            .ok_or(EditError::NoSuchHalfedge {
                halfedge,
                num_halfedges,
            })
    }

    pub(super) fn check_face(&self, face: FaceId) -> Result<(), EditError> {
        let num_faces = self.num_faces();
        (face.index() < num_faces)
            .then_some(())
            .ok_or(EditError::NoSuchFace { face, num_faces })
    }

    /// Checks that no vertex has copies: rows must stay the first vertices.
    pub(super) fn check_no_copies(&self) -> Result<(), EditError> {
        match self.has_copies() {
            true => Err(EditError::Copies),
            false => Ok(()),
        }
    }

    /// Checks that ids are left for `more` edges. There are never more vertices or faces than
    /// edges.
    pub(super) fn check_room(&self, more: usize) -> Result<(), EditError> {
        let num_edges = self.num_edges().saturating_add(more);
        (num_edges <= MAX_EDGES)
            .then_some(())
            .ok_or(EditError::TooLarge { num_edges })
    }

    pub(super) fn check_no_edge(&self, a: VertexId, b: VertexId) -> Result<(), EditError> {
        match self.halfedge_between(a, b) {
            Some(h) => Err(EditError::EdgeExists {
                vertices: [a, b],
                edge: h.edge(),
            }),
            None => Ok(()),
        }
    }

    /// Returns true if the face on the left of `halfedge` is a triangle.
    pub(super) fn has_triangle(&self, halfedge: HalfedgeId) -> bool {
        !self.is_boundary_halfedge(halfedge)
            && self.next(self.next(self.next(halfedge))) == halfedge
    }
}

/// The largest number of edges whose halfedge ids all stay below `NONE`.
pub(crate) const MAX_EDGES: usize = (1 << 31) - 2;
