//! Shorter edges where the new surface is too far from the original.
//!
//! A triangle with sides of length L departs from a surface of curvature κ by up to L²κ/6, and
//! cuts off tips and ridges that are smaller than it. Such places are found by measuring the
//! distance both ways: from the vertices of the original to the new surface, and from the middles
//! of new edges and triangles to the original.

use std::collections::VecDeque;

use cotan_geometry::{Positions, TriangleTree};
use nalgebra::Vector3;

use super::Remesher;
use super::sizes::limit_growth;
use crate::nearest::walk_within;
use crate::triangles::{NONE, Triangles};

/// The distance allowed between the surfaces, and the length below which edges are not shortened
/// to keep it. Both in the scaled unit.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Tolerance {
    pub(super) distance: f64,
    pub(super) shortest: f64,
}

/// A triangle of the new surface at which the surfaces are too far apart.
struct Far {
    face: u32,
    distance: f64,
}

impl Remesher<'_> {
    /// Shortens the target lengths where the distance between the surfaces is above the
    /// tolerance. Returns true if a length changed.
    pub(super) fn shorten_where_far(&mut self, tolerance: Tolerance) -> bool {
        let limit = SAFETY * tolerance.distance;
        let mut far = self.far_of_new(limit);
        far.extend(self.far_of_original(limit));
        let before = self.sizes.clone();
        for Far { face, distance } in far {
            // On a curved surface the distance falls by the square of the length.
            let factor = (limit / distance).sqrt().max(MIN_FACTOR);
            for v in self.triangles.corners(face) {
                let shorter = (before[v as usize] * factor).max(tolerance.shortest);
                let size = &mut self.sizes[v as usize];
                *size = size.min(shorter);
            }
        }
        if self.sizes == before {
            return false;
        }
        limit_growth(&self.triangles, &mut self.sizes);
        for (v, size) in self.sizes.iter().enumerate() {
            self.shortening[v] *= size / before[v];
        }
        true
    }

    /// Triangles of the new surface that are too far from the original.
    fn far_of_new(&self, limit: f64) -> Vec<Far> {
        let new = &self.triangles;
        let seed = |f: u32| self.seeds[new.origin(3 * f) as usize];
        let faces = cotan_parallel::filter_map(new.origin.len() / 3, |f| {
            let f = f as u32;
            let is_far = new.is_alive(3 * f) && {
                let far = |p| !is_within(self.original, seed(f), p, limit);
                middles(new, f).any(far)
            };
            is_far.then_some(f)
        });
        if faces.is_empty() {
            return Vec::new();
        }
        let tree = self.original_tree.get_or_init(|| Tree::new(self.original));
        cotan_parallel::filter_map(faces.len(), |i| {
            let face = faces[i];
            let (distance, _) = tree.farthest(middles(new, face))?;
            (distance > limit).then_some(Far { face, distance })
        })
    }

    /// Triangles of the new surface from which the original is too far.
    fn far_of_original(&self, limit: f64) -> Vec<Far> {
        let starts = self.starts();
        let faces = cotan_parallel::filter_map(self.original.num_faces, |f| {
            let start = starts[f];
            let far = |p| !is_within(&self.triangles, start, p, limit);
            let is_far = start == NONE || corners(self.original, f as u32).any(far);
            is_far.then_some(f as u32)
        });
        if faces.is_empty() {
            return Vec::new();
        }
        let tree = Tree::new(&self.triangles);
        cotan_parallel::filter_map(faces.len(), |i| {
            let (distance, face) = tree.farthest(corners(self.original, faces[i]))?;
            (distance > limit).then_some(Far { face, distance })
        })
    }

    /// Per triangle of the original: a triangle of the new surface close to it.
    fn starts(&self) -> Vec<u32> {
        let new = &self.triangles;
        let mut starts = vec![NONE; self.original.num_faces];
        let mut queue = VecDeque::new();
        for h in 0..new.origin.len() as u32 {
            if new.is_alive(h) {
                let face = self.seeds[new.origin(h) as usize];
                if starts[face as usize] == NONE {
                    starts[face as usize] = h / 3;
                    queue.push_back(face);
                }
            }
        }
        while let Some(face) = queue.pop_front() {
            for h in 3 * face..3 * face + 3 {
                let twin = self.original.twin(h);
                if twin != NONE && starts[twin as usize / 3] == NONE {
                    starts[twin as usize / 3] = starts[face as usize];
                    queue.push_back(twin / 3);
                }
            }
        }
        starts
    }
}

/// A search tree over triangles. A walk ends at a point that is nearest among its surroundings
/// only, so the few samples that it leaves far away are looked up among all triangles.
pub(super) struct Tree {
    tree: TriangleTree,
    positions: Positions<f64>,
    /// Per entry of the tree: its triangle.
    faces: Vec<u32>,
}

impl Tree {
    fn new(triangles: &Triangles) -> Self {
        let faces = cotan_parallel::filter_map(triangles.origin.len() / 3, |f| {
            let f = f as u32;
            triangles.is_alive(3 * f).then_some(f)
        });
        let corners = faces.iter().map(|&f| triangles.corners(f)).collect();
        let positions = triangles.points.iter().map(|&p| p.into()).collect();
        Self {
            tree: TriangleTree::build(corners, &positions),
            positions,
            faces,
        }
    }

    /// The distance of the sample that is farthest from the triangles, and the triangle nearest
    /// to it.
    fn farthest(&self, samples: impl Iterator<Item = Vector3<f64>>) -> Option<(f64, u32)> {
        samples
            .filter_map(|p| self.tree.closest(&p.into(), f64::INFINITY, &self.positions))
            .max_by(|a, b| a.squared_distance.total_cmp(&b.squared_distance))
            .map(|foot| (foot.squared_distance.sqrt(), self.faces[foot.triangle]))
    }
}

/// The middles of the sides and the centre of a triangle. A side counts for one of its triangles.
fn middles(triangles: &Triangles, face: u32) -> impl Iterator<Item = Vector3<f64>> + '_ {
    let sides = (3 * face..3 * face + 3)
        .filter(|&h| h == triangles.edge_of(h))
        .map(|h| {
            let ends = [triangles.origin(h), triangles.target(h)].map(|v| triangles.point(v));
            (ends[0] + ends[1]) / 2.0
        });
    sides.chain([center(triangles, face)])
}

/// The corners of a triangle. A corner counts for one of its triangles.
fn corners(triangles: &Triangles, face: u32) -> impl Iterator<Item = Vector3<f64>> + '_ {
    (3 * face..3 * face + 3).filter_map(|h| {
        let v = triangles.origin(h);
        (triangles.outgoing[v as usize] == h).then(|| triangles.point(v))
    })
}

fn is_within(triangles: &Triangles, start: u32, point: Vector3<f64>, distance: f64) -> bool {
    walk_within(triangles, start, point, distance).distance_squared <= distance * distance
}

fn center(triangles: &Triangles, face: u32) -> Vector3<f64> {
    let [a, b, c] = triangles.corners(face).map(|v| triangles.point(v));
    (a + b + c) / 3.0
}

/// The share of the allowed distance to which samples are held: between them it is larger.
const SAFETY: f64 = 0.85;

/// The largest shortening at once.
const MIN_FACTOR: f64 = 0.6;
