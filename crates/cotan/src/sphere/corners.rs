//! A triangulated sphere as a corner table whose vertices can be removed and reinserted.
//!
//! Face f has the corners (halfedges) 3f, 3f + 1 and 3f + 2; halfedge c runs from `origin(c)` to
//! `origin(next(c))`. A collapse leaves the data of the two removed faces intact, so it can be
//! undone from its halfedge alone, in reverse order, in time proportional to one ring.
//!
//! ```text
//!        a                     a
//!      ╱ │ ╲                 ╱ │
//!     ╱  │  ╲    collapse   ╱  │
//!    ·   v───u     ───▶    ·───u      v is taken out, its other faces get the corner u
//!     ╲  │  ╱    h: v → u   ╲  │
//!      ╲ │ ╱                 ╲ │
//!        b                     b
//! ```

use cotan_halfedge::HalfedgeMesh;

/// The halfedges of a closed triangle mesh.
#[derive(Clone, Debug)]
pub(super) struct CornerTable {
    /// Per halfedge: its origin.
    origin: Vec<u32>,
    /// Per halfedge: the other side of its edge.
    twin: Vec<u32>,
    /// Per vertex: an outgoing halfedge.
    leaving: Vec<u32>,
    /// Per vertex: its number of edges.
    valence: Vec<u32>,
}

/// The next halfedge of the same face.
#[inline]
pub(super) fn next(halfedge: u32) -> u32 {
    if halfedge % 3 == 2 {
        halfedge - 2
    } else {
        halfedge + 1
    }
}

/// The previous halfedge of the same face.
#[inline]
pub(super) fn prev(halfedge: u32) -> u32 {
    if halfedge.is_multiple_of(3) {
        halfedge + 2
    } else {
        halfedge - 1
    }
}

/// The face of a halfedge.
#[inline]
pub(super) fn face_of(halfedge: u32) -> usize {
    halfedge as usize / 3
}

impl CornerTable {
    /// Builds the table of a closed triangle mesh. Corners start at the origin of the first
    /// halfedge of each face, as in [`HalfedgeMesh::triangle`].
    pub(super) fn new(mesh: &HalfedgeMesh) -> Self {
        let mut corner_of = vec![0_u32; mesh.num_halfedges()];
        let mut halfedge_of = Vec::with_capacity(3 * mesh.num_faces());
        for face in mesh.faces() {
            for h in mesh.face_halfedges(face) {
                corner_of[h.index()] = halfedge_of.len() as u32;
                halfedge_of.push(h);
            }
        }
        let origin: Vec<u32> = halfedge_of
            .iter()
            .map(|&h| mesh.origin(h).index() as u32)
            .collect();
        let twin = halfedge_of
            .iter()
            .map(|h| corner_of[h.twin().index()])
            .collect();
        let mut leaving = vec![0; mesh.num_vertices()];
        let mut valence = vec![0; mesh.num_vertices()];
        for (corner, &v) in origin.iter().enumerate() {
            leaving[v as usize] = corner as u32;
            valence[v as usize] += 1;
        }
        Self {
            origin,
            twin,
            leaving,
            valence,
        }
    }

    /// The origin of a halfedge.
    #[inline]
    pub(super) fn origin(&self, halfedge: u32) -> u32 {
        self.origin[halfedge as usize]
    }

    /// The target of a halfedge.
    #[inline]
    pub(super) fn target(&self, halfedge: u32) -> u32 {
        self.origin(next(halfedge))
    }

    /// The corners of a face.
    #[inline]
    pub(super) fn triangle(&self, face: usize) -> [u32; 3] {
        [0, 1, 2].map(|k| self.origin[3 * face + k])
    }

    /// Number of edges at a vertex.
    #[inline]
    pub(super) fn valence(&self, vertex: u32) -> u32 {
        self.valence[vertex as usize]
    }

    /// Number of faces, including removed ones.
    pub(super) fn num_faces(&self) -> usize {
        self.origin.len() / 3
    }

    /// Number of vertices, including removed ones.
    pub(super) fn num_vertices(&self) -> usize {
        self.leaving.len()
    }

