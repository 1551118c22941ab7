//! Triangulation of polygons inside their outline, even where it is concave.
//!
//! The polygon is projected along its Newell normal n = ½ Σ p_i × p_{i+1}. If every corner turns
//! left, it is cut into a fan from its first corner. Otherwise ears are clipped: corners that
//! turn left and whose triangle contains no other corner that does not (Meisters 1975, "Polygons
//! have ears"). If no ear is left, in polygons that cross themselves or lie on a line, the rest
//! becomes a fan. Every polygon of degree d thus yields d − 2 triangles that cover its corners in
//! order.
//!
//! Each polygon is triangulated independently here; see [`Recuts`](crate::recut::Recuts) for
//! conflicts with its neighbours.

use nalgebra::{Point2, Point3, Vector3};

/// Triangulates the polygons of one document.
pub(crate) struct Triangulator<'a> {
    positions: &'a [Point3<f64>],
    /// The remaining number of corners that may be compared with an ear, over all polygons.
    budget: usize,
    /// The corners of the current polygon, projected to its plane.
    flat: Vec<Point2<f64>>,
    /// The corners that are left.
    rest: Vec<usize>,
}

/// Limits on the search for ears, in comparisons of corners.
///
/// The search is quadratic for ordinary polygons and cubic in the worst case. These bounds admit
/// concave polygons of 20,000 corners and limit the time for a hostile file to seconds. Once they
/// are exceeded, the rest of the polygons become fans.
const BUDGET_PER_CORNER: usize = 256;
const BUDGET: usize = 1 << 28;

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

    /// Cuts one polygon, given by indices of positions, into triangles of its 0-based corners.
    pub(crate) fn cut_corners(&mut self, polygon: &[u32], mut triangle: impl FnMut([usize; 3])) {
        if polygon.len() == 3 {
            return triangle([0, 1, 2]);
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
            self.clip_ears(&mut triangle, |_, _| true);
        }
        for pair in self.rest.get(1..).unwrap_or(&[]).windows(2) {
            triangle([self.rest[0], pair[0], pair[1]]);
        }
    }

    /// Like [`Triangulator::cut_corners`], but uses only allowed diagonals.
    ///
    /// Returns the corners of the part in which no ear was found, which are at least three.
    pub(crate) fn clip_allowed(
        &mut self,
        polygon: &[u32],
        mut triangle: impl FnMut([usize; 3]),
        is_allowed: impl Fn(usize, usize) -> bool,
    ) -> &[usize] {
        self.flatten(polygon);
        self.rest.clear();
        self.rest.extend(0..polygon.len());
        self.clip_ears(&mut triangle, is_allowed);
        &self.rest
    }

    /// Twice the signed area of a triangle of corners of the polygon that was cut or flattened
    /// last, in the plane of that polygon.
    pub(crate) fn area(&self, corners: [usize; 3]) -> f64 {
        let [a, b, c] = corners.map(|i| self.flat[i]);
        turn(a, b, c)
    }

    /// Projects the polygon onto the plane of its Newell normal.
    pub(crate) fn flatten(&mut self, polygon: &[u32]) {
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

    /// Clips ears until three corners, no ears, or no budget are left.
    fn clip_ears(
        &mut self,
        mut clip: impl FnMut([usize; 3]),
        is_allowed: impl Fn(usize, usize) -> bool,
    ) {
        let mut at = 0;
        let mut failures = 0;
        while self.rest.len() > 3 && failures < self.rest.len() && self.budget > 0 {
            let m = self.rest.len();
            let ear = [at + m - 1, at, at + 1].map(|i| self.rest[i % m]);
            if is_allowed(ear[0], ear[2]) && self.is_ear(ear) {
                clip(ear);
                self.rest.remove(at % m);
                failures = 0;
                // Skipping one corner keeps the triangles from clustering around a single corner.
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn cut(points: &[Point3<f64>]) -> Vec<[u32; 3]> {
        let polygon: Vec<u32> = (0..points.len() as u32).collect();
        let mut triangles = Vec::new();
        let mut triangulator = Triangulator::new(points, points.len());
        triangulator.cut_corners(&polygon, |t| triangles.push(t.map(|i| i as u32)));
        triangles
    }

    fn area_vector(points: &[Point3<f64>], [a, b, c]: [u32; 3]) -> Vector3<f64> {
        let p = |i: u32| points[i as usize];
        (p(b) - p(a)).cross(&(p(c) - p(a))) * 0.5
    }

    #[test]
    fn an_l_is_covered_once() {
        let l = [(0, 0), (2, 0), (2, 2), (1, 2), (1, 1), (0, 1)];
        let points = l.map(|(x, y)| Point3::new(f64::from(x), f64::from(y), 7.0));
        // Test every starting corner, since a fan from some corners would succeed by luck.
        for first in 0..6 {
            let mut points = points;
            points.rotate_left(first);
            let triangles = cut(&points);
            assert_eq!(triangles.len(), 4);
            let areas: Vec<f64> = triangles
                .iter()
                .map(|&t| area_vector(&points, t).z)
                .collect();
            assert!(areas.iter().all(|&area| area > 0.0), "{areas:?}");
            assert_eq!(areas.iter().sum::<f64>(), 3.0);
        }
    }

    #[test]
    fn a_concave_quad_is_cut_at_its_reflex_corner() {
        let points =
            [[0.0, 0.0], [4.0, 0.0], [1.0, 1.0], [0.0, 4.0]].map(|[x, y]| Point3::new(0.0, x, y));
        assert!(cut(&points).iter().all(|&t| t.contains(&2)));
    }

    #[test]
    fn polygons_without_an_inside_still_give_all_triangles() {
        let line: Vec<_> = (0..5)
            .map(|i| Point3::new(f64::from(i), 0.0, 0.0))
            .collect();
        assert_eq!(cut(&line).len(), 3);
        assert_eq!(cut(&[Point3::origin(); 6]).len(), 4);
        let crossing = [(0, 0), (1, 1), (1, 0), (0, 1)];
        assert_eq!(
            cut(&crossing.map(|(x, y)| Point3::new(f64::from(x), f64::from(y), 0.0))).len(),
            2
        );
        assert_eq!(
            cut(&[Point3::new(f64::MAX, f64::MIN, f64::MAX); 5]).len(),
            3
        );
    }

    #[test]
    fn a_hostile_polygon_ends_soon() {
        // A zigzag on a parabola: half of its corners are reflex.
        let zigzag: Vec<_> = (0..200_000)
            .map(f64::from)
            .map(|x| Point3::new(x, x * x * 1e-6 + (x % 2.0), 0.0))
            .collect();
        assert_eq!(cut(&zigzag).len(), zigzag.len() - 2);
    }

    proptest! {
        // A star-shaped polygon is simple, so its triangles cover it exactly once: all have its
        // orientation, and their areas add up to its own.
        #[test]
        fn triangles_of_a_star_shaped_polygon_cover_it_once(
            radii in prop::collection::vec(0.2f64..2.0, 4..40),
            tilt in prop::array::uniform3(-1.0f64..1.0),
        ) {
            let n = radii.len() as f64;
            let rotation = nalgebra::Rotation3::new(Vector3::from(tilt));
            let points: Vec<_> = radii
                .iter()
                .enumerate()
                .map(|(i, r)| {
                    let (sin, cos) = (std::f64::consts::TAU * i as f64 / n).sin_cos();
                    rotation * Point3::new(r * cos, r * sin, 0.0)
                })
                .collect();
            let normal = rotation * Vector3::z();
            let areas: Vec<f64> =
                cut(&points).iter().map(|&t| area_vector(&points, t).dot(&normal)).collect();
            let whole: f64 = (0..points.len())
                .map(|i| points[i].coords.cross(&points[(i + 1) % points.len()].coords))
                .sum::<Vector3<f64>>()
                .dot(&normal) * 0.5;
            prop_assert_eq!(areas.len(), points.len() - 2);
            prop_assert!(areas.iter().all(|&area| area > -1e-12), "{:?}", areas);
            prop_assert!((areas.iter().sum::<f64>() - whole).abs() < 1e-10);
        }
    }
}
