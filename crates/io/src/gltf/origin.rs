//! The point from which a new glTF counts its positions.
//!
//! Positions of glTF are numbers of 32 bits. A mesh that is far from the origin for its size keeps
//! its shape if they count from a point nearby, which a node adds in the 64 bits that JSON has.

use nalgebra::Point3;

use crate::faces::FaceList;
use crate::precision::{Rounding, single};

/// The origin of a mesh: zero, or a round point near its middle if it would suffer from single
/// precision otherwise.
pub(super) fn of(positions: &[Point3<f64>], faces: &FaceList) -> Point3<f64> {
    let rounding = Rounding::measure(positions, faces, |v| single(positions[v]));
    match rounding {
        Some(rounding) if rounding.is_severe() => middle(positions, rounding.size),
        _ => Point3::origin(),
    }
}

/// The middle of the bounding box, rounded so that it has few digits and is still inside.
fn middle(positions: &[Point3<f64>], size: f64) -> Point3<f64> {
    let unit = 10f64.powf(size.log10().floor());
    let mut middle = Point3::origin();
    for k in 0..3 {
        let numbers = positions.iter().map(|p| p[k]);
        let (low, high) = numbers.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        let own = low / 2.0 + high / 2.0;
        let round = (own / unit).round() * unit;
        middle[k] = if round.is_finite() { round } else { own };
    }
    middle
}

/// A position as a file stores it that counts from `origin`.
pub(super) fn stored(p: Point3<f64>, origin: &Point3<f64>) -> Point3<f64> {
    *origin + single(Point3::from(p - origin)).coords
}
