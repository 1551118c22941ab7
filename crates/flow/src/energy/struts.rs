//! Struts, which keep the opposite walls of a body apart.

use std::ops::ControlFlow;

use cotan_geometry::{Meeting, Positions, Ray, Scalar, TriangleTree};
use cotan_halfedge::FaceId;
use cotan_parallel as parallel;
use nalgebra::{Point3, Vector3};

use super::bodies::Bodies;
use crate::nearest_rotation::Mat3;
use crate::passes::{Four, turned};
use crate::rest::Rest;

/// A strut joins a vertex to the point of the opposite wall that a ray into the body meets first,
/// whatever pieces the surface was cut into.
///
/// ```text
/// Σ_j ν_j |(x_j − y_j) − R̄_j d_j|²,   y_j = Σ_k b_k x_k,   ν_j = β μ min(A_j / |d_j|², 0.03)
/// ```
///
/// with d_j the strut of the original shape and A_j a third of the area around the vertex. The cap
/// keeps thin webs from becoming stiffer than the rest of the system by orders of magnitude.
#[derive(Debug)]
pub(super) struct Struts {
    of_vertex: Vec<Strut>,
    /// The struts that end at each vertex's triangles: those of vertex i from `starts[i]` on, each
    /// with its share.
    starts: Vec<u32>,
    ends: Vec<(u32, f64)>,
    /// Half the gradient of each strut's energy by x_j − y_j, over μ.
    forces: Vec<[f64; 3]>,
    is_hard: bool,
    /// Σ ν_j |d_j|².
    pub(super) rest_energy: f64,
}

/// The strut of one vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Strut {
    /// Corners of the triangle where it ends, and their shares of the end.
    corners: [u32; 3],
    shares: [f64; 3],
    /// d.
    pub(crate) rest: [f64; 3],
    /// ν over μ; 0 where there is no strut.
    pub(super) weight: f64,
    /// A third of the area around the vertex.
    area: f64,
    /// The weight of its hardening over μ; 0 unless the struts harden.
    hardening: f64,
}

/// The terms that a strut adds when it is compressed, over μ.
pub(super) struct Hardness {
    pub(super) energy: f64,
    /// Half the gradient by the span, over the span.
    force: f64,
}

impl Strut {
    /// The vertices on which it ends, and their shares.
    pub(crate) fn ends(&self) -> impl Iterator<Item = (usize, f64)> {
        let corners = self.corners.map(|c| c as usize);
        corners.into_iter().zip(self.shares)
    }

    /// x_j − y_j, for the vertex at `from`.
    #[inline(always)]
    pub(super) fn span<T: Scalar>(&self, from: Four, positions: &[Point3<T>]) -> Four {
        let mut span = from;
        for (corner, share) in self.corners.iter().zip(self.shares) {
            span = span - Four::of_point(&positions[*corner as usize]) * Four::all(share);
        }
        span
    }
}

impl Strut {
    /// w (ln(λ0/λ))₊^p, with λ the length over the original one: struts that harden under
    /// compression keep a section from collapsing where the surface is wound up.
    #[inline(always)]
    pub(super) fn hardness(&self, span: Four) -> Hardness {
        /// λ0 and p: of those that were tried the ones that hold the widest turns.
        const FREE: f64 = 0.9;
        const POWER: i32 = 2;
        let squared = (span * span).sum();
        let ratio = (squared / Vector3::from(self.rest).norm_squared()).sqrt();
        let over = (FREE / ratio).ln();
        if !(over > 0.0) || self.hardening == 0.0 {
            return Hardness {
                energy: 0.0,
                force: 0.0,
            };
        }
        Hardness {
            energy: self.hardening * over.powi(POWER),
            force: -0.5 * self.hardening * f64::from(POWER) * over.powi(POWER - 1) / squared,
        }
    }
}

