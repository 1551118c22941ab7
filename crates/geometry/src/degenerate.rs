//! Degenerate and nearly degenerate triangles.

use cotan_halfedge::FaceId;
use nalgebra::Point3;

use crate::areas::triangle_area_vector;
use crate::normals::unit_or_zero;
use crate::scalar::Scalar;
use crate::surface::Surface;

/// The smallest height of a triangle divided by its longest edge: √3/2 for an equilateral
/// triangle, 0 if it has no area or no extent.
///
/// **Units**: dimensionless and independent of scale.
pub fn relative_height<T: Scalar>(a: &Point3<T>, b: &Point3<T>, c: &Point3<T>) -> T {
    let edges = [b - a, c - b, a - c];
    let longest = edges.iter().fold(T::zero(), |l, e| l.max(e.amax()));
    if longest <= T::zero() || !longest.is_finite() {
        return T::zero();
    }
    // Scaled to unit size first, so that squares neither underflow nor overflow.
    let [u, v, w] = edges.map(|e| e / longest);
    let square = u.norm_squared().max(v.norm_squared()).max(w.norm_squared());
    u.cross(&v).norm() / square
}

/// See [`Surface::degenerate_faces`].
#[must_use]
pub(crate) fn degenerate_faces<T: Scalar>(surface: &Surface<'_, T>, eps: T) -> Vec<FaceId> {
    let is_degenerate = |f: &FaceId| {
        let [a, b, c] = surface.mesh().triangle(*f).map(|v| surface.position(v));
        let no_normal = || unit_or_zero(&triangle_area_vector(&a, &b, &c)).norm() == T::zero();
        relative_height(&a, &b, &c) <= eps || no_normal()
    };
    surface.mesh().faces().filter(is_degenerate).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::tetrahedron;

    #[test]
    fn heights_of_known_triangles() {
        let a = Point3::new(0.0, 0.0, 1.0);
        let b = Point3::new(4.0, 0.0, 1.0);
        let height = |y: f64| relative_height(&a, &b, &Point3::new(2.0, y, 1.0));
        assert!((height(12.0_f64.sqrt()) - 0.75_f64.sqrt()).abs() < 1e-15);
        assert!((height(1e-7) - 0.25e-7).abs() < 1e-20);
        assert_eq!(height(0.0), 0.0);
        assert_eq!(relative_height(&a, &a, &a), 0.0);
    }

    #[test]
    fn collapsing_an_edge_makes_its_faces_degenerate() {
        let shape = tetrahedron::<f64>();
        let surface = shape.surface();
        let [a, b] = surface.mesh().edge_vertices(cotan_halfedge::EdgeId::new(0));
        let mut positions = shape.positions().clone();
        positions[a] = positions[b];
        let collapsed = surface.with_positions(&positions);
        assert_eq!(degenerate_faces(&collapsed, 0.0).len(), 2);
        assert!(degenerate_faces(&surface, 0.5).is_empty());
    }
}
