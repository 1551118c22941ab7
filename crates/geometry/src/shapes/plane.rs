//! The bumpy plane.

use nalgebra::Point3;
use std::f64::consts::TAU;

use super::{MAX_SEGMENTS, connect};
use crate::mesh::Mesh;
use crate::scalar::Scalar;

/// A rectangle in the x y plane, centred at the origin, with smooth bumps up and down: a disc
/// with one boundary loop.
///
/// **Units**: `size` are the lengths along x and y. `amplitude` is the height of the bumps (a
/// length; 0 gives a flat plane), which have five different wavelengths from the whole side to a
/// third of it, so that no two bumps are alike. `segments` are the numbers of cells along x and
/// y, at least 1.
#[must_use]
pub fn bumpy_plane<T: Scalar>(size: [T; 2], segments: [usize; 2], amplitude: T) -> Mesh<T> {
    let [width, depth] = size.map(T::as_f64);
    let amplitude = amplitude.as_f64();
    let [nx, ny] = segments.map(|count| count.clamp(1, MAX_SEGMENTS));
    let mut points = Vec::with_capacity((nx + 1) * (ny + 1));
    for i in 0..=nx {
        for j in 0..=ny {
            let (u, v) = (i as f64 / nx as f64, j as f64 / ny as f64);
            let z = amplitude * bumps(u, v);
            points.push(Point3::new(width * (u - 0.5), depth * (v - 0.5), z));
        }
    }
    let at = |i: usize, j: usize| (i * (ny + 1) + j) as u32;
    let mut faces = Vec::with_capacity(2 * nx * ny);
    for i in 0..nx {
        for j in 0..ny {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            // The diagonals alternate, so that the grid has no preferred direction.
            faces.extend(if (i + j) % 2 == 0 {
                [[a, b, c], [a, c, d]]
            } else {
                [[a, b, d], [b, c, d]]
            });
        }
    }
    connect(&points, &faces)
}

/// A height in −1 … 1 over the unit square.
fn bumps(u: f64, v: f64) -> f64 {
    let long = (TAU * (1.0 * u + 0.10)).sin() * (TAU * (1.5 * v + 0.20)).sin();
    let short = (TAU * (2.0 * u + 0.35)).sin() * (TAU * (3.0 * v - 1.0 * u + 0.05)).sin();
    0.6 * long + 0.4 * short
}
