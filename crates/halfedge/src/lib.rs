//! Connectivity of polygon meshes: a compact half-edge structure with typed ids, dense maps,
//! checked construction and checked edits.
//!
//! This crate holds no floating-point number and knows no other crate of the workspace: positions
//! and every other attribute live beside the mesh, in a [`VertexMap`], [`HalfedgeMap`],
//! [`EdgeMap`] or [`FaceMap`]. Ids are `u32` newtypes without gaps, halfedges come in pairs
//! (twin and edge are bit arithmetic), boundary loops are explicit. Every construction and edit
//! returns a `Result` that names the element at fault; no input panics.
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
//! Every edit checks first and changes then, so that a refused one leaves the mesh as it was; ids
//! stay 0, 1, 2, … without gaps.
//!
//! | edit | adds | takes away |
//! |---|---|---|
//! | [`HalfedgeMesh::flip_edge`] | | |
//! | [`HalfedgeMesh::split_edge`] | a vertex, up to three edges, up to two faces | |
//! | [`HalfedgeMesh::split_face`] | a vertex, an edge a corner, a face a corner less one | |
//! | [`HalfedgeMesh::connect_corners`] | an edge, a face | |
//! | [`HalfedgeMesh::triangulate`] | edges and faces | |
//! | [`HalfedgeMesh::collapse`] | | a vertex, up to three edges, up to two faces |
//! | [`HalfedgeMesh::delete_faces`] | | faces, and the edges and vertices that only they use |
//!
//! New elements get the numbers after the last one, so a map is kept up with
//! [`DenseMap::push`]. Edits return the elements that are new with those
//! they come from ([`SplitEdge`], [`SplitFace`], [`CutFace`]), so that attributes can follow.
//! Edits that take elements away return a [`Renumbering`] to apply to the maps, a collapse as a
//! part of [`Collapsed`].

mod build;
mod build_error;
mod circulate;
mod edit;
mod ids;
mod map;
mod mesh;
mod orientation;
#[cfg(any(test, feature = "testing"))]
pub mod testing;
mod topology;
mod validate;

pub use build_error::BuildError;
pub use circulate::{BoundaryLoop, FaceHalfedges, IncomingHalfedges, OutgoingHalfedges};
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
