//! Welding: vertices that represent one point of the surface.

use std::collections::HashMap;

use foldhash::fast::RandomState;
use nalgebra::Point3;

use crate::attributes::NONE;

/// The vertices of a document that count as one vertex of its surface.
///
/// Texture seams split vertices in glTF, and an STL is a triangle soup. Without welding, one
/// closed surface would become many open ones. Only the surface is welded, never the file.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub enum Weld {
    /// As the format implies: vertices at exactly the same position within one mesh of a glTF or
    /// in an STL, none in other formats.
    #[default]
    AsFormat,
    /// Every document vertex is separate.
    Off,
    /// Vertices at exactly the same position are welded.
    Exact,
    /// Vertices within this distance of each other, in file units, are welded. The distance must
    /// be finite and not negative.
    Within(f64),
}

/// For each vertex, the first vertex at the same position in the same part.
pub(crate) fn exact(positions: &[Point3<f64>], part: impl Fn(usize) -> u32) -> Vec<u32> {
    let mut first = HashMap::with_capacity_and_hasher(positions.len() / 2, RandomState::default());
    positions
        .iter()
        .enumerate()
        .map(|(v, p)| {
            // Negative and positive zero are the same position.
            let place: [u64; 3] = p.coords.map(|x| (x + 0.0).to_bits()).into();
            *first.entry((part(v), place)).or_insert(v as u32)
        })
        .collect()
}

/// For each vertex, the first representative vertex within `tolerance`.
///
/// Vertices are processed in order, so that the result is the same on every machine. Two
/// representatives are always further apart than the tolerance.
pub(crate) fn within(
    positions: &[Point3<f64>],
    part: impl Fn(usize) -> u32,
    tolerance: f64,
) -> Vec<u32> {
    let low = positions
        .iter()
        .fold(Point3::from([f64::INFINITY; 3]), |low, p| low.inf(p));
    let extent = positions
        .iter()
        .map(|p| (p - low).amax())
        .fold(0.0, f64::max);
    // If cell indices exceeded the precision of `f64`, all vertices could end up in one cell.
    if !(tolerance > extent * f64::EPSILON) {
        return exact(positions, part);
    }
    // Each cell lists its representatives in a linked list through the vertices.
    let mut cells: HashMap<(u32, [i64; 3]), u32, RandomState> = HashMap::default();
    let mut chain = vec![NONE; positions.len()];
    let mut places = Vec::with_capacity(positions.len());
    for (v, p) in positions.iter().enumerate() {
        let part = part(v);
        let cell: [i64; 3] = (p - low).map(|x| (x / tolerance).floor() as i64).into();
        let mut nearest: Option<(f64, u32)> = None;
        for near in neighbours(cell) {
            let mut at = cells.get(&(part, near)).copied().unwrap_or(NONE);
            while at != NONE {
                let distance = (positions[at as usize] - p).norm();
                if distance <= tolerance && nearest.is_none_or(|n| (distance, at) < n) {
                    nearest = Some((distance, at));
                }
                at = chain[at as usize];
            }
        }
        places.push(match nearest {
            Some((_, place)) => place,
            None => {
                let head = cells.entry((part, cell)).or_insert(NONE);
                chain[v] = std::mem::replace(head, v as u32);
                v as u32
            }
        });
    }
    places
}

fn neighbours(cell: [i64; 3]) -> impl Iterator<Item = [i64; 3]> {
    (0..27).map(move |k| {
        [
            cell[0] + k % 3 - 1,
            cell[1] + k / 3 % 3 - 1,
            cell[2] + k / 9 - 1,
        ]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(x: &[f64]) -> Vec<Point3<f64>> {
        x.iter().map(|&x| Point3::new(x, 0.0, -x)).collect()
    }

    #[test]
    fn the_first_vertex_at_a_place_stands_for_it() {
        let points = line(&[0.0, 1.0, -0.0, 1.0, 1.0 + f64::EPSILON]);
        assert_eq!(exact(&points, |_| 0), [0, 1, 0, 1, 4]);
        assert_eq!(exact(&points, |v| u32::from(v > 1)), [0, 1, 2, 3, 4]);
        assert_eq!(within(&points, |_| 0, 0.0), [0, 1, 0, 1, 4]);
        assert_eq!(within(&points, |_| 0, 1e-9), [0, 1, 0, 1, 1]);
        assert_eq!(within(&points, |_| 0, 10.0), [0; 5]);
    }

    #[test]
    fn places_of_their_own_are_further_apart_than_the_tolerance() {
        let points: Vec<_> = (0..500)
            .map(|i| {
                Point3::new(
                    f64::from(i * 37 % 100),
                    f64::from(i * 61 % 50),
                    1e-3 * f64::from(i),
                )
            })
            .collect();
        let tolerance = 3.0;
        let places = within(&points, |_| 0, tolerance);
        let own: Vec<usize> = (0..points.len())
            .filter(|&v| places[v] as usize == v)
            .collect();
        assert!(own.len() < 300, "{}", own.len());
        for (i, &a) in own.iter().enumerate() {
            assert!(
                own[..i]
                    .iter()
                    .all(|&b| (points[a] - points[b]).norm() > tolerance)
            );
        }
        for (v, &place) in places.iter().enumerate() {
            assert!((points[v] - points[place as usize]).norm() <= tolerance);
        }
    }

    #[test]
    fn tiny_tolerances_and_far_points_end_soon() {
        let points: Vec<_> = (0..20_000)
            .map(|i| Point3::new(f64::from(i), 1e300, 0.0))
            .collect();
        let places = within(&points, |_| 0, 1e-300);
        assert!(places.iter().enumerate().all(|(v, &p)| v == p as usize));
    }
}
