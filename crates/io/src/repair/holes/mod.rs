//! Filling of holes with triangles between their vertices, or with new vertices.

mod cover;
mod refine;

use std::collections::HashSet;

use foldhash::fast::RandomState;
use nalgebra::Vector3;

use super::work::Work;
use super::{Change, Filling};
use crate::attributes::NONE;
use crate::cuts::Cuts;
use crate::topology::{BoundaryLoop, Topology};
use cover::{Cover, Failure, Rim};
use refine::{MAX_ADDED, Patch};

/// A face that fills a hole, and the source corner of each of its corners.
type Filled = ([u32; 3], [u32; 3]);

impl Work<'_> {
    pub(super) fn fill_holes(&mut self, filling: Filling) {
        let at = self.at();
        let topology = Topology::new(&self.faces, &at);
        let points = self.points();
        let loops = topology.boundary_loops(&mut topology.fans());
        let cuts = Cuts::new(&topology, self.faces.corners(), &self.places, &points);
        let mut edges: HashSet<[u32; 2], RandomState> =
            topology.edges().map(|sides| sides[0].ends).collect();
        edges.extend(cuts.ends());
        let mut cover = Cover::new(&points, self.faces.num_corners());
        let (mut filled, mut max_added): (Vec<Filled>, _) = (Vec::new(), MAX_ADDED);
        let corner_vertices = self.faces.corners().to_vec();
        for found in loops {
            if found.sides.len() > filling.max_edges() || is_outline(&found, &topology) {
                continue;
            }
            let vertex = |corner: u32| corner_vertices[corner as usize];
            let vertices = found
                .corners
                .iter()
                .map(|&c| self.vertex(vertex(c)))
                .collect();
            if let Some(problem) = obstacle(&found, &topology) {
                self.changes.push(Change::KeptHole { vertices, problem });
                continue;
            }
            // Opposite to the faces next to it.
            let mut corners = found.corners;
            corners[1..].reverse();
            let n = corners.len();
            let normals = (0..n).map(|k| {
                let face = topology.face(corners[(k + 1) % n]);
                let outline = topology.outlines.get(face as usize).unwrap_or_default();
                normal(
                    outline
                        .iter()
                        .map(|&corner| points[vertex(corner) as usize].coords),
                )
            });
            let rim: Vec<u32> = corners.iter().map(|&corner| vertex(corner)).collect();
            let rim = Rim::new(rim, &points, normals.collect());
            let ends = |i: usize, j: usize| {
                let (a, b) = (topology.place(corners[i]), topology.place(corners[j]));
                [a.min(b), a.max(b)]
            };
            let is_free = |i: usize, j: usize| !edges.contains(&ends(i, j));
            let rim_points = || rim.vertices.iter().map(|&v| points[v as usize]).collect();
            let mut patch = match (cover.triangles(&rim, is_free), filling) {
                (Ok(triangles), _) => Patch::plain(rim_points(), triangles),
                (Err(_), Filling::Smooth { .. }) => Patch::fan(rim_points()),
                (Err(failure), _) => {
                    let problem = problem(failure);
                    self.changes.push(Change::KeptHole { vertices, problem });
                    continue;
                }
            };
            if let Filling::Smooth { .. } = filling {
                patch.refine(max_added, is_free);
                max_added = max_added.saturating_sub(patch.rim_vertices.len());
            }
            let inner = patch
                .triangles
                .iter()
                .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
            let inner = inner.filter(|&[i, j]| i < n && j < n && i.abs_diff(j) % (n - 1) > 1);
            edges.extend(inner.map(|[i, j]| ends(i, j)));
            self.changes.push(Change::FilledHole {
                vertices,
                num_faces: patch.triangles.len(),
                num_added: patch.rim_vertices.len(),
            });
            let mut numbers = rim.vertices.clone();
            for (&vertex, &point) in patch.rim_vertices.iter().zip(&patch.points[n..]) {
                numbers.push(self.add_vertex(rim.vertices[vertex], point));
            }
            let source = |i: usize| match i.checked_sub(n) {
                Some(added) => corners[patch.rim_vertices[added]],
                None => corners[i],
            };
            filled.extend(patch.triangles.iter().map(|&triangle| {
                let vertices = triangle.map(|i| numbers[i]);
                (vertices, triangle.map(source))
            }));
        }
        for (vertices, sources) in filled {
            for (vertex, source) in vertices.into_iter().zip(sources) {
                self.faces.push_corner(vertex);
                self.corner_sources
                    .push(self.corner_sources[source as usize]);
            }
            self.faces.end_face();
            self.face_sources.push(NONE);
        }
    }
}

/// The unit normal of a polygon, or zero.
fn normal(points: impl Iterator<Item = Vector3<f64>> + Clone) -> Vector3<f64> {
    let Some(origin) = points.clone().next() else {
        return Vector3::zeros();
    };
    let spokes = points.map(|p| p - origin);
    let pairs = spokes.clone().zip(spokes.skip(1));
    let sum: Vector3<f64> = pairs.map(|(a, b)| a.cross(&b)).sum();
    sum.try_normalize(0.0).unwrap_or_default()
}

fn problem(failure: Failure) -> &'static str {
    match failure {
        Failure::NoneExists => {
            "every way to cut it into triangles needs an edge that already exists; \
             smooth filling adds vertices"
        }
        Failure::NoneFound => {
            "it is long, and no way to cut it into triangles was found without an edge that \
             already exists; smooth filling adds vertices"
        }
    }
}

/// Returns `true` if a loop goes around a single face, whose back would fill it.
fn is_outline(found: &BoundaryLoop, topology: &Topology<'_>) -> bool {
    let face = topology.face(found.sides[0]);
    found.sides.iter().all(|&side| topology.face(side) == face)
        && topology
            .outlines
            .get(face as usize)
            .is_some_and(|outline| outline.len() == found.sides.len())
}

/// Returns the reason why a loop cannot be filled, if any.
fn obstacle(found: &BoundaryLoop, topology: &Topology<'_>) -> Option<&'static str> {
    let mut places: Vec<u32> = found.corners.iter().map(|&c| topology.place(c)).collect();
    places.sort_unstable();
    places.dedup();
    if !found.is_simple || places.len() != found.corners.len() {
        return Some("its boundary meets itself");
    }
    if found.corners != found.sides {
        return Some("the faces round it are oriented against each other");
    }
    (places.len() < 3).then_some("it has fewer than three corners")
}

#[cfg(test)]
mod tests;
