//! Deletion of faces.

use super::renumbering::Changes;
use super::{EditError, Renumbering};
use crate::ids::{FaceId, HalfedgeId, NONE, VertexId};
use crate::map::{EdgeMap, FaceMap, VertexMap};
use crate::mesh::HalfedgeMesh;

/// The new boundary at a vertex that loses some of its faces.
struct Border {
    vertex: VertexId,
    /// The boundary halfedges that will arrive and leave, or `None` if the vertex is removed as
    /// well.
    sides: Option<[HalfedgeId; 2]>,
}

impl HalfedgeMesh {
    /// Removes faces, and the edges and vertices that no other face uses.
    ///
    /// ```text
    ///    ●──────●──────●           ●──────●
    ///    │      │      │           │      ▲
    ///    │  f   │  g   │    ──▶    │  f   │ boundary
    ///    │      │      │           │      │
    ///    ●──────●──────●           ●──────●
    /// ```
    ///
    /// The remaining elements keep their order and move up to close the gaps. O(n). A face may be
    /// listed more than once. If all faces are removed, the mesh is empty.
    ///
    /// # Errors
    /// [`EditError::BowTie`] if several fans of faces would meet at a vertex (the lowest such
    /// vertex is reported), [`EditError::NoSuchFace`].
    pub fn delete_faces(&mut self, faces: &[FaceId]) -> Result<Renumbering, EditError> {
        self.check_no_copies()?;
        let mut doomed = FaceMap::filled(self.num_faces(), false);
        for &face in faces {
            self.check_face(face)?;
            doomed[face] = true;
        }
        let borders = self.new_borders(&doomed)?;

        let mut lost_edges = EdgeMap::filled(self.num_edges(), false);
        let mut lost_vertices = VertexMap::filled(self.num_vertices(), false);
        for h in self.halfedges() {
            if self.face(h).is_some_and(|f| doomed[f]) {
                self.face[h.index()] = NONE;
                // Both sides are without a face if the other side had none or has lost its own.
                lost_edges[h.edge()] = self.is_boundary_halfedge(h.twin());
            }
        }
        for Border { vertex, sides } in borders {
            match sides {
                Some([arriving, leaving]) => {
                    self.link(arriving, leaving);
                    self.vertex_halfedge[vertex.index()] = leaving;
                }
                None => lost_vertices[vertex] = true,
            }
        }
        let renumbering = Renumbering {
            vertices: Changes::move_up(&lost_vertices),
            edges: Changes::move_up(&lost_edges),
            faces: Changes::move_up(&doomed),
        };
        self.renumber(&renumbering);
        Ok(renumbering)
    }

    /// The new boundary at each corner of the doomed faces, in ascending order of the vertices.
    fn new_borders(&self, doomed: &FaceMap<bool>) -> Result<Vec<Border>, EditError> {
        let mut touched = VertexMap::filled(self.num_vertices(), false);
        for (face, _) in doomed.iter().filter(|(_, is_doomed)| **is_doomed) {
            self.face_vertices(face).for_each(|v| touched[v] = true);
        }
        let touched = self.vertices().filter(|&v| touched[v]);
        touched
            .map(|vertex| self.new_border(vertex, doomed))
            .collect()
    }

    /// Walks once around a vertex and finds the places where remaining faces begin and end.
    fn new_border(&self, vertex: VertexId, doomed: &FaceMap<bool>) -> Result<Border, EditError> {
        let stays = |h: HalfedgeId| self.face(h).is_some_and(|face| !doomed[face]);
        let mut num_fans = 0;
        let mut sides = None;
        let mut leaving = None;
        let mut arriving = None;
        let last = self.outgoing_halfedges(vertex).next_back();
        let mut before = last.is_some_and(stays);
        for h in self.outgoing_halfedges(vertex) {
            match (before, stays(h)) {
                (false, true) => {
                    num_fans += 1;
                    arriving = Some(h.twin());
                }
                (true, false) => leaving = Some(h),
                _ => {}
            }
            before = stays(h);
        }
        if num_fans > 1 {
            return Err(EditError::BowTie { vertex, num_fans });
        }
        if let (Some(arriving), Some(leaving)) = (arriving, leaving) {
            sides = Some([arriving, leaving]);
        }
        Ok(Border { vertex, sides })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::TriangleFaces;

    #[test]
    fn a_hole_in_a_sphere() {
        let mesh = TriangleFaces::icosahedron().mesh().unwrap();
        let mut open = mesh.clone();
        let fan: Vec<_> = mesh.vertex_faces(VertexId(4)).collect();
        let changes = open.delete_faces(&fan).unwrap();
        open.validate().unwrap();
        assert_eq!(
            (open.num_vertices(), open.num_edges(), open.num_faces()),
            (11, 25, 15)
        );
        assert_eq!(open.boundary_loop(open.boundary_loops()[0]).count(), 5);
        assert_eq!(changes.vertex(VertexId(4)), None);
        assert_eq!(changes.vertex(VertexId(11)), Some(VertexId(10)));
        for face in mesh.faces().filter(|f| !fan.contains(f)) {
            let moved = changes.face(face).unwrap();
            let corners: Vec<_> = mesh
                .face_vertices(face)
                .map(|v| changes.vertex(v).unwrap())
                .collect();
            assert_eq!(open.face_vertices(moved).collect::<Vec<_>>(), corners);
        }
    }

    #[test]
    fn all_faces() {
        let mut mesh = TriangleFaces::torus(3, 4).mesh().unwrap();
        let all: Vec<_> = mesh.faces().chain(mesh.faces()).collect();
        let _ = mesh.delete_faces(&all).unwrap();
        assert_eq!(mesh, HalfedgeMesh::default());
    }

    #[test]
    fn a_bow_tie_is_refused() {
        // A grid of two by two squares: opposite squares meet only in the middle.
        let faces = [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7u32]];
        let mesh = HalfedgeMesh::from_faces(9, &faces).unwrap();
        let mut edited = mesh.clone();
        let error = edited.delete_faces(&[FaceId(0), FaceId(3)]).unwrap_err();
        assert_eq!(
            error,
            EditError::BowTie {
                vertex: VertexId(4),
                num_fans: 2
            }
        );
        assert_eq!(edited, mesh);
        let _ = edited
            .delete_faces(&[FaceId(0), FaceId(3), FaceId(2)])
            .unwrap();
        edited.validate().unwrap();
        assert_eq!(edited.to_faces(), [[0, 1, 3, 2]]);
    }
}
