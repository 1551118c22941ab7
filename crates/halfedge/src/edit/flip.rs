//! The edge flip.

use super::EditError;
use crate::ids::{EdgeId, FaceId, VertexId};
use crate::mesh::HalfedgeMesh;

/// The result of [`HalfedgeMesh::flip_edge`]. No element is added or removed, but the edge joins
/// other vertices and its two triangles have other corners.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct FlippedEdge {
    /// The edge, whose id does not change.
    pub edge: EdgeId,
    /// The ends of the edge before the flip, which are now opposite it: origin and target of its
    /// first halfedge.
    pub old_ends: [VertexId; 2],
    /// The ends of the edge after the flip, which used to be opposite it: origin and target of
    /// its first halfedge.
    pub new_ends: [VertexId; 2],
    /// The triangles on the left and on the right of the edge, whose ids do not change.
    pub faces: [FaceId; 2],
}

impl HalfedgeMesh {
    /// Turns an edge between two triangles counter-clockwise, so that it joins the two opposite
    /// corners.
    ///
    /// ```text
    ///         d                     d
    ///        ╱ ╲                   ╱▲╲
    ///       ╱ f ╲                 ╱ │ ╲
    ///      u──h─▶v      ──▶      u f│h v
    ///       ╲ g ╱                 ╲ │g╱
    ///        ╲ ╱                   ╲│╱
    ///         c                     c
    /// ```
    ///
    /// Here h is the first halfedge of the edge. All ids stay the same. A second flip restores
    /// the edge with its sides swapped, a fourth one restores everything. After two flips the two
    /// faces have changed places, so differing per-face values must be swapped.
    ///
    /// # Errors
    /// - [`EditError::BoundaryEdge`], [`EditError::NotTriangle`]: the edge is not between two
    ///   triangles.
    /// - [`EditError::EdgeExists`]: c and d are already joined, as in a tetrahedron.
    /// - [`EditError::BackToBack`]: c = d.
    /// - [`EditError::NoSuchEdge`].
    pub fn flip_edge(&mut self, edge: EdgeId) -> Result<FlippedEdge, EditError> {
        let flipped = self.check_flip(edge)?;
        let FlippedEdge {
            old_ends: [u, v],
            new_ends: [c, d],
            faces: [f, g],
            ..
        } = flipped;
        let [h, t] = edge.halfedges();
        let (v_d, d_u) = (self.next(h), self.prev(h));
        let (u_c, c_v) = (self.next(t), self.prev(t));
        for (vertex, side, other) in [(u, h, u_c), (v, t, v_d)] {
            if self.vertex_halfedge(vertex) == side {
                self.vertex_halfedge[vertex.index()] = other;
            }
        }
        self.set_target(h, d);
        self.set_target(t, c);
        for [first, second, third] in [[h, d_u, u_c], [t, c_v, v_d]] {
            self.link(first, second);
            self.link(second, third);
            self.link(third, first);
            self.copy_face(first, third);
        }
        self.face_halfedge[f.index()] = h;
        self.face_halfedge[g.index()] = t;
        Ok(flipped)
    }

    /// Checks whether [`Self::flip_edge`] would flip the edge, and returns the reason if not. The
    /// mesh is not changed.
    ///
    /// # Errors
    /// Same as [`Self::flip_edge`].
    pub fn can_flip(&self, edge: EdgeId) -> Result<(), EditError> {
        self.check_flip(edge).map(drop)
    }

