//! The elementary steps of edits. Between two steps the mesh may be inconsistent.

use crate::ids::{FaceId, HalfedgeId, NONE, VertexId};
use crate::mesh::HalfedgeMesh;

impl HalfedgeMesh {
    /// Makes `after` the successor of `before`.
    pub(super) fn link(&mut self, before: HalfedgeId, after: HalfedgeId) {
        self.next[before.index()] = after;
        self.prev[after.index()] = before;
    }

    pub(super) fn set_target(&mut self, halfedge: HalfedgeId, vertex: VertexId) {
        self.target[halfedge.index()] = vertex;
    }

    pub(super) fn copy_face(&mut self, from: HalfedgeId, to: HalfedgeId) {
        self.face[to.index()] = self.face[from.index()];
    }

    /// Appends an edge without links and faces, and returns its halfedge from `origin` to
    /// `target`.
    pub(super) fn push_edge(&mut self, origin: VertexId, target: VertexId) -> HalfedgeId {
        let h = HalfedgeId::new(self.num_halfedges());
        self.target.extend([target, origin]);
        self.next.extend([h, h.twin()]);
        self.prev.extend([h, h.twin()]);
        self.face.extend([NONE; 2]);
        h
    }

    /// Appends a face whose halfedges are the loop of `first`. O(degree).
    pub(super) fn push_face(&mut self, first: HalfedgeId) -> FaceId {
        let face = FaceId::new(self.num_faces());
        self.face_halfedge.push(first);
        let mut h = first;
        loop {
            self.face[h.index()] = face.0;
            h = self.next(h);
            if h == first {
                return face;
            }
        }
    }

    /// Joins the origins of two halfedges of the same face by a new edge.
    ///
    /// ```text
    ///    ◀───── to            ◀───── to
    ///   ╱         ▲          ╱    f    ▲ new face:
    ///  ▼     f     ╲   ──▶  ▼  ──────▶  ╲ from … up to `to`
    ///   ╲         ╱          ╲  result ╱
    ///    ● from ─▶            ● from ─▶
    /// ```
    ///
    /// The returned halfedge runs from the origin of `from` to that of `to` and has the old face
    /// on its left. The time is proportional to the number of corners of the cut-off part.
    pub(super) fn cut_face(&mut self, from: HalfedgeId, to: HalfedgeId) -> HalfedgeId {
        let (before_from, before_to) = (self.prev(from), self.prev(to));
        let cut = self.push_edge(self.origin(from), self.origin(to));
        self.copy_face(from, cut);
        self.link(before_from, cut);
        self.link(cut, to);
        self.link(before_to, cut.twin());
        self.link(cut.twin(), from);
        let old_face = self.face(cut);
        let new_face = self.push_face(cut.twin());
        if let Some(face) = old_face
            && self.face(self.face_halfedge(face)) == Some(new_face)
        {
            // The first halfedge now belongs to the new face.
            self.face_halfedge[face.index()] = cut;
        }
        cut
    }
}
