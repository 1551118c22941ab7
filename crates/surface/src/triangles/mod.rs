//! A compact structure of triangles for algorithms that make millions of local changes.
//!
//! Halfedge 3f + k is corner k of triangle f, so `next` and `prev` are arithmetic, and an edit
//! writes a few numbers. Removed elements stay as gaps until the end, unlike the edits of
//! [`HalfedgeMesh`], which keep ids without gaps: that is why this structure exists next to it.
//! It is built from a valid mesh, and every edit checks what it needs to keep it valid.
//!
//! [`HalfedgeMesh`]: cotan_halfedge::HalfedgeMesh

mod convert;
mod edits;
mod order;

use nalgebra::Vector3;

pub(crate) use edits::Edge;
pub(crate) use order::permuted;

/// The id of no element: a missing twin, or an element that was removed.
pub(crate) const NONE: u32 = u32::MAX;

/// Triangles with the twins of their halfedges, and positions in double precision.
#[derive(Clone, Debug, Default)]
pub(crate) struct Triangles {
    /// Per halfedge, three per triangle: its origin; [`NONE`] in a removed triangle.
    pub(crate) origin: Vec<u32>,
    /// Per halfedge: the opposite halfedge; [`NONE`] on the boundary.
    pub(crate) twin: Vec<u32>,
    /// Per halfedge: a tag of its edge, the same on both sides; [`NONE`] for an edge that may
    /// change freely.
    pub(crate) tag: Vec<u32>,
    /// Per vertex: an outgoing halfedge, the one without a twin if there is one; [`NONE`] for a
    /// removed vertex.
    pub(crate) outgoing: Vec<u32>,
    /// Per vertex: its position.
    pub(crate) points: Vec<Vector3<f64>>,
    pub(crate) num_faces: usize,
    /// Per vertex: the last search that met it.
    seen: Vec<u32>,
    search: u32,
}

/// The next halfedge of the same triangle.
#[inline]
pub(crate) fn next(h: u32) -> u32 {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

/// The previous halfedge of the same triangle.
#[inline]
pub(crate) fn prev(h: u32) -> u32 {
    if h.is_multiple_of(3) { h + 2 } else { h - 1 }
}

impl Triangles {
    #[inline]
    pub(crate) fn origin(&self, h: u32) -> u32 {
        self.origin[h as usize]
    }

    #[inline]
    pub(crate) fn target(&self, h: u32) -> u32 {
        self.origin[next(h) as usize]
    }

    #[inline]
    pub(crate) fn twin(&self, h: u32) -> u32 {
        self.twin[h as usize]
    }

    #[inline]
    pub(crate) fn tag(&self, h: u32) -> u32 {
        self.tag[h as usize]
    }

    #[inline]
    pub(crate) fn point(&self, v: u32) -> Vector3<f64> {
        self.points[v as usize]
    }

    /// Returns false for the halfedges of a removed triangle.
    #[inline]
    pub(crate) fn is_alive(&self, h: u32) -> bool {
        self.origin[h as usize] != NONE
    }

    #[inline]
    pub(crate) fn has_vertex(&self, v: u32) -> bool {
        self.outgoing[v as usize] != NONE
    }

    #[inline]
    pub(crate) fn is_boundary_vertex(&self, v: u32) -> bool {
        self.twin(self.outgoing[v as usize]) == NONE
    }

    /// The halfedge that stands for the edge of `h`: the smaller of its two sides.
    #[inline]
    pub(crate) fn edge_of(&self, h: u32) -> u32 {
        h.min(self.twin(h))
    }

    /// Returns true if `h` is the side that stands for an existing edge.
    #[inline]
    pub(crate) fn is_edge(&self, h: u32) -> bool {
        self.is_alive(h) && h < self.twin(h)
    }

    #[inline]
    pub(crate) fn corners(&self, face: u32) -> [u32; 3] {
        let h = 3 * face as usize;
        [self.origin[h], self.origin[h + 1], self.origin[h + 2]]
    }

    #[inline]
    pub(crate) fn length(&self, h: u32) -> f64 {
        (self.point(self.target(h)) - self.point(self.origin(h))).norm()
    }

    /// The halfedges that leave `v`, counter-clockwise; at a boundary from one border to the
    /// other.
    #[inline]
    pub(crate) fn ring(&self, v: u32) -> Ring<'_> {
        let start = self.outgoing[v as usize];
        Ring {
            triangles: self,
            start,
            at: start,
        }
    }

    /// The neighbours of `v`, counter-clockwise.
    pub(crate) fn neighbors(&self, v: u32) -> impl Iterator<Item = u32> + '_ {
        self.ring(v).flat_map(move |h| {
            let last = prev(h);
            let at_border = self.twin(last) == NONE;
            [Some(self.target(h)), at_border.then(|| self.origin(last))]
                .into_iter()
                .flatten()
        })
    }

    /// One halfedge of each edge at `v`, in either direction.
    pub(crate) fn edges_at(&self, v: u32) -> impl Iterator<Item = u32> + '_ {
        self.ring(v).flat_map(move |h| {
            let last = prev(h);
            let at_border = self.twin(last) == NONE;
            [Some(h), at_border.then_some(last)].into_iter().flatten()
        })
    }

    pub(crate) fn valence(&self, v: u32) -> usize {
        self.neighbors(v).count()
    }

    /// Twice the area vector of a triangle.
    #[inline]
    pub(crate) fn area_vector(&self, face: u32) -> Vector3<f64> {
        let [a, b, c] = self.corners(face).map(|v| self.point(v));
        (b - a).cross(&(c - a))
    }

    /// The sum of the area vectors around `v`, not normalized.
    pub(crate) fn normal(&self, v: u32) -> Vector3<f64> {
        self.ring(v).map(|h| self.area_vector(h / 3)).sum()
    }

    /// Starts a search: no vertex has been seen.
    fn start_search(&mut self) {
        if self.search == u32::MAX {
            self.seen.fill(0);
            self.search = 0;
        }
        self.search += 1;
    }
}

/// The halfedges that leave a vertex.
#[derive(Clone)]
pub(crate) struct Ring<'a> {
    triangles: &'a Triangles,
    start: u32,
    at: u32,
}

impl Iterator for Ring<'_> {
    type Item = u32;

    #[inline]
    fn next(&mut self) -> Option<u32> {
        if self.at == NONE {
            return None;
        }
        let h = self.at;
        let next = self.triangles.twin(prev(h));
        self.at = if next == self.start { NONE } else { next };
        Some(h)
    }
}

#[cfg(test)]
mod tests;
