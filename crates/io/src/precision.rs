//! The effect of single precision on a mesh: vertex displacements, and faces that lose their
//! area.

use std::fmt;

use cotan_geometry::relative_height;
use nalgebra::Point3;

use crate::cuts::FLAT;
use crate::faces::FaceList;

/// The effect of a file's number type on the positions of a mesh.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Rounding {
    /// The largest change of a coordinate.
    pub(crate) farthest: f64,
    /// The longest side of the bounding box.
    pub(crate) size: f64,
    /// The number of faces that have an area before rounding but none after.
    pub(crate) num_flat: usize,
}

/// Rounds a position to single precision.
pub(crate) fn single(p: Point3<f64>) -> Point3<f64> {
    p.map(|x| f64::from(x as f32))
}

impl Rounding {
    /// Compares a mesh with its stored form; `None` if all positions are equal.
    pub(crate) fn measure(
        positions: &[Point3<f64>],
        faces: &FaceList,
        stored: impl Fn(usize) -> Point3<f64>,
    ) -> Option<Self> {
        let mut farthest = 0.0f64;
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for (vertex, p) in positions.iter().enumerate() {
            farthest = farthest.max((stored(vertex) - p).amax());
            for k in 0..3 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        if farthest == 0.0 {
            return None;
        }
        let size = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
        let is_flat = |face: &[u32], at: &dyn Fn(usize) -> Point3<f64>| {
            let corner = |k: usize| at(face[k] as usize);
            (2..face.len()).all(|k| relative_height(&corner(0), &corner(k - 1), &corner(k)) <= FLAT)
        };
        let before = |vertex: usize| positions[vertex];
        let is_lost = |face: &&[u32]| is_flat(face, &stored) && !is_flat(face, &before);
        // Rounding far below the size of every face does not flatten any.
        let num_flat = match farthest > 1e-12 * size {
            true => faces.iter().filter(is_lost).count(),
            false => 0,
        };
        Some(Self {
            farthest,
            size,
            num_flat,
        })
    }

    /// Returns `true` if the shape is visibly affected, and not only insignificant digits.
    pub(crate) fn is_severe(&self) -> bool {
        self.num_flat > 0 || self.farthest > SEVERE * self.size
    }

    /// Describes the loss.
    pub(crate) fn loss(&self) -> String {
        match self.is_severe() {
            true => format!("the exact shape, which is far from the origin for its size ({self}),"),
            false => format!(
                "digits of coordinates beyond single precision (vertices move by {:.0e} at most)",
                self.farthest
            ),
        }
    }
}

/// A severe rounding: `vertices move by 0.25 at most, which is 6 % of the size of the mesh; …`.
impl fmt::Display for Rounding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "vertices move by {} at most", short(self.farthest))?;
        if self.size > 0.0 {
            let share = short(100.0 * self.farthest / self.size);
            write!(f, ", {share} % of the size of the mesh")?;
        }
        match self.num_flat {
            0 => Ok(()),
            1 => f.write_str("; 1 face becomes degenerate"),
            n => write!(f, "; {n} faces become degenerate"),
        }
    }
}

/// Formats a number with two significant digits.
fn short(x: f64) -> String {
    let digits = format!("{x:.1e}");
    match digits.parse::<f64>() {
        Ok(rounded) if (1e-3..1e6).contains(&rounded) => rounded.to_string(),
        _ => digits,
    }
}

/// Threshold for a severe rounding, relative to the size of the mesh.
///
/// Near the origin, single precision rounds by at most 6e-8 of the size; this is the rounding at
/// a distance of a hundred sizes.
const SEVERE: f64 = 6e-6;

#[cfg(test)]
mod tests {
    use super::*;

    fn far(distance: f64) -> Option<Rounding> {
        let positions: Vec<_> = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]]
            .map(|p| Point3::from(p) + nalgebra::Vector3::repeat(distance))
            .to_vec();
        let faces: FaceList = [[0u32, 1, 2]].into_iter().collect();
        Rounding::measure(&positions, &faces, |v| single(positions[v]))
    }

    #[test]
    fn a_small_loss_and_a_large_one_have_their_numbers() {
        let near = far(0.0).unwrap();
        assert!(!near.is_severe());
        assert_eq!(
            near.loss(),
            "digits of coordinates beyond single precision (vertices move by 1e-9 at most)"
        );
        let lost = far(4e6).unwrap();
        assert_eq!((lost.num_flat, lost.is_severe()), (1, true));
        let text = lost.loss();
        assert!(
            text.contains("vertices move by 0.1 at most, 100 % of"),
            "{text}"
        );
        assert!(text.contains("1 face becomes degenerate"), "{text}");
        let middle = far(3e4).unwrap();
        assert!(middle.is_severe() && middle.num_flat == 0, "{middle:?}");
    }
}
