//! A complete check of a mesh: every invariant that [`HalfedgeMesh`] guarantees.
//!
//! Construction and edits preserve these by design; the check is meant for tests, fuzzing and
//! debugging. It assumes nothing: ranges are checked first, so a broken mesh gives an error
//! rather than a panic.

use thiserror::Error;

use crate::ids::{EdgeId, FaceId, HalfedgeId, NONE, VertexId};
use crate::mesh::HalfedgeMesh;

/// An invariant that a mesh violates, with its location.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[non_exhaustive]
pub enum ValidateError {
    /// The halfedge arrays have different lengths, or an odd length.
    #[error("the halfedge arrays have lengths {lengths:?}; they must be equal and even")]
    Lengths {
        /// Lengths of target, next, prev, face.
        lengths: [usize; 4],
    },
    /// A halfedge refers to an element that does not exist.
    #[error("halfedge {halfedge} refers to a {element} that does not exist")]
    HalfedgeRange {
        /// The halfedge.
        halfedge: HalfedgeId,
        /// The kind of element that it refers to.
        element: &'static str,
    },
    /// The halfedge stored for a vertex does not exist or starts at another vertex.
    #[error("the halfedge stored for vertex {vertex} does not leave it")]
    VertexHalfedge {
        /// The vertex.
        vertex: VertexId,
    },
    /// The halfedge stored for a boundary vertex is not its boundary halfedge.
    #[error("vertex {vertex} lies on the boundary, but its stored halfedge does not")]
    NotBoundaryHalfedge {
        /// The vertex.
        vertex: VertexId,
    },
    /// The first halfedge of a face does not exist or belongs to another face.
    #[error("the first halfedge of face {face} does not belong to it")]
    FaceHalfedge {
        /// The face.
        face: FaceId,
    },
    /// `next` and `prev` are not inverse to each other.
    #[error("next and prev disagree at halfedge {halfedge}")]
    NextPrev {
        /// The halfedge.
        halfedge: HalfedgeId,
    },
    /// The successor of a halfedge starts at another vertex.
    #[error("the halfedge after {halfedge} does not start where it ends")]
    Disconnected {
        /// The halfedge.
        halfedge: HalfedgeId,
    },
    /// The successor of a halfedge has another face.
    #[error("the halfedge after {halfedge} belongs to another face")]
    FaceChanges {
        /// The halfedge.
        halfedge: HalfedgeId,
    },
    /// An edge joins a vertex to itself.
    #[error("edge {edge} joins a vertex to itself")]
    SelfLoop {
        /// The edge.
        edge: EdgeId,
    },
    /// An edge has no face on either side.
    #[error("edge {edge} has no face")]
    LooseEdge {
        /// The edge.
        edge: EdgeId,
    },
    /// Two edges have the same ends.
    #[error("edges {} and {} join the same two vertices", edges[0], edges[1])]
    DoubleEdge {
        /// The two edges.
        edges: [EdgeId; 2],
    },
    /// A face has fewer than three corners.
    #[error("face {face} has only {degree} corners")]
    TooFewCorners {
        /// The face.
        face: FaceId,
        /// Its number of corners.
        degree: usize,
    },
    /// A face visits a vertex twice.
    #[error("face {face} passes twice through vertex {vertex}")]
    RepeatedVertex {
        /// The face.
        face: FaceId,
        /// The vertex.
        vertex: VertexId,
    },
    /// Some halfedges refer to a face but are not on its loop.
    #[error("face {face} is more than one loop of halfedges")]
    SeveralLoops {
        /// The face.
        face: FaceId,
    },
    /// A vertex has outgoing halfedges that its fan does not reach.
    #[error("vertex {vertex} joins more than one fan of faces")]
    SeveralFans {
        /// The vertex.
        vertex: VertexId,
    },
}

impl HalfedgeMesh {
    /// Checks all invariants of [`HalfedgeMesh`]. O(n log n).
    ///
    /// A mesh built by [`HalfedgeMesh::from_faces`] passes, also after any sequence of edits.
    ///
    /// # Errors
    /// The first violated invariant, with the element at fault.
    pub fn validate(&self) -> Result<(), ValidateError> {
        self.validate_ranges()?;
        self.validate_links()?;
        self.validate_edges()?;
        self.validate_faces()?;
        self.validate_vertices()
    }

