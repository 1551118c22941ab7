//! Collapse, flip and split.

use nalgebra::Vector3;

use super::{NONE, Triangles, next, prev};

/// The vertices around an edge.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Edge {
    /// The two ends.
    pub(crate) ends: [u32; 2],
    /// The opposite corners; the second is [`NONE`] on the boundary.
    pub(crate) opposite: [u32; 2],
}

impl Triangles {
    /// The vertices around the edge of `h`, from the side of `h`.
    #[inline]
    pub(crate) fn edge(&self, h: u32) -> Edge {
        let t = self.twin(h);
        let other = if t == NONE {
            NONE
        } else {
            self.origin(prev(t))
        };
        Edge {
            ends: [self.origin(h), self.target(h)],
            opposite: [self.origin(prev(h)), other],
        }
    }

    /// Returns true if the edge of `h` can be collapsed and the result is a manifold of the same
    /// topology: the common neighbours of its ends are the corners opposite to it (the link
    /// condition), it does not connect two boundaries, and something is left.
    pub(crate) fn can_collapse(&mut self, h: u32) -> bool {
        let t = self.twin(h);
        let Edge {
            ends: [u, v],
            opposite: [c, d],
        } = self.edge(h);
        let is_ear = |h: u32| self.twin(next(h)) == NONE && self.twin(prev(h)) == NONE;
        if c == d || is_ear(h) || (t != NONE && is_ear(t)) {
            return false;
        }
        if t != NONE && self.is_boundary_vertex(u) && self.is_boundary_vertex(v) {
            return false;
        }
        self.start_search();
        let mut at = self.outgoing[u as usize];
        let start = at;
        loop {
            let neighbor = self.target(at);
            self.seen[neighbor as usize] = self.search;
            let last = prev(at);
            at = self.twin(last);
            if at == NONE {
                let border = self.origin(last);
                self.seen[border as usize] = self.search;
            }
            if at == NONE || at == start {
                break;
            }
        }
        let is_common = |w: u32| usize::from(self.seen[w as usize] == self.search);
        let mut num_common = 0;
        let start = self.outgoing[v as usize];
        let mut at = start;
        loop {
            num_common += is_common(self.target(at));
            let last = prev(at);
            at = self.twin(last);
            if at == NONE {
                num_common += is_common(self.origin(last));
            }
            if at == NONE || at == start {
                break;
            }
        }
        if num_common != if t == NONE { 1 } else { 2 } {
            return false;
        }
        // Of a tetrahedron two triangles with the same corners would be left.
        t == NONE || self.twin(next(h)) == NONE || self.twin(prev(h)) == NONE || {
            let across = |h: u32| self.origin(prev(self.twin(h)));
            across(next(h)) != d || across(prev(h)) != d
        }
    }

    /// Merges the origin of `h` into its target, whose position stays. Requires
    /// [`Self::can_collapse`].
    ///
    /// ```text
    ///        c                c
    ///       ╱ ╲               │
    ///      u ─▶ v     →       v
    ///       ╲ ╱               │
    ///        d                d
    /// ```
    pub(crate) fn collapse(&mut self, h: u32) {
        let t = self.twin(h);
        let (u, v) = (self.origin(h), self.target(h));
        let mut at = self.outgoing[u as usize];
        let start = at;
        while at != NONE {
            self.origin[at as usize] = v;
            let following = self.twin(prev(at));
            at = if following == start { NONE } else { following };
        }
        let mut around = self.close(next(h), prev(h));
        if t != NONE {
            // Of this triangle, the halfedge towards v is the previous one.
            let other = self.close(next(t), prev(t));
            around = if around == NONE { other } else { around };
        }
        self.outgoing[u as usize] = NONE;
        self.set_outgoing(v, around);
    }

    /// As [`Self::collapse`], but the end `stays` is the one that is kept, whichever it is: an edge
    /// on the boundary has a halfedge in one direction only.
    pub(crate) fn collapse_into(&mut self, h: u32, stays: u32) {
        let target = self.target(h);
        let t = self.twin(h);
        if stays == target {
            self.collapse(h);
        } else if t != NONE {
            self.collapse(t);
        } else {
            self.collapse(h);
            let mut at = self.outgoing[target as usize];
            self.outgoing[stays as usize] = at;
            self.outgoing[target as usize] = NONE;
            while at != NONE {
                self.origin[at as usize] = stays;
                // At the boundary, the ring begins and ends.
                at = self.twin(prev(at));
            }
        }
    }

