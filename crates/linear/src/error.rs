//! Errors of a system.

use cotan_geometry::Readable;
use cotan_halfedge::VertexId;
use cotan_sparse::SparseError;
use thiserror::Error;

use crate::strategy::{Reason, Strategy};

/// The reason why a system could not be prepared.
#[derive(Clone, PartialEq, Debug, Error)]
#[non_exhaustive]
pub enum LinearError {
    /// No handle at all.
    #[error("there are no handles; give at least one vertex a position")]
    NoHandles,
    /// A component of the mesh that nothing holds.
    #[error(
        "the component of the mesh with vertex {vertex} ({num_vertices} vertices) has no handle; fix or move at least one vertex of it"
    )]
    ComponentWithoutHandle {
        /// The component's lowest vertex.
        vertex: VertexId,
        /// The number of vertices of the component.
        num_vertices: usize,
    },
    /// A handle at a vertex that the mesh does not have.
    #[error(
        "handle vertex {vertex} does not exist: the mesh has {num_vertices} vertices, numbered from 0"
    )]
    HandleOutOfRange {
        /// The vertex index.
        vertex: VertexId,
        /// The number of vertices of the mesh.
        num_vertices: usize,
    },
    /// A vertex with two handles.
    #[error("vertex {vertex} is given as a handle twice")]
    DuplicateHandle {
        /// The vertex.
        vertex: VertexId,
    },
    /// A weight of a soft handle that is not a positive number, or too large.
    #[error(
        "the weight {} of the handle at vertex {vertex} must be a positive number of at most 1e9 (hard handles are met exactly)",
        Readable(*weight)
    )]
    HandleWeight {
        /// The vertex.
        vertex: VertexId,
        /// The weight that was refused.
        weight: f64,
    },
    /// A tie of a weight that is no positive number, or of a vertex that does not exist.
    #[error(
        "a tie of weight {} is no spring between points of the {num_vertices} vertices",
        Readable(*weight)
    )]
    Tie {
        /// Its weight.
        weight: f64,
        /// The number of vertices.
        num_vertices: usize,
    },
    /// A membrane weight that is negative or not finite.
    #[error("the membrane weight {} is not a finite number of at least 0", Readable(*_0))]
    MembraneWeight(f64),
    /// A factorization or an iteration that failed.
    #[error("{error}{advice}", error = .0, advice = advice(.0))]
    Sparse(SparseError),
    /// A component of the mesh in which nothing determines a constant.
    #[error(
        "the equation is singular on the component of the mesh with vertex {vertex} ({num_vertices} vertices); fix a vertex of it, or give one a positive diagonal entry"
    )]
    Singular {
        /// The component's lowest vertex.
        vertex: VertexId,
        /// The number of vertices of the component.
        num_vertices: usize,
    },
    /// A diagonal entry that is negative or not finite.
    #[error("the diagonal entry {value} of vertex {vertex} is not a finite number of at least 0")]
    Diagonal {
        /// The vertex.
        vertex: VertexId,
        /// The entry that was refused.
        value: f64,
    },
    /// A diagonal of another length than the operator.
    #[error(
        "the diagonal has {found} entries, but the operator has {expected} rows; give one per row"
    )]
    DiagonalLength {
        /// The number of rows.
        expected: usize,
        /// The number of entries that were given.
        found: usize,
    },
    /// An operator whose weights differ in the two directions of an edge.
    #[error(
        "the weights of the operator are not symmetric; take a symmetric scheme, such as the cotangent one"
    )]
    NotSymmetric,
    /// The requested strategy is unsuitable.
    #[error(
        "the strategy \"{strategy}\" cannot solve this system because {reason}; take \"auto\" or \"normal\""
    )]
    StrategyUnsuitable {
        /// The requested strategy.
        strategy: Strategy,
        /// The reason why it is unsuitable.
        reason: Reason,
    },
    /// Handles whose columns are the same within rounding.
    #[error(
        "the {handles} handles are too close together to be held by columns of the inverse; take the strategy \"auto\" or \"normal\""
    )]
    IllConditioned {
        /// The number of handles that need a column.
        handles: usize,
    },
    /// More memory is predicted than is allowed.
    #[error(
        "the system is predicted to take {} by the strategy \"{strategy}\", but only {} are allowed; raise the limit, hold more of the mesh still, or simplify it", megabytes(*predicted), megabytes(*permitted)
    )]
    MemoryLimit {
        /// The strategy that would be used.
        strategy: Strategy,
        /// Bytes of factors and columns.
        predicted: u64,
        /// Bytes that are allowed.
        permitted: u64,
    },
    /// Weights of another mesh.
    #[error("the operator belongs to another mesh than the system; prepare a new system")]
    DifferentMesh,
}

impl From<SparseError> for LinearError {
    fn from(error: SparseError) -> Self {
        Self::Sparse(error)
    }
}

/// Advice to the owner of a mesh, behind the message of the solver.
fn advice(error: &SparseError) -> &'static str {
    match error {
        SparseError::NotPositiveDefinite { .. } => {
            " (look for zero-area faces, and for handles that leave a part of the mesh free)"
        }
        SparseError::Inaccurate { .. } | SparseError::NotConverged { .. } => {
            " (look for zero-area faces)"
        }
        _ => "",
    }
}

fn megabytes(bytes: u64) -> String {
    format!("{:.1} MB", bytes as f64 / 1e6)
}
