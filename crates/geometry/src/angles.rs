//! Corner angles and their cotangents.

use cotan_halfedge::{HalfedgeId, HalfedgeMap};
use nalgebra::{Point3, Vector3};

use crate::maps;
use crate::scalar::{Scalar, scalar};
use crate::surface::Surface;

/// Cotangent of the angle at corner `apex` of a triangle. Finite for every finite input.
///
/// cot = (a·b) / max(|a×b|, φ·s), where a and b are the edges from the apex and s is the sum of
/// the squares of all three edges. The floor only affects needles: |a×b| is 0.29 s for an
/// equilateral triangle and decreases in proportion to the height over the longest edge.
///
/// **Units**: dimensionless and independent of scale. Zero if all three corners coincide. At most
/// ½/φ.
///
/// φ is 1e-12 in `f64`, far below any intended triangle. In `f32` it is the machine epsilon,
/// 1.2e-7: the rounding error of a×b is about as large as φ·s, so the floor only replaces values
/// without correct digits, and the result stays below 5e6 and can be summed.
///
/// ```
/// use nalgebra::Point3;
/// let [a, b, c] = [Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.5, 0.5, 0.0)];
/// assert_eq!(cotan_geometry::cotangent(&a, &b, &c), 1.0);
/// assert_eq!(cotan_geometry::cotangent(&a, &a, &a), 0.0);
/// ```
///
/// **Source**: the cotangent formula of Pinkall and Polthier 1993; the floor is ours.
#[inline]
pub fn cotangent<T: Scalar>(apex: &Point3<T>, left: &Point3<T>, right: &Point3<T>) -> T {
    triangle_cotangents(apex, left, right)[0]
}

/// [`cotangent`] of the angles at all three corners, with a shared cross product.
#[inline]
pub fn triangle_cotangents<T: Scalar>(a: &Point3<T>, b: &Point3<T>, c: &Point3<T>) -> [T; 3] {
    triangle_cotangents_with_floor(a, b, c, cotangent_floor())
}

/// [`triangle_cotangents`] with another floor φ, for callers that square the result.
#[inline]
pub fn triangle_cotangents_with_floor<T: Scalar>(
    a: &Point3<T>,
    b: &Point3<T>,
    c: &Point3<T>,
    floor: T,
) -> [T; 3] {
    let edges = [b - a, c - b, a - c];
    let squares = sum_of_squares(&edges);
    let (low, high) = direct_squares();
    if squares > low && squares < high {
        cotangents_of_edges(&edges, squares, floor)
    } else {
        scaled_cotangents(a, b, c, floor)
    }
}

/// [`triangle_cotangents_with_floor`] of the two corners other than the apex, at the ends of
/// `left` and `right`. For sums around the apex, where the edges and twice the area are already
/// known.
#[inline]
pub fn far_cotangents<T: Scalar>(
    left: &Vector3<T>,
    right: &Vector3<T>,
    doubled_area: T,
    floor: T,
) -> [T; 2] {
    let across = right - left;
    let squares = sum_of_squares(&[*left, *right, across]);
    let (low, high) = direct_squares();
    if squares > low && squares < high {
        let over = T::one() / doubled_area.max(floor * squares);
        [-left.dot(&across) * over, right.dot(&across) * over]
    } else {
        let [_, at_left, at_right] =
            scaled_cotangents(&Point3::origin(), &(*left).into(), &(*right).into(), floor);
        [at_left, at_right]
    }
}

/// Angle at corner `apex` of a triangle, in 0 … π.
///
/// **Units**: radians. Zero if an edge at the apex has zero length.
#[inline]
pub fn corner_angle<T: Scalar>(apex: &Point3<T>, left: &Point3<T>, right: &Point3<T>) -> T {
    angle_between(&(left - apex), &(right - apex))
}

/// Angle between two vectors, in 0 … π. Unlike the arc cosine, it is accurate near both ends.
///
/// **Units**: radians. Zero if one of the vectors is zero.
#[inline]
pub fn angle_between<T: Scalar>(a: &Vector3<T>, b: &Vector3<T>) -> T {
    a.cross(b).norm().atan2(a.dot(b))
}

/// See [`Surface::opposite_cotangents`].
#[must_use]
pub(crate) fn opposite_cotangents<T: Scalar>(surface: &Surface<'_, T>) -> HalfedgeMap<T> {
    let mut out = HalfedgeMap::default();
    opposite_cotangents_into(surface, &mut out);
    out
}

