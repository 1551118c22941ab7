//! Algorithms on triangle meshes that a pipeline needs around its main job: remeshing, decimation,
//! subdivision, distances along the surface, and curvature.
//!
//! Each is one module with its formula and its source, generic over `f32` and `f64`, and gives the
//! same bytes for any number of threads. Queries (closest points, rays) are in `cotan-geometry`.

#![warn(missing_docs)]

mod curvatures;
mod decimate;
mod deviation;
mod edge_paths;
mod fast_marching;
mod features;
mod heat;
mod isolines;
mod mirror;
mod nearest;
mod reached;
mod remesh;
mod straight;
mod subdivide;
mod tessellation_error;
mod triangles;
mod units;

pub use curvatures::{
    PrincipalCurvature, gaussian_curvatures, mean_curvatures, principal_curvatures,
};
pub use decimate::{DecimateAttributes, DecimateOptions, DecimateTarget, Decimated, decimate};
pub use deviation::{Deviation, DeviationOptions, OneSidedDeviation, deviation};
pub use edge_paths::EdgePaths;
pub use fast_marching::distances_within;
pub use features::Features;
pub use heat::{DistanceError, GeodesicDistances, HeatOptions};
pub use isolines::{Isoline, isolines};
pub use mirror::{MirrorPlane, mirror_plane, nearest_corner};
pub use nearest::{corner_places, interpolated, places_near};
pub use remesh::{EdgeLengths, RemeshOptions, Remeshed, remesh};
pub use straight::{LineEnd, StraightLine, straight_line};
pub use subdivide::{Stencils, SubdivideOptions, Subdivided, SubdivisionScheme, subdivide};
pub use tessellation_error::TessellationError;

/// Runs the example of the README as a doc test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;
