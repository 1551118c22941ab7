//! The edge flip.

use super::EditError;
use crate::ids::EdgeId;
use crate::mesh::HalfedgeMesh;

impl HalfedgeMesh {
    /// Turns an edge between two triangles, counter-clockwise, to join the other two corners.
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
    /// Here h is the first halfedge of the edge; no element changes its number. A second flip
    /// restores the edge with its sides interchanged, a fourth one everything.
    ///
    /// # Errors
    /// - [`EditError::BoundaryEdge`], [`EditError::NotTriangle`]: the edge does not lie between
    ///   two triangles.
    /// - [`EditError::EdgeExists`]: c and d are joined already, as in a tetrahedron.
    /// - [`EditError::BackToBack`]: c = d.
    /// - [`EditError::NoSuchEdge`].
    pub fn flip_edge(&mut self, edge: EdgeId) -> Result<(), EditError> {
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
        let (v_d, d_u) = (self.next(h), self.prev(h));
        let (u_c, c_v) = (self.next(t), self.prev(t));
        let (c, d) = (self.target(u_c), self.target(v_d));
        if c == d {
            return Err(EditError::BackToBack { edge, vertex: c });
        }
        self.check_no_edge(c, d)?;

        for (v, side, other) in [(self.origin(h), h, u_c), (self.origin(t), t, v_d)] {
            if self.vertex_halfedge(v) == side {
                self.vertex_halfedge[v.index()] = other;
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
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::{FaceId, VertexId};
    use crate::testing::TriangleFaces;

    #[test]
    fn flips_in_a_square() {
        let mut mesh = HalfedgeMesh::from_faces(4, &[[0, 1, 2], [0, 2, 3]]).unwrap();
        let between = |mesh: &HalfedgeMesh, a, b| {
            mesh.halfedge_between(VertexId::new(a), VertexId::new(b))
                .map(|h| h.edge())
        };
        let edge = between(&mesh, 0, 2).unwrap();
        mesh.flip_edge(edge).unwrap();
        mesh.validate().unwrap();
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
