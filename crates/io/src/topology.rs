//! Connectivity of an arbitrary polygon list, manifold or not.
//!
//! Corners are numbered through all faces. The *place* of a corner is its vertex, or the first
//! vertex that its vertex is welded to. A corner also identifies the side of its face that starts
//! there. Every step is linear or a sort, so that hostile input costs no more than a large mesh.
//!
//! `HalfedgeMesh::from_faces_in_pieces` also sorts sides and turns faces, but to build a mesh from
//! valid faces. Here faces may be degenerate and vertices welded, and what is wrong is reported.

use cotan_halfedge::DisjointSets;

use crate::attributes::NONE;
use crate::faces::FaceList;

/// Returns the corners of every face without those that enclose nothing; empty if fewer than
/// three remain.
///
/// Removed are corners at the place of the preceding corner, and the tips of spikes: corners from
/// which the outline runs straight back to where it came from.
pub(crate) fn outlines(faces: &FaceList, at: &[u32]) -> FaceList {
    let place = |corner: u32| at[corner as usize];
    let mut outlines = FaceList::new();
    let mut kept: Vec<u32> = Vec::new();
    for face in 0..faces.len() {
        kept.clear();
        for corner in faces.corner_range(face).map(|corner| corner as u32) {
            match *kept.as_slice() {
                [.., last] if place(last) == place(corner) => {}
                [.., before, _] if place(before) == place(corner) => {
                    kept.pop();
                }
                _ => kept.push(corner),
            }
        }
        // The same at the closing side of the outline.
        let mut rest = kept.as_slice();
        loop {
            match *rest {
                [first, .., last] if place(first) == place(last) => rest = &rest[..rest.len() - 1],
                [first, .., before, _] if place(first) == place(before) => {
                    rest = &rest[..rest.len() - 1];
                }
                [_, second, .., last] if place(second) == place(last) => rest = &rest[1..],
                _ => break,
            }
        }
        if rest.len() >= 3 {
            rest.iter().for_each(|&corner| outlines.push_corner(corner));
        }
        outlines.end_face();
    }
    outlines
}

/// One side of a face.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) struct Side {
    /// The places at its ends, in ascending order.
    pub(crate) ends: [u32; 2],
    /// The corner that it starts from.
    pub(crate) corner: u32,
    pub(crate) face: u32,
    /// `true` if it runs from the lower end to the upper one.
    pub(crate) is_forward: bool,
}

/// Faces, their sides, and the edges that these form.
#[derive(Debug)]
pub(crate) struct Topology<'a> {
    pub(crate) outlines: FaceList,
    /// The place of every corner.
    pub(crate) at: &'a [u32],
    /// Sorted by their ends, so that the sides of an edge are adjacent.
    sides: Vec<Side>,
    /// For each corner, the next corner of its outline; [`NONE`] if it is in no outline.
    next: Vec<u32>,
    /// For each corner, its face; [`NONE`] if it is in no outline.
    face: Vec<u32>,
}

impl<'a> Topology<'a> {
    pub(crate) fn new(faces: &FaceList, at: &'a [u32]) -> Self {
        let outlines = outlines(faces, at);
        let mut sides = Vec::with_capacity(outlines.num_corners());
        let (mut next, mut face_of) = (vec![NONE; at.len()], vec![NONE; at.len()]);
        for (face, outline) in (0u32..).zip(outlines.iter()) {
            for (k, &corner) in outline.iter().enumerate() {
                let after = outline[(k + 1) % outline.len()];
                next[corner as usize] = after;
                face_of[corner as usize] = face;
                let (a, b) = (at[corner as usize], at[after as usize]);
                sides.push(Side {
                    ends: [a.min(b), a.max(b)],
                    corner,
                    face,
                    is_forward: a < b,
                });
            }
        }
        sides.sort_unstable();
        Self {
            outlines,
            at,
            sides,
            next,
            face: face_of,
        }
    }

    /// The sides of every edge.
    pub(crate) fn edges(&self) -> impl Iterator<Item = &[Side]> + Clone {
        self.sides.chunk_by(|a, b| a.ends == b.ends)
    }

    /// Returns `true` if the face has an outline.
    pub(crate) fn is_face(&self, face: usize) -> bool {
        self.outlines.get(face).is_some_and(|o| !o.is_empty())
    }

    pub(crate) fn place(&self, corner: u32) -> u32 {
        self.at[corner as usize]
    }

    pub(crate) fn next(&self, corner: u32) -> u32 {
        self.next[corner as usize]
    }

