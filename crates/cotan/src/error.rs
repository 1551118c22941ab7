//! What the facade's functions report.

use cotan_flow::FlowError;
use cotan_geometry::{MeshError, Readable, SurfaceError};
use cotan_halfedge::VertexId;
use cotan_laplacian::SchemeError;
use cotan_linear::LinearError;
use thiserror::Error as ThisError;

use crate::handles::HandleId;

/// Why a mesh could not be edited or measured.
#[derive(Clone, PartialEq, Debug, ThisError)]
#[non_exhaustive]
pub enum Error {
    /// The flow could not be built or could not go on.
    #[error(transparent)]
    Flow(#[from] FlowError),
    /// A mesh to be measured is no surface.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// Positions and faces are no mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A mesh to be measured cannot be weighted.
    #[error(transparent)]
    Scheme(#[from] SchemeError),
    /// A handle vertex that does not exist.
    #[error(
        "handle {group} names vertex {vertex}, but the mesh has {num_vertices} vertices, numbered from 0"
    )]
    HandleOutOfRange {
        /// Which handle, counted from 0.
        group: usize,
        /// The vertex number.
        vertex: VertexId,
        /// How many vertices there are.
        num_vertices: usize,
    },
    /// A handle without vertices.
    #[error("handle {group} holds no vertex; check its numbers, box or sphere")]
    EmptyHandle {
        /// Which handle, counted from 0.
        group: usize,
    },
    /// A list of targets of the wrong length.
    #[error("handle {group} has {vertices} vertices but {targets} target positions")]
    TargetCount {
        /// Which handle, counted from 0.
        group: usize,
        /// Its number of vertices.
        vertices: usize,
        /// The number of targets.
        targets: usize,
    },
    /// Two handles that want a vertex at two places.
    #[error("handles {} and {} contradict each other: they want vertex {vertex} at two places", groups[0], groups[1])]
    Contradiction {
        /// The two handles, counted from 0.
        groups: [usize; 2],
        /// The vertex.
        vertex: VertexId,
    },
    /// A handle that does not exist in a session.
    #[error("handle {handle} does not exist, or was removed: the session has {num_handles}")]
    NoSuchHandle {
        /// The name that was given.
        handle: HandleId,
        /// How many there are.
        num_handles: usize,
    },
    /// An observer stopped a job before there was a result.
    #[error("stopped on request")]
    Cancelled,
    /// A smoothing whose positions ran away.
    #[error(
        "smoothing ran away after {iterations} iterations; hold the mesh with more handles, or use an anchored method"
    )]
    SmoothingDiverged {
        /// How many iterations there were.
        iterations: usize,
    },
    /// A volume or an area that no offset along the normals restores.
    #[error(
        "the volume or area of the component of vertex {vertex} cannot be kept exactly{}",
        bound.map_or(String::new(), |d| format!(" while no vertex moves farther than {}; allow more", Readable(d)))
    )]
    CannotPreserve {
        /// The component's vertex with the lowest number.
        vertex: VertexId,
        /// The displacement bound, if there was one.
        bound: Option<f64>,
    },
    /// A field or a mask of the wrong length.
    #[error("{what} has {len} values, but the mesh has {num_vertices} vertices")]
    FieldLength {
        /// What it is.
        what: &'static str,
        /// Its number of values.
        len: usize,
        /// How many vertices there are.
        num_vertices: usize,
    },
    /// Two embeddings that do not belong to the same mesh.
    #[error("the two meshes differ in connectivity: {0}")]
    DifferentMeshes(String),
}

impl From<LinearError> for Error {
    fn from(error: LinearError) -> Self {
        Self::Flow(error.into())
    }
}
