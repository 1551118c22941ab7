//! Valleys of a cut.

use nalgebra::{Point3, Vector3};

use super::bridge::Side;

/// The side with the sharpest corners between its edges filled by triangles, as (before, corner,
/// after), and these triangles.
///
/// A cut runs along whole faces and zigzags. In a valley of 60° a strip has to squeeze two
/// triangles or more, with angles below 30°; a triangle that closes the valley has none below 40°.
/// Corners below [`WIDEST`] are filled, the sharper of two neighbours first, until half of the
/// vertices are left or fewer. `is_edge` tells which pairs of vertices have an edge already.
pub(super) fn filled(side: &Side, is_edge: impl Fn(u32, u32) -> bool) -> (Side, Vec<[u32; 3]>) {
    let mut left: Vec<usize> = (0..side.vertices.len()).collect();
    let mut faces = Vec::new();
    loop {
        let n = left.len();
        if n < 6 || 2 * n <= side.vertices.len() {
            break;
        }
        let around = |k: usize| [left[(k + n - 1) % n], left[k], left[(k + 1) % n]];
        let cosines: Vec<f64> = (0..n).map(|k| cosine(side, around(k))).collect();
        let is_valley = |k: usize| {
            let [before, _, after] = around(k).map(|at| side.vertices[at]);
            let (last, next) = ((k + n - 1) % n, (k + 1) % n);
            let is_sharpest = cosines[k] >= cosines[next] && cosines[k] >= cosines[last];
            cosines[k] > WIDEST && is_sharpest && !is_edge(before, after)
        };
        let chosen = chosen(n, is_valley);
        if chosen.is_empty() {
            break;
        }
        faces.extend(
            chosen
                .iter()
                .map(|&k| around(k).map(|at| side.vertices[at])),
        );
        let mut is_filled = vec![false; n];
        chosen.iter().for_each(|&k| is_filled[k] = true);
        let kept = left.iter().zip(&is_filled).filter(|(_, filled)| !**filled);
        left = kept.map(|(at, _)| *at).collect();
    }
    let side = Side {
        vertices: left.iter().map(|&at| side.vertices[at]).collect(),
        points: left.iter().map(|&at| side.points[at]).collect(),
        outward: left.iter().map(|&at| side.outward[at]).collect(),
    };
    (side, faces)
}

/// The places that are chosen, of which no two are neighbours.
fn chosen(n: usize, is_valley: impl Fn(usize) -> bool) -> Vec<usize> {
    let mut chosen: Vec<usize> = Vec::new();
    for k in (0..n).filter(|&k| is_valley(k)) {
        let follows = chosen.last().is_some_and(|&last| last + 1 == k);
        let closes = k + 1 == n && chosen.first() == Some(&0);
        if !follows && !closes {
            chosen.push(k);
        }
    }
    chosen
}

/// The cosine of the angle of a corner towards the seam; −1 where it is more than 180°.
fn cosine(side: &Side, [before, at, after]: [usize; 3]) -> f64 {
    let corner = side.points[at];
    let along = |p: Point3<f64>| {
        (p - corner)
            .try_normalize(0.0)
            .unwrap_or_else(Vector3::zeros)
    };
    let (a, b) = (along(side.points[before]), along(side.points[after]));
    match (a + b).dot(&side.outward[at]) > 0.0 {
        true => a.dot(&b),
        false => -1.0,
    }
}

/// The cosine of 100°.
const WIDEST: f64 = -0.174;

#[cfg(test)]
mod tests {
    use super::*;

    /// A circle whose vertices lie in turn on two heights; the seam is above.
    fn zigzag(n: usize, depth: f64) -> Side {
        let place = |k: usize| {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / n as f64).sin_cos();
            Point3::new(cos, sin, if k % 2 == 0 { 0.0 } else { depth })
        };
        Side {
            vertices: (0..n as u32).collect(),
            points: (0..n).map(place).collect(),
            outward: vec![Vector3::z(); n],
        }
    }

    #[test]
    fn deep_valleys_are_filled_and_shallow_ones_left() {
        let edge = std::f64::consts::TAU / 32.0;
        let (side, faces) = filled(&zigzag(32, 1.5 * edge), |_, _| false);
        assert_eq!((side.vertices.len(), faces.len()), (16, 16));
        assert!(side.points.iter().all(|p| p.z > 0.0));
        assert!(faces.contains(&[31, 0, 1]) && faces.contains(&[1, 2, 3]));
        let (side, faces) = filled(&zigzag(32, 0.2 * edge), |_, _| false);
        assert_eq!((side.vertices.len(), faces.len()), (32, 0));
        let (side, _) = filled(&zigzag(32, 1.5 * edge), |_, _| true);
        assert_eq!(side.vertices.len(), 32);
    }
}
