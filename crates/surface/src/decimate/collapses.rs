//! The queue of collapses.

use nalgebra::Vector3;

use super::attributes::Channels;
use super::options::Stop;
use super::quadric::{Quadrics, is_on_inner_line};
use super::queue::RadixHeap;
use crate::features::{Place, places};
use crate::triangles::{NONE, Triangles, next, prev};

/// The state of a decimation.
pub(super) struct Collapses<'a> {
    triangles: &'a mut Triangles,
    pub(super) quadrics: Quadrics,
    places: Vec<Place>,
    /// Per vertex, if an attribute may jump at kept lines: whether it is on one.
    has_jump: Vec<bool>,
    queue: RadixHeap,
    /// Per halfedge: true if its edge is in the queue under this index.
    is_queued: Vec<bool>,
    /// Per vertex: the vertex that it was merged into, or [`NONE`].
    pub(super) into: Vec<u32>,
    /// Per vertex: true if it left its original position.
    pub(super) is_moved: Vec<bool>,
    /// The largest distance so far.
    pub(super) error: f64,
}

/// A possible collapse.
struct Candidate {
    cost: f64,
    /// The root mean square distance.
    distance: f64,
    point: Vector3<f64>,
    /// A halfedge of the edge.
    halfedge: u32,
    /// The end that stays.
    stays: u32,
}

impl<'a> Collapses<'a> {
    pub(super) fn new(triangles: &'a mut Triangles, channels: &Channels) -> Self {
        let quadrics = Quadrics::new(triangles, channels);
        let num_halfedges = triangles.origin.len();
        let num_vertices = triangles.points.len();
        let mut collapses = Self {
            places: places(triangles, f64::INFINITY),
            has_jump: if channels.may_jump {
                cotan_parallel::filled(num_vertices, |v| is_on_inner_line(triangles, v as u32))
            } else {
                Vec::new()
            },
            quadrics,
            queue: RadixHeap::new([]),
            is_queued: vec![false; num_halfedges],
            into: vec![NONE; num_vertices],
            is_moved: vec![false; num_vertices],
            error: 0.0,
            triangles,
        };
        collapses.fill();
        collapses
    }

    /// Puts every edge that may be collapsed into the queue. Returns true if there is any.
    fn fill(&mut self) -> bool {
        let this = &*self;
        let keys = cotan_parallel::filter_map(this.is_queued.len(), |h| {
            let h = h as u32;
            let is_wanted = this.triangles.is_edge(h) && !this.is_queued[h as usize];
            let candidate = is_wanted.then(|| this.candidate(h)).flatten()?;
            Some(key(candidate.cost, h))
        });
        for &key in &keys {
            self.is_queued[key as u32 as usize] = true;
        }
        let has_any = !keys.is_empty();
        self.queue = RadixHeap::new(keys);
        has_any
    }

    /// Collapses edges until a bound is reached or no edge can be collapsed.
    pub(super) fn run(&mut self, stop: &Stop) {
        loop {
            let before = self.triangles.num_faces;
            self.empty_queue(stop);
            let has_progress = self.triangles.num_faces < before;
            // Edges that were refused may have become possible by later collapses.
            if self.triangles.num_faces <= stop.faces || !has_progress || !self.fill() {
                return;
            }
        }
    }

    fn empty_queue(&mut self, stop: &Stop) {
        while self.triangles.num_faces > stop.faces {
            let Some(entry) = self.queue.pop() else {
                return;
            };
            let h = entry as u32;
            self.is_queued[h as usize] = false;
            if !self.triangles.is_edge(h) {
                continue;
            }
            let Some(candidate) = self.candidate(h) else {
                continue;
            };
            let current = key(candidate.cost, h);
            if current > entry {
                self.is_queued[h as usize] = true;
                self.queue.push(current);
                continue;
            }
            if candidate.distance <= stop.error
                && self.triangles.can_collapse(candidate.halfedge)
                && self.keeps_shape(&candidate)
            {
                self.collapse(&candidate);
            }
        }
    }

    fn collapse(&mut self, candidate: &Candidate) {
        let h = candidate.halfedge;
        let v = candidate.stays;
        let u = self.triangles.origin(h) + self.triangles.target(h) - v;
        self.triangles.collapse_into(h, v);
        self.quadrics.merge(u, v);
        self.into[u as usize] = v;
        self.error = self.error.max(candidate.distance);
        if candidate.point != self.triangles.point(v) {
            self.triangles.points[v as usize] = candidate.point;
            self.is_moved[v as usize] = true;
        }
        let start = self.triangles.outgoing[v as usize];
        let mut at = start;
        loop {
            self.enqueue(self.triangles.edge_of(at));
            let last = prev(at);
            at = self.triangles.twin(last);
            if at == NONE {
                self.enqueue(last);
            }
            if at == NONE || at == start {
                return;
            }
        }
    }

