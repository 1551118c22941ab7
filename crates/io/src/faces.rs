//! The polygons of a document.

use std::ops::Range;

use crate::error::IoError;
use crate::room;

/// A list of polygons of any degree, stored flat: one list of all corners, and the end of each
/// polygon.
///
/// A triangle takes 16 bytes.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct FaceList {
    corners: Vec<u32>,
    ends: Vec<u32>,
}

impl FaceList {
    /// Creates an empty list.
    pub fn new() -> Self {
        Self::default()
    }

    /// Number of faces.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Returns `true` if there are no faces.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// Total number of corners of all faces.
    pub fn num_corners(&self) -> usize {
        self.corners.len()
    }

    /// Number of triangles after triangulation: degree − 2 per face.
    pub fn num_triangles(&self) -> usize {
        self.iter()
            .map(|polygon| polygon.len().saturating_sub(2))
            .sum()
    }

    /// The vertices of `face` (0-based), or `None` if the index is out of range.
    pub fn get(&self, face: usize) -> Option<&[u32]> {
        (face < self.len()).then(|| &self.corners[self.corner_range(face)])
    }

    /// The vertices of all corners, in face order.
    pub fn corners(&self) -> &[u32] {
        &self.corners
    }

    /// For each of `num_vertices` vertices, `true` if a face uses it.
    pub(crate) fn used_vertices(&self, num_vertices: usize) -> Vec<bool> {
        let mut is_used = vec![false; num_vertices];
        for &vertex in &self.corners {
            is_used[vertex as usize] = true;
        }
        is_used
    }

    /// The corner indices of `face`, counted through all faces.
    ///
    /// # Panics
    /// If `face` is out of range.
    pub fn corner_range(&self, face: usize) -> Range<usize> {
        let start = match face {
            0 => 0,
            _ => self.ends[face - 1],
        };
        start as usize..self.ends[face] as usize
    }

    /// The face that contains `corner`, where corners are counted through all faces.
    pub(crate) fn face_of(&self, corner: usize) -> usize {
        self.ends.partition_point(|&end| end as usize <= corner)
    }

    /// Iterates over the faces in order, each as a slice of its 0-based vertex indices.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &[u32]> + Clone {
        let mut start = 0;
        self.ends.iter().map(move |&end| {
            let polygon = &self.corners[start..end as usize];
            start = end as usize;
            polygon
        })
    }

    /// Creates a list of triangles from their corners, of which there must be fewer than 2^32.
    pub(crate) fn from_triangles(corners: Vec<u32>) -> Result<Self, IoError> {
        let mut ends = Vec::new();
        room::reserve_exact(&mut ends, corners.len() / 3)?;
        ends.extend((1..=corners.len() as u32 / 3).map(|face| 3 * face));
        Ok(Self { corners, ends })
    }

    /// Appends a corner to the current face.
    #[inline]
    pub(crate) fn push_corner(&mut self, vertex: u32) {
        self.corners.push(vertex);
    }

    /// Appends faces, given by their corners and the end of each face within them.
    ///
    /// The readers keep the number of corners below 2^32 (`Limits::check_corners`).
    pub(crate) fn append(&mut self, corners: &[u32], ends: &[u32]) {
        let start = self.corners.len() as u32;
        self.corners.extend_from_slice(corners);
        self.ends.extend(ends.iter().map(|end| start + end));
    }

    /// Reserves capacity for additional faces and corners.
    pub(crate) fn reserve(&mut self, faces: usize, corners: usize) {
        self.ends.reserve(faces);
        self.corners.reserve(corners);
    }

    /// Reserves capacity for additional faces and corners, or returns an error if memory is
    /// exhausted.
    #[inline]
    pub(crate) fn make_room(&mut self, faces: usize, corners: usize) -> Result<(), IoError> {
        room::reserve(&mut self.ends, faces)?;
        room::reserve(&mut self.corners, corners)
    }

    /// Like [`FaceList::reserve`], for estimated counts.
    pub(crate) fn reserve_if_there(&mut self, faces: usize, corners: usize) {
        room::reserve_if_there(&mut self.ends, faces);
        room::reserve_if_there(&mut self.corners, corners);
    }

    /// Completes the current face and returns its degree.
    ///
    /// The readers keep the number of corners below 2^32 (`Limits::check_corners`).
    #[inline]
    pub(crate) fn end_face(&mut self) -> usize {
        let start = self.ends.last().map_or(0, |&end| end as usize);
        self.ends.push(self.corners.len() as u32);
        self.corners.len() - start
    }
}

impl<F: AsRef<[u32]>> FromIterator<F> for FaceList {
    /// # Panics
    /// If there are 2^32 corners or more.
    fn from_iter<I: IntoIterator<Item = F>>(faces: I) -> Self {
        let mut list = Self::new();
        for polygon in faces {
            list.corners.extend_from_slice(polygon.as_ref());
            assert!(
                u32::try_from(list.corners.len()).is_ok(),
                "fewer than 2^32 face corners"
            );
            list.end_face();
        }
        list
    }
}
