//! Refinement of the triangles that fill a hole to the vertex density around it.
//!
//! Each vertex has a scale, the mean length of the boundary edges there. A triangle is split at
//! its centroid if the distances from the centroid to its corners, times √2, exceed the scales of
//! both. Then edges are flipped until the angles opposite each add up to at most π. Both steps
//! are repeated until no triangle is split. Source: P. Liepa, "Filling holes in meshes", SGP
//! 2003, section 4.
//!
//! The new vertices lie in the original triangles; [fairing](super::super::Filling::Smooth) is a
//! separate step.

use cotan_halfedge::{EdgeId, FaceId, HalfedgeMesh};
use nalgebra::{Point3, Vector3};

/// Maximum number of vertices added to all holes of a mesh together.
pub(super) const MAX_ADDED: usize = 100_000;

/// Maximum number of passes over all edges between two passes of splits. On a flat patch the
/// flips terminate by themselves.
const MAX_SWEEPS: usize = 20;

/// Triangles between the vertices of a rim, which come first, and added vertices.
pub(super) struct Patch {
    pub(super) points: Vec<Point3<f64>>,
    /// For each added vertex, a nearby vertex of the rim.
    pub(super) rim_vertices: Vec<usize>,
    pub(super) triangles: Vec<[usize; 3]>,
}

impl Patch {
    /// Creates a patch of triangles between rim vertices only.
    pub(super) fn plain(points: Vec<Point3<f64>>, triangles: Vec<[usize; 3]>) -> Self {
        Self {
            points,
            rim_vertices: Vec::new(),
            triangles,
        }
    }

    /// Creates a fan around a new vertex in the middle of the rim.
    pub(super) fn fan(mut points: Vec<Point3<f64>>) -> Self {
        let n = points.len();
        // Weight each term, so that no sum overflows.
        let weight = 1.0 / n as f64;
        let middle: Vector3<f64> = points.iter().map(|p| p.coords * weight).sum();
        points.push(Point3::from(middle));
        Self {
            points,
            rim_vertices: vec![0],
            triangles: (0..n).map(|i| [i, (i + 1) % n, n]).collect(),
        }
    }

    pub(super) fn num_rim(&self) -> usize {
        self.points.len() - self.rim_vertices.len()
    }

    /// Adds at most `max_added` vertices.
    ///
    /// `is_free` returns `true` for two rim vertices if there is no edge between them yet.
    pub(super) fn refine(&mut self, max_added: usize, is_free: impl Fn(usize, usize) -> bool) {
        let num_rim = self.num_rim();
        let triangles: Vec<[u32; 3]> = self.triangles.iter().map(|t| t.map(|i| i as u32)).collect();
        // The rim passes through every vertex once, so this is a disc.
        let Ok(mesh) = HalfedgeMesh::from_faces(self.points.len(), &triangles) else {
            return;
        };
        let max_vertices = self.points.len() + max_added;
        let mut refinement = Refinement {
            scales: scales(&self.points, num_rim, self.area(), max_added),
            points: std::mem::take(&mut self.points),
            rim_vertices: std::mem::take(&mut self.rim_vertices),
            num_rim,
            mesh,
        };
        loop {
            let num_before = refinement.points.len();
            refinement.split(max_vertices);
            refinement.relax(&is_free);
            if refinement.points.len() == num_before {
                break;
            }
        }
        let Refinement {
            points,
            rim_vertices,
            mesh,
            ..
        } = refinement;
        (self.points, self.rim_vertices) = (points, rim_vertices);
        self.triangles = mesh
            .faces()
            .map(|face| mesh.triangle(face).map(|v| v.index()))
            .collect();
    }

    fn area(&self) -> f64 {
        let area = |&t: &[usize; 3]| {
            let [a, b, c] = t.map(|i| self.points[i]);
            (b - a).cross(&(c - a)).norm() / 2.0
        };
        self.triangles.iter().map(area).sum()
    }
}

