//! Errors of the functions in this crate.

use cotan_flow::FlowError;
use cotan_geometry::{MeshError, Readable, SurfaceError};
use cotan_halfedge::VertexId;
use cotan_laplacian::SchemeError;
use cotan_linear::LinearError;
use thiserror::Error as ThisError;

use crate::handle_id::HandleId;

/// The reason why a mesh could not be edited or measured.
#[derive(Clone, PartialEq, Debug, ThisError)]
#[non_exhaustive]
pub enum Error {
    /// The flow could not be built or could not continue.
    #[error(transparent)]
    Flow(#[from] FlowError),
    /// The mesh to be measured is not a valid surface.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// Positions and faces do not form a mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// No weights can be computed for the mesh to be measured.
    #[error(transparent)]
    Scheme(#[from] SchemeError),
    /// A handle refers to a vertex that does not exist.
    #[error(
        "handle {group} names vertex {vertex}, but the mesh has {num_vertices} vertices, numbered from 0"
    )]
    HandleOutOfRange {
        /// The index of the handle, from 0.
        group: usize,
        /// The vertex.
        vertex: VertexId,
        /// The number of vertices.
        num_vertices: usize,
    },
    /// A handle has no vertices.
    #[error("handle {group} holds no vertex; check its numbers, box or sphere")]
    EmptyHandle {
        /// The index of the handle, from 0.
        group: usize,
    },
    /// A list of targets has the wrong length.
    #[error("handle {group} has {vertices} vertices but {targets} target positions")]
    TargetCount {
        /// The index of the handle, from 0.
        group: usize,
        /// The number of its vertices.
        vertices: usize,
        /// The number of targets.
        targets: usize,
    },
    /// Two handles require different positions of the same vertex.
    #[error("handles {} and {} contradict each other: they move vertex {vertex} to different positions", groups[0], groups[1])]
    Contradiction {
        /// The indices of the two handles, from 0.
        groups: [usize; 2],
        /// The vertex.
        vertex: VertexId,
    },
    /// The session has no handle with this id.
    #[error("handle {handle} does not exist, or was removed: the session has {num_handles}")]
    NoSuchHandle {
        /// The id that was given.
        handle: HandleId,
        /// The number of handles.
        num_handles: usize,
    },
    /// A part of the model that does not exist was named.
    #[error("there is no part {part}; the model has {num_parts} parts, numbered from 0")]
    NoSuchPart {
        /// The number that was given.
        part: usize,
        /// The number of parts.
        num_parts: usize,
    },
    /// The strength of the ties between parts is out of range.
    #[error("the strength of ties must be above 0 and at most 1e6, but is {}", Readable(*_0))]
    TieStrength(f64),
    /// An observer stopped a job before there was a result.
    #[error("stopped on request")]
    Cancelled,
    /// The positions diverged during smoothing.
    #[error(
        "smoothing diverged after {iterations} iterations; hold the mesh with more handles, or use an anchored method"
    )]
    SmoothingDiverged {
        /// The number of completed iterations.
        iterations: usize,
    },
    /// No offset along the normals restores the volume or the area.
    #[error(
        "the volume or area of the component of vertex {vertex} cannot be kept exactly{}",
        bound.map_or(String::new(), |d| format!(" while no vertex moves farther than {}; allow more", Readable(d)))
    )]
    CannotPreserve {
        /// The lowest vertex of the component.
        vertex: VertexId,
        /// The displacement bound, if there was one.
        bound: Option<f64>,
    },
    /// A field or a mask has the wrong length.
    #[error("{what} has {len} values, but the mesh has {num_vertices} vertices")]
    FieldLength {
        /// The kind of data.
        what: &'static str,
        /// The number of its values.
        len: usize,
        /// The number of vertices.
        num_vertices: usize,
    },
    /// Two embeddings do not belong to the same mesh.
    #[error("the two meshes differ in connectivity: {0}")]
    DifferentMeshes(String),
}

impl Error {
    /// The same error with other vertex numbers, for meshes that are numbered differently
    /// elsewhere. Indices that are out of range are kept.
    #[must_use]
    pub fn with_vertices(self, number: impl Fn(VertexId) -> VertexId) -> Self {
        let linear = |error| match error {
            LinearError::ComponentWithoutHandle {
                vertex,
                num_vertices,
            } => LinearError::ComponentWithoutHandle {
                vertex: number(vertex),
                num_vertices,
            },
            LinearError::DuplicateHandle { vertex } => LinearError::DuplicateHandle {
                vertex: number(vertex),
            },
            LinearError::HandleWeight { vertex, weight } => LinearError::HandleWeight {
                vertex: number(vertex),
                weight,
            },
            other => other,
        };
        let surface = |error| match error {
            SurfaceError::NonFinite { vertex } => SurfaceError::NonFinite {
                vertex: number(vertex),
            },
            other => other,
        };
        let scheme = |error| match error {
            SchemeError::NonFiniteWeight { scheme, vertices } => SchemeError::NonFiniteWeight {
                scheme,
                vertices: vertices.map(&number),
            },
            other => other,
        };
        let flow = |error| match error {
            FlowError::Scheme(error) => FlowError::Scheme(scheme(error)),
            FlowError::Surface(error) => FlowError::Surface(surface(error)),
            FlowError::Linear(error) => FlowError::Linear(linear(error)),
            FlowError::NonFiniteTarget { vertex } => FlowError::NonFiniteTarget {
                vertex: number(vertex),
            },
            FlowError::TargetTooFar { vertex } => FlowError::TargetTooFar {
                vertex: number(vertex),
            },
            other => other,
        };
        match self {
            Self::Contradiction { groups, vertex } => Self::Contradiction {
                groups,
                vertex: number(vertex),
            },
            Self::Surface(error) => Self::Surface(surface(error)),
            Self::Scheme(error) => Self::Scheme(scheme(error)),
            Self::Flow(error) => Self::Flow(flow(error)),
            other => other,
        }
    }
}

impl From<LinearError> for Error {
    fn from(error: LinearError) -> Self {
        Self::Flow(error.into())
    }
}
