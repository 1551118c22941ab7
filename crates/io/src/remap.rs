//! A mesh made of the vertices and faces of another: what every repair comes to.

use crate::attributes::NONE;
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
    /// For each new face the old face that it comes from; [`NONE`] for one that closes a hole.
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

    /// Whether a new face has the corners of its old face in the old order, vertices unchanged.
    pub(crate) fn keeps_face(&self, face: usize, old: &FaceList) -> bool {
        let source = self.face_sources[face];
        source != NONE
            && self
                .faces
                .get(face)
                .zip(old.get(source as usize))
                .is_some_and(|(new, old)| {
                    new.len() == old.len() && new.iter().zip(old).all(|(&n, &o)| n == o)
                })
            && self
                .faces
                .corner_range(face)
                .zip(old.corner_range(source as usize))
                .all(|(new, old)| self.corner_sources[new] as usize == old)
    }
}
