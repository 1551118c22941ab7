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
