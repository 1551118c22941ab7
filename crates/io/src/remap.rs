//! A mesh made of the vertices and faces of another, which is the result of every repair.

use crate::faces::FaceList;

/// New vertices and faces, each with the old one from which it is derived.
///
/// All data that the file has for a vertex, a face or a corner is carried along.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Remap {
    /// For each new vertex, the old vertex of which it is a copy.
    pub(crate) vertices: Vec<u32>,
    /// The new faces, as indices of new vertices.
    pub(crate) faces: FaceList,
    /// For each new face, the old face from which it is derived; [`NONE`](crate::NONE) for one
    /// that closes a hole.
    pub(crate) face_sources: Vec<u32>,
    /// For each corner of the new faces, the old corner (counted through all old faces) whose
    /// vertex, texture coordinate and normal it has.
    ///
    /// The corners of a face that closes a hole are derived from a corner next to the hole.
    pub(crate) corner_sources: Vec<u32>,
}

impl Remap {
    /// The identity mapping.
    pub(crate) fn identity(num_vertices: usize, faces: &FaceList) -> Self {
        Self {
            vertices: (0..num_vertices as u32).collect(),
            face_sources: (0..faces.len() as u32).collect(),
            corner_sources: (0..faces.num_corners() as u32).collect(),
            faces: faces.clone(),
        }
    }
}
