//! The bipyramid: two vertices with any valence.

use nalgebra::Point3;
use std::f64::consts::TAU;

use super::connect;
use crate::mesh::Mesh;
use crate::scalar::Scalar;

/// A closed double pyramid about the z axis over a regular polygon of radius 1. The two apices at
/// z = ±1 come last in vertex order, and `valence` triangles meet at each. `valence` is clamped
/// to 3 … 2²⁰.
///
/// No mesh algorithm may have a cost quadratic in a valence; this shape reveals those that do.
///
/// ```
/// let shape = cotan_geometry::shapes::bipyramid::<f64>(100);
/// assert_eq!((shape.num_vertices(), shape.num_faces()), (102, 200));
/// ```
#[must_use]
pub fn bipyramid<T: Scalar>(valence: usize) -> Mesh<T> {
    let n = valence.clamp(3, 1 << 20);
    let mut points: Vec<Point3<f64>> = (0..n)
        .map(|k| {
            let (sin, cos) = (TAU * k as f64 / n as f64).sin_cos();
            Point3::new(cos, sin, 0.0)
        })
        .collect();
    points.extend([Point3::new(0.0, 0.0, 1.0), Point3::new(0.0, 0.0, -1.0)]);
    let (top, bottom) = (n as u32, n as u32 + 1);
    let faces: Vec<[u32; 3]> = (0..n)
        .flat_map(|k| {
            let (a, b) = (k as u32, ((k + 1) % n) as u32);
            [[a, b, top], [b, a, bottom]]
        })
        .collect();
    connect(&points, &faces)
}
