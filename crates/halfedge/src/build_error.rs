//! Errors in a list of faces.

use thiserror::Error;

use crate::ids::VertexId;

/// The reason why a list of faces is not an oriented 2-manifold.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[non_exhaustive]
pub enum BuildError {
    /// There are more elements than 32-bit ids can number.
    #[error("{count} {elements} are too many: a mesh holds fewer than 2^31 corners and vertices")]
    TooLarge {
        /// The kind of element.
        elements: &'static str,
        /// The number of elements given.
        count: usize,
    },
    /// A face has fewer than three corners.
    #[error("face {face} has {degree} corners; a face needs three or more")]
    TooFewCorners {
        /// The face, counted from 0.
        face: usize,
        /// Its number of corners.
        degree: usize,
    },
    /// A corner refers to a vertex that does not exist.
    #[error(
        "face {face} refers to vertex {vertex}, but there are only {num_vertices} vertices (numbered from 0)"
    )]
    IndexOutOfRange {
        /// The face, counted from 0.
        face: usize,
        /// The vertex index that was given.
        vertex: usize,
        /// The number of vertices.
        num_vertices: usize,
    },
    /// A face visits the same vertex twice.
    #[error("face {face} passes twice through vertex {vertex}; drop or split the face")]
    RepeatedVertex {
        /// The face, counted from 0.
        face: usize,
        /// The repeated vertex.
        vertex: VertexId,
    },
    /// An edge has three or more faces.
    #[error("the edge between vertices {} and {} has {num_faces} faces (among them face {face}); a manifold edge has at most two", vertices[0], vertices[1])]
    NonManifoldEdge {
        /// The ends of the edge.
        vertices: [VertexId; 2],
        /// The number of faces at the edge.
        num_faces: usize,
        /// One of these faces.
        face: usize,
    },
    /// Two faces traverse an edge in the same direction.
    #[error("faces {} and {} both run from vertex {} to vertex {}: they are oriented against each other; flip one of them", faces[0], faces[1], vertices[0], vertices[1])]
    InconsistentOrientation {
        /// Origin and target of the directed edge that both faces contain.
        vertices: [VertexId; 2],
        /// The two faces.
        faces: [usize; 2],
    },
    /// The faces at a vertex form more than one fan (a bow-tie).
    #[error(
        "vertex {vertex} joins {num_fans} separate fans of faces (a bow-tie); split it into one vertex per fan"
    )]
    SeveralFans {
        /// The vertex.
        vertex: VertexId,
        /// The number of fans at the vertex.
        num_fans: usize,
    },
    /// A vertex is not used by any face.
    #[error("vertex {vertex} belongs to no face; leave unreferenced vertices out")]
    IsolatedVertex {
        /// The vertex.
        vertex: VertexId,
    },
}

impl BuildError {
    /// Translates the error to other vertex and face indices, for a mesh that was built from
    /// parts of another one. Sizes, out-of-range indices and unused vertices stay unchanged. An
    /// edge is named with its lower end first.
    pub fn renumbered(
        self,
        vertex: impl Fn(VertexId) -> VertexId,
        face: impl Fn(usize) -> usize,
    ) -> Self {
        match self {
            Self::RepeatedVertex { face: f, vertex: v } => Self::RepeatedVertex {
                face: face(f),
                vertex: vertex(v),
            },
            Self::NonManifoldEdge {
                vertices,
                num_faces,
                face: f,
            } => {
                let mut vertices = vertices.map(vertex);
                vertices.sort_unstable();
                Self::NonManifoldEdge {
                    vertices,
                    num_faces,
                    face: face(f),
                }
            }
            Self::InconsistentOrientation { vertices, faces } => Self::InconsistentOrientation {
                vertices: vertices.map(vertex),
                faces: faces.map(face),
            },
            Self::SeveralFans {
                vertex: v,
                num_fans,
            } => Self::SeveralFans {
                vertex: vertex(v),
                num_fans,
            },
            other => other,
        }
    }
}
