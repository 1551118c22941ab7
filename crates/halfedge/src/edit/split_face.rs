//! A face cut up: at a new vertex, or between two of its corners.

use super::EditError;
use crate::ids::{EdgeId, FaceId, HalfedgeId, VertexId};
use crate::mesh::HalfedgeMesh;

impl HalfedgeMesh {
    /// Inserts a vertex into a face and joins it to all corners.
    ///
    /// ```text
    ///          c                     c
    ///         ╱ ╲                   ╱│╲
    ///        ╱   ╲                 ╱ │ ╲
    ///       ╱  f  ╲      ──▶      ╱  m  ╲
    ///      ╱       ╲             ╱ ╱   ╲ ╲
    ///     ╱         ╲           ╱ ╱  f  ╲ ╲
    ///    a───first──▶b         a─────────▶b
    /// ```
    ///
    /// The face keeps its number and its first halfedge; the triangles at the other halfedges
    /// follow in order as new faces. New edges run from m to the corners, in order from the first.
    ///
    /// # Errors
    /// [`EditError::NoSuchFace`], [`EditError::TooLarge`]. A face that exists can always be split.
    pub fn split_face(&mut self, face: FaceId) -> Result<VertexId, EditError> {
        self.check_face(face)?;
        let sides: Vec<HalfedgeId> = self.face_halfedges(face).collect();
        self.check_room(sides.len())?;

        let m = VertexId::new(self.num_vertices());
        let spokes: Vec<HalfedgeId> = sides
            .iter()
            .map(|&side| self.push_edge(m, self.origin(side)))
            .collect();
        self.vertex_halfedge.push(spokes[0]);
        for (i, (&side, &spoke)) in sides.iter().zip(&spokes).enumerate() {
            let back = spokes[(i + 1) % spokes.len()].twin();
            self.link(spoke, side);
            self.link(side, back);
            self.link(back, spoke);
            if i == 0 {
                self.copy_face(side, spoke);
                self.copy_face(side, back);
            } else {
                self.push_face(side);
            }
        }
        Ok(m)
    }

    /// Cuts a face in two by an edge between two of its corners.
    ///
    /// ```text
    ///    ◀──── to            ◀──── to
    ///   ╱        ▲          ╱   f   ▲
    ///  ▼    f     ╲   ──▶  ▼ ──────▶ ╲
    ///   ╲        ╱          ╲  new  ╱
    ///    ● from ▶            ● from ▶
    /// ```
    ///
    /// The corners are the origins of the halfedges `from` and `to`. The new edge (returned) runs
    /// from the first to the second and keeps the old face on its left; the part from `from` to
    /// `to` is the new face.
    ///
    /// # Errors
    /// - [`EditError::NotOneFace`]: the halfedges do not belong to one face, or are the same.
    /// - [`EditError::EdgeExists`]: an edge joins the corners already, be it a side of the face.
    /// - [`EditError::NoSuchHalfedge`], [`EditError::TooLarge`].
    pub fn connect_corners(
        &mut self,
        from: HalfedgeId,
        to: HalfedgeId,
    ) -> Result<EdgeId, EditError> {
        self.check_halfedge(from)?;
        self.check_halfedge(to)?;
        if from == to || self.face(from).is_none() || self.face(from) != self.face(to) {
            return Err(EditError::NotOneFace {
                corners: [from, to],
            });
        }
        self.check_no_edge(self.origin(from), self.origin(to))?;
        self.check_room(1)?;
        Ok(self.cut_face(from, to).edge())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hexagon() -> HalfedgeMesh {
        HalfedgeMesh::from_faces(6, &[[0, 1, 2, 3, 4, 5]]).unwrap()
    }

    #[test]
    fn a_hexagon_splits_into_six() {
        let mut mesh = hexagon();
        let m = mesh.split_face(FaceId(0)).unwrap();
        mesh.validate().unwrap();
        assert_eq!((mesh.valence(m), mesh.num_faces()), (6, 6));
        assert!(mesh.is_triangle_mesh());
        for i in 0..6 {
            assert_eq!(mesh.origin(mesh.face_halfedge(FaceId(i))), VertexId(i));
            assert_eq!(mesh.edge_vertices(EdgeId(6 + i)), [m, VertexId(i)]);
        }
        let face = FaceId(6);
        let error = EditError::NoSuchFace { face, num_faces: 6 };
        assert_eq!(mesh.split_face(face), Err(error));
    }

    #[test]
    fn a_hexagon_cut_in_two() {
        let mut mesh = hexagon();
        let sides: Vec<_> = mesh.face_halfedges(FaceId(0)).collect();
        let edge = mesh.connect_corners(sides[1], sides[4]).unwrap();
        mesh.validate().unwrap();
        assert_eq!(mesh.edge_vertices(edge), [VertexId(1), VertexId(4)]);
        assert_eq!(mesh.to_faces(), [[0, 1, 4, 5], [4, 1, 2, 3]]);
    }

    #[test]
    fn refusals() {
        let mesh = hexagon();
        let sides: Vec<_> = mesh.face_halfedges(FaceId(0)).collect();
        let refused = |from: HalfedgeId, to| {
            let mut edited = mesh.clone();
            let error = edited.connect_corners(from, to).unwrap_err();
            assert_eq!(edited, mesh);
            error
        };
        let [a, b, c] = [sides[0], sides[1], sides[2]];
        assert_eq!(refused(a, a), EditError::NotOneFace { corners: [a, a] });
        assert_eq!(
            refused(a, c.twin()),
            EditError::NotOneFace {
                corners: [a, c.twin()]
            }
        );
        let edge = a.edge();
        let vertices = [VertexId(0), VertexId(1)];
        assert_eq!(refused(a, b), EditError::EdgeExists { vertices, edge });
        assert!(matches!(
            refused(a, HalfedgeId(99)),
            EditError::NoSuchHalfedge { .. }
        ));
    }
}
