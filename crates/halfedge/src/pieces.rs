//! Cutting faces that form no oriented manifold into pieces that do: see
//! [`HalfedgeMesh::from_faces_in_pieces`](crate::HalfedgeMesh::from_faces_in_pieces).

use crate::disjoint_sets::DisjointSets;
use crate::ids::{NONE, VertexId};

/// One side of a face.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    /// The vertices at its ends, in ascending order.
    ends: [u32; 2],
    /// The corner that it starts from.
    corner: u32,
    /// True if it runs from the lower end to the upper one.
    runs_up: bool,
}

/// The sides of all faces.
pub(crate) struct Sides {
    /// Sorted, so that the sides of an edge are adjacent.
    sides: Vec<Side>,
    /// Per corner: its vertex, its face, and the next corner of the face.
    vertex: Vec<u32>,
    face: Vec<u32>,
    next: Vec<u32>,
    /// The first corner of each face, followed by the number of all corners.
    starts: Vec<usize>,
}

impl Sides {
    /// For faces whose indices are valid.
    pub(crate) fn new<F: AsRef<[u32]>>(faces: &[F]) -> Self {
        let mut all = Self {
            sides: Vec::new(),
            vertex: Vec::new(),
            face: Vec::new(),
            next: Vec::new(),
            starts: vec![0],
        };
        for (face, polygon) in (0u32..).zip(faces) {
            let polygon = polygon.as_ref();
            let first = all.vertex.len() as u32;
            let degree = polygon.len() as u32;
            for (k, &a) in (0u32..).zip(polygon) {
                let after = (k + 1) % degree;
                let b = polygon[after as usize];
                all.sides.push(Side {
                    ends: [a.min(b), a.max(b)],
                    corner: first + k,
                    runs_up: a < b,
                });
                all.vertex.push(a);
                all.face.push(face);
                all.next.push(first + after);
            }
            all.starts.push(all.vertex.len());
        }
        all.sides.sort_unstable();
        all
    }

    /// The sides of every edge.
    fn edges(&self) -> impl Iterator<Item = &[Side]> {
        self.sides.chunk_by(|a, b| a.ends == b.ends)
    }

    /// The vertices at the ends of the side that starts from a corner, in ascending order.
    fn ends(&self, corner: usize) -> [u32; 2] {
        let [a, b] = [corner, self.next[corner] as usize].map(|c| self.vertex[c]);
        [a.min(b), a.max(b)]
    }

    fn face_of(&self, side: &Side) -> usize {
        self.face[side.corner as usize] as usize
    }

    /// Per row: whether it has an edge with a single face.
    pub(crate) fn rim(&self, num_vertices: usize) -> Vec<bool> {
        let mut is_rim = vec![false; num_vertices];
        for edge in self.edges() {
            if let [side] = edge {
                side.ends.iter().for_each(|&v| is_rim[v as usize] = true);
            }
        }
        is_rim
    }

    /// The corners that share a vertex: each is in the set of the lowest one.
    pub(crate) fn fans(&self, orientation: &Orientation) -> DisjointSets {
        /// Rounds after which all faces are detached, so that the time stays linear: a round may
        /// leave conflicts for the next one.
        const MAX_ROUNDS: usize = 16;
        let mut is_loose = vec![false; self.starts.len() - 1];
        let mut round = 0;
        loop {
            round += 1;
            if round > MAX_ROUNDS {
                is_loose.fill(true);
            }
            let partners = self.partners(orientation, &is_loose);
            let mut fans = DisjointSets::new(self.vertex.len());
            for (a, &b) in (0u32..).zip(&partners) {
                if b != NONE && a < b {
                    self.join_ends(&mut fans, a, b);
                }
            }
            if !self.loosen_conflicts(&mut fans, &partners, &mut is_loose) {
                return fans;
            }
        }
    }

    /// Per corner, the corner of the side that continues the surface across its side, or `NONE`.
    fn partners(&self, orientation: &Orientation, is_loose: &[bool]) -> Vec<u32> {
        let mut partners = vec![NONE; self.vertex.len()];
        let mut here: Vec<(u32, &Side)> = Vec::new();
        for edge in self.edges() {
            here.clear();
            let free = edge.iter().filter(|side| !is_loose[self.face_of(side)]);
            here.extend(free.map(|side| (orientation.surface[self.face_of(side)], side)));
            here.sort_unstable_by_key(|(surface, side)| (*surface, side.corner));
            for of_surface in here.chunk_by(|a, b| a.0 == b.0) {
                if let [(_, a), (_, b)] = of_surface {
                    let runs_up =
                        |side: &Side| side.runs_up != orientation.is_turned[self.face_of(side)];
                    if runs_up(a) != runs_up(b) {
                        partners[a.corner as usize] = b.corner;
                        partners[b.corner as usize] = a.corner;
                    }
                }
            }
        }
        partners
    }

