//! Splits, collapses and flips.

use nalgebra::Vector3;

use super::Remesher;
use crate::features::Place;
use crate::triangles::{Edge, NONE, next, prev};

impl Remesher<'_> {
    /// Splits edges above 4/3 of their target length, the longest first, until there is none.
    pub(super) fn split_long(&mut self) {
        let mut first = 0;
        while first < self.triangles.origin.len() {
            let last = self.triangles.origin.len();
            let mut edges = self.edges_by_length(first..last, |ratio| ratio > LONG);
            edges.reverse();
            // Halves that are still too long were appended, except the first half, which kept its
            // index: it is visited again with its neighbours.
            let mut again = Vec::new();
            for h in edges {
                if self.is_long(h) && self.triangles.num_faces + 2 <= self.most_faces {
                    self.split(h);
                    again.push(h);
                }
            }
            while let Some(h) = again.pop() {
                let h = self.triangles.edge_of(h);
                if self.is_long(h) && self.triangles.num_faces + 2 <= self.most_faces {
                    self.split(h);
                    again.push(h);
                }
            }
            first = last;
        }
    }

    fn is_long(&self, h: u32) -> bool {
        self.triangles.is_edge(h) && self.triangles.length(h) > LONG * self.target(h)
    }

    fn split(&mut self, h: u32) {
        let [a, b] = self.triangles.edge(h).ends;
        let middle = (self.triangles.point(a) + self.triangles.point(b)) / 2.0;
        let on_line = self.triangles.tag(h) != NONE;
        self.triangles.split(h, middle);
        self.places
            .push(if on_line { Place::Line } else { Place::Free });
        self.seeds.push(self.seeds[a as usize]);
        self.sources.push(NONE);
        for values in [&mut self.sizes, &mut self.shortening] {
            values.push((values[a as usize] + values[b as usize]) / 2.0);
        }
    }

    /// Collapses edges below 4/5 of their target length, the shortest first, unless that makes
    /// another edge too long.
    pub(super) fn collapse_short(&mut self) {
        let edges = self.edges_by_length(0..self.triangles.origin.len(), |ratio| ratio < SHORT);
        for h in edges {
            if self.triangles.is_edge(h) && self.triangles.length(h) < SHORT * self.target(h) {
                self.collapse(h, LONG);
            }
        }
    }

    /// Merges the ends of an edge if no edge becomes longer than `longest` times its target and
    /// no triangle turns over.
    fn collapse(&mut self, h: u32, longest: f64) -> bool {
        let t = self.triangles.twin(h);
        let [u, v] = self.triangles.edge(h).ends;
        let is_line = self.triangles.tag(h) != NONE;
        let middle = (self.triangles.point(u) + self.triangles.point(v)) / 2.0;
        let [place_u, place_v] = [u, v].map(|v| self.places[v as usize]);
        let (h, point) = match (place_u, place_v) {
            (Place::Free, Place::Free) => (h, middle),
            (Place::Free, _) => (h, self.triangles.point(v)),
            (_, Place::Free) => (t, self.triangles.point(u)),
            (Place::Line, _) if is_line => (h, self.triangles.point(v)),
            (Place::Corner, Place::Line) if is_line && t != NONE => (t, self.triangles.point(u)),
            // The boundary has one side: the vertex moves to the corner, which stays.
            (Place::Corner, Place::Line) if is_line => (h, self.triangles.point(u)),
            _ => return false,
        };
        if h == NONE || !self.triangles.can_collapse(h) || !self.allows(h, &point, longest) {
            return false;
        }
        let [from, into] = self.triangles.edge(h).ends;
        if self.places[from as usize] == Place::Corner {
            self.places[into as usize] = Place::Corner;
        }
        if point == self.triangles.point(from) {
            self.seeds[into as usize] = self.seeds[from as usize];
        }
        self.triangles.collapse(h);
        self.triangles.points[into as usize] = point;
        true
    }

    /// Returns true if merging the ends of `h` at `point` is allowed.
    fn allows(&self, h: u32, point: &Vector3<f64>, longest: f64) -> bool {
        let triangles = &self.triangles;
        let t = triangles.twin(h);
        let removed = [h / 3, if t == NONE { NONE } else { t / 3 }];
        [h, next(h)].into_iter().all(|at| {
            let v = triangles.origin(at);
            triangles.ring(v).all(|g| {
                let ends = [triangles.target(g), triangles.origin(prev(g))];
                let is_short = ends.iter().all(|&w| {
                    let size = self.sizes[v as usize].min(self.sizes[w as usize]);
                    (triangles.point(w) - point).norm() <= longest * size
                });
                let [a, b] = ends.map(|w| triangles.point(w));
                let before = triangles.area_vector(g / 3);
                let after = Self::area_vector(*point, a, b);
                removed.contains(&(g / 3)) || (is_short && is_same_side(&before, &after))
            })
        })
    }

    /// Flips edges where that brings the valences closer to 6, or 4 on the boundary.
    pub(super) fn flip_to_valence(&mut self) {
        let mut valences: Vec<i32> = (0..self.triangles.points.len() as u32)
            .map(|v| {
                if self.triangles.has_vertex(v) {
                    self.excess(v)
                } else {
                    0
                }
            })
            .collect();
        for h in 0..self.triangles.origin.len() as u32 {
            if !self.may_flip(h) {
                continue;
            }
            let Edge { ends, opposite } = self.triangles.edge(h);
            let cost = |loses: i32, gains: i32| -> i32 {
                let off = |v: u32, change: i32| (valences[v as usize] + change).pow(2);
                ends.iter().map(|&v| off(v, loses)).sum::<i32>()
                    + opposite.iter().map(|&v| off(v, gains)).sum::<i32>()
            };
            if cost(-1, 1) < cost(0, 0) && self.keeps_surface(h, Some(WORST_ANGLE)) {
                self.triangles.flip(h);
                for v in ends {
                    valences[v as usize] -= 1;
                }
                for v in opposite {
                    valences[v as usize] += 1;
                }
            }
        }
    }

    fn excess(&self, v: u32) -> i32 {
        let regular = if self.triangles.is_boundary_vertex(v) {
            4
        } else {
            6
        };
        self.triangles.valence(v) as i32 - regular
    }

    /// Flips edges where that raises the least angle of the two triangles.
    pub(super) fn flip_to_angles(&mut self) {
        for h in 0..self.triangles.origin.len() as u32 {
            if self.may_flip(h) && self.keeps_surface(h, None) {
                self.triangles.flip(h);
            }
        }
    }

    fn may_flip(&self, h: u32) -> bool {
        self.triangles.is_edge(h) && self.triangles.tag(h) == NONE && self.triangles.can_flip(h)
    }

    /// Returns true if the triangles after flipping `h` face the same way as before and have no
    /// angle that is smaller than the least one before, unless it is above `accepted` (in
    /// radians).
    fn keeps_surface(&self, h: u32, accepted: Option<f64>) -> bool {
        let Edge {
            ends: [u, v],
            opposite: [c, d],
        } = self.triangles.edge(h);
        let [u, v, c, d] = [u, v, c, d].map(|w| self.triangles.point(w));
        let (old, new) = ([[u, v, c], [v, u, d]], [[d, c, u], [c, d, v]]);
        let normal = |[a, b, c]: [Vector3<f64>; 3]| Self::area_vector(a, b, c);
        let sum = old.map(normal).iter().sum::<Vector3<f64>>();
        let faces_out = new.map(normal).iter().all(|n| is_same_side(&sum, n));
        let worst = |pair: [[Vector3<f64>; 3]; 2]| least_cosine(pair[0]).max(least_cosine(pair[1]));
        let after = worst(new);
        faces_out
            && (after < worst(old) - 1e-9 || accepted.is_some_and(|least| after <= least.cos()))
    }

    /// Removes triangles with an angle below 30 degrees by a collapse of their shortest edge or a
    /// split of their longest.
    pub(super) fn improve_slivers(&mut self) {
        for f in 0..(self.triangles.origin.len() / 3) as u32 {
            if !self.triangles.is_alive(3 * f) {
                continue;
            }
            let corners = self.triangles.corners(f).map(|v| self.triangles.point(v));
            if least_cosine(corners) <= SLIVER_ANGLE.cos() {
                continue;
            }
            let mut sides = [3 * f, 3 * f + 1, 3 * f + 2];
            sides.sort_by(|&a, &b| {
                self.triangles
                    .length(a)
                    .total_cmp(&self.triangles.length(b))
            });
            let [shortest, _, longest] = sides.map(|h| self.triangles.edge_of(h));
            let is_long = self.triangles.length(longest) > 1.1 * self.target(longest);
            if !self.collapse(shortest, 1.5)
                && is_long
                && self.triangles.num_faces + 2 <= self.most_faces
            {
                self.split(longest);
            }
        }
    }

    /// The edges among some halfedges whose length relative to the target satisfies a condition,
    /// from the shortest to the longest.
    fn edges_by_length(
        &self,
        range: std::ops::Range<usize>,
        is_wanted: impl Fn(f64) -> bool + Sync + Send,
    ) -> Vec<u32> {
        let first = range.start;
        let mut found = cotan_parallel::filter_map(range.len(), |i| {
            let side = (first + i) as u32;
            let twin = self.triangles.twin(side);
            // Once per edge: from its smaller side, or from the only side within the range.
            let is_its_turn = side < twin || (twin as usize) < first;
            if !self.triangles.is_alive(side) || !is_its_turn {
                return None;
            }
            let h = self.triangles.edge_of(side);
            let length = self.triangles.length(h);
            is_wanted(length / self.target(h)).then(|| (length.to_bits(), h))
        });
        cotan_parallel::sort_unstable(&mut found);
        found.into_iter().map(|(_, h)| h).collect()
    }
}

