//! Algorithms on triangle meshes that a pipeline needs around its main job: remeshing, decimation,
//! subdivision, distances along the surface, and curvature.
//!
//! Each is one module with its formula and its source, generic over `f32` and `f64`, and gives the
//! same bytes for any number of threads. Queries (closest points, rays) are in `cotan-geometry`.

#![warn(missing_docs)]
