//! Triangle mesh editing: move a few handles, and the surface follows with its details rotated
//! and scaled naturally.
//!
//! cotan implements and extends "Mesh Editing with Curvature Flow Laplacian Operator" (Au, Tai,
//! Fu, Liu 2005). Everything is based on one iteration: solve a sparse system whose matrix never
//! changes, then rebuild the right-hand side from the new positions.
//!
//! ```
//! use cotan::prelude::*;
//!
//! // A bar, one end fixed, the other raised and turned.
//! let shape = cotan::shapes::bar::<f64>([4.0, 1.0, 1.0], [16, 4, 4]);
//! let left = shape.surface().vertices_where(|p| p.x < -1.99);
//! let right = shape.surface().vertices_where(|p| p.x > 1.99);
//! let turn = Isometry3::new(Vector3::new(0.0, 1.0, 0.0), Vector3::new(0.0, 0.0, 0.7));
//! let handles = Handles::new().fix(left).transform(right, turn.to_homogeneous());
//!
//! let deformed = deform(&shape, &handles, &DeformOptions::default())?;
//! assert_eq!(deformed.report.stop, StopReason::Converged);
//!
//! let surface = shape.surface();
//! let quality = Quality::measure(&surface, &surface.with_positions(&deformed.positions))?;
//! assert_eq!(quality.flipped_faces, 0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! - A [`Mesh`] is built from flat buffers of positions and indices, and converted back to them.
//!   Every job takes `&mesh`, or a [`Surface`] for other positions
//!   (`mesh.surface().with_positions(&moved)`). [`Surface`] has the measures as methods.
//! - [`deform()`] moves handles once; a [`Session`] is kept while they move.
//! - [`reconstruct()`] rebuilds a shape from its two scalar fields alone.
//! - [`spherical()`] maps a closed mesh onto the unit sphere without flipped triangles;
//!   [`sphere`] works with such maps.
//! - [`smooth`] smooths without shrinking, and edits the curvature field.
//! - [`detail`] carries details from one surface to another, of other triangles.
//! - [`merge`](mod@merge) joins parts of two surfaces without a seam.
//! - [`fair()`] makes a part of a surface, such as a filled hole, continue the rest.
//! - [`Quality`] measures the effects of a deformation.
//! - The underlying crates are re-exported: [`halfedge`], [`geometry`], [`laplacian`],
//!   [`linear`], [`flow`], [`surface`]. A [`flow::Flow`] takes any [`laplacian::LaplacianScheme`],
//!   [`flow::ScalarFieldUpdater`] and [`flow::Orientation`], including custom ones.
//! - With the feature `testing`, `cotan::testing` has proptest strategies for random surfaces and
//!   motions.

pub use cotan_flow as flow;
pub use cotan_geometry as geometry;
#[cfg(feature = "testing")]
pub use cotan_geometry::testing;
pub use cotan_geometry::{BuiltMesh, Mesh, MeshBuilder, MeshError, Surface, shapes};
pub use cotan_halfedge as halfedge;
pub use cotan_laplacian as laplacian;
pub use cotan_linear as linear;
pub use cotan_surface as surface;
pub use nalgebra;
pub use nalgebra_sparse;

pub mod sphere;

mod arap;
mod comparison;
mod deform;
pub mod detail;
mod error;
mod fair;
mod handle_id;
mod handles;
pub mod merge;
mod named;
mod options;
mod outward;
mod part_options;
mod parts;
mod quality;
mod reconstruct;
mod session;
pub mod smooth;
mod turning;
mod unmoved;

pub use comparison::{ErrorFields, ShapeComparison, ShapeErrors};
pub use deform::{Deformed, deform, deform_with};
pub use error::Error;
pub use fair::fair;
pub use handle_id::HandleId;
pub use handles::{HandleGroup, Handles, Motion};
pub use named::UnknownName;
pub use options::{DeformOptions, DetailSize, OrientationKind, SchemeKind};
pub use part_options::{Parts, Ties};
pub use parts::{PartReport, Role, survey};
pub use quality::{Extent, Quality, ShapeDistance};
pub use reconstruct::{reconstruct, reconstruct_observed};
pub use session::Session;
pub use sphere::spherical;
pub use turning::nearest_turn;

/// The names that most programs need: the jobs, and the traits for custom schemes, updaters,
/// orientations and energies with their argument types.
pub mod prelude {
    pub use crate::{
        DeformOptions, Deformed, DetailSize, Error, HandleGroup, HandleId, Handles, Motion,
        OrientationKind, Quality, SchemeKind, Session, ShapeDistance, ShapeErrors, deform,
        deform_with, reconstruct,
    };
    pub use cotan_flow::{
        Acceleration, BestRotation, BoxUnits, Energy, FirstGuess, FittedCells, Flow, FlowBuilder,
        FlowError, FlowState, Hybrid, KeepMagnitude, Limited, LocalGlobal, LostTurn, NextStep,
        Orientation, PerRest, Reflect, ReflectFirst, Report, RescaleByArea, Rest,
        ScalarFieldUpdater, Schedule, Start, StepReport, Stiffness, StopReason, Winding,
        nearest_rotation,
    };
    pub use cotan_geometry::{
        BuiltMesh, Mesh, MeshBuilder, MeshError, Positions, Scalar, Surface, SurfaceError, scalar,
    };
    pub use cotan_halfedge::{
        EdgeId, EdgeMap, EditError, FaceId, FaceMap, HalfedgeId, HalfedgeMap, HalfedgeMesh,
        VertexId, VertexMap,
    };
    pub use cotan_laplacian::{
        ClampedCotangent, Cotangent, EdgeLength, FanSums, Fans, LaplacianScheme, Operator,
        SchemeError, Symmetry, Tutte, Uniform,
    };
    pub use cotan_linear::{Handle, Hold, LinearSystem};
    pub use nalgebra::{Isometry3, Matrix3, Matrix4, Point3, Rotation3, Vector3};
}

/// Runs the example of the README as a doc test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;