/// The scale of every vertex. Scales exceed the edge lengths around the hole if these would
/// require more vertices than may be added.
fn scales(points: &[Point3<f64>], num_rim: usize, area: f64, max_added: usize) -> Vec<f64> {
    let length = |i: usize| (points[(i + 1) % num_rim] - points[i]).norm();
    let mut scales: Vec<f64> = (0..num_rim)
        .map(|i| (length(i) + length((i + num_rim - 1) % num_rim)) / 2.0)
        .collect();
    let mean = scales.iter().sum::<f64>() / num_rim as f64;
    scales.resize(points.len(), mean);
    // In a regular triangulation, the area per vertex is √3/2 times the squared edge length.
    let expected = area / (mean * mean * 3f64.sqrt() / 2.0);
    let factor = (expected / max_added.max(1) as f64).sqrt();
    if factor > 1.0 && factor.is_finite() {
        scales.iter_mut().for_each(|scale| *scale *= factor);
    }
    scales
}

struct Refinement {
    mesh: HalfedgeMesh,
    points: Vec<Point3<f64>>,
    scales: Vec<f64>,
    rim_vertices: Vec<usize>,
    num_rim: usize,
}

impl Refinement {
    /// Splits all triangles that are too large once.
    fn split(&mut self, max_vertices: usize) {
        for face in 0..self.mesh.num_faces() {
            if self.points.len() >= max_vertices {
                return;
            }
            let face = FaceId::new(face);
            let corners = self.mesh.triangle(face).map(|v| v.index());
            let center: Vector3<f64> = corners.map(|i| self.points[i].coords / 3.0).iter().sum();
            let center = Point3::from(center);
            let scale = corners.map(|i| self.scales[i] / 3.0).iter().sum::<f64>();
            let is_far = |&i: &usize| {
                let distance = std::f64::consts::SQRT_2 * (self.points[i] - center).norm();
                distance > scale && distance > self.scales[i]
            };
            if !corners.iter().all(is_far) || self.mesh.split_face(face).is_err() {
                continue;
            }
            let distance = |i: &usize| (self.points[*i] - center).norm();
            let nearest = corners
                .into_iter()
                .min_by(|a, b| distance(a).total_cmp(&distance(b)))
                .unwrap_or_default();
            let rim_vertex = match nearest.checked_sub(self.num_rim) {
                Some(added) => self.rim_vertices[added],
                None => nearest,
            };
            self.points.push(center);
            self.scales.push(scale);
            self.rim_vertices.push(rim_vertex);
        }
    }

    /// Flips edges as long as that reduces the angles opposite them.
    fn relax(&mut self, is_free: impl Fn(usize, usize) -> bool) {
        for _ in 0..MAX_SWEEPS {
            let mut num_flips = 0;
            for edge in 0..self.mesh.num_edges() {
                let edge = EdgeId::new(edge);
                if self.is_flip_good(edge, &is_free) && self.mesh.flip_edge(edge).is_ok() {
                    num_flips += 1;
                }
            }
            if num_flips == 0 {
                return;
            }
        }
    }

    fn is_flip_good(&self, edge: EdgeId, is_free: impl Fn(usize, usize) -> bool) -> bool {
        let mesh = &self.mesh;
        let [one, other] = edge.halfedges();
        if mesh.is_boundary_edge(edge) {
            return false;
        }
        let apex = |halfedge| mesh.target(mesh.next(halfedge)).index();
        let (c, d) = (apex(one), apex(other));
        let is_of_rim = c < self.num_rim && d < self.num_rim;
        if is_of_rim && !is_free(c, d) {
            return false;
        }
        let (u, v) = (mesh.origin(one).index(), mesh.target(one).index());
        let cotangent = |apex: usize| {
            let [a, b] = [u, v].map(|i| self.points[i] - self.points[apex]);
            a.dot(&b) / a.cross(&b).norm()
        };
        cotangent(c) + cotangent(d) < -SMALLEST
    }
}

/// Angles that add up to π within rounding are left unchanged.
const SMALLEST: f64 = 1e-9;
