//! Errors in mesh buffers.

use cotan_halfedge::BuildError;
use thiserror::Error;

/// The reason why positions and faces do not form a mesh. All indices refer to the input, from 0.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The list of triangle corners is incomplete.
    #[error("{count} indices are not a multiple of three; give three per triangle")]
    Indices {
        /// The number of indices given.
        count: usize,
    },
    /// There are no faces.
    #[error("there are no faces; a mesh needs one or more")]
    NoFaces,
    /// Every face has fewer than three distinct positions.
    #[error("all {num_faces} faces collapse when equal positions are welded")]
    AllCollapsed {
        /// The number of faces given.
        num_faces: usize,
    },
    /// A vertex does not belong to any face.
    #[error("vertex {vertex} belongs to no face; leave it out or set `MeshBuilder::drop_unused`")]
    Unused {
        /// The vertex.
        vertex: usize,
    },
    /// A coordinate is NaN or infinite, possibly because the scalar type of the mesh cannot hold
    /// it.
    #[error("vertex {vertex} has a coordinate that is not a finite number")]
    NonFinite {
        /// The vertex.
        vertex: usize,
    },
    /// The faces do not form an oriented 2-manifold.
    #[error(transparent)]
    NotManifold(#[from] BuildError),
    /// A polygon cannot be cut into triangles.
    #[error(
        "face {face} ({degree} corners) cannot be cut into triangles without doubling an edge; give triangles instead"
    )]
    NotCut {
        /// The face.
        face: usize,
        /// Its number of corners.
        degree: usize,
    },
}
