//! The origin of the positions in a new glTF.
//!
//! glTF positions are 32-bit numbers. A mesh that is far from the origin relative to its size
//! keeps its shape if its positions are relative to a nearby point, which a node adds in the 64
//! bits available in JSON.

use nalgebra::Point3;

use crate::faces::FaceList;
use crate::precision::{Rounding, single};

/// Returns the origin of a mesh: zero, or a round point near its middle if single precision would
/// otherwise affect the shape.
pub(super) fn of(positions: &[Point3<f64>], faces: &FaceList) -> Point3<f64> {
    let rounding = Rounding::measure(positions, faces, |v| single(positions[v]));
    match rounding {
        Some(rounding) if rounding.is_severe() => middle(positions, rounding.size),
        _ => Point3::origin(),
    }
}

/// The middle of the bounding box, rounded to few digits but still inside.
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

/// A position as stored in a file with positions relative to `origin`.
pub(super) fn stored(p: Point3<f64>, origin: &Point3<f64>) -> Point3<f64> {
    *origin + single(Point3::from(p - origin)).coords
}
