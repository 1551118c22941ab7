//! The exact predicate for flipped triangles of a sphere map.

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::{FaceId, HalfedgeMesh};
use cotan_parallel as parallel;
use nalgebra::Point3;
use robust::{Coord3D, orient3d};

/// Returns true if a, b, c are counter-clockwise as seen from outside the unit sphere: det(a, b,
/// c) > 0, by the exact sign of the determinant of the stored coordinates. The central projection
/// of such an *upright* triangle is a spherical triangle that is neither flipped nor degenerate.
///
/// **Source**: Shewchuk's adaptive predicates (1997), from the `robust` crate.
pub fn is_upright<T: Scalar>(a: &Point3<T>, b: &Point3<T>, c: &Point3<T>) -> bool {
    let coord = |p: &Point3<T>| Coord3D {
        x: p.x.as_f64(),
        y: p.y.as_f64(),
        z: p.z.as_f64(),
    };
    let origin = Coord3D {
        x: 0.0,
        y: 0.0,
        z: 0.0,
    };
    // Positive if the origin lies below the plane of a, b, c, that is, on the side from which
    // they appear clockwise.
    orient3d(coord(a), coord(b), coord(c), origin) > 0.0
}

/// The faces that are flipped or degenerate on the sphere, in ascending order.
pub fn flipped_faces<T: Scalar>(mesh: &HalfedgeMesh, positions: &Positions<T>) -> Vec<FaceId> {
    parallel::filter_map(mesh.num_faces(), |i| {
        let f = FaceId::new(i);
        let [a, b, c] = mesh.triangle(f).map(|v| positions[v]);
        (!is_upright(&a, &b, &c)).then_some(f)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sign_is_that_of_the_determinant() {
        let (x, y, z) = (
            Point3::new(1.0, 0.0, 0.0),
            Point3::new(0.0, 1.0, 0.0),
            Point3::new(0.0, 0.0, 1.0),
        );
        assert!(is_upright(&x, &y, &z));
        assert!(!is_upright(&y, &x, &z));
        assert!(!is_upright(&x, &y, &y));
    }

    #[test]
    fn a_triangle_of_a_few_units_in_the_last_place_is_judged_right() {
        let a = Point3::new(0.6, 0.8, 0.0);
        let b = Point3::new(0.6, 0.8, 1e-18);
        let c = Point3::new(0.6_f64.next_down(), 0.8, 0.0);
        // det(a, b, c) = 1e-18 · (0.6 · 0.8 − 0.8 · 0.6') with signs: exact, although far below
        // the rounding error.
        assert_ne!(is_upright(&a, &b, &c), is_upright(&a, &c, &b));
    }
}