impl Struts {
    /// Struts of weight β = `stiffness`; μ = `membrane`.
    pub(super) fn new<T: Scalar>(
        rest: &Rest<T>,
        bodies: &Bodies,
        stiffness: f64,
        membrane: f64,
    ) -> Self {
        /// The largest weight of a strut relative to an edge.
        const MAX_WEIGHT: f64 = 0.03;
        let points = rest.positions().map(|p| p.map(T::as_f64));
        let walls = Walls::new(rest, bodies, &points);
        let areas = rest.areas().as_slice();
        let mut of_vertex = parallel::filled(points.len(), |j| walls.strut(j));
        for (j, strut) in of_vertex.iter_mut().enumerate() {
            if strut.weight > 0.0 {
                let squared = Vector3::from(strut.rest).norm_squared();
                strut.area = areas[j].as_f64() / 3.0;
                strut.weight = stiffness * (strut.area / squared).min(MAX_WEIGHT);
            }
        }
        let (starts, ends) = ends_at(&of_vertex);
        let squares = |s: &Strut| s.weight * Vector3::from(s.rest).norm_squared();
        Self {
            rest_energy: membrane * of_vertex.iter().map(squares).sum::<f64>(),
            forces: vec![[0.0; 3]; of_vertex.len()],
            is_hard: false,
            of_vertex,
            starts,
            ends,
        }
    }

    /// Predicts the bytes that the struts of a mesh take while they are found: their own, the tree
    /// of the triangles, and a copy of the positions.
    pub(super) fn predicted_bytes(num_vertices: usize, num_triangles: usize) -> u64 {
        let points = num_vertices as u64 * size_of::<Point3<f64>>() as u64;
        let tree = TriangleTree::predicted_bytes(num_triangles);
        Self::kept_bytes(num_vertices) + tree + points
    }

    /// Those that they take from then on, at most: each vertex has a strut with three ends.
    fn kept_bytes(num_vertices: usize) -> u64 {
        let end = size_of::<(u32, f64)>();
        let per_vertex = size_of::<Strut>() + 3 * end + size_of::<u32>() + size_of::<[f64; 3]>();
        num_vertices as u64 * per_vertex as u64 + size_of::<u32>() as u64
    }

    pub(super) fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    pub(super) fn of_vertex(&self) -> &[Strut] {
        &self.of_vertex
    }

    /// Measures the forces at these positions, with R̄ = `means`.
    pub(super) fn pull<T: Scalar>(&mut self, positions: &Positions<T>, means: &[Mat3]) {
        let (struts, x) = (&self.of_vertex, positions.as_slice());
        parallel::fill(&mut self.forces, |j| {
            let strut = &struts[j];
            if strut.weight == 0.0 {
                return [0.0; 3];
            }
            let span = strut.span(Four::of_point(&x[j]), x);
            let mut force = (span - turned(&means[j], &strut.rest)) * Four::all(strut.weight);
            if strut.hardening > 0.0 {
                force += span * Four::all(strut.hardness(span).force);
            }
            force.vector()
        });
    }

    /// Has the struts harden under compression, from here on.
    pub(super) fn harden(&mut self) {
        /// The weight relative to that of the struts, and the largest area that a strut counts
        /// for.
        const WEIGHT: f64 = 10.0;
        const MAX_AREA: f64 = 0.03;
        let length = |s: &Strut| Vector3::from(s.rest).norm();
        let mut sorted: Vec<[f64; 2]> = self
            .of_vertex
            .iter()
            .filter(|s| s.weight > 0.0)
            .map(|s| [length(s), s.area])
            .collect();
        sorted.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let half = 0.5 * sorted.iter().map(|[_, area]| area).sum::<f64>();
        let mut sum = 0.0;
        let median = sorted.iter().find(|[_, area]| {
            sum += area;
            sum >= half
        });
        let Some([median, _]) = median.copied() else {
            return;
        };
        for strut in self.of_vertex.iter_mut().filter(|s| s.weight > 0.0) {
            let d = length(strut);
            // Struts from end to end would dominate bends.
            let near = (median / d).min(1.0).powi(4);
            strut.hardening = WEIGHT * strut.area.min(MAX_AREA * d * d) * near;
        }
        self.is_hard = true;
    }

