//! The target length at every vertex of the original.
//!
//! **Source**: M. Dunyach, D. Vanderhaeghe, L. Barthe, M. Botsch, "Adaptive remeshing for
//! real-time mesh deformation", Eurographics 2013: an edge of length L on a sphere of curvature κ
//! leaves its surface by ε if L² = 6ε/κ − 3ε².

use super::distance::Tolerance;
use super::options::EdgeLengths;
use crate::tessellation_error::TessellationError;
use crate::triangles::{NONE, Triangles};

/// A length for every vertex of the original, in the scaled unit.
pub(super) fn sizes(
    original: &Triangles,
    lengths: EdgeLengths,
    scale: f64,
) -> Result<Vec<f64>, TessellationError> {
    let positive = |option, value: f64| {
        if value.is_finite() && value > 0.0 {
            Ok(value * scale)
        } else {
            Err(TessellationError::Option {
                option,
                expected: "a finite number above 0",
                value,
            })
        }
    };
    match lengths {
        EdgeLengths::Uniform(length) => Ok(vec![
            positive("the edge length", length)?;
            original.points.len()
        ]),
        EdgeLengths::Adaptive {
            error,
            shortest,
            longest,
        } => {
            let error = positive("the error", error)?;
            let shortest = positive("the shortest edge length", shortest)?;
            let longest = positive("the longest edge length", longest)?.max(shortest);
            let normals = normals(original);
            let mut sizes = cotan_parallel::filled(original.points.len(), |v| {
                let curvature = curvature(original, &normals, v as u32);
                let squared = 6.0 * error / curvature - 3.0 * error * error;
                squared.max(0.0).sqrt().clamp(shortest, longest)
            });
            limit_growth(original, &mut sizes);
            Ok(sizes)
        }
    }
}

/// The distance that the lengths stand for. Call it after [`sizes`], which checks them.
pub(super) fn tolerance(lengths: EdgeLengths, scale: f64) -> Tolerance {
    let (distance, shortest) = match lengths {
        EdgeLengths::Uniform(length) => (DISTANCE * length, SHORTEST * length),
        EdgeLengths::Adaptive {
            error, shortest, ..
        } => (error, shortest),
    };
    Tolerance {
        distance: distance * scale,
        shortest: shortest * scale,
    }
}

fn normals(original: &Triangles) -> Vec<nalgebra::Vector3<f64>> {
    cotan_parallel::filled(original.points.len(), |v| {
        if original.has_vertex(v as u32) {
            original
                .normal(v as u32)
                .try_normalize(0.0)
                .unwrap_or_default()
        } else {
            Default::default()
        }
    })
}

/// The largest normal curvature along the edges of `v` that lie on no line: the turn of the
/// normal per length.
fn curvature(original: &Triangles, normals: &[nalgebra::Vector3<f64>], v: u32) -> f64 {
    let mut largest: f64 = 0.0;
    for h in original.edges_at(v) {
        if original.tag(h) == NONE {
            let (a, b) = (original.origin(h), original.target(h));
            let along = original.point(b) - original.point(a);
            let turn = (normals[b as usize] - normals[a as usize])
                .dot(&along)
                .abs();
            if along.norm_squared() > 0.0 {
                largest = largest.max(turn / along.norm_squared());
            }
        }
    }
    largest
}

/// Lets lengths grow by no more than half of the distance, so that neighbours are of similar
/// size.
pub(super) fn limit_growth(triangles: &Triangles, sizes: &mut [f64]) {
    for _ in 0..GROWTH_ROUNDS {
        let before = &*sizes;
        let limited = cotan_parallel::filled(before.len(), |v| {
            triangles.edges_at(v as u32).fold(before[v], |least, h| {
                let other = triangles.origin(h) + triangles.target(h) - v as u32;
                least.min(before[other as usize] + GROWTH * triangles.length(h))
            })
        });
        if limited == *sizes {
            break;
        }
        sizes.copy_from_slice(&limited);
    }
}

/// The growth of the target length per distance.
const GROWTH: f64 = 0.3;

/// A bound of the number of edges over which growth is limited.
const GROWTH_ROUNDS: usize = 20;

/// The distance allowed between the surfaces, relative to the length of even edges.
const DISTANCE: f64 = 0.2;

/// The least length to which even edges are shortened, relative to their length.
const SHORTEST: f64 = 0.25;