/// [`Surface::opposite_cotangents`] into an existing map, which is replaced if its length
/// differs.
///
/// Single-threaded: a face gives three entries for one cross product, which is faster than
/// computing each entry separately on four threads.
pub fn opposite_cotangents_into<T: Scalar>(surface: &Surface<'_, T>, out: &mut HalfedgeMap<T>) {
    opposite_cotangents_with_floor_into(surface, cotangent_floor(), out);
}

/// [`opposite_cotangents_into`] with another floor φ (see [`cotangent`]).
pub fn opposite_cotangents_with_floor_into<T: Scalar>(
    surface: &Surface<'_, T>,
    floor: T,
    out: &mut HalfedgeMap<T>,
) {
    let mesh = surface.mesh();
    maps::clear(out, mesh.num_halfedges());
    for f in mesh.faces() {
        let h = mesh.face_halfedge(f);
        let [next, prev] = [mesh.next(h), mesh.prev(h)];
        // The first halfedge starts at corner a and is opposite c.
        let [a, b, c] = mesh.triangle(f).map(|v| surface.position(v));
        [out[next], out[prev], out[h]] = triangle_cotangents_with_floor(&a, &b, &c, floor);
    }
}

/// The cotangent of the angle opposite a halfedge in its face, or zero for a boundary halfedge.
#[inline]
pub fn opposite_cotangent<T: Scalar>(surface: &Surface<'_, T>, halfedge: HalfedgeId) -> T {
    let mesh = surface.mesh();
    if mesh.is_boundary_halfedge(halfedge) {
        return T::zero();
    }
    let opposite = mesh.target(mesh.next(halfedge));
    let [apex, left, right] =
        [opposite, mesh.origin(halfedge), mesh.target(halfedge)].map(|v| surface.position(v));
    cotangent(&apex, &left, &right)
}

/// See [`Surface::corner_angles`].
#[must_use]
pub(crate) fn corner_angles<T: Scalar>(surface: &Surface<'_, T>) -> HalfedgeMap<T> {
    maps::filled(surface.mesh().num_halfedges(), |h| {
        halfedge_corner_angle(surface, h)
    })
}

/// The angle of the corner at the origin of a halfedge, or zero for a boundary halfedge.
#[inline]
pub fn halfedge_corner_angle<T: Scalar>(surface: &Surface<'_, T>, halfedge: HalfedgeId) -> T {
    let mesh = surface.mesh();
    if mesh.is_boundary_halfedge(halfedge) {
        return T::zero();
    }
    let a = surface.halfedge_vector(halfedge);
    angle_between(&a, &-surface.halfedge_vector(mesh.prev(halfedge)))
}

/// Smallest, largest and mean corner angles of a surface, as a measure of triangle quality.
///
/// **Units**: radians.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct AngleStatistics<T> {
    /// The smallest corner angle.
    pub min: T,
    /// The largest corner angle.
    pub max: T,
    /// The mean over the faces of their smallest angle; π/3 if all faces are equilateral.
    pub mean_smallest: T,
}

/// See [`Surface::angle_statistics`].
pub(crate) fn angle_statistics<T: Scalar>(surface: &Surface<'_, T>) -> AngleStatistics<T> {
    let angles = corner_angles(surface);
    let mesh = surface.mesh();
    let mut statistics = AngleStatistics {
        min: T::pi(),
        max: T::zero(),
        mean_smallest: T::zero(),
    };
    let mut total = 0.0;
    for f in mesh.faces() {
        let mut smallest = T::pi();
        for h in mesh.face_halfedges(f) {
            smallest = smallest.min(angles[h]);
            statistics.max = statistics.max.max(angles[h]);
        }
        statistics.min = statistics.min.min(smallest);
        total += smallest.as_f64();
    }
    statistics.mean_smallest = T::of_f64(total / mesh.num_faces() as f64);
    statistics
}