    /// Puts the edge of `h` into the queue if it may be collapsed and is not there.
    #[inline]
    fn enqueue(&mut self, h: u32) {
        if !self.is_queued[h as usize]
            && let Some(candidate) = self.candidate(h)
        {
            self.is_queued[h as usize] = true;
            self.queue.push(key(candidate.cost, h));
        }
    }

    /// The best collapse of the edge of `h`, if its ends may be merged at all.
    #[inline]
    fn candidate(&self, h: u32) -> Option<Candidate> {
        let (u, v) = (self.triangles.origin(h), self.triangles.target(h));
        let (p, q) = (self.triangles.point(u), self.triangles.point(v));
        let is_line = self.triangles.tag(h) != NONE;
        let [place_u, place_v] = [u, v].map(|v| self.places[v as usize]);
        if !self.has_jump.is_empty() && self.has_jump[u as usize] != self.has_jump[v as usize] {
            return None;
        }
        let quadric = self.quadrics.merged(u, v);
        let (stays, point) = match (place_u, place_v) {
            (Place::Free, Place::Free) => (v, None),
            (Place::Line, Place::Line) if is_line => (v, None),
            (Place::Free, _) => (v, Some(q)),
            (_, Place::Free) => (u, Some(p)),
            (Place::Line, Place::Corner) if is_line => (v, Some(q)),
            (Place::Corner, Place::Line) if is_line => (u, Some(p)),
            _ => return None,
        };
        let point = point.unwrap_or_else(|| {
            let middle = (p + q) / 2.0;
            let free = quadric.minimum(&middle).unwrap_or(middle);
            // Far beyond the edge, the planes are too parallel to be trusted.
            if (free - middle).norm_squared() <= 4.0 * (q - p).norm_squared() {
                free
            } else {
                middle
            }
        });
        let cost = quadric.at(&point);
        Some(Candidate {
            cost,
            distance: quadric.distance(cost),
            point,
            halfedge: h,
            stays,
        })
    }

    /// Returns true if no triangle around the edge turns over or becomes a sliver.
    fn keeps_shape(&self, candidate: &Candidate) -> bool {
        let (h, t) = (candidate.halfedge, self.triangles.twin(candidate.halfedge));
        let removed = [h / 3, if t == NONE { NONE } else { t / 3 }];
        for at in [h, next(h)] {
            for g in self.triangles.ring(self.triangles.origin(at)) {
                let face = g / 3;
                if face != removed[0]
                    && face != removed[1]
                    && !self.keeps_triangle(g, &candidate.point)
                {
                    return false;
                }
            }
        }
        true
    }

    #[inline]
    fn keeps_triangle(&self, g: u32, point: &Vector3<f64>) -> bool {
        let corner = |h: u32| self.triangles.point(self.triangles.origin(h));
        let (a, b, c) = (corner(g), corner(next(g)), corner(prev(g)));
        let (ab, ac, opposite) = (b - point, c - point, c - b);
        let before = (b - a).cross(&(c - a));
        let after = ab.cross(&ac);
        let (before_squared, after_squared) = (before.norm_squared(), after.norm_squared());
        let dot = before.dot(&after);
        let turns =
            !(dot >= 0.0 && dot * dot >= MIN_COSINE.powi(2) * before_squared * after_squared);
        if turns {
            return false;
        }
        let square = |x: Vector3<f64>| x.norm_squared();
        let longest = square(ab).max(square(ac)).max(square(opposite));
        if after_squared >= (MIN_HEIGHT * longest).powi(2) {
            return true;
        }
        // A sliver may be replaced by a better one.
        let longest_before = square(b - a).max(square(c - a)).max(square(opposite));
        after_squared * longest_before.powi(2) > before_squared * longest.powi(2)
    }
}

/// An entry of the queue: ordered by cost, then by the edge.
fn key(cost: f64, h: u32) -> u64 {
    // The bits of positive floats are in the order of their values.
    (u64::from((cost as f32).to_bits()) << 32) | u64::from(h)
}

/// The cosine of the largest angle by which a collapse may turn a triangle.
const MIN_COSINE: f64 = 0.2;

/// The smallest height of a new triangle relative to its longest side.
const MIN_HEIGHT: f64 = 0.05;
