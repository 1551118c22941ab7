//! Edges, components, boundaries and defects of any list of polygons.

use cotan_io::FaceList;
use nalgebra::Point3;

use super::Lengths;
use super::defect::Defect;

/// One side of a face.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    /// The ends, lower one first.
    ends: [u32; 2],
    /// The corner (in the order of the face list) that the side starts from, and the next one.
    corners: [u32; 2],
    face: u32,
    /// Whether it runs from the lower end to the upper one.
    is_forward: bool,
}

pub(super) struct Connectivity<'a> {
    num_vertices: usize,
    faces: &'a FaceList,
    /// Sorted by their ends, so that the sides of an edge are neighbours.
    sides: Vec<Side>,
    is_used: Vec<bool>,
}

impl<'a> Connectivity<'a> {
    pub(super) fn of(num_vertices: usize, faces: &'a FaceList) -> Self {
        let mut sides = Vec::with_capacity(faces.num_corners());
        let mut is_used = vec![false; num_vertices];
        let mut first_corner = 0u32;
        for (face, polygon) in (0u32..).zip(faces.iter()) {
            let degree = polygon.len() as u32;
            for k in 0..degree {
                let next = (k + 1) % degree;
                let (a, b) = (polygon[k as usize], polygon[next as usize]);
                is_used[a as usize] = true;
                if a != b {
                    sides.push(Side {
                        ends: [a.min(b), a.max(b)],
                        corners: [first_corner + k, first_corner + next],
                        face,
                        is_forward: a < b,
                    });
                }
            }
            first_corner += degree;
        }
        sides.sort_unstable();
        Self {
            num_vertices,
            faces,
            sides,
            is_used,
        }
    }

    /// The sides of every edge.
    fn edges(&self) -> impl Iterator<Item = &[Side]> {
        self.sides.chunk_by(|a, b| a.ends == b.ends)
    }

    pub(super) fn num_edges(&self) -> usize {
        self.edges().count()
    }

    pub(super) fn num_boundary_edges(&self) -> usize {
        self.edges().filter(|sides| sides.len() == 1).count()
    }

    /// Whether no edge has only one face.
    pub(super) fn is_closed(&self) -> bool {
        self.edges().all(|sides| sides.len() > 1)
    }

    pub(super) fn unreferenced(&self) -> impl Iterator<Item = usize> {
        (0..self.num_vertices).filter(|&v| !self.is_used[v])
    }

    pub(super) fn euler_characteristic(&self) -> i64 {
        let used = self.is_used.iter().filter(|used| **used).count();
        used as i64 - self.num_edges() as i64 + self.faces.len() as i64
    }

    /// Sets of faces that hang together by edges.
    pub(super) fn num_components(&self) -> usize {
        let mut sets = Sets::new(self.faces.len());
        for sides in self.edges() {
            sides
                .windows(2)
                .for_each(|pair| sets.join(pair[0].face, pair[1].face));
        }
        sets.count()
    }

    /// Boundary loops of a manifold mesh.
    pub(super) fn num_boundary_loops(&self) -> usize {
        let boundary: Vec<[u32; 2]> = self
            .edges()
            .filter(|sides| sides.len() == 1)
            .map(|sides| sides[0].ends)
            .collect();
        let mut sets = Sets::new(self.num_vertices);
        boundary.iter().for_each(|&[a, b]| sets.join(a, b));
        let mut roots: Vec<u32> = boundary.iter().map(|&[a, _]| sets.root(a)).collect();
        roots.sort_unstable();
        roots.dedup();
        roots.len()
    }

    pub(super) fn edge_lengths(&self, positions: &[Point3<f64>]) -> Option<Lengths> {
        let (mut min, mut max, mut sum, mut count) = (f64::INFINITY, 0.0f64, 0.0, 0usize);
        for sides in self.edges() {
            let [a, b] = sides[0].ends.map(|v| positions[v as usize]);
            let length = (b - a).norm();
            (min, max) = (min.min(length), max.max(length));
            sum += length;
            count += 1;
        }
        (count > 0).then(|| Lengths {
            min,
            mean: sum / count as f64,
            max,
        })
    }

    /// Everything that keeps the faces from being an oriented manifold, and unused vertices.
    pub(super) fn defects(&self) -> Vec<Defect> {
        let mut defects = self.repeated_vertices();
        for sides in self.edges() {
            let faces = || sides.iter().map(|side| side.face as usize).collect();
            match sides {
                [_] => {}
                [a, b] if a.is_forward != b.is_forward => {}
                [_, _] => {
                    defects.push(Defect::inconsistent_orientation(sides[0].ends, faces()));
                }
                _ => defects.push(Defect::non_manifold_edge(sides[0].ends, faces())),
            }
        }
        defects.extend(self.several_fans());
        defects.extend(self.unreferenced().map(Defect::unreferenced_vertex));
        defects
    }

    fn repeated_vertices(&self) -> Vec<Defect> {
        let mut last_face = vec![usize::MAX; self.num_vertices];
        let mut defects = Vec::new();
        for (face, polygon) in self.faces.iter().enumerate() {
            for &v in polygon {
                if std::mem::replace(&mut last_face[v as usize], face) == face {
                    defects.push(Defect::repeated_vertex(v, face));
                }
            }
        }
        defects
    }

    /// Vertices whose faces do not hang together by edges at the vertex.
    fn several_fans(&self) -> Vec<Defect> {
        let mut sets = Sets::new(self.faces.num_corners());
        for sides in self.edges() {
            for pair in sides.windows(2) {
                // The corner of each side at the edge's lower end, and at its upper end.
                let [a, b] = [pair[0], pair[1]].map(|side| match side.is_forward {
                    true => side.corners,
                    false => [side.corners[1], side.corners[0]],
                });
                sets.join(a[0], b[0]);
                sets.join(a[1], b[1]);
            }
        }
        let mut num_fans = vec![0usize; self.num_vertices];
        for (corner, &v) in (0u32..).zip(self.faces.iter().flatten()) {
            num_fans[v as usize] += usize::from(sets.root(corner) == corner);
        }
        let several = num_fans
            .into_iter()
            .enumerate()
            .filter(|(_, fans)| *fans > 1);
        several
            .map(|(vertex, fans)| Defect::several_fans(vertex, fans))
            .collect()
    }
}

/// Disjoint sets of the numbers 0..n (union–find with path halving).
struct Sets {
    parents: Vec<u32>,
}

impl Sets {
    fn new(len: usize) -> Self {
        Self {
            parents: (0..len as u32).collect(),
        }
    }

    fn root(&mut self, mut x: u32) -> u32 {
        while self.parents[x as usize] != x {
            let grandparent = self.parents[self.parents[x as usize] as usize];
            self.parents[x as usize] = grandparent;
            x = grandparent;
        }
        x
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        // The lower number is the root, so that the outcome does not depend on the order.
        self.parents[a.max(b) as usize] = a.min(b);
    }

    fn count(&mut self) -> usize {
        (0..self.parents.len() as u32)
            .filter(|&x| self.parents[x as usize] == x)
            .count()
    }
}
