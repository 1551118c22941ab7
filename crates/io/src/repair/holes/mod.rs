//! Holes closed by triangles between their vertices.

use std::collections::HashSet;

use foldhash::fast::RandomState;

use super::Change;
use super::work::Work;
use crate::attributes::NONE;
use crate::cuts::Cuts;
use crate::topology::{BoundaryLoop, Topology};
use crate::triangulate::Triangulator;

impl Work<'_> {
    pub(super) fn fill_holes(&mut self, most_edges: usize) {
        let at = self.at();
        let topology = Topology::new(&self.faces, &at);
        let points = self.points();
        let loops = topology.boundary_loops(&mut topology.fans());
        let cuts = Cuts::new(&topology, self.faces.corners(), &self.places, &points);
        let mut edges: HashSet<[u32; 2], RandomState> =
            topology.edges().map(|sides| sides[0].ends).collect();
        edges.extend(cuts.ends());
        let mut triangulator = Triangulator::new(&points, self.faces.num_corners());
        // The corner beside the hole at each vertex round it.
        let mut corner_at = vec![NONE; self.sources.len()];
        let mut triangles = Vec::new();
        for found in loops {
            if found.sides.len() > most_edges || is_outline(&found, &topology) {
                continue;
            }
            let vertex = |corner: u32| self.faces.corners()[corner as usize];
            let vertices = found
                .corners
                .iter()
                .map(|&c| self.vertex(vertex(c)))
                .collect();
            if let Some(problem) = obstacle(&found, &topology) {
                self.changes.push(Change::KeptHole { vertices, problem });
                continue;
            }
            // Against the faces beside it.
            let mut corners = found.corners;
            corners[1..].reverse();
            for &corner in &corners {
                corner_at[vertex(corner) as usize] = corner;
            }
            let polygon: Vec<u32> = corners.iter().map(|&corner| vertex(corner)).collect();
            let start = triangles.len();
            triangulator.cut(&polygon, |t| {
                triangles.push(t.map(|v| corner_at[v as usize]))
            });
            let ends = |a: u32, b: u32| {
                let (a, b) = (topology.place(a), topology.place(b));
                [a.min(b), a.max(b)]
            };
            let rim: HashSet<[u32; 2], RandomState> = (0..corners.len())
                .map(|k| ends(corners[k], corners[(k + 1) % corners.len()]))
                .collect();
            let sides = triangles[start..]
                .iter()
                .flat_map(|&[a, b, c]| [ends(a, b), ends(b, c), ends(c, a)]);
            let inner: HashSet<_, RandomState> = sides.filter(|side| !rim.contains(side)).collect();
            if inner.iter().any(|side| edges.contains(side)) {
                triangles.truncate(start);
                let problem = "its triangles would need an edge that is there already";
                self.changes.push(Change::KeptHole { vertices, problem });
                continue;
            }
            edges.extend(inner);
            self.changes.push(Change::FilledHole {
                vertices,
                num_faces: triangles.len() - start,
            });
        }
        for corner in triangles.iter().flatten().map(|&corner| corner as usize) {
            self.corner_sources.push(self.corner_sources[corner]);
        }
        let vertices = self.faces.corners().to_vec();
        for triangle in triangles {
            for corner in triangle {
                self.faces.push_corner(vertices[corner as usize]);
            }
            self.faces.end_face();
            self.face_sources.push(NONE);
        }
    }
}

/// Whether a loop runs round a single face, whose back would fill it.
fn is_outline(found: &BoundaryLoop, topology: &Topology<'_>) -> bool {
    let face = topology.face(found.sides[0]);
    found.sides.iter().all(|&side| topology.face(side) == face)
        && topology
            .outlines
            .get(face as usize)
            .is_some_and(|outline| outline.len() == found.sides.len())
}

/// Why a loop cannot be filled, if so.
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