    /// The face of a corner; [`NONE`] for a corner in no outline.
    pub(crate) fn face(&self, corner: u32) -> u32 {
        self.face[corner as usize]
    }

    /// Pairs the sides of the edges with exactly two sides; [`NONE`] for all others.
    pub(crate) fn pairs(&self) -> Vec<u32> {
        let mut partners = vec![NONE; self.at.len()];
        for sides in self.edges() {
            if let [a, b] = sides {
                partners[a.corner as usize] = b.corner;
                partners[b.corner as usize] = a.corner;
            }
        }
        partners
    }

    /// Returns `true` if the faces of two sides of an edge traverse it in opposite directions.
    pub(crate) fn agree(&self, a: u32, b: u32) -> bool {
        self.place(a) != self.place(b)
    }

    /// Joins the corners of two sides of an edge that are at the same place.
    pub(crate) fn join_ends(&self, fans: &mut DisjointSets, a: u32, b: u32) {
        let (next_a, next_b) = (self.next(a), self.next(b));
        if self.agree(a, b) {
            fans.join(a, next_b);
            fans.join(next_a, b);
        } else {
            fans.join(a, b);
            fans.join(next_a, next_b);
        }
    }

    /// The sets of corners connected through edges at their place.
    pub(crate) fn fans(&self) -> DisjointSets {
        let mut fans = DisjointSets::new(self.at.len());
        for sides in self.edges() {
            for pair in sides.windows(2) {
                self.join_ends(&mut fans, pair[0].corner, pair[1].corner);
            }
        }
        fans
    }

    /// The sets of faces connected through edges.
    pub(crate) fn components(&self) -> DisjointSets {
        let mut components = DisjointSets::new(self.outlines.len());
        for sides in self.edges() {
            for pair in sides.windows(2) {
                components.join(pair[0].face, pair[1].face);
            }
        }
        components
    }

    /// Orients every face consistently with its neighbours where that is possible.
    ///
    /// Neighbours are faces that share an edge with exactly two sides.
    pub(crate) fn orientation(&self, partners: &[u32]) -> Orientation {
        let num_faces = self.outlines.len();
        let mut orientation = Orientation {
            component: vec![NONE; num_faces],
            is_turned: vec![false; num_faces],
            is_orientable: Vec::new(),
        };
        let mut queue = Vec::new();
        for first in 0..num_faces {
            if !self.is_face(first) || orientation.component[first] != NONE {
                continue;
            }
            let component = orientation.is_orientable.len() as u32;
            let mut is_orientable = true;
            orientation.component[first] = component;
            queue.clear();
            queue.push(first as u32);
            let mut at = 0;
            while let Some(&face) = queue.get(at) {
                at += 1;
                for &corner in self.outlines.get(face as usize).unwrap_or_default() {
                    let partner = partners[corner as usize];
                    if partner == NONE {
                        continue;
                    }
                    let other = self.face(partner) as usize;
                    let is_turned =
                        orientation.is_turned[face as usize] == self.agree(corner, partner);
                    if orientation.component[other] == NONE {
                        orientation.component[other] = component;
                        orientation.is_turned[other] = is_turned;
                        queue.push(other as u32);
                    } else if orientation.is_turned[other] != is_turned {
                        is_orientable = false;
                    }
                }
            }
            orientation.is_orientable.push(is_orientable);
        }
        orientation
    }