    /// Has the struts no longer harden.
    pub(super) fn soften(&mut self) {
        if std::mem::take(&mut self.is_hard) {
            self.of_vertex.iter_mut().for_each(|s| s.hardening = 0.0);
        }
    }

    pub(super) fn is_hard(&self) -> bool {
        self.is_hard
    }

    /// Takes all struts times a factor for the original ones.
    pub(super) fn resize(&mut self, scale: f64) {
        for strut in &mut self.of_vertex {
            strut.rest = strut.rest.map(|x| x * scale);
        }
        self.rest_energy *= scale * scale;
    }

    /// Half the gradient of all struts' energy at vertex `i`, over μ.
    #[inline]
    pub(super) fn force_at(&self, i: usize) -> Vector3<f64> {
        let mut force = Vector3::from(self.forces[i]);
        for (strut, share) in &self.ends[self.starts[i] as usize..self.starts[i + 1] as usize] {
            force -= Vector3::from(self.forces[*strut as usize]) * *share;
        }
        force
    }
}

/// For every vertex the struts that end on a triangle of its, with its share of the end.
fn ends_at(struts: &[Strut]) -> (Vec<u32>, Vec<(u32, f64)>) {
    let held = || struts.iter().filter(|s| s.weight > 0.0);
    let mut starts = vec![0; struts.len() + 1];
    for corner in held().flat_map(|s| s.corners) {
        starts[corner as usize + 1] += 1;
    }
    for i in 0..struts.len() {
        starts[i + 1] += starts[i];
    }
    let mut next = starts.clone();
    let mut ends = vec![(0, 0.0); 3 * held().count()];
    for (j, strut) in struts.iter().enumerate().filter(|(_, s)| s.weight > 0.0) {
        for (corner, share) in strut.corners.iter().zip(strut.shares) {
            let at = &mut next[*corner as usize];
            ends[*at as usize] = (j as u32, share);
            *at += 1;
        }
    }
    (starts, ends)
}

/// The surface, as rays see it.
struct Walls<'a, T: Scalar> {
    rest: &'a Rest<T>,
    bodies: &'a Bodies,
    points: &'a Positions<f64>,
    tree: TriangleTree,
    /// The body of every triangle, and the sign of its normal that points outwards.
    of_triangle: Vec<(u32, f64)>,
}

impl<'a, T: Scalar> Walls<'a, T> {
    fn new(rest: &'a Rest<T>, bodies: &'a Bodies, points: &'a Positions<f64>) -> Self {
        let mesh = rest.mesh();
        let corners = |f: FaceId| mesh.triangle(f).map(|v| mesh.row_of(v).index() as u32);
        let triangles = mesh.faces().map(corners).collect();
        let body = |f: FaceId| {
            let corner = mesh.triangle(f)[0].index();
            (bodies.of(corner), bodies.outwards(corner))
        };
        Self {
            rest,
            bodies,
            points,
            tree: TriangleTree::build(triangles, points),
            of_triangle: mesh.faces().map(body).collect(),
        }
    }

    /// The corners of a triangle, and the cosine between its normal and a ray; 0 if it has no
    /// area.
    fn cosine(&self, triangle: usize, ray: &Ray) -> ([u32; 3], f64) {
        let corners = self.tree.triangles()[triangle];
        let [a, b, c] = corners.map(|v| self.points.as_slice()[v as usize]);
        let vector = (b - a).cross(&(c - a));
        let area = vector.norm();
        let cosine = vector.dot(&ray.direction);
        (corners, if area > 0.0 { cosine / area } else { 0.0 })
    }

