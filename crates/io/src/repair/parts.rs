//! Dropping of parts: small ones, and all but the largest.

use super::Change;
use super::work::Work;
use crate::attributes::NONE;
use crate::error::IoError;
use crate::topology::Topology;

/// The parts to keep: those that meet both conditions.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Kept {
    /// Maximum number of parts.
    pub(super) most_parts: usize,
    /// Minimum number of faces per part.
    pub(super) least_faces: usize,
}

impl Kept {
    pub(super) const ALL: Self = Self {
        most_parts: usize::MAX,
        least_faces: 0,
    };
}

/// A set of faces connected through edges.
#[derive(Clone, Copy)]
struct Part {
    first_face: u32,
    num_faces: usize,
}

impl Work<'_> {
    /// Drops all faces of the other parts, and the vertices that only they use.
    ///
    /// Among parts with equally many faces, the one with the lower first face ranks higher. Faces
    /// that enclose nothing are not part of any and are kept.
    ///
    /// # Errors
    /// [`IoError::NoPartLeft`] if no part would be kept.
    pub(super) fn keep_parts(&mut self, kept: Kept) -> Result<(), IoError> {
        let at = self.at();
        let topology = Topology::new(&self.faces, &at);
        let mut sets = topology.components();
        let mut numbers = vec![NONE; self.faces.len()];
        let mut parts: Vec<Part> = Vec::new();
        let mut part_of = vec![NONE; self.faces.len()];
        for face in (0..self.faces.len()).filter(|&face| topology.is_face(face)) {
            let root = sets.root(face as u32) as usize;
            if numbers[root] == NONE {
                numbers[root] = parts.len() as u32;
                parts.push(Part {
                    first_face: face as u32,
                    num_faces: 0,
                });
            }
            part_of[face] = numbers[root];
            parts[numbers[root] as usize].num_faces += 1;
        }
        let mut order: Vec<usize> = (0..parts.len()).collect();
        order.sort_by_key(|&part| (std::cmp::Reverse(parts[part].num_faces), part));
        let mut is_kept = vec![false; parts.len()];
        for &part in order.iter().take(kept.most_parts) {
            is_kept[part] = parts[part].num_faces >= kept.least_faces;
        }
        if let Some(&largest) = order.first()
            && !is_kept.contains(&true)
        {
            return Err(IoError::NoPartLeft {
                least_faces: kept.least_faces,
                num_faces: parts[largest].num_faces,
            });
        }
        for (part, _) in parts.iter().zip(&is_kept).filter(|(_, is_kept)| !**is_kept) {
            let face = self.face(part.first_face);
            let num_faces = part.num_faces;
            self.changes.push(Change::DroppedPart { face, num_faces });
        }
        let is_dropped: Vec<bool> = part_of
            .iter()
            .map(|&part| part != NONE && !is_kept[part as usize])
            .collect();
        self.drop_with_vertices(&is_dropped);
        Ok(())
    }
}
