//! Minimum-cost triangulation of a polygon by dynamic programming.
//!
//! W(i, j), the minimum cost of the part between corners i and j, is the minimum over the corners
//! k between them of W(i, k) + W(k, j) + cost of the triangle (i, k, j). The cost of a triangle
//! may depend on the triangles across its inner sides. Time O(n³), memory O(n²).
//!
//! Source: G. Barequet and M. Sharir, "Filling gaps in the boundary of a polyhedron", CAGD 12
//! (1995); P. Liepa, "Filling holes in meshes", SGP 2003, section 3.

use crate::attributes::NONE;

/// The cost of triangles, ordered by the worst triangle first and then by the sum.
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug, Default)]
pub(crate) struct Cost {
    pub(crate) worst: f64,
    pub(crate) sum: f64,
}

impl Cost {
    pub(crate) fn plus(self, other: Self) -> Self {
        Self {
            worst: self.worst.max(other.worst),
            sum: self.sum + other.sum,
        }
    }

    fn is_below(&self, other: &Self) -> bool {
        let order = self.worst.total_cmp(&other.worst);
        order.then(self.sum.total_cmp(&other.sum)).is_lt()
    }
}

/// A triangle i < k < j of a polygon, with the corners across its two lower sides if these are
/// inside the polygon.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    pub(crate) corners: [usize; 3],
    /// The corner across the side i k.
    pub(crate) before: Option<usize>,
    /// The corner across the side k j.
    pub(crate) behind: Option<usize>,
}

/// Returns the minimum-cost triangulation of a polygon with `n` corners, or `None` if every
/// triangulation contains a triangle or a diagonal that is not allowed.
///
/// `is_allowed` is called for every diagonal, `cost` for every triangle between allowed ones.
pub(crate) fn triangulation(
    n: usize,
    is_allowed: impl Fn(usize, usize) -> bool,
    cost: impl Fn(Candidate) -> Cost,
) -> Option<Vec<[usize; 3]>> {
    let mut table = vec![Entry::default(); n * n];
    for i in 0..n.saturating_sub(1) {
        table[i * n + i + 1].is_possible = true;
    }
    for span in 2..n {
        for i in 0..n - span {
            let j = i + span;
            if span + 1 < n && !is_allowed(i, j) {
                continue;
            }
            let mut best = Entry::default();
            for k in i + 1..j {
                let (left, right) = (table[i * n + k], table[k * n + j]);
                if !left.is_possible || !right.is_possible {
                    continue;
                }
                let candidate = Candidate {
                    corners: [i, k, j],
                    before: left.apex(),
                    behind: right.apex(),
                };
                let cost = left.cost.plus(right.cost).plus(cost(candidate));
                if !best.is_possible || cost.is_below(&best.cost) {
                    best = Entry {
                        cost,
                        apex: k as u32,
                        is_possible: true,
                    };
                }
            }
            table[i * n + j] = best;
        }
    }
    if n < 3 || !table[n - 1].is_possible {
        return None;
    }
    let mut triangles = Vec::with_capacity(n - 2);
    let mut open = vec![(0, n - 1)];
    while let Some((i, j)) = open.pop() {
        if let Some(k) = table[i * n + j].apex() {
            triangles.push([i, k, j]);
            open.extend([(k, j), (i, k)]);
        }
    }
    Some(triangles)
}

/// The best triangulation of the part between two corners.
#[derive(Clone, Copy, Debug)]
struct Entry {
    cost: Cost,
    /// The third corner of the triangle at the diagonal; [`NONE`] at a side of the polygon.
    apex: u32,
    is_possible: bool,
}

impl Default for Entry {
    fn default() -> Self {
        Self {
            cost: Cost::default(),
            apex: NONE,
            is_possible: false,
        }
    }
}

impl Entry {
    fn apex(&self) -> Option<usize> {
        (self.apex != NONE).then_some(self.apex as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn even(_: Candidate) -> Cost {
        Cost::default()
    }

    #[test]
    fn every_polygon_has_two_triangles_less_than_corners() {
        for n in 3..12 {
            assert_eq!(triangulation(n, |_, _| true, even).unwrap().len(), n - 2);
        }
        assert!(triangulation(2, |_, _| true, even).is_none());
    }

    #[test]
    fn diagonals_that_are_not_allowed_are_avoided() {
        let quad = triangulation(4, |i, j| (i, j) != (0, 2), even).unwrap();
        assert_eq!(quad, [[0, 1, 3], [1, 2, 3]]);
        assert!(triangulation(4, |_, _| false, even).is_none());
        // Only the two diagonals from one corner of the pentagon are allowed.
        let fan = triangulation(5, |i, j| i == 1 || j == 1, even).unwrap();
        assert!(fan.iter().all(|t| t.contains(&1)), "{fan:?}");
        // Two crossing diagonals are not enough.
        let allowed = |i, j| [(0, 2), (1, 3)].contains(&(i, j));
        assert!(triangulation(5, allowed, even).is_none());
    }

    #[test]
    fn the_worst_triangle_counts_before_the_sum() {
        let cost = |candidate: Candidate| match candidate.corners {
            [0, 1, 2] | [0, 2, 3] => Cost {
                worst: 1.0,
                sum: 9.0,
            },
            _ => Cost {
                worst: 2.0,
                sum: 0.0,
            },
        };
        let quad = triangulation(4, |_, _| true, cost).unwrap();
        assert_eq!(quad, [[0, 2, 3], [0, 1, 2]]);
    }
}