    fn validate_ranges(&self) -> Result<(), ValidateError> {
        let lengths = [
            self.target.len(),
            self.next.len(),
            self.prev.len(),
            self.face.len(),
        ];
        if lengths.iter().any(|&len| len != lengths[0] || len % 2 == 1) {
            return Err(ValidateError::Lengths { lengths });
        }
        for halfedge in self.halfedges() {
            let i = halfedge.index();
            let references = [
                ("vertex", self.target[i].index() < self.num_vertices()),
                ("next halfedge", self.next[i].index() < self.num_halfedges()),
                (
                    "previous halfedge",
                    self.prev[i].index() < self.num_halfedges(),
                ),
                (
                    "face",
                    self.face[i] == NONE || (self.face[i] as usize) < self.num_faces(),
                ),
            ];
            if let Some(&(element, _)) = references.iter().find(|(_, exists)| !exists) {
                return Err(ValidateError::HalfedgeRange { halfedge, element });
            }
        }
        for vertex in self.vertices() {
            let h = self.vertex_halfedge(vertex);
            if h.index() >= self.num_halfedges() || self.origin(h) != vertex {
                return Err(ValidateError::VertexHalfedge { vertex });
            }
        }
        for face in self.faces() {
            let h = self.face_halfedge(face);
            if h.index() >= self.num_halfedges() || self.face(h) != Some(face) {
                return Err(ValidateError::FaceHalfedge { face });
            }
        }
        Ok(())
    }

    fn validate_links(&self) -> Result<(), ValidateError> {
        for halfedge in self.halfedges() {
            let next = self.next(halfedge);
            if self.prev(next) != halfedge || self.next(self.prev(halfedge)) != halfedge {
                return Err(ValidateError::NextPrev { halfedge });
            }
            if self.origin(next) != self.target(halfedge) {
                return Err(ValidateError::Disconnected { halfedge });
            }
            if self.face(next) != self.face(halfedge) {
                return Err(ValidateError::FaceChanges { halfedge });
            }
        }
        Ok(())
    }

    fn validate_edges(&self) -> Result<(), ValidateError> {
        let mut ends = Vec::with_capacity(self.num_edges());
        for edge in self.edges() {
            let [a, b] = self.edge_vertices(edge);
            if a == b {
                return Err(ValidateError::SelfLoop { edge });
            }
            if edge
                .halfedges()
                .into_iter()
                .all(|h| self.is_boundary_halfedge(h))
            {
                return Err(ValidateError::LooseEdge { edge });
            }
            ends.push((a.min(b), a.max(b), edge));
        }
        ends.sort_unstable();
        match ends
            .windows(2)
            .find(|pair| (pair[0].0, pair[0].1) == (pair[1].0, pair[1].1))
        {
            Some(pair) => Err(ValidateError::DoubleEdge {
                edges: [pair[0].2, pair[1].2],
            }),
            None => Ok(()),
        }
    }

    fn validate_faces(&self) -> Result<(), ValidateError> {
        let mut labelled = vec![0usize; self.num_faces()];
        for face in self.halfedges().filter_map(|h| self.face(h)) {
            labelled[face.index()] += 1;
        }
        let mut seen = vec![NONE; self.num_vertices()];
        for face in self.faces() {
            let mut degree = 0;
            for vertex in self.face_vertices(face) {
                if std::mem::replace(&mut seen[vertex.index()], face.0) == face.0 {
                    return Err(ValidateError::RepeatedVertex { face, vertex });
                }
                degree += 1;
            }
            if degree < 3 {
                return Err(ValidateError::TooFewCorners { face, degree });
            }
            if degree != labelled[face.index()] {
                return Err(ValidateError::SeveralLoops { face });
            }
        }
        Ok(())
    }

