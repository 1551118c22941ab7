//! Detection of faces that would be connected if vertices at the same position were welded: a
//! triangle soup, or patches that were written separately.

use std::fmt;

use crate::document::Document;
use crate::error::IoError;
use crate::topology::Topology;
use crate::weld::Weld;

/// The edges that welding would join. Its `Display` text gives the numbers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub struct Weldable {
    /// Number of vertices used by faces.
    pub num_vertices: usize,
    /// Number of distinct places of these vertices.
    pub num_places: usize,
    /// Number of edges with one face that would get a second one.
    pub num_joined: usize,
}

impl Document {
    /// Reports what [`Weld::Exact`] would join that `weld` does not; `None` if no edge with one
    /// face would meet another.
    ///
    /// # Errors
    /// [`IoError::WeldTolerance`] for a tolerance that is not a valid distance.
    ///
    /// ```
    /// use cotan_io::{Limits, Weld, read};
    /// let two = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 4 5 6\n";
    /// let weldable = read(two, None, &Limits::default())?.weldable(Weld::AsFormat)?.unwrap();
    /// assert_eq!((weldable.num_vertices, weldable.num_places), (6, 4));
    /// # Ok::<(), cotan_io::IoError>(())
    /// ```
    pub fn weldable(&self, weld: Weld) -> Result<Option<Weldable>, IoError> {
        let places = self.places(weld)?;
        let exact = self.places(Weld::Exact)?;
        let place = |v: u32| places.get(v as usize).copied().unwrap_or(v);
        let corners = self.faces().corners().iter();
        let at: Vec<u32> = corners.map(|&v| place(v)).collect();
        let topology = Topology::new(self.faces(), &at);
        let exact_of = |place: u32| exact.get(place as usize).copied().unwrap_or(place);
        let mut open: Vec<[u32; 2]> = topology
            .edges()
            .filter(|sides| sides.len() == 1)
            .map(|sides| {
                let [a, b] = sides[0].ends.map(exact_of);
                [a.min(b), a.max(b)]
            })
            .filter(|[a, b]| a != b)
            .collect();
        open.sort_unstable();
        let same = open.chunk_by(|a, b| a == b).filter(|same| same.len() > 1);
        let num_joined: usize = same.map(<[_]>::len).sum();
        if num_joined == 0 {
            return Ok(None);
        }
        let count = |mut places: Vec<u32>| {
            places.sort_unstable();
            places.dedup();
            places.len()
        };
        let used = topology.outlines.corners().iter();
        let used: Vec<u32> = used.map(|&corner| topology.place(corner)).collect();
        Ok(Some(Weldable {
            num_places: count(used.iter().map(|&place| exact_of(place)).collect()),
            num_vertices: count(used),
            num_joined,
        }))
    }
}

impl fmt::Display for Weldable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "its {} vertices lie at {} distinct places; with --weld exact {} open edges meet others",
            self.num_vertices, self.num_places, self.num_joined
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faces::FaceList;
    use nalgebra::Point3;

    fn weldable(points: &[[f64; 3]], faces: &[[u32; 3]]) -> Option<Weldable> {
        let faces: FaceList = faces.iter().collect();
        let points = points.iter().map(|&p| Point3::from(p)).collect();
        let document = Document::new(points, faces).unwrap();
        assert_eq!(document.weldable(Weld::Exact).unwrap(), None);
        document.weldable(Weld::AsFormat).unwrap()
    }

    #[test]
    fn a_soup_is_told_by_its_edges() {
        let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let solid = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        assert_eq!(weldable(&corners, &solid), None);
        let soup: Vec<[f64; 3]> = solid
            .concat()
            .iter()
            .map(|&v| corners[v as usize])
            .collect();
        let faces = [[0, 1, 2], [3, 4, 5], [6, 7, 8], [9, 10, 11]];
        let found = weldable(&soup, &faces).unwrap();
        assert_eq!(
            (found.num_vertices, found.num_places, found.num_joined),
            (12, 4, 12)
        );
        // No open edge meets another between two closed solids at the same place, or between
        // triangles that touch at a corner.
        let twice = [corners, corners].concat();
        let both = [solid, solid.map(|face| face.map(|v| v + 4))].concat();
        assert_eq!(weldable(&twice, &both), None);
        assert_eq!(weldable(&soup, &[[0, 1, 2]]), None);
    }
}
