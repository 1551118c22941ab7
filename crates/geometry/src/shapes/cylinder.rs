//! The closed cylinder.

use nalgebra::Point3;
use std::f64::consts::TAU;

use super::{MAX_SEGMENTS, connect};
use crate::mesh::Mesh;
use crate::scalar::Scalar;

/// A closed cylinder about the z axis, centred at the origin, with sharp rims.
///
/// **Units**: `radius` and `height` are lengths. `segments` is the number of segments around the
/// axis, rounded up to a multiple of 6, so that each cap is a disc of rings with 6, 12, 18, …
/// vertices and nearly equilateral triangles. `stacks` is the number of rows along the axis (at
/// least 1); every other row is rotated by half a segment. The triangles of the side are best
/// shaped for `stacks` = `height` · `segments` / (5.4 · `radius`).
///
/// ```
/// let shape = cotan_geometry::cylinder::<f64>(0.5, 3.0, 24, 26);
/// assert_eq!(shape.num_vertices(), 24 * 27 + 2 * (1 + 6 + 12 + 18));
/// ```
#[must_use]
pub fn cylinder<T: Scalar>(radius: T, height: T, segments: usize, stacks: usize) -> Mesh<T> {
    let (radius, height) = (radius.as_f64(), height.as_f64());
    let rings = segments.clamp(6, MAX_SEGMENTS).div_ceil(6);
    let stacks = stacks.clamp(1, MAX_SEGMENTS);
    let mut points = Vec::new();
    let mut faces = Vec::new();
    push_side(radius, height, 6 * rings, stacks, &mut points, &mut faces);
    let top = Cap {
        first_rim: stacks * 6 * rings,
        rings,
        radius,
        z: height / 2.0,
    };
    top.push(stacks, &mut points, &mut faces);
    let num_top_faces = 6 * rings * rings;
    Cap {
        first_rim: 0,
        z: -height / 2.0,
        ..top
    }
    .push(0, &mut points, &mut faces);
    // Both caps are built the same way, so the bottom one is flipped to face down.
    let bottom = faces.len() - num_top_faces;
    faces[bottom..].iter_mut().for_each(|face| face.swap(1, 2));
    connect(&points, &faces)
}

/// Builds the rows of the side from the bottom up. Odd rows are rotated by half a segment.
fn push_side(
    radius: f64,
    height: f64,
    segments: usize,
    stacks: usize,
    points: &mut Vec<Point3<f64>>,
    faces: &mut Vec<[u32; 3]>,
) {
    for row in 0..=stacks {
        let z = height * (row as f64 / stacks as f64 - 0.5);
        for s in 0..segments {
            let (sin, cos) = rim_angle(s, segments, row).sin_cos();
            points.push(Point3::new(radius * cos, radius * sin, z));
        }
    }
    for row in 0..stacks {
        for s in 0..segments {
            let at = |row: usize, s: usize| (row * segments + s % segments) as u32;
            let [a, b] = [at(row, s), at(row, s + 1)];
            let [c, d] = [at(row + 1, s), at(row + 1, s + 1)];
            // Above an even row the vertex over the edge a b is c, above an odd row it is d.
            if row % 2 == 0 {
                faces.extend([[a, b, c], [b, d, c]]);
            } else {
                faces.extend([[a, b, d], [a, d, c]]);
            }
        }
    }
}

/// The angle of vertex `s` of `segments` in a ring that is rotated by half a rim segment if `row`
/// is odd.
fn rim_angle(s: usize, segments: usize, row: usize) -> f64 {
    TAU * (s as f64 + 0.5 * (row % 2) as f64) / segments as f64
}

/// A disc of concentric rings: ring j has 6 j vertices, ring 0 is the centre.
struct Cap {
    /// Index of the first rim vertex, which the side has created.
    first_rim: usize,
    rings: usize,
    radius: f64,
    z: f64,
}

impl Cap {
    /// Appends the inner vertices and the faces, counter-clockwise as seen from above.
    fn push(&self, row: usize, points: &mut Vec<Point3<f64>>, faces: &mut Vec<[u32; 3]>) {
        let center = points.len();
        let turn = rim_angle(0, 6 * self.rings, row);
        points.push(Point3::new(0.0, 0.0, self.z));
        for ring in 1..self.rings {
            let radius = self.radius * ring as f64 / self.rings as f64;
            for s in 0..6 * ring {
                let (sin, cos) = (turn + rim_angle(s, 6 * ring, 0)).sin_cos();
                points.push(Point3::new(radius * cos, radius * sin, self.z));
            }
        }
        let at = |ring: usize, s: usize| match ring {
            0 => center as u32,
            _ if ring == self.rings => (self.first_rim + s % (6 * ring)) as u32,
            // Rings 1 … j − 1 have 6 (1 + … + (j − 1)) = 3 j (j − 1) vertices.
            _ => (center + 1 + 3 * ring * (ring - 1) + s % (6 * ring)) as u32,
        };
        for ring in 1..=self.rings {
            for sector in 0..6 {
                let outer = |t: usize| at(ring, sector * ring + t);
                let inner = |t: usize| at(ring - 1, sector * (ring - 1) + t);
                faces.extend((0..ring).map(|t| [inner(t), outer(t), outer(t + 1)]));
                faces.extend((1..ring).map(|t| [inner(t - 1), outer(t), inner(t)]));
            }
        }
    }
}
