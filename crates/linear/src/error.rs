//! What can be wrong with a system.

use cotan_geometry::Readable;
use cotan_halfedge::VertexId;
use thiserror::Error;

use crate::strategy::{Reason, Strategy};

/// Why a system could not be prepared.
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
        /// How many vertices the component has.
        num_vertices: usize,
    },
    /// A handle at a vertex that the mesh does not have.
    #[error(
        "handle vertex {vertex} does not exist: the mesh has {num_vertices} vertices, numbered from 0"
    )]
    HandleOutOfRange {
        /// The vertex number that was given.
        vertex: VertexId,
        /// How many vertices there are.
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
    /// A membrane weight that is negative or not finite.
    #[error("the membrane weight {} is not a finite number of at least 0", Readable(*_0))]
    MembraneWeight(f64),
    /// A matrix that cannot be factorized.
    #[error(
        "the system of {unknowns} unknowns cannot be factorized: it is not positive definite in double precision (look for zero-area faces, and for handles that leave a part of the mesh free)"
    )]
    NotPositiveDefinite {
        /// Number of free vertices.
        unknowns: usize,
    },
    /// A factorization that does not reproduce its matrix.
    #[error(
        "the factorization of {unknowns} unknowns is not accurate: a check solve left a relative residual of {residual:.1e} (look for zero-area faces)"
    )]
    Inaccurate {
        /// Number of free vertices.
        unknowns: usize,
        /// Normwise backward error of the check solve.
        residual: f64,
    },
    /// An iteration that did not reach its tolerance.
    #[error(
        "the iteration for {unknowns} unknowns did not converge: a relative residual of {residual:.1e} is left (look for zero-area faces, or take the strategy \"normal\")"
    )]
    NotConverged {
        /// Number of unknowns.
        unknowns: usize,
        /// The largest |residual| / |right-hand side| that is left.
        residual: f64,
    },
    /// Not enough memory.
    #[error("not enough memory for a system of {unknowns} unknowns ({bytes} bytes for the factor)")]
    OutOfMemory {
        /// Number of free vertices.
        unknowns: usize,
        /// Size of the factor.
        bytes: u64,
    },
    /// A strategy was asked for that cannot serve.
    #[error(
        "the strategy \"{strategy}\" cannot solve this system because {reason}; take \"auto\" or \"normal\""
    )]
    StrategyUnsuitable {
        /// What was asked for.
        strategy: Strategy,
        /// Why it cannot serve.
        reason: Reason,
    },
    /// Handles whose columns are the same within rounding.
    #[error(
        "the {handles} handles are too close together to be held by columns of the inverse; take the strategy \"auto\" or \"normal\""
    )]
    IllConditioned {
        /// Number of handles that need a column.
        handles: usize,
    },
    /// More memory is predicted than is allowed.
    #[error(
        "the system is predicted to take {} by the strategy \"{strategy}\", but only {} are allowed; raise the limit, hold more of the mesh still, or simplify it", megabytes(*predicted), megabytes(*permitted)
    )]
    MemoryLimit {
        /// What would be used.
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

fn megabytes(bytes: u64) -> String {
    format!("{:.1} MB", bytes as f64 / 1e6)
}