    /// The strut of vertex `j`, of weight 1 if there is one.
    fn strut(&self, j: usize) -> Strut {
        /// The least cosine between ray and wall: what is hit at a flatter angle is no opposite
        /// wall.
        const LEAST_COSINE: f64 = 0.2;
        /// Triangles that are tried for a ray. Around a vertex of a huge valence all boxes meet,
        /// and trying them all for every vertex would take hours.
        const MAX_TRIED: usize = 1000;
        /// Distances that differ by less, of themselves, are the same.
        const TIE: f64 = 1e-9;
        let none = Strut::default();
        let Some(normal) = self.bodies.outward_normal(self.rest, j) else {
            return none;
        };
        let ray = Ray {
            origin: self.points.as_slice()[j],
            direction: -normal,
        };
        let body = self.bodies.of(j);
        // Of triangles that meet at one point of the ray the one that faces it most: an edge or a
        // corner that is hit is no matter of rounding.
        let mut nearest: Option<(Meeting, f64)> = None;
        self.tree
            .walk(&ray, f64::INFINITY, MAX_TRIED, self.points, |meeting| {
                let (corners, cosine) = self.cosine(meeting.triangle, &ray);
                let limit = |distance: f64| ControlFlow::Continue(distance * (1.0 + TIE));
                let old = nearest.map_or(f64::INFINITY, |(old, _)| old.distance);
                let is_own = corners.contains(&(j as u32));
                let (of, outwards) = self.of_triangle[meeting.triangle];
                if is_own || of != body {
                    return limit(old);
                }
                let is_nearer = meeting.distance < old * (1.0 - TIE);
                let is_flatter = nearest.is_some_and(|(_, best)| cosine * outwards <= best);
                if is_nearer || !is_flatter {
                    nearest = Some((meeting, cosine * outwards));
                }
                limit(nearest.map_or(old, |(new, _)| new.distance.min(old)))
            });
        let Some((meeting, cosine)) = nearest else {
            return none;
        };
        if !(cosine > LEAST_COSINE) {
            return none;
        }
        let corners = self.tree.triangles()[meeting.triangle];
        let [a, b, c] = corners.map(|v| self.points.as_slice()[v as usize]);
        let vector = (b - a).cross(&(c - a));
        let area = vector.norm();
        let end = ray.at(meeting.distance);
        let share = |p: Point3<f64>, q: Point3<f64>| {
            let part = (p - end).cross(&(q - end)).dot(&vector);
            (part / (area * area)).clamp(0.0, 1.0)
        };
        let shares = [share(b, c), share(c, a), share(a, b)];
        let sum: f64 = shares.iter().sum();
        if !(sum > 0.5) {
            return none;
        }
        let mut strut = Strut {
            corners,
            shares: shares.map(|s| s / sum),
            ..none
        };
        // As it is measured later: a shape at rest pulls by nothing at all.
        let x = self.rest.positions().as_slice();
        strut.rest = strut.span(Four::of_point(&x[j]), x).vector();
        strut.weight = f64::from(Vector3::from(strut.rest).norm_squared() > 0.0);
        strut
    }
}

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::icosphere;
    use cotan_laplacian::Cotangent;

    use super::*;

    #[test]
    fn the_predicted_bytes_are_those_of_a_ball() {
        let shape = icosphere::<f64>(3);
        let (mesh, positions) = (shape.connectivity(), shape.positions());
        let rest = Rest::new(mesh, positions, Cotangent::default()).unwrap();
        let bodies = Bodies::new(&rest);
        let struts = Struts::new(&rest, &bodies, 0.3, 1.0);
        // Every vertex of a ball has a strut.
        let taken = size_of_val(&*struts.of_vertex)
            + size_of_val(&*struts.ends)
            + size_of_val(&*struts.starts)
            + size_of_val(&*struts.forces);
        assert_eq!(taken as u64, Struts::kept_bytes(positions.len()));
        assert_eq!(struts.ends.capacity(), 3 * positions.len());
    }
}
