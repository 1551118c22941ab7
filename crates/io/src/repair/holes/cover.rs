//! Triangulation of a hole between its vertices, without using any existing edge.
//!
//! Up to [`MAX_OPTIMAL`] edges the minimum-cost triangulation is computed; if none is found,
//! none exists. The cost is ordered first by the largest angle between neighbouring triangles,
//! including those around the hole (in steps of about 10°, so that shape decides where angles
//! hardly differ), then by the squared lengths, which avoids slivers. In longer holes, ears are
//! clipped until that many edges are left: in the plane of the hole as long as there are any,
//! then those with the shortest new edge.
//!
//! Source: P. Liepa, "Filling holes in meshes", SGP 2003, section 3. The paper uses areas instead
//! of squared lengths, which leaves the triangles of flat holes to rounding.

use cotan_geometry::relative_height;
use nalgebra::{Point3, Vector3};

use crate::cuts::FLAT;
use crate::ears::clip_short_ears;
use crate::optimal::{self, Candidate, Cost};
use crate::triangulate::Triangulator;

/// Maximum number of edges of a hole for which all triangulations are compared: 4.5 million
/// triangles.
const MAX_OPTIMAL: usize = 300;

/// The same limit once [`BUDGET`] is used up.
const MAX_LATER: usize = 24;

/// Number of triangles compared in all holes together before they are filled with less care:
/// about ten seconds.
const BUDGET: usize = 1 << 28;

/// The boundary of a hole, in the direction of the filling, which is opposite to that of the
/// faces next to it.
pub(super) struct Rim {
    /// The indices of its vertices, in order.
    pub(super) vertices: Vec<u32>,
    /// Their positions, scaled to a size of about 1.
    points: Vec<Point3<f64>>,
    /// The unit normal of the face at the edge from each vertex to the next, or zero.
    normals: Vec<Vector3<f64>>,
}

/// The reason why there is no triangulation.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Failure {
    /// Every triangulation needs an existing edge.
    NoneExists,
    /// The triangulations that were tried need an existing edge.
    NoneFound,
}

/// Covers holes, one at a time.
pub(super) struct Cover<'a> {
    triangulator: Triangulator<'a>,
    budget: usize,
}

impl Rim {
    /// `points` are the positions of the vertices, `normals` those of the faces next to the
    /// edges.
    pub(super) fn new(
        vertices: Vec<u32>,
        points: &[Point3<f64>],
        normals: Vec<Vector3<f64>>,
    ) -> Self {
        let point = |v: u32| points[v as usize];
        let origin = vertices.first().map_or_else(Point3::origin, |&v| point(v));
        let size = vertices
            .iter()
            .map(|&v| (point(v) / 2.0 - origin.coords / 2.0).coords.amax())
            .fold(0.0, f64::max);
        let scale = if size > 0.0 && size.is_finite() {
            size
        } else {
            1.0
        };
        let scaled = |&v: &u32| Point3::from((point(v) / 2.0 - origin / 2.0) / scale);
        Self {
            points: vertices.iter().map(scaled).collect(),
            vertices,
            normals,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.vertices.len()
    }

    fn normal(&self, corners: [usize; 3]) -> Vector3<f64> {
        let [a, b, c] = corners.map(|i| self.points[i]);
        let normal = (b - a).cross(&(c - a));
        normal.try_normalize(0.0).unwrap_or_default()
    }

    fn cost(&self, candidate: Candidate) -> Cost {
        let [i, k, j] = candidate.corners;
        let normal = self.normal([i, k, j]);
        let beyond = |a: usize, apex: Option<usize>, b: usize| match apex {
            Some(apex) => self.normal([a, apex, b]),
            None => self.normals[a],
        };
        let bend = |other: Vector3<f64>| 1.0 - normal.dot(&other);
        let mut worst =
            bend(beyond(i, candidate.before, k)).max(bend(beyond(k, candidate.behind, j)));
        // The last triangle closes the hole.
        if i == 0 && j + 1 == self.len() {
            worst = worst.max(bend(self.normals[j]));
        }
        let [a, b, c] = [i, k, j].map(|i| self.points[i]);
        // A triangle without area ranks as a larger bend than any other.
        if relative_height(&a, &b, &c) <= FLAT {
            worst = 4.0;
        }
        Cost {
            worst: (worst * BEND_STEPS).floor(),
            sum: (b - a).norm_squared() + (c - b).norm_squared() + (a - c).norm_squared(),
        }
    }
}

/// Resolution of 1 − cos of an angle: the first step of 1/64 is 10°.
const BEND_STEPS: f64 = 64.0;

impl<'a> Cover<'a> {
    pub(super) fn new(points: &'a [Point3<f64>], num_corners: usize) -> Self {
        Self {
            triangulator: Triangulator::new(points, num_corners),
            budget: BUDGET,
        }
    }

    /// Returns the triangles, as corners of the rim.
    ///
    /// `is_free` returns `true` if there is no edge between two corners yet.
    pub(super) fn triangles(
        &mut self,
        rim: &Rim,
        is_free: impl Fn(usize, usize) -> bool,
    ) -> Result<Vec<[usize; 3]>, Failure> {
        let n = rim.len();
        if n == 3 {
            return Ok(vec![[0, 1, 2]]);
        }
        let work = |n: usize| n.saturating_mul(n).saturating_mul(n) / 6;
        let most = match work(n.min(MAX_OPTIMAL)) <= self.budget {
            true => MAX_OPTIMAL,
            false => MAX_LATER,
        };
        let mut triangles = Vec::new();
        let mut rest: Vec<usize> = (0..n).collect();
        let mut failure = Failure::NoneExists;
        if n > most {
            failure = Failure::NoneFound;
            let clip = |ear| triangles.push(ear);
            rest = self
                .triangulator
                .clip_allowed(&rim.vertices, clip, &is_free)
                .to_vec();
            if rest.len() > most {
                let point = |i: usize| rim.points[i];
                clip_short_ears(&mut rest, most, &mut triangles, point, &is_free);
            }
        }
        if rest.len() > most {
            return Err(failure);
        }
        self.budget = self.budget.saturating_sub(work(rest.len()));
        let covered = if rest.len() == n {
            optimal::triangulation(n, &is_free, |candidate| rim.cost(candidate))
        } else {
            cover_rest(rim, &rest, &is_free)
        };
        triangles.extend(covered.ok_or(failure)?);
        Ok(triangles)
    }
}

/// Covers the part left after clipping ears, avoiding flat triangles and long edges.
fn cover_rest(
    rim: &Rim,
    rest: &[usize],
    is_free: impl Fn(usize, usize) -> bool,
) -> Option<Vec<[usize; 3]>> {
    let cost = |candidate: Candidate| {
        let [a, b, c] = candidate.corners.map(|i| rim.points[rest[i]]);
        let is_flat = relative_height(&a, &b, &c) <= FLAT;
        Cost {
            worst: if is_flat { 1.0 } else { 0.0 },
            sum: (b - a).norm_squared() + (c - b).norm_squared() + (a - c).norm_squared(),
        }
    };
    let free = |i: usize, j: usize| is_free(rest[i], rest[j]);
    let triangles = optimal::triangulation(rest.len(), free, cost)?;
    Some(triangles.into_iter().map(|t| t.map(|i| rest[i])).collect())
}