    /// The outgoing halfedges of a vertex, counter-clockwise.
    #[inline]
    pub(super) fn outgoing(&self, vertex: u32) -> Outgoing<'_> {
        self.outgoing_from(self.leaving[vertex as usize])
    }

    /// The outgoing halfedges of the origin of `first`, counter-clockwise, starting with it.
    #[inline]
    pub(super) fn outgoing_from(&self, first: u32) -> Outgoing<'_> {
        Outgoing {
            table: self,
            first,
            at: Some(first),
        }
    }

    /// The neighbours of a vertex, counter-clockwise.
    pub(super) fn ring(&self, vertex: u32) -> impl Iterator<Item = u32> + '_ {
        self.outgoing(vertex).map(|h| self.target(h))
    }

    /// Returns true if an edge joins two vertices, in time proportional to the smaller valence.
    fn adjacent(&self, a: u32, b: u32) -> bool {
        let (few, other) = if self.valence(a) < self.valence(b) {
            (a, b)
        } else {
            (b, a)
        };
        self.ring(few).any(|v| v == other)
    }

    /// Returns true if removing the origin of `halfedge` leaves a triangulated sphere, that is,
    /// if its ends have no common neighbours except the two opposite corners, and there are more
    /// than four vertices.
    ///
    /// Every vertex of a triangulated sphere with more than four vertices has such a halfedge:
    /// the chords of its ring do not cross, so some ring vertex is not the end of any chord.
    pub(super) fn may_collapse(&self, halfedge: u32) -> bool {
        let (v, u) = (self.origin(halfedge), self.target(halfedge));
        let left = self.origin(prev(halfedge));
        let right = self.origin(prev(self.twin[halfedge as usize]));
        if self.valence(left) <= 3 || self.valence(right) <= 3 {
            return false;
        }
        self.ring(v)
            .all(|w| w == u || w == left || w == right || !self.adjacent(w, u))
    }

    /// Removes the origin of `halfedge`. All but two of its faces get the target of the halfedge
    /// as their new corner.
    pub(super) fn collapse(&mut self, halfedge: u32) {
        let (v, u) = (self.origin(halfedge), self.target(halfedge));
        let mut at = halfedge;
        for _ in 0..self.valence(v) {
            let following = self.twin[prev(at) as usize];
            if face_of(at) != face_of(halfedge) && at != next(self.twin[halfedge as usize]) {
                self.origin[at as usize] = u;
            }
            at = following;
        }
        let twin = self.twin[halfedge as usize];
        let [a, b] = [halfedge, twin].map(|h| self.origin(prev(h)));
        let [to_a, from_a] = [next(halfedge), prev(halfedge)].map(|h| self.twin[h as usize]);
        let [to_b, from_b] = [next(twin), prev(twin)].map(|h| self.twin[h as usize]);
        self.glue(to_a, from_a);
        self.glue(to_b, from_b);
        self.leaving[u as usize] = from_a;
        self.leaving[a as usize] = to_a;
        self.leaving[b as usize] = to_b;
        self.valence[u as usize] = self.valence(u) + self.valence(v) - 4;
        self.valence[a as usize] -= 1;
        self.valence[b as usize] -= 1;
    }

    /// Undoes the last collapse, which was that of `halfedge`.
    pub(super) fn undo(&mut self, halfedge: u32) {
        let twin = self.twin[halfedge as usize];
        let (v, u) = (self.origin(halfedge), self.origin(twin));
        for side in [halfedge, twin] {
            for inner in [next(side), prev(side)] {
                let outer = self.twin[inner as usize];
                self.twin[outer as usize] = inner;
            }
        }
        let [a, b] = [halfedge, twin].map(|h| self.origin(prev(h)));
        self.leaving[v as usize] = halfedge;
        self.leaving[u as usize] = twin;
        self.leaving[a as usize] = prev(halfedge);
        self.leaving[b as usize] = prev(twin);
        self.valence[u as usize] = self.valence(u) + 4 - self.valence(v);
        self.valence[a as usize] += 1;
        self.valence[b as usize] += 1;
        let mut at = halfedge;
        for _ in 0..self.valence[v as usize] {
            self.origin[at as usize] = v;
            at = self.twin[prev(at) as usize];
        }
    }

    /// The two faces that a collapse of `halfedge` removes.
    pub(super) fn lost_faces(&self, halfedge: u32) -> [usize; 2] {
        [face_of(halfedge), face_of(self.twin[halfedge as usize])]
    }

    fn glue(&mut self, a: u32, b: u32) {
        self.twin[a as usize] = b;
        self.twin[b as usize] = a;
    }
}

/// The halfedges around a vertex: see [`CornerTable::outgoing`].
#[derive(Clone, Debug)]
pub(super) struct Outgoing<'a> {
    table: &'a CornerTable,
    first: u32,
    at: Option<u32>,
}

impl Iterator for Outgoing<'_> {
    type Item = u32;

    #[inline]
    fn next(&mut self) -> Option<u32> {
        let at = self.at?;
        let following = self.table.twin[prev(at) as usize];
        self.at = (following != self.first).then_some(following);
        Some(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cotan_halfedge::testing::genus_zero;
    use proptest::prelude::*;

    fn legal(table: &CornerTable, v: u32) -> Option<u32> {
        table.outgoing(v).find(|&h| table.may_collapse(h))
    }

    proptest! {
        #[test]
        fn collapses_down_to_a_tetrahedron_are_undone(mesh in genus_zero()) {
            let fresh = CornerTable::new(&mesh);
            let mut table = fresh.clone();
            let mut done = Vec::new();
            let n = mesh.num_vertices() as u32;
            // A vertex of any valence can be removed.
            for v in 4..n {
                let h = legal(&table, v - 4).expect("a contractible edge");
                table.collapse(h);
                done.push(h);
            }
            for v in n - 4..n {
                prop_assert_eq!(table.valence(v), 3);
                prop_assert_eq!(table.ring(v).count(), 3);
            }
            for h in done.into_iter().rev() {
                table.undo(h);
            }
            prop_assert_eq!(&table.origin, &fresh.origin);
            prop_assert_eq!(&table.twin, &fresh.twin);
            prop_assert_eq!(&table.valence, &fresh.valence);
        }
    }
}