/// The fraction of edges whose weight cot α + cot β is negative, in 0 … 1.
///
/// Such edges make a cotangent Laplacian lose the maximum principle. The diagonals of
/// right-angled grids, whose weight is zero up to rounding, are not counted: the bound is −√ε.
pub fn negative_cotangent_share<T: Scalar>(surface: &Surface<'_, T>) -> T {
    let bound = -T::default_epsilon().sqrt();
    let is_negative = |e: cotan_halfedge::EdgeId| {
        let [h, twin] = e.halfedges();
        let weight = opposite_cotangent(surface, h) + opposite_cotangent(surface, twin);
        f64::from(u8::from(weight < bound))
    };
    let num_edges = surface.mesh().num_edges();
    T::of_f64(maps::sum(num_edges, is_negative) / num_edges as f64)
}

/// The floor φ in [`cotangent`].
#[inline]
fn cotangent_floor<T: Scalar>() -> T {
    T::default_epsilon().max(scalar(1e-12))
}

/// The range of sums of squares in which [`cotangent`] can be computed directly: it squares them
/// once more, and needles need some digits below that.
#[inline]
fn direct_squares<T: Scalar>() -> (T, T) {
    let low = if T::default_epsilon() < scalar(1e-12) {
        1e-120
    } else {
        1e-14
    };
    (scalar(low), scalar(1.0 / low))
}

/// Cotangents at the origins of three edges that form a triangle in order.
#[inline]
fn cotangents_of_edges<T: Scalar>([u, v, w]: &[Vector3<T>; 3], squares: T, floor: T) -> [T; 3] {
    let doubled_area = u.cross(v).norm().max(floor * squares);
    [
        -w.dot(u) / doubled_area,
        -u.dot(v) / doubled_area,
        -v.dot(w) / doubled_area,
    ]
}

#[inline]
fn sum_of_squares<T: Scalar>([u, v, w]: &[Vector3<T>; 3]) -> T {
    u.norm_squared() + v.norm_squared() + w.norm_squared()
}