    fn validate_vertices(&self) -> Result<(), ValidateError> {
        let mut leaving = vec![0usize; self.num_vertices()];
        for halfedge in self.halfedges() {
            let vertex = self.origin(halfedge);
            leaving[vertex.index()] += 1;
            if self.is_boundary_halfedge(halfedge) && !self.is_boundary_vertex(vertex) {
                return Err(ValidateError::NotBoundaryHalfedge { vertex });
            }
        }
        match self
            .vertices()
            .find(|&v| self.valence(v) != leaving[v.index()])
        {
            Some(vertex) => Err(ValidateError::SeveralFans { vertex }),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles that share an edge: four corners, all on the boundary.
    fn square() -> HalfedgeMesh {
        HalfedgeMesh::from_faces(4, &[[0, 1, 2], [0, 2, 3]]).unwrap()
    }

    fn broken(damage: impl FnOnce(&mut HalfedgeMesh)) -> ValidateError {
        let mut mesh = square();
        assert_eq!(mesh.validate(), Ok(()));
        damage(&mut mesh);
        mesh.validate().unwrap_err()
    }

    #[test]
    fn empty_mesh_is_valid() {
        assert_eq!(HalfedgeMesh::default().validate(), Ok(()));
    }

    #[test]
    fn ranges_are_checked_first() {
        let far = HalfedgeId(99);
        assert!(matches!(
            broken(|m| m.target.truncate(9)),
            ValidateError::Lengths { .. }
        ));
        assert!(matches!(
            broken(|m| m.next[3] = far),
            ValidateError::HalfedgeRange { .. }
        ));
        assert!(matches!(
            broken(|m| m.face[0] = 2),
            ValidateError::HalfedgeRange { .. }
        ));
        let error = broken(|m| m.vertex_halfedge[1] = far);
        assert_eq!(
            error,
            ValidateError::VertexHalfedge {
                vertex: VertexId(1)
            }
        );
        let error = broken(|m| m.face_halfedge[1] = m.face_halfedge[0]);
        assert_eq!(error, ValidateError::FaceHalfedge { face: FaceId(1) });
    }

    #[test]
    fn broken_links_are_named() {
        let error = broken(|m| m.next.swap(0, 2));
        assert_eq!(
            error,
            ValidateError::NextPrev {
                halfedge: HalfedgeId(0)
            }
        );
        let error = broken(|m| {
            let h = m.face_halfedge(FaceId(0));
            m.face[h.index()] = NONE;
            m.face_halfedge[0] = m.next(h);
        });
        assert!(matches!(error, ValidateError::FaceChanges { .. }));
    }

    #[test]
    fn boundary_vertex_must_store_its_boundary_halfedge() {
        let vertex = VertexId(0);
        let error = broken(|m| {
            m.vertex_halfedge[0] = m.outgoing_halfedges(vertex).next().unwrap();
        });
        assert_eq!(error, ValidateError::NotBoundaryHalfedge { vertex });
    }

    #[test]
    fn two_fans_and_double_edges_are_found() {
        // Two tetrahedra; vertex 4 is then identified with vertex 0.
        let tetrahedron = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2u32]];
        let faces: Vec<[u32; 3]> = [0, 4]
            .into_iter()
            .flat_map(|shift| tetrahedron.map(|face| face.map(|v| v + shift)))
            .collect();
        let apart = HalfedgeMesh::from_faces(8, &faces).unwrap();
        let merge = |mesh: &mut HalfedgeMesh, from: u32, to: u32| {
            for v in &mut mesh.target {
                *v = if v.0 == from { VertexId(to) } else { *v };
            }
        };
        let mut pinched = apart.clone();
        merge(&mut pinched, 4, 0);
        pinched.vertex_halfedge[4] = pinched.vertex_halfedge[7];
        merge(&mut pinched, 7, 4);
        pinched.vertex_halfedge.pop();
        assert_eq!(
            pinched.validate(),
            Err(ValidateError::SeveralFans {
                vertex: VertexId(0)
            })
        );
        merge(&mut pinched, 5, 1);
        pinched.vertex_halfedge[5] = pinched.vertex_halfedge[6];
        merge(&mut pinched, 6, 5);
        pinched.vertex_halfedge.pop();
        assert!(matches!(
            pinched.validate(),
            Err(ValidateError::DoubleEdge { .. })
        ));
    }
}
