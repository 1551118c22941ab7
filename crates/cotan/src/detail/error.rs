//! Errors of the transfer of details.

use cotan_geometry::Readable;
use cotan_halfedge::VertexId;
use thiserror::Error as ThisError;

use crate::error::Error;

/// The reason why details could not be transferred.
#[derive(Clone, PartialEq, Debug, ThisError)]
#[non_exhaustive]
pub enum DetailError {
    /// The surface has no area, so that sizes relative to it mean nothing.
    #[error("the surface has no area; details are measured relative to its size")]
    NoArea,
    /// The correspondence belongs to other meshes.
    #[error(
        "the correspondence is between meshes of {} and {} vertices, but those given have {} and {}",
        expected[0], expected[1], found[0], found[1]
    )]
    OtherMeshes {
        /// The numbers of vertices of source and target that the correspondence was made for.
        expected: [usize; 2],
        /// Those of the meshes that were given.
        found: [usize; 2],
    },
    /// A corresponding point is not a point of a triangle of the source.
    #[error(
        "the point that corresponds to vertex {vertex} is not in a triangle of the source: its three corners must exist, and their weights be at least 0 with the sum 1"
    )]
    NotAPoint {
        /// The vertex of the target.
        vertex: VertexId,
    },
    /// No vertex of the target has a counterpart.
    #[error(
        "no part of the target corresponds to the source; place the source on the target, for example by landmarks, or map both to a sphere"
    )]
    NothingCovered,
    /// The correspondence distorts details too much.
    #[error(
        "the map from the target to the source stretches a twentieth of the area by more than {} times, and {} are allowed; details would become stripes: give landmarks, transfer to a part only, or allow more",
        Readable(*stretch), Readable(*limit)
    )]
    Stretched {
        /// The 95 % quantile of the stretch.
        stretch: f64,
        /// The limit.
        limit: f64,
    },
    /// A mesh could not be filtered, or a setting is out of range.
    #[error(transparent)]
    Mesh(#[from] Error),
}
