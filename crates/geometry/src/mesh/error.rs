//! Errors in the buffers of a mesh.

use cotan_halfedge::BuildError;
use thiserror::Error;

/// Why positions and faces do not form a mesh. All numbers are those of the input, from 0.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[non_exhaustive]
pub enum MeshError {
    /// A list of triangle corners that is cut short.
    #[error("{count} indices are not a multiple of three; give three per triangle")]
    Indices {
        /// The number of indices that were given.
        count: usize,
    },
    /// Nothing to build from.
    #[error("there are no faces; a mesh needs one or more")]
    NoFaces,
    /// Every face has fewer than three different positions.
    #[error("all {num_faces} faces collapse when equal positions are welded")]
    AllCollapsed {
        /// The number of faces that were given.
        num_faces: usize,
    },
    /// A vertex without a face.
    #[error("vertex {vertex} belongs to no face; leave it out or set `MeshBuilder::drop_unused`")]
    Unused {
        /// The vertex.
        vertex: usize,
    },
    /// A coordinate that is NaN or infinite, perhaps because the mesh's scalar type cannot hold it.
    #[error("vertex {vertex} has a coordinate that is not a finite number")]
    NonFinite {
        /// The vertex.
        vertex: usize,
    },
    /// The faces do not form an oriented 2-manifold.
    #[error(transparent)]
    NotManifold(#[from] BuildError),
    /// A polygon that cannot be cut into triangles.
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
