//! A mesh made of the vertices and faces of another: what every repair comes to.

use crate::faces::FaceList;

/// New vertices and faces, each with the old one that it comes from.
///
/// Everything that the file says about a vertex, a face or a corner goes with it.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Remap {
    /// For each new vertex the old vertex that it is a copy of.
    pub(crate) vertices: Vec<u32>,
    /// The new faces, of new vertices.
    pub(crate) faces: FaceList,
    /// For each new face the old face that it comes from; [`NONE`](crate::NONE) for one that closes a hole.
    pub(crate) face_sources: Vec<u32>,
    /// For each corner of the new faces the old corner (counted through all old faces) whose
    /// vertex, texture coordinate and normal it has. Corners of a face that closes a hole come
    /// from a corner beside the hole.
    pub(crate) corner_sources: Vec<u32>,
}

impl Remap {
    /// The mesh as it is.
    pub(crate) fn identity(num_vertices: usize, faces: &FaceList) -> Self {
        Self {
            vertices: (0..num_vertices as u32).collect(),
            face_sources: (0..faces.len() as u32).collect(),
            corner_sources: (0..faces.num_corners() as u32).collect(),
            faces: faces.clone(),
        }
    }
}
