//! Polygons cut into triangles inside their outline, also where it is concave.
//!
//! The polygon is seen along its Newell normal n = ½ Σ p_i × p_{i+1}. If every corner turns left
//! it is cut into a fan from its first corner; otherwise ears are clipped: corners that turn left
//! and whose triangle holds no other corner that does not (Meisters 1975, "Polygons have ears").
//! Where no ear is left, in polygons that cross themselves or lie on a line, the rest becomes a
//! fan, so every polygon of degree d gives d − 2 triangles that cover its corners in order.

use nalgebra::{Point2, Point3, Vector3};

/// Cuts the polygons of one document.
pub(crate) struct Triangulator<'a> {
    positions: &'a [Point3<f64>],
    /// How many more corners may be compared with an ear, in all polygons together.
    budget: usize,
    /// The corners of the polygon at hand, in its plane.
    flat: Vec<Point2<f64>>,
    /// The corners that are left.
    rest: Vec<usize>,
}

/// Ears of ordinary polygons are found after a few comparisons per corner; these bounds keep a
/// hostile polygon of a million corners, for which the search is cubic, within seconds.
const BUDGET_PER_CORNER: usize = 256;
const BUDGET: usize = 1 << 24;

impl<'a> Triangulator<'a> {
    pub(crate) fn new(positions: &'a [Point3<f64>], num_corners: usize) -> Self {
        let budget = num_corners
            .saturating_mul(BUDGET_PER_CORNER)
            .saturating_add(BUDGET);
        Self {
            positions,
            budget,
            flat: Vec::new(),
            rest: Vec::new(),
        }
    }

    /// Cuts one polygon, given by numbers of positions.
    pub(crate) fn cut(&mut self, polygon: &[u32], mut triangle: impl FnMut([u32; 3])) {
        if let [a, b, c] = *polygon {
            return triangle([a, b, c]);
        }
        self.flatten(polygon);
        let n = polygon.len();
        let is_convex = (0..n).all(|i| {
            turn(
                self.flat[(i + n - 1) % n],
                self.flat[i],
                self.flat[(i + 1) % n],
            ) > 0.0
        });
        self.rest.clear();
        self.rest.extend(0..n);
        if !is_convex {
            self.clip_ears(|ear| triangle(ear.map(|i| polygon[i])));
        }
        for pair in self.rest.get(1..).unwrap_or(&[]).windows(2) {
            triangle([polygon[self.rest[0]], polygon[pair[0]], polygon[pair[1]]]);
        }
    }

    /// Projects the polygon to the plane of its Newell normal.
    fn flatten(&mut self, polygon: &[u32]) {
        let p = |i: usize| self.positions[polygon[i % polygon.len()] as usize];
        let origin = p(0);
        let normal: Vector3<f64> = (0..polygon.len())
            .map(|i| (p(i) - origin).cross(&(p(i + 1) - origin)))
            .sum();
        let axis = normal.iamin();
        let mut helper = Vector3::zeros();
        helper[axis] = 1.0;
        let u = normal
            .cross(&helper)
            .try_normalize(0.0)
            .unwrap_or_else(Vector3::x);
        let v = normal
            .cross(&u)
            .try_normalize(0.0)
            .unwrap_or_else(Vector3::y);
        let flat = (0..polygon.len()).map(|i| {
            let d = p(i) - origin;
            Point2::new(u.dot(&d), v.dot(&d))
        });
        self.flat.clear();
        self.flat.extend(flat);
    }

    /// Clips ears until three corners, no ear, or no budget is left.
    fn clip_ears(&mut self, mut clip: impl FnMut([usize; 3])) {
        let mut at = 0;
        let mut failures = 0;
        while self.rest.len() > 3 && failures < self.rest.len() && self.budget > 0 {
            let m = self.rest.len();
            let ear = [at + m - 1, at, at + 1].map(|i| self.rest[i % m]);
            if self.is_ear(ear) {
                clip(ear);
                self.rest.remove(at % m);
                failures = 0;
                // Skipping one corner keeps the triangles from crowding round one of them.
                at = if at >= self.rest.len() { 0 } else { at + 1 };
            } else {
                failures += 1;
                at += 1;
            }
            at %= self.rest.len();
        }
    }

    fn is_ear(&mut self, [a, b, c]: [usize; 3]) -> bool {
        let [pa, pb, pc] = [a, b, c].map(|i| self.flat[i]);
        if turn(pa, pb, pc) <= 0.0 {
            self.budget = self.budget.saturating_sub(1);
            return false;
        }
        self.budget = self.budget.saturating_sub(self.rest.len());
        self.rest.iter().all(|&i| {
            let p = self.flat[i];
            let is_corner = i == a || i == b || i == c || p == pa || p == pb || p == pc;
            is_corner || turn(pa, pb, p) < 0.0 || turn(pb, pc, p) < 0.0 || turn(pc, pa, p) < 0.0
        })
    }
}

/// Twice the signed area of a triangle: positive if it turns left.
fn turn(a: Point2<f64>, b: Point2<f64>, c: Point2<f64>) -> f64 {
    (b - a).perp(&(c - a))
}
