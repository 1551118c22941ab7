//! Conversion of facets to a mesh: corners at exactly the same position become one vertex.

use std::collections::HashMap;
use std::hash::Hash;

use foldhash::fast::RandomState;
use nalgebra::Point3;

use crate::error::{IoError, Warning};
use crate::faces::FaceList;
use crate::limits::Limits;
use crate::parsed::Parsed;
use crate::room;

/// A mesh that grows facet by facet.
///
/// `K` identifies positions: the bits of three coordinates in the file's precision.
pub(super) struct Soup<'a, K> {
    limits: &'a Limits,
    /// Bytes held in addition to vertices and faces: the file, and the offsets of its facets.
    held_bytes: usize,
    numbers: HashMap<K, u32, RandomState>,
    positions: Vec<Point3<f64>>,
    faces: FaceList,
}

impl<'a, K: Hash + Eq> Soup<'a, K> {
    /// Creates an empty mesh, given the number of bytes held for the file and the expected number
    /// of facets.
    ///
    /// `num_facets` must be bounded by the size of the file, not by a count in its header.
    pub(super) fn new(limits: &'a Limits, held_bytes: usize, num_facets: usize) -> Self {
        // A closed surface has half as many vertices as triangles.
        let expected = (num_facets / 2).min(limits.max_vertices);
        let mut numbers = HashMap::default();
        // If memory is short, the table grows as vertices are added.
        if numbers.try_reserve(expected).is_err() || room::check(room::MARGIN as u64).is_err() {
            numbers = HashMap::default();
        }
        Self {
            limits,
            held_bytes,
            numbers,
            positions: Vec::new(),
            faces: FaceList::new(),
        }
    }

    /// Sets the number of bytes held.
    pub(super) fn set_held(&mut self, num_bytes: usize) {
        self.held_bytes = num_bytes;
    }

    /// The index of the next new vertex.
    pub(super) fn next_vertex(&self) -> usize {
        self.positions.len()
    }

    pub(super) fn facet(&mut self, corners: [(K, Point3<f64>); 3]) -> Result<(), IoError> {
        let num_corners = self.faces.num_corners() + 3;
        self.limits.check_faces(self.faces.len() + 1)?;
        self.limits.check_degree(3)?;
        self.limits.check_corners(num_corners)?;
        self.limits
            .check_memory(self.held_bytes, self.positions.len() + 3, num_corners)?;
        self.faces.make_room(1, 3)?;
        room::reserve(&mut self.positions, 3)?;
        if self.numbers.capacity() - self.numbers.len() < 3 {
            let table = self.numbers.try_reserve(3);
            table.map_err(|_| room::missing::<(K, u32)>(self.numbers.len()))?;
            room::check(room::MARGIN as u64)?;
        }
        for (place, position) in corners {
            let next = self.positions.len() as u32;
            let vertex = *self.numbers.entry(place).or_insert(next);
            if vertex == next {
                self.limits.check_vertices(self.positions.len() + 1)?;
                self.positions.push(position);
            }
            self.faces.push_corner(vertex);
        }
        self.faces.end_face();
        Ok(())
    }

    pub(super) fn finish(self, warnings: Vec<Warning>) -> Parsed {
        Parsed {
            positions: self.positions,
            faces: self.faces,
            warnings,
            ..Parsed::default()
        }
    }
}
