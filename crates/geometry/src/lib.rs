//! Geometry of meshes: lengths, angles, areas, normals, curvature, volume, distortion, and sample
//! shapes.
//!
//! A [`Mesh`] owns a [`HalfedgeMesh`](cotan_halfedge::HalfedgeMesh) and [`Positions`]; a
//! [`Surface`] borrows them and has the measures as methods, generic over `f32` and `f64`.
//! Measures of single corners and triangles, and comparisons of two surfaces, are free functions.
//! Measures that an iteration needs in every step also have a variant named `…_into` that fills
//! an existing map. Long loops run in parallel where that pays off, and the resulting bytes never
//! depend on the number of threads. Sums over the surface are accumulated in `f64`.
//!
//! ```
//! use cotan_geometry::icosphere;
//! use std::f64::consts::PI;
//!
//! let shape = icosphere::<f64>(4);
//! let surface = shape.surface();
//! assert!((surface.volume() / (4.0 / 3.0 * PI) - 1.0).abs() < 0.005);
//! assert!((surface.area() / (4.0 * PI) - 1.0).abs() < 0.005);
//! let total: f64 = surface.angle_defects().values().sum();
//! assert!((total - 4.0 * PI).abs() < 1e-9);
//! ```
//!
//! This crate never assembles a matrix, never iterates towards a solution, and reads no files.

mod angles;
mod areas;
mod bounds;
mod closest_tree;
mod curvature;
mod degenerate;
mod distortion;
mod lengths;
pub mod maps;
mod measures;
mod mesh;
mod normals;
mod readable;
mod scalar;
mod self_intersections;
pub mod shapes;
mod spatial_order;
mod surface;
mod surface_tree;
#[cfg(feature = "testing")]
pub mod testing;
mod triangle_map;
mod triangle_tree;
mod volume;

pub use angles::{
    AngleStatistics, angle_between, corner_angle, cotangent, far_cotangents, halfedge_corner_angle,
    negative_cotangent_share, opposite_cotangent, opposite_cotangents_into,
    opposite_cotangents_with_floor_into, triangle_cotangents, triangle_cotangents_with_floor,
};
pub use areas::{
    dual_areas_into, face_area_vector, face_area_vectors, face_area_vectors_into, face_areas_into,
    one_ring_areas, one_ring_areas_into, surface_area, triangle_area_vector,
};
pub use bounds::{BoundingBox, bounding_box};
pub use closest_tree::{Closest, ClosestTree, Marks};
pub use curvature::dihedral_angle;
pub use degenerate::relative_height;
pub use distortion::{
    Distortion, angle_distortion_rms, area_distortion, dihedral_changes, edge_distortion,
    edge_distortion_rms, edge_length_ratios, folded_faces,
};
pub use lengths::edge_lengths_into;
pub use mesh::{BuiltMesh, Mesh, MeshBuilder, MeshError};
pub use normals::{
    face_normals_into, unit_or_zero, vertex_area_vectors, vertex_area_vectors_into, vertex_normals,
    vertex_normals_into,
};
pub use readable::Readable;
pub use scalar::{Scalar, scalar};
pub use self_intersections::triangles_cross;
pub use shapes::{
    CREATURE_RESOLUTION, Region, bar, bumpy_plane, creature, creature_regions, cylinder, icosphere,
    tetrahedron, torus,
};
pub use spatial_order::SpatialOrder;
pub use surface::{Positions, Surface, SurfaceError};
pub use surface_tree::{ClosestPoint, RayHit, SurfacePoint, SurfaceTree};
pub use triangle_map::{TriangleMap, face_map, singular_values};
pub use triangle_tree::{
    Foot, Meeting, Ray, TriangleTree, closest_on_triangle, solid_angle, triangle_corners,
    triangle_on_ray,
};
pub use volume::{surface_centroid, volume};

/// Runs the example of the README as a doc test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;
