//! Tangential smoothing with projection onto the original.

use nalgebra::Vector3;

use super::Remesher;
use super::edits::is_same_side;
use crate::features::Place;
use crate::nearest::{walk, walk_line};
use crate::triangles::NONE;

/// The new place of a vertex.
#[derive(Clone, Copy)]
struct Moved {
    point: Vector3<f64>,
    seed: u32,
    size: f64,
}

impl Remesher<'_> {
    /// Moves every vertex towards the centre of its triangles along the surface, and those of a
    /// line along it. Moves that would turn a triangle over are undone.
    pub(super) fn relax(&mut self) {
        let this = &*self;
        let moved = cotan_parallel::filled(this.triangles.points.len(), |v| this.moved(v as u32));
        let before = std::mem::take(&mut self.triangles.points);
        self.triangles.points = moved.iter().map(|m| m.point).collect();
        let mut is_undone = vec![false; moved.len()];
        let before_of = |corners: [u32; 3]| corners.map(|v| before[v as usize]);
        for _ in 0..UNDO_ROUNDS {
            let triangles = &self.triangles;
            let turned = cotan_parallel::filter_map(triangles.origin.len() / 3, |f| {
                let f = f as u32;
                if !triangles.is_alive(3 * f) {
                    return None;
                }
                let [a, b, c] = before_of(triangles.corners(f));
                let old = Self::area_vector(a, b, c);
                (!is_same_side(&old, &triangles.area_vector(f)) && old != Vector3::zeros())
                    .then(|| triangles.corners(f))
            });
            if turned.is_empty() {
                break;
            }
            for v in turned.into_iter().flatten() {
                self.triangles.points[v as usize] = before[v as usize];
                is_undone[v as usize] = true;
            }
        }
        for (v, m) in moved.iter().enumerate() {
            if !is_undone[v] {
                self.seeds[v] = m.seed;
                self.sizes[v] = m.size;
            }
        }
    }

    fn moved(&self, v: u32) -> Moved {
        let point = self.triangles.points[v as usize];
        let stays = Moved {
            point,
            seed: self.seeds[v as usize],
            size: self.sizes[v as usize],
        };
        if !self.triangles.has_vertex(v) {
            return stays;
        }
        let wanted = match self.places[v as usize] {
            Place::Corner => return stays,
            Place::Line => self.along_line(v),
            Place::Free => Some((self.toward_center(v), self.seeds[v as usize])),
        };
        let Some((wanted, start)) = wanted else {
            return stays;
        };
        let near = walk(self.original, start, wanted);
        let corners = self.original.corners(near.face);
        let size: f64 = (0..3)
            .map(|k| near.barycentric[k] * self.original_sizes[corners[k] as usize])
            .sum();
        let size = size * self.shortening[v as usize];
        let point = if self.places[v as usize] == Place::Line {
            wanted
        } else {
            near.point
        };
        let is_finite = point.iter().all(|x| x.is_finite());
        if is_finite {
            Moved {
                point,
                seed: near.face,
                size,
            }
        } else {
            stays
        }
    }

    /// The centre of the triangles around `v`, weighted by area and by the density that the
    /// target lengths ask for, moved into the tangent plane.
    fn toward_center(&self, v: u32) -> Vector3<f64> {
        let point = self.triangles.point(v);
        let (mut sum, mut total, mut normal) = (Vector3::zeros(), 0.0, Vector3::zeros());
        for h in self.triangles.ring(v) {
            let corners = self.triangles.corners(h / 3);
            let n = self.triangles.area_vector(h / 3);
            let size: f64 = corners.iter().map(|&w| self.sizes[w as usize]).sum();
            let weight = n.norm() / (size * size);
            let center: Vector3<f64> = corners.iter().map(|&w| self.triangles.point(w)).sum();
            sum += center * (weight / 3.0);
            total += weight;
            normal += n;
        }
        if !(total > 0.0) {
            return point;
        }
        let step = sum / total - point;
        match normal.try_normalize(0.0) {
            Some(n) => point + step - n * n.dot(&step),
            None => point,
        }
    }

    /// The middle between the two neighbours on the line of `v`, projected onto the line of the
    /// original, and a triangle of the original at that point.
    fn along_line(&self, v: u32) -> Option<(Vector3<f64>, u32)> {
        let mut lines = self
            .triangles
            .edges_at(v)
            .filter(|&h| self.triangles.tag(h) != NONE);
        let (a, b) = (lines.next()?, lines.next()?);
        let other = |h: u32| self.triangles.origin(h) + self.triangles.target(h) - v;
        let middle = (self.triangles.point(other(a)) + self.triangles.point(other(b))) / 2.0;
        let wanted = (self.triangles.point(v) + middle) / 2.0;
        let on = |h: u32| {
            let tag = self.triangles.tag(h);
            walk_line(self.original, &self.original_places, tag, wanted)
        };
        let (p, q) = (on(a), on(b));
        let is_nearer = (p.1 - wanted).norm_squared() <= (q.1 - wanted).norm_squared();
        let (edge, point) = if is_nearer { p } else { q };
        Some((point, edge / 3))
    }
}

/// Attempts to undo moves. The vertices of a turned triangle all return, so a few rounds suffice.
const UNDO_ROUNDS: usize = 8;
