//! Errors of a flow.

use cotan_geometry::{Readable, SurfaceError};
use cotan_halfedge::VertexId;
use cotan_laplacian::SchemeError;
use cotan_linear::LinearError;
use thiserror::Error;

/// Why a flow could not be built or could not go on.
#[derive(Clone, PartialEq, Debug, Error)]
#[non_exhaustive]
pub enum FlowError {
    /// The mesh and its positions do not form a surface.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// The surface cannot be weighted.
    #[error(transparent)]
    Scheme(#[from] SchemeError),
    /// The system cannot be solved.
    #[error(transparent)]
    Linear(#[from] LinearError),
    /// All vertices lie at one point, or so far apart that their distance overflows.
    #[error(
        "the mesh has no size to scale by: all its vertices lie at the same point, or too far apart for the precision"
    )]
    NoExtent,
    /// The number of targets is not the number of handles.
    #[error("there are {targets} target positions for {handles} handle vertices")]
    TargetCount {
        /// The number of targets.
        targets: usize,
        /// The number of handle vertices.
        handles: usize,
    },
    /// A surface that shrank to a point during the flow, or whose weights are mostly negative.
    #[error(
        "the surface has shrunk to a point, or its weights are mostly negative; try --scheme uniform"
    )]
    Collapsed,
    /// A surface that lost its volume during the flow.
    #[error("the surface encloses no volume any more, so it has no constant curvature")]
    NoVolume,
    /// A target that is NaN or infinite.
    #[error("the target of handle vertex {vertex} is not a finite position")]
    NonFiniteTarget {
        /// The handle vertex.
        vertex: VertexId,
    },
    /// A target so far away that the mesh would lose its digits.
    #[error(
        "the target of handle vertex {vertex} is so far from the mesh, compared to its size, that the mesh would lose its digits; check the units of the target"
    )]
    TargetTooFar {
        /// The handle vertex.
        vertex: VertexId,
    },
    /// A vertex of the region that the mesh does not have.
    #[error(
        "vertex {vertex} of the region does not exist: the mesh has {num_vertices} vertices, numbered from 0"
    )]
    RegionOutOfRange {
        /// The vertex index.
        vertex: VertexId,
        /// The number of vertices of the mesh.
        num_vertices: usize,
    },
    /// A vertex that is not a handle was addressed as one.
    #[error("vertex {vertex} is not a handle of this session")]
    NotAHandle {
        /// The vertex.
        vertex: VertexId,
    },
    /// A setting outside its range.
    #[error("the {setting} must be {range}, but is {}", Readable(*value))]
    Setting {
        /// Name of the setting.
        setting: &'static str,
        /// The allowed values.
        range: &'static str,
        /// The value that was given.
        value: f64,
    },
    /// An updater was given, and neither an orientation nor an energy.
    #[error(
        "an updater was given without an orientation or an energy: the membrane of the default energy knows the original edges and would mute its scalar field; choose an orientation, such as BestRotation, or name the energy that the field is to be weighed against"
    )]
    MutedUpdater,
    /// A rule that needs one oriented surface was given a mesh that was cut into pieces.
    #[error(
        "{rule} needs one oriented surface, but this mesh has non-manifold edges, bow-ties or a one-sided part; use {instead}, or repair the mesh (cotan repair)"
    )]
    NeedsOneSurface {
        /// Name of the rule.
        rule: &'static str,
        /// A replacement that works.
        instead: &'static str,
    },
    /// An updater or orientation failed, in its own words.
    #[error("{0}")]
    Custom(String),
}