/// [`triangle_cotangents`] for squares that underflow or overflow: the edges are scaled to unit
/// size first.
#[cold]
fn scaled_cotangents<T: Scalar>(a: &Point3<T>, b: &Point3<T>, c: &Point3<T>, floor: T) -> [T; 3] {
    // Scaled by a quarter, so that the difference of two huge coordinates does not overflow.
    let [a, b, c] = [a, b, c].map(|p| p.coords * scalar::<T>(0.25));
    let edges = [b - a, c - b, a - c];
    let largest = edges.iter().fold(T::zero(), |l, e| l.max(e.amax()));
    if largest <= T::zero() || !largest.is_finite() {
        return [T::zero(); 3];
    }
    let edges = edges.map(|e| e / largest);
    cotangents_of_edges(&edges, sum_of_squares(&edges), floor)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{bar, icosphere};
    use crate::testing;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    fn coordinate() -> impl Strategy<Value = f64> {
        prop_oneof![
            -1.0..1.0_f64,
            (-300..300_i32, -1.0..1.0_f64).prop_map(|(e, m)| m * 10.0_f64.powi(e)),
            Just(0.0),
            Just(1.0),
            Just(f64::MAX),
        ]
    }

    fn point() -> impl Strategy<Value = Point3<f64>> {
        [coordinate(), coordinate(), coordinate()].prop_map(Point3::from)
    }

    #[test]
    fn known_cotangents() {
        let apex = Point3::new(1e3, -2e3, 5.0);
        for angle in [0.01, 0.3, PI / 2.0, 2.0, 3.1] {
            let (sin, cos) = f64::sin_cos(angle);
            let left = apex + Vector3::new(2.0, 0.0, 0.0);
            let right = apex + Vector3::new(cos, sin, 0.0);
            let cot = cotangent(&apex, &left, &right);
            assert!(
                (cot - cos / sin).abs() < 1e-8 * (1.0 + cot.abs()),
                "{angle}: {cot}"
            );
            assert!((corner_angle(&apex, &left, &right) - angle).abs() < 1e-11);
        }
    }

    #[test]
    fn far_cotangents_are_those_of_the_triangle() {
        let points = [[0.3, 0.1, 0.0], [1.0, 0.2, 0.1], [0.3, 0.9, -0.4]].map(Point3::from);
        for scale in [1e-200, 1e-3, 1.0, 1e200] {
            for [i, j, k] in [[0, 1, 2], [1, 2, 0], [0, 1, 1], [0, 0, 1], [0, 0, 0]] {
                let corners: [Point3<f64>; 3] =
                    [i, j, k].map(|corner: usize| points[corner] * scale);
                let [a, b, c] = corners;
                let [_, at_b, at_c] = triangle_cotangents(&a, &b, &c);
                let (left, right) = (b - a, c - a);
                let doubled_area = left.cross(&right).norm();
                let ours = far_cotangents(&left, &right, doubled_area, cotangent_floor());
                for (ours, expected) in ours.into_iter().zip::<[f64; 2]>([at_b, at_c]) {
                    assert!((ours - expected).abs() <= 1e-12 * (1.0 + expected.abs()));
                }
            }
        }
    }

    #[test]
    fn collinear_corners_meet_the_floor() {
        let [a, b, c] = [0.0_f64, 1.0, 2.0].map(|x| Point3::new(x, 0.0, 0.0));
        assert!((cotangent(&a, &b, &c) * 3e-12 - 1.0).abs() < 1e-14);
        assert!((cotangent(&b, &c, &a) * 6e-12 + 1.0).abs() < 1e-14);
        let single = cotangent(&a.cast::<f32>(), &b.cast(), &c.cast());
        assert!((f64::from(single) - 2.0 / (6.0 * f64::from(f32::EPSILON))).abs() < 1.0);
    }

    #[test]
    fn scale_does_not_matter_at_either_end() {
        let points = [[0.0, 0.0, 0.0], [1.0, 0.2, 0.0], [0.3, 0.9, -0.4]].map(Point3::from);
        let [a, b, c] = points;
        let cot = cotangent(&a, &b, &c);
        for exponent in [-290, -170, -150, -60, 60, 170, 300] {
            let [a, b, c] = points.map(|p| p * 10.0_f64.powi(exponent));
            assert!(
                (cotangent(&a, &b, &c) / cot - 1.0).abs() < 1e-12,
                "{exponent}"
            );
        }
        let [a, b, c] = points.map(|p| (p * 1e-25).cast::<f32>());
        assert!((f64::from(cotangent(&a, &b, &c)) / cot - 1.0).abs() < 1e-5);
    }

    #[test]
    fn icosphere_angles_are_near_sixty_degrees() {
        let shape = icosphere::<f64>(3);
        let statistics = angle_statistics(&shape.surface());
        assert!(statistics.min > 50.0 * PI / 180.0 && statistics.max < 75.0 * PI / 180.0);
        assert!(statistics.mean_smallest > statistics.min);
        assert_eq!(negative_cotangent_share(&shape.surface()), 0.0);
    }

    #[test]
    fn grid_diagonals_are_not_negative_and_a_flat_bar_is() {
        assert_eq!(
            negative_cotangent_share(&bar::<f32>([0.3; 3], [4; 3]).surface()),
            0.0
        );
        let shape = icosphere::<f64>(2);
        let flat = shape.positions().map(|p| Point3::new(p.x, p.y, 0.05 * p.z));
        assert!(negative_cotangent_share(&shape.surface().with_positions(&flat)) > 0.05);
    }

    proptest! {
        #[test]
        fn cotangents_of_any_triangle_are_finite(a in point(), b in point(), c in point()) {
            prop_assert!(cotangent(&a, &b, &c).is_finite());
            let [a, b, c] = [a, b, c].map(|p| p.map(|x| (x as f32).clamp(f32::MIN, f32::MAX)));
            prop_assert!(cotangent(&a, &b, &c).is_finite());
        }

        #[test]
        fn the_angles_of_every_face_sum_to_pi(shape in testing::surfaces()) {
            let surface = shape.surface();
            let angles = corner_angles(&surface);
            for f in surface.mesh().faces() {
                let sum: f64 = surface.mesh().face_halfedges(f).map(|h| angles[h]).sum();
                prop_assert!((sum - PI).abs() < 1e-12);
            }
        }

        #[test]
        fn cotangents_are_those_of_the_angles(shape in testing::surfaces()) {
            let surface = shape.surface();
            let mesh = surface.mesh();
            let (angles, cots) = (corner_angles(&surface), opposite_cotangents(&surface));
            for h in mesh.halfedges() {
                if mesh.is_boundary_halfedge(h) {
                    prop_assert_eq!(cots[h], 0.0);
                } else {
                    let expected = 1.0 / angles[mesh.prev(h)].tan();
                    prop_assert!((cots[h] - expected).abs() < 1e-9 * (1.0 + expected.powi(2)));
                }
            }
        }
    }
}