    fn check_flip(&self, edge: EdgeId) -> Result<FlippedEdge, EditError> {
        self.check_edge(edge)?;
        let [h, t] = edge.halfedges();
        let (Some(f), Some(g)) = (self.face(h), self.face(t)) else {
            return Err(EditError::BoundaryEdge { edge });
        };
        for (side, face) in [(h, f), (t, g)] {
            if !self.has_triangle(side) {
                return Err(EditError::NotTriangle {
                    face,
                    degree: self.degree(face),
                });
            }
        }
        let (c, d) = (self.target(self.next(t)), self.target(self.next(h)));
        if c == d {
            return Err(EditError::BackToBack { edge, vertex: c });
        }
        self.check_no_edge(c, d)?;
        Ok(FlippedEdge {
            edge,
            old_ends: self.edge_vertices(edge),
            new_ends: [c, d],
            faces: [f, g],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::TriangleFaces;

    #[test]
    fn flips_in_a_square() {
        let mut mesh = HalfedgeMesh::from_faces(4, &[[0, 1, 2], [0, 2, 3]]).unwrap();
        let between = |mesh: &HalfedgeMesh, a, b| {
            mesh.halfedge_between(VertexId::new(a), VertexId::new(b))
                .map(|h| h.edge())
        };
        let edge = between(&mesh, 0, 2).unwrap();
        let before = mesh.edge_vertices(edge);
        let flipped = mesh.flip_edge(edge).unwrap();
        mesh.validate().unwrap();
        assert_eq!(flipped.edge, edge);
        assert_eq!(flipped.old_ends, before);
        assert_eq!(flipped.new_ends, mesh.edge_vertices(edge));
        let sides = edge.halfedges().map(|h| mesh.face(h));
        assert_eq!(sides, flipped.faces.map(Some));
        assert_eq!(between(&mesh, 1, 3), Some(edge));
        assert_eq!(between(&mesh, 0, 2), None);
        assert_eq!(mesh.num_faces(), 2);
    }

    #[test]
    fn two_flips_swap_the_sides_and_four_restore_everything() {
        let mesh = TriangleFaces::icosahedron().mesh().unwrap();
        let edge = EdgeId::new(7);
        let [h, t] = edge.halfedges();
        let mut flipped = mesh.clone();
        flipped.flip_edge(edge).unwrap();
        flipped.flip_edge(edge).unwrap();
        flipped.validate().unwrap();
        assert_eq!(
            (flipped.origin(h), flipped.target(h)),
            (mesh.target(h), mesh.origin(h))
        );
        assert_eq!(
            (flipped.face(h), flipped.face(t)),
            (mesh.face(h), mesh.face(t))
        );
        assert_eq!(
            (flipped.next(h), flipped.next(t)),
            (mesh.next(t), mesh.next(h))
        );
        flipped.flip_edge(edge).unwrap();
        flipped.flip_edge(edge).unwrap();
        assert_eq!((&flipped.target, &flipped.next), (&mesh.target, &mesh.next));
        assert_eq!((&flipped.prev, &flipped.face), (&mesh.prev, &mesh.face));
    }

    #[test]
    fn refusals() {
        let refused = |mesh: &HalfedgeMesh, edge| {
            let mut edited = mesh.clone();
            let error = edited.flip_edge(edge).unwrap_err();
            assert_eq!(&edited, mesh);
            assert_eq!(mesh.can_flip(edge).as_ref(), Err(&error));
            error
        };
        let tetrahedron = TriangleFaces::tetrahedron().mesh().unwrap();
        assert!(matches!(
            refused(&tetrahedron, EdgeId(0)),
            EditError::EdgeExists { .. }
        ));
        let edge = EdgeId(6);
        assert_eq!(
            refused(&tetrahedron, edge),
            EditError::NoSuchEdge { edge, num_edges: 6 }
        );
        let pillow = HalfedgeMesh::from_faces(3, &[[0, 1, 2], [0, 2, 1]]).unwrap();
        let vertex = VertexId(2);
        assert_eq!(
            refused(&pillow, EdgeId(0)),
            EditError::BackToBack {
                edge: EdgeId(0),
                vertex
            }
        );
        let mixed = HalfedgeMesh::from_faces(5, &[vec![0, 1, 2], vec![0, 2, 3, 4]]).unwrap();
        let boundary = mixed.vertex_halfedge(VertexId(1)).edge();
        assert_eq!(
            refused(&mixed, boundary),
            EditError::BoundaryEdge { edge: boundary }
        );
        let inner = mixed
            .halfedge_between(VertexId(0), VertexId(2))
            .unwrap()
            .edge();
        let error = EditError::NotTriangle {
            face: FaceId(1),
            degree: 4,
        };
        assert_eq!(refused(&mixed, inner), error);
    }
}