    /// Joins the corners at the same vertices of two sides of an edge.
    fn join_ends(&self, fans: &mut DisjointSets, a: u32, b: u32) {
        let [next_a, next_b] = [a, b].map(|c| self.next[c as usize]);
        if self.vertex[a as usize] == self.vertex[b as usize] {
            fans.join(a, b);
            fans.join(next_a, next_b);
        } else {
            fans.join(a, next_b);
            fans.join(next_a, b);
        }
    }

    /// Marks faces with a side between the same two fans as a side that does not continue it.
    /// Detached from all their neighbours, they conflict with nothing. Returns true if there were
    /// any.
    fn loosen_conflicts(
        &self,
        fans: &mut DisjointSets,
        partners: &[u32],
        is_loose: &mut [bool],
    ) -> bool {
        let mut any = false;
        let mut here: Vec<([u32; 2], u32)> = Vec::new();
        for edge in self.edges().filter(|edge| edge.len() > 1) {
            here.clear();
            for side in edge {
                let ends = [side.corner, self.next[side.corner as usize]].map(|c| fans.root(c));
                let ends = if side.runs_up {
                    ends
                } else {
                    [ends[1], ends[0]]
                };
                here.push((ends, side.corner));
            }
            here.sort_unstable();
            for same in here.chunk_by(|a, b| a.0 == b.0) {
                let is_proper = match *same {
                    [_] => true,
                    [(_, a), (_, b)] => partners[a as usize] == b,
                    _ => false,
                };
                if !is_proper {
                    any = true;
                    let faces = same.iter().map(|(_, c)| self.face[*c as usize] as usize);
                    faces.for_each(|face| is_loose[face] = true);
                }
            }
        }
        any
    }

    /// The vertex of every corner, and the row of every copy.
    pub(crate) fn copies(
        &self,
        num_vertices: usize,
        fans: &DisjointSets,
    ) -> (Vec<u32>, Vec<VertexId>) {
        let mut fans = fans.clone();
        let mut is_used = vec![false; num_vertices];
        let mut rows = Vec::new();
        let mut corners = vec![NONE; self.vertex.len()];
        for corner in 0..corners.len() {
            let row = self.vertex[corner] as usize;
            let root = fans.root(corner as u32) as usize;
            // The root is the lowest corner of its fan.
            corners[corner] = if root != corner {
                corners[root]
            } else if std::mem::replace(&mut is_used[row], true) {
                rows.push(VertexId::new(row));
                (num_vertices + rows.len() - 1) as u32
            } else {
                row as u32
            };
        }
        (corners, rows)
    }

    /// The vertices of a face of the pieces.
    pub(crate) fn piece_face(&self, corners: &[u32], face: usize, is_turned: bool) -> Vec<u32> {
        let mut polygon = corners[self.starts[face]..self.starts[face + 1]].to_vec();
        if is_turned {
            polygon[1..].reverse();
        }
        polygon
    }
}

/// Faces that are connected across edges with exactly two faces, turned to agree.
pub(crate) struct Orientation {
    /// The surface of each face.
    surface: Vec<u32>,
    pub(crate) is_turned: Vec<bool>,
}

impl Orientation {
    pub(crate) fn new(all: &Sides) -> Self {
        let num_faces = all.starts.len() - 1;
        let mut partner = vec![NONE; all.vertex.len()];
        for edge in all.edges() {
            if let [a, b] = edge {
                partner[a.corner as usize] = b.corner;
                partner[b.corner as usize] = a.corner;
            }
        }
        let mut surface = vec![NONE; num_faces];
        let mut is_turned = vec![false; num_faces];
        let (mut found, mut corners) = (Vec::new(), Vec::new());
        for first in 0..num_faces {
            if surface[first] != NONE {
                continue;
            }
            surface[first] = first as u32;
            found.clear();
            found.push(first);
            let mut at = 0;
            while let Some(&face) = found.get(at) {
                at += 1;
                // By their ends: in an order that is the same for a face that is turned.
                corners.clear();
                corners.extend(all.starts[face]..all.starts[face + 1]);
                corners.sort_unstable_by_key(|corner| all.ends(*corner));
                for &corner in &corners {
                    let other = partner[corner];
                    if other == NONE {
                        continue;
                    }
                    let neighbour = all.face[other as usize] as usize;
                    if surface[neighbour] == NONE {
                        surface[neighbour] = first as u32;
                        // Sides that start at the same vertex run in the same direction.
                        let is_same = all.vertex[corner] == all.vertex[other as usize];
                        is_turned[neighbour] = is_turned[face] != is_same;
                        found.push(neighbour);
                    }
                }
            }
            let num_turned = found.iter().filter(|&&face| is_turned[face]).count();
            if 2 * num_turned > found.len() {
                found.iter().for_each(|&face| is_turned[face] ^= true);
            }
        }
        Self { surface, is_turned }
    }
}
