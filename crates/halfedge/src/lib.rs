//! Connectivity of polygon meshes: a compact half-edge structure with typed ids, dense maps,
//! checked construction and checked edits.
//!
//! This crate contains no floating-point numbers and does not depend on other crates of the
//! workspace. Positions and all other attributes are stored in a separate [`VertexMap`],
//! [`HalfedgeMap`], [`EdgeMap`] or [`FaceMap`]. Ids are `u32` newtypes without gaps, halfedges
//! come in pairs (twin and edge are bit operations), and boundary loops are explicit.
//! Construction and edits return a `Result` whose error names the element at fault; no input
//! panics.
//!
//! ```
//! use cotan_halfedge::{HalfedgeMesh, VertexId};
//!
//! // Two triangles that share an edge.
//! let mesh = HalfedgeMesh::from_faces(4, &[[0, 1, 2], [0, 2, 3]])?;
//! let ring: Vec<_> = mesh.one_ring(VertexId::new(0)).map(VertexId::index).collect();
//! assert_eq!(ring, [1, 2, 3]);
//! # Ok::<(), cotan_halfedge::BuildError>(())
//! ```
//!
//! # Edits
//!
//! Each edit checks its conditions before it changes anything, so a rejected edit leaves the mesh
//! unchanged. Ids stay 0, 1, 2, … without gaps.
//!
//! | edit | adds | removes |
//! |---|---|---|
//! | [`HalfedgeMesh::flip_edge`] | | |
//! | [`HalfedgeMesh::split_edge`] | a vertex, up to three edges, up to two faces | |
//! | [`HalfedgeMesh::split_face`] | a vertex, an edge per corner, a face per corner minus one | |
//! | [`HalfedgeMesh::connect_corners`] | an edge, a face | |
//! | [`HalfedgeMesh::triangulate`] | edges and faces | |
//! | [`HalfedgeMesh::collapse`] | | a vertex, up to three edges, up to two faces |
//! | [`HalfedgeMesh::delete_faces`] | | faces, and the edges and vertices that only they use |
//!
//! New elements get the ids after the last one, so maps are extended with [`DenseMap::push`].
//! Edits return the new elements with their parents ([`SplitEdge`], [`SplitFace`], [`CutFace`]),
//! so that attributes can be transferred. Edits that remove elements return a [`Renumbering`] to
//! apply to the maps; a collapse returns it as part of [`Collapsed`].

mod build;
mod build_error;
mod circulate;
mod disjoint_sets;
mod edit;
mod ids;
mod map;
mod mesh;
mod orientation;
mod pieces;
mod shared;
#[cfg(any(test, feature = "testing"))]
pub mod testing;
mod topology;
mod validate;

pub use build_error::BuildError;
pub use circulate::{BoundaryLoop, FaceHalfedges, IncomingHalfedges, OutgoingHalfedges};
pub use disjoint_sets::DisjointSets;
pub use edit::{
    ClosedFace, Collapsed, CutFace, EditError, FlippedEdge, Renumbering, SplitEdge, SplitFace,
};
pub use ids::{EdgeId, FaceId, HalfedgeId, Id, VertexId};
pub use map::{DenseMap, EdgeMap, FaceMap, HalfedgeMap, Pairs, VertexMap};
pub use mesh::HalfedgeMesh;
pub use topology::{ComponentTopology, Components};
pub use validate::ValidateError;

/// Runs the example of the README as a doc test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;
