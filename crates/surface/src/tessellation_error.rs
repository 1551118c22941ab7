//! The errors of algorithms that change the triangles of a mesh.

use cotan_geometry::SurfaceError;
use cotan_halfedge::BuildError;
use thiserror::Error;

/// The reasons for which a mesh cannot be decimated, remeshed or subdivided.
#[derive(Clone, PartialEq, Debug, Error)]
#[non_exhaustive]
pub enum TessellationError {
    /// A face has more than three corners.
    #[error("face {face} has more than three corners; triangulate the mesh first")]
    NotTriangles {
        /// The index of the face.
        face: usize,
    },
    /// The result would have more elements than 32-bit indices can count, or than the memory
    /// limit allows.
    #[error("the result would have about {faces} faces, which is too many; ask for fewer")]
    TooLarge {
        /// The predicted number of faces.
        faces: u64,
    },
    /// An option is out of range.
    #[error("{option} must be {expected}, not {value}")]
    Option {
        /// The name of the option.
        option: &'static str,
        /// The accepted values.
        expected: &'static str,
        /// The refused value.
        value: f64,
    },
    /// A map has a different number of entries than the mesh has elements.
    #[error("the map of {name} has {entries} entries, but the mesh has {elements} elements")]
    Length {
        /// The name of the map.
        name: &'static str,
        /// Its number of entries.
        entries: usize,
        /// The number of elements.
        elements: usize,
    },
    /// A value of an attribute is not finite.
    #[error("the attribute of vertex {vertex} is not a finite number")]
    Attribute {
        /// The index of the vertex.
        vertex: usize,
    },
    /// A coordinate is too large to compute with.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// The result is not a manifold. This is a defect of the algorithm.
    #[error("the result is not a manifold: {0}")]
    Build(#[from] BuildError),
}
