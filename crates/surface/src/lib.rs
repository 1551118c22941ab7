//! Algorithms on triangle meshes that a pipeline needs around its main job: remeshing, decimation,
//! subdivision, distances along the surface, and curvature.
//!
//! Each is one module with its formula and its source, generic over `f32` and `f64`, and gives the
//! same bytes for any number of threads. Queries (closest points, rays) are in `cotan-geometry`.

#![warn(missing_docs)]

mod curvatures;
mod deviation;
mod edge_paths;
mod heat;
mod isolines;
mod straight;

pub use curvatures::{
    PrincipalCurvature, gaussian_curvatures, mean_curvatures, principal_curvatures,
};
pub use deviation::{Deviation, DeviationOptions, OneSidedDeviation, deviation};
pub use edge_paths::EdgePaths;
pub use heat::{DistanceError, GeodesicDistances, HeatOptions};
pub use isolines::{Isoline, isolines};
pub use straight::{LineEnd, StraightLine, straight_line};