    /// Removes the triangle of the halfedges `n` (from the merged vertex) and `p` (to it), and
    /// glues the triangles beyond. Returns a halfedge that leaves the merged vertex.
    fn close(&mut self, n: u32, p: u32) -> u32 {
        let (beyond_n, beyond_p) = (self.twin(n), self.twin(p));
        let c = self.origin(p);
        let tag = self.tag(n).min(self.tag(p));
        for (side, other) in [(beyond_n, beyond_p), (beyond_p, beyond_n)] {
            if side != NONE {
                self.twin[side as usize] = other;
                self.tag[side as usize] = tag;
            }
        }
        let from_c = if beyond_n != NONE {
            beyond_n
        } else {
            next(beyond_p)
        };
        let first = 3 * (n / 3) as usize;
        self.origin[first..first + 3].fill(NONE);
        self.twin[first..first + 3].fill(NONE);
        self.num_faces -= 1;
        if self.outgoing[c as usize] == p {
            self.outgoing[c as usize] = from_c;
        }
        if beyond_p != NONE {
            beyond_p
        } else {
            next(beyond_n)
        }
    }

    /// Stores the outgoing halfedge of `v`, starting from any of them.
    fn set_outgoing(&mut self, v: u32, any: u32) {
        let mut at = any;
        loop {
            let t = self.twin(at);
            if t == NONE {
                break;
            }
            at = next(t);
            if at == any {
                break;
            }
        }
        self.outgoing[v as usize] = at;
    }

    /// Returns true if the edge of `h` can be flipped: two triangles, and no edge between the
    /// opposite corners yet.
    pub(crate) fn can_flip(&self, h: u32) -> bool {
        let [c, d] = self.edge(h).opposite;
        self.twin(h) != NONE && c != d && !self.neighbors(c).any(|w| w == d)
    }

    /// Replaces the edge of `h` by that between the opposite corners. Requires
    /// [`Self::can_flip`].
    ///
    /// ```text
    ///        c                c
    ///       ╱ ╲              ╱│╲
    ///      u ─▶ v     →     u ▲ v
    ///       ╲ ╱              ╲│╱
    ///        d                d
    /// ```
    pub(crate) fn flip(&mut self, h: u32) {
        let t = self.twin(h);
        let (n, p, tn, tp) = (next(h), prev(h), next(t), prev(t));
        let Edge {
            ends: [u, v],
            opposite: [c, d],
        } = self.edge(h);
        let beyond = [p, tn, tp, n].map(|h| (self.twin(h), self.tag(h)));
        for (slot, origin) in [(h, d), (n, c), (p, u), (t, c), (tn, d), (tp, v)] {
            self.origin[slot as usize] = origin;
        }
        for (slot, (twin, tag)) in [n, p, tn, tp].into_iter().zip(beyond) {
            self.link(slot, twin, tag);
        }
        for (vertex, from, to) in [
            (u, [h, tn], p),
            (v, [t, n], tp),
            (c, [p, p], n),
            (d, [tp, tp], tn),
        ] {
            if from.contains(&self.outgoing[vertex as usize]) {
                self.outgoing[vertex as usize] = to;
            }
        }
    }

    /// Inserts a vertex at `point` on the edge of `h` and returns it. The halves keep the tag.
    ///
    /// ```text
    ///        c                c
    ///       ╱ ╲              ╱│╲
    ///      u ─▶ v     →     u─m─v
    ///       ╲ ╱              ╲│╱
    ///        d                d
    /// ```
    pub(crate) fn split(&mut self, h: u32, point: Vector3<f64>) -> u32 {
        let (t, n) = (self.twin(h), next(h));
        let Edge {
            ends: [_, v],
            opposite: [c, d],
        } = self.edge(h);
        let tag = self.tag(h);
        let m = self.points.len() as u32;
        self.points.push(point);
        self.seen.push(0);
        let a = self.push_face([m, v, c]);
        let (beyond, beyond_tag) = (self.twin(n), self.tag(n));
        self.link(a, NONE, tag);
        self.link(a + 1, beyond, beyond_tag);
        self.link(a + 2, n, NONE);
        self.origin[n as usize] = m;
        if self.outgoing[v as usize] == n {
            self.outgoing[v as usize] = a + 1;
        }
        self.outgoing.push(a);
        if t != NONE {
            let tp = prev(t);
            let b = self.push_face([v, m, d]);
            let (beyond, beyond_tag) = (self.twin(tp), self.tag(tp));
            self.link(b, a, tag);
            self.link(b + 1, tp, NONE);
            self.link(b + 2, beyond, beyond_tag);
            self.origin[t as usize] = m;
            if self.outgoing[v as usize] == t {
                self.outgoing[v as usize] = b;
            }
            if self.outgoing[d as usize] == tp {
                self.outgoing[d as usize] = b + 2;
            }
        }
        m
    }

    fn push_face(&mut self, corners: [u32; 3]) -> u32 {
        let first = self.origin.len() as u32;
        self.origin.extend(corners);
        self.twin.extend([NONE; 3]);
        self.tag.extend([NONE; 3]);
        self.num_faces += 1;
        first
    }

    /// Makes `h` and `twin` the sides of an edge.
    fn link(&mut self, h: u32, twin: u32, tag: u32) {
        self.twin[h as usize] = twin;
        self.tag[h as usize] = tag;
        if twin != NONE {
            self.twin[twin as usize] = h;
            self.tag[twin as usize] = tag;
        }
    }
}
