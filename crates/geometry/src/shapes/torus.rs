//! The torus.

use nalgebra::Point3;
use std::f64::consts::TAU;

use super::{MAX_SEGMENTS, connect};
use crate::mesh::Mesh;
use crate::scalar::Scalar;

/// A torus about the z axis: genus 1, `around` × `across` vertices.
///
/// **Units**: `major_radius` (from the axis to the middle of the tube) and `minor_radius` (of the
/// tube) are lengths. There are `around` segments around the axis and `across` segments around
/// the tube, each at least 3.
#[must_use]
pub fn torus<T: Scalar>(major_radius: T, minor_radius: T, around: usize, across: usize) -> Mesh<T> {
    let (major, minor) = (major_radius.as_f64(), minor_radius.as_f64());
    let [around, across] = [around, across].map(|count| count.clamp(3, MAX_SEGMENTS));
    let mut points = Vec::with_capacity(around * across);
    let mut faces = Vec::with_capacity(2 * around * across);
    for i in 0..around {
        let (sin_u, cos_u) = (TAU * i as f64 / around as f64).sin_cos();
        for j in 0..across {
            let (sin_v, cos_v) = (TAU * j as f64 / across as f64).sin_cos();
            let radius = major + minor * cos_v;
            points.push(Point3::new(radius * cos_u, radius * sin_u, minor * sin_v));
            let at = |i: usize, j: usize| ((i % around) * across + j % across) as u32;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            faces.push([a, b, c]);
            faces.push([a, c, d]);
        }
    }
    connect(&points, &faces)
}