/// Returns true if two normals are less than about 80 degrees apart.
pub(super) fn is_same_side(m: &Vector3<f64>, n: &Vector3<f64>) -> bool {
    let dot = m.dot(n);
    dot > 0.0 && dot * dot > 0.04 * m.norm_squared() * n.norm_squared()
}

/// The cosine of the least angle of a triangle; 1 for one without area.
fn least_cosine([a, b, c]: [Vector3<f64>; 3]) -> f64 {
    let [x, y, z] = [c - b, a - c, b - a].map(|e| e.norm_squared());
    // The least angle is opposite to the shortest side.
    let (least, p, q) = if x <= y && x <= z {
        (x, y, z)
    } else if y <= z {
        (y, z, x)
    } else {
        (z, x, y)
    };
    let product = (p * q).sqrt();
    if product > 0.0 {
        ((p + q - least) / (2.0 * product)).min(1.0)
    } else {
        1.0
    }
}

/// Edges longer than this many target lengths are split.
const LONG: f64 = 4.0 / 3.0;

/// Edges shorter than this many target lengths are collapsed.
const SHORT: f64 = 4.0 / 5.0;

/// A flip for the sake of valences makes no angle below this one, in radians.
const WORST_ANGLE: f64 = 0.35;

/// Triangles with an angle below this one, in radians, are removed at the end.
const SLIVER_ANGLE: f64 = 0.5;
