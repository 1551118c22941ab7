//! The kernel of a star polygon on the sphere: the region from which all edges are seen from the
//! left.
//!
//! It is the cone of all x with det(b, c, x) > 0 for each edge (b, c) of the polygon, clipped
//! from a square in the tangent plane at a corner from which the whole polygon is known to be
//! visible.

use nalgebra::{Vector2, Vector3};

use super::energy::Wedge;
use super::layout::tangents;

/// Candidate directions inside the kernel, the centroid first. Empty if the kernel has no
/// interior at the available precision. `eye` is a ring vertex from which the whole ring is
/// visible, such as the target of a collapse.
pub(super) fn kernel_points(star: &[Wedge], eye: &Vector3<f64>) -> Vec<Vector3<f64>> {
    let frame = tangents(eye);
    let mut polygon = square(star, eye);
    for wedge in star {
        // The half plane n · (eye + s t1 + t t2) ≥ 0, computed from differences to the eye.
        let (b, c) = (wedge.b - eye, wedge.c - eye);
        let normal = wedge.b.cross(&(c - b));
        let offset = eye.dot(&b.cross(&c));
        let slope = Vector2::new(normal.dot(&frame[0]), normal.dot(&frame[1]));
        polygon = clip(&polygon, slope, offset);
    }
    let Some(centroid) = centroid(&polygon) else {
        return Vec::new();
    };
    let mean = polygon.iter().sum::<Vector2<f64>>() / polygon.len() as f64;
    let towards_eye = centroid * 0.3;
    [centroid, mean, towards_eye]
        .iter()
        .map(|p| eye + frame[0] * p.x + frame[1] * p.y)
        .collect()
}

/// A square around the eye that contains the ring, up to a steep angle.
fn square(star: &[Wedge], eye: &Vector3<f64>) -> Vec<Vector2<f64>> {
    let far = star.iter().map(|w| (w.b - eye).norm()).fold(0.0, f64::max);
    let half = if far < 1.0 { 2.0 * far } else { WIDEST };
    let corners = [(-half, -half), (half, -half), (half, half), (-half, half)];
    corners.map(|(x, y)| Vector2::new(x, y)).to_vec()
}

/// The part of a convex polygon where slope · p + offset ≥ 0.
fn clip(polygon: &[Vector2<f64>], slope: Vector2<f64>, offset: f64) -> Vec<Vector2<f64>> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, p) in polygon.iter().enumerate() {
        let q = &polygon[(i + 1) % polygon.len()];
        let (at_p, at_q) = (slope.dot(p) + offset, slope.dot(q) + offset);
        if at_p >= 0.0 {
            kept.push(*p);
        }
        if (at_p > 0.0 && at_q < 0.0) || (at_p < 0.0 && at_q > 0.0) {
            kept.push(p + (q - p) * (at_p / (at_p - at_q)));
        }
    }
    kept
}

/// The centroid of a polygon, or `None` if it has no area.
fn centroid(polygon: &[Vector2<f64>]) -> Option<Vector2<f64>> {
    let origin = *polygon.first()?;
    let (mut area, mut moment) = (0.0, Vector2::zeros());
    for pair in polygon.windows(2) {
        let (p, q) = (pair[0] - origin, pair[1] - origin);
        let double = p.x * q.y - p.y * q.x;
        area += double;
        moment += (p + q) * (double / 3.0);
    }
    (area > 0.0).then(|| origin + moment / area)
}

/// Half the side of the square for a ring that spans a large part of the sphere: 84 degrees from
/// the eye.
const WIDEST: f64 = 10.0;

#[cfg(test)]
mod tests {
    use super::super::energy::Rest;
    use super::super::layout::is_valid;
    use super::*;

    #[test]
    fn the_kernel_of_a_star_shaped_ring_is_found_at_every_scale() {
        // An arrow, which is visible as a whole only from near its head, the first corner.
        let arrow = [[0.0, 0.0], [-2.0, -1.5], [-0.4, 0.0], [-2.0, 1.5]];
        for scale in [0.3, 1e-3, 1e-9] {
            let ring: Vec<_> = arrow
                .iter()
                .map(|[x, y]| Vector3::new(scale * x, scale * y, 1.0).normalize())
                .collect();
            let rest = Rest {
                weight: 1.0,
                cot: [1.0; 3],
            };
            let star: Vec<_> = (0..4)
                .map(|i| Wedge {
                    b: ring[(i + 1) % 4],
                    c: ring[i],
                    rest,
                })
                .map(|w| Wedge {
                    b: w.c,
                    c: w.b,
                    rest,
                })
                .rev()
                .map(|w| Wedge {
                    b: w.c,
                    c: w.b,
                    rest,
                })
                .collect();
            let points = kernel_points(&star, &ring[0]);
            assert_eq!(points.len(), 3, "scale {scale}");
            assert!(is_valid(&star, &points[0].normalize()), "scale {scale}");
        }
    }
}
