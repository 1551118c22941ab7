//! Vertices next to tips and ridges of the original move onto them.

use cotan_geometry::{Positions, TriangleTree};
use nalgebra::{Point3, Vector3};

use super::Remesher;
use super::edits::{is_same_side, least_cosine};
use crate::features::Place;
use crate::triangles::{next, prev};

impl Remesher<'_> {
    /// Moves vertices to vertices of the original that are too far from the new surface, the
    /// farthest first, where no triangle turns over or becomes a sliver.
    pub(super) fn reach_out(&mut self) {
        let mut has_moved = vec![false; self.triangles.points.len()];
        for (v, original) in self.missed() {
            let point = self.original.point(original);
            if !has_moved[v as usize] && self.may_move(v, &point) {
                has_moved[v as usize] = true;
                self.triangles.points[v as usize] = point;
                self.seeds[v as usize] = self.original.outgoing[original as usize] / 3;
            }
        }
    }

    /// Vertices with a vertex of the original that they should move to, the farthest from the
    /// surface first.
    fn missed(&self) -> Vec<(u32, u32)> {
        let faces: Vec<[u32; 3]> = (0..(self.triangles.origin.len() / 3) as u32)
            .filter(|f| self.triangles.is_alive(3 * f))
            .map(|f| self.triangles.corners(f))
            .collect();
        let positions: Positions<f64> = self
            .triangles
            .points
            .iter()
            .map(|&p| Point3::from(p))
            .collect();
        let tree = TriangleTree::build(faces, &positions);
        let mut missed = cotan_parallel::filter_map(self.original.points.len(), |i| {
            let point = Point3::from(self.original.points[i]);
            let size = self.original_sizes[i];
            let foot = tree.closest(&point, 2.0 * size, &positions)?;
            let distance = foot.squared_distance.sqrt();
            let corners = tree.triangles()[foot.triangle];
            let nearest = (0..3)
                .max_by(|&a: &usize, &b| foot.barycentric[a].total_cmp(&foot.barycentric[b]))?;
            let v = corners[nearest];
            let is_wanted = distance > TOLERANCE * size && self.places[v as usize] == Place::Free;
            is_wanted.then(|| (u64::MAX - (distance / size).to_bits(), v, i as u32))
        });
        cotan_parallel::sort_unstable(&mut missed);
        missed.into_iter().map(|(_, v, i)| (v, i)).collect()
    }

    fn may_move(&self, v: u32, point: &Vector3<f64>) -> bool {
        self.triangles.ring(v).all(|h| {
            let [a, b, c] = [h, next(h), prev(h)].map(|g| self.triangles.origin(g));
            let [a, b, c] = [a, b, c].map(|w| self.triangles.point(w));
            let (before, after) = ([a, b, c], [*point, b, c]);
            let normal = |[a, b, c]: [Vector3<f64>; 3]| Self::area_vector(a, b, c);
            let worst = least_cosine(after);
            is_same_side(&normal(before), &normal(after))
                && (worst < LEAST_ANGLE.cos() || worst <= least_cosine(before))
        })
    }
}

/// The distance, in target lengths, from which on a vertex of the original counts as cut off.
const TOLERANCE: f64 = 0.1;

/// The least angle, in radians, of a triangle that is changed here.
const LEAST_ANGLE: f64 = 0.47;
