//! Random edits that are drawn before the mesh they are applied to is known.

use proptest::prelude::*;
use proptest::sample::Index;

use crate::edit::EditError;
use crate::ids::{EdgeId, FaceId, HalfedgeId};
use crate::mesh::HalfedgeMesh;

/// An edit at a random location: each index picks an element of the mesh it is applied to.
#[derive(Clone, Debug)]
pub enum Edit {
    /// [`HalfedgeMesh::flip_edge`].
    FlipEdge(Index),
    /// [`HalfedgeMesh::split_edge`].
    SplitEdge(Index),
    /// [`HalfedgeMesh::split_face`].
    SplitFace(Index),
    /// [`HalfedgeMesh::connect_corners`] of a halfedge and a later one in its loop.
    ConnectCorners(Index, usize),
    /// [`HalfedgeMesh::collapse`].
    Collapse(Index),
    /// [`HalfedgeMesh::delete_faces`].
    DeleteFaces(Vec<Index>),
    /// [`HalfedgeMesh::triangulate`].
    Triangulate,
    /// [`HalfedgeMesh::flip_orientation`].
    FlipOrientation(Index),
}

impl Edit {
    /// Applies the edit. On an empty mesh it does nothing.
    ///
    /// # Errors
    /// If the edit is rejected.
    pub fn apply(&self, mesh: &mut HalfedgeMesh) -> Result<(), EditError> {
        if mesh.num_faces() == 0 {
            return Ok(());
        }
        let edge = |at: &Index| EdgeId::new(at.index(mesh.num_edges()));
        let face = |at: &Index| FaceId::new(at.index(mesh.num_faces()));
        let halfedge = |at: &Index| HalfedgeId::new(at.index(mesh.num_halfedges()));
        match self {
            Self::FlipEdge(at) => mesh.flip_edge(edge(at)).map(drop),
            Self::SplitEdge(at) => mesh.split_edge(edge(at)).map(drop),
            Self::SplitFace(at) => mesh.split_face(face(at)).map(drop),
            Self::ConnectCorners(at, steps) => {
                let from = halfedge(at);
                let to = (0..*steps).fold(from, |h, _| mesh.next(h));
                mesh.connect_corners(from, to).map(drop)
            }
            Self::Collapse(at) => mesh.collapse(halfedge(at)).map(drop),
            Self::DeleteFaces(at) => {
                let faces: Vec<FaceId> = at.iter().map(face).collect();
                mesh.delete_faces(&faces).map(drop)
            }
            Self::Triangulate => mesh.triangulate().map(drop),
            Self::FlipOrientation(at) => {
                let component = at.index(mesh.components().count());
                mesh.flip_orientation(component)
            }
        }
    }
}

/// Up to `most` edits of all kinds, with more local ones.
pub fn edits(most: usize) -> impl Strategy<Value = Vec<Edit>> {
    let at = any::<Index>;
    let edit = prop_oneof![
        4 => at().prop_map(Edit::FlipEdge),
        4 => at().prop_map(Edit::SplitEdge),
        2 => at().prop_map(Edit::SplitFace),
        4 => (at(), 0..6usize).prop_map(|(from, steps)| Edit::ConnectCorners(from, steps)),
        8 => at().prop_map(Edit::Collapse),
        2 => prop::collection::vec(at(), 1..4).prop_map(Edit::DeleteFaces),
        1 => Just(Edit::Triangulate),
        1 => at().prop_map(Edit::FlipOrientation),
    ];
    prop::collection::vec(edit, 0..most.max(1) + 1)
}