    /// Finds the loops formed by the sides of edges with one face, in the order of their first
    /// side.
    ///
    /// `fans` must be the result of [`Topology::fans`]; a loop continues within a fan.
    pub(crate) fn boundary_loops(&self, fans: &mut DisjointSets) -> Vec<BoundaryLoop> {
        // Every end of a boundary side, with the fan that contains it.
        let mut ends: Vec<(u32, u32)> = Vec::new();
        let mut sides: Vec<u32> = Vec::new();
        for edge in self.edges() {
            if let [side] = edge {
                sides.push(side.corner);
                ends.push((fans.root(side.corner), side.corner));
                ends.push((fans.root(self.next(side.corner)), side.corner));
            }
        }
        ends.sort_unstable();
        sides.sort_unstable();
        let range = |fan: u32| {
            let start = ends.partition_point(|&(f, _)| f < fan);
            start..ends.partition_point(|&(f, _)| f <= fan)
        };
        // The number of ends used in each fan, stored at the first of them.
        let mut used = vec![0u32; ends.len()];
        let mut is_done = vec![false; self.at.len()];
        let mut loops = Vec::new();
        for &first in &sides {
            if is_done[first as usize] {
                continue;
            }
            let mut found = BoundaryLoop {
                corners: Vec::new(),
                sides: Vec::new(),
                is_simple: true,
            };
            let start = fans.root(first);
            let (mut side, mut from) = (first, first);
            loop {
                is_done[side as usize] = true;
                found.corners.push(from);
                found.sides.push(side);
                let to = if from == side { self.next(side) } else { side };
                let fan = fans.root(to);
                let here = range(fan);
                found.is_simple &= here.len() == 2;
                if fan == start {
                    break;
                }
                let first_end = here.start;
                let mut at = first_end + used[first_end] as usize;
                while at < here.end && is_done[ends[at].1 as usize] {
                    at += 1;
                }
                used[first_end] = (at - first_end) as u32;
                let Some(&(_, onward)) = ends.get(at).filter(|_| at < here.end) else {
                    found.is_simple = false;
                    break;
                };
                side = onward;
                // The end of the next side that lies in this fan.
                from = if fans.root(side) == fan {
                    side
                } else {
                    self.next(side)
                };
            }
            loops.push(found);
        }
        loops
    }
}

/// The faces that have to be reversed for a consistent orientation.
#[derive(Debug)]
pub(crate) struct Orientation {
    /// For each face, the index of its connected component; [`NONE`] for a face without an
    /// outline.
    pub(crate) component: Vec<u32>,
    /// For each face, `true` if it is reversed relative to the first face of its component.
    pub(crate) is_turned: Vec<bool>,
    /// One entry per component.
    pub(crate) is_orientable: Vec<bool>,
}

/// A sequence of connected sides with one face each.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct BoundaryLoop {
    /// The corner through which each side is entered.
    pub(crate) corners: Vec<u32>,
    /// The sides, identified by the corner at which each starts.
    pub(crate) sides: Vec<u32>,
    /// `true` if the loop is closed and passes through each of its fans once.
    pub(crate) is_simple: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reduced(polygon: &[u32]) -> Vec<u32> {
        let faces: FaceList = [polygon].iter().collect();
        let outlines = outlines(&faces, polygon);
        let outline = outlines.get(0).unwrap();
        outline.iter().map(|&c| polygon[c as usize]).collect()
    }

    #[test]
    fn outlines_leave_out_what_encloses_nothing() {
        assert_eq!(reduced(&[4, 5, 6]), [4, 5, 6]);
        assert_eq!(reduced(&[4, 4, 5, 6, 6, 4]), [4, 5, 6]);
        assert_eq!(reduced(&[4, 5, 9, 5, 6]), [4, 5, 6]);
        assert_eq!(reduced(&[9, 5, 6, 4, 5]), [5, 6, 4]);
        assert_eq!(reduced(&[5, 6, 4, 5, 9]), [5, 6, 4]);
        assert_eq!(reduced(&[4, 5, 8, 9, 8, 5, 6]), [4, 5, 6]);
        for nothing in [
            &[1, 1, 1][..],
            &[1, 2, 1],
            &[1, 2, 1, 3],
            &[1, 2, 3, 2],
            &[1; 9],
        ] {
            assert!(reduced(nothing).is_empty(), "{nothing:?}");
        }
        // A hole that is bridged to the outline is not a spike.
        let bridged = [0, 1, 2, 3, 0, 4, 5, 6, 4];
        assert_eq!(reduced(&bridged), bridged);
    }

    #[test]
    fn loops_go_on_within_a_fan() {
        // Two triangles that share one vertex have two loops.
        let faces: FaceList = [[0u32, 1, 2], [0, 3, 4]].iter().collect();
        let at = faces.corners().to_vec();
        let topology = Topology::new(&faces, &at);
        let loops = topology.boundary_loops(&mut topology.fans());
        assert_eq!(loops.len(), 2);
        assert!(loops.iter().all(|l| l.is_simple && l.sides.len() == 3));
        // Opposite orientations across the shared edge still give one loop.
        let faces: FaceList = [[0u32, 1, 2], [0, 1, 3]].iter().collect();
        let at = faces.corners().to_vec();
        let topology = Topology::new(&faces, &at);
        let loops = topology.boundary_loops(&mut topology.fans());
        assert_eq!(loops.len(), 1);
        let places: Vec<u32> = loops[0].corners.iter().map(|&c| at[c as usize]).collect();
        assert_eq!(places, [1, 2, 0, 3]);
    }
}
