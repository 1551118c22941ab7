//! The possible triangulations of one polygon with few corners.

use std::cmp::Ordering;

use super::{MAX_CORNERS, Polygons};
use crate::optimal::Cost;
use crate::triangulate::Triangulator;

/// A triangulation of a polygon.
#[derive(Clone, Debug)]
pub(super) struct Choice {
    /// The triangles, as 0-based corners of the polygon.
    pub(super) triangles: Vec<[usize; 3]>,
    /// The places at the ends of its diagonals, in ascending order.
    pub(super) diagonals: Vec<[u32; 2]>,
    /// `true` if this is the triangulation of the polygon on its own.
    pub(super) is_default: bool,
    /// The number of its diagonals that also occur in a polygon with many corners.
    num_met: usize,
    /// Inverted triangles count first, then the squared lengths.
    cost: Cost,
}

/// All triangulations of polygons, indexed by the number of corners.
#[derive(Debug, Default)]
pub(super) struct Catalogue {
    /// Each triangulation is a sorted list of sorted triangles.
    lists: [Vec<Vec<[usize; 3]>>; MAX_CORNERS + 1],
}

impl Catalogue {
    fn of(&mut self, num_corners: usize) -> &[Vec<[usize; 3]>] {
        let list = &mut self.lists[num_corners];
        if list.is_empty() {
            *list = all(0, num_corners - 1);
            list.iter_mut()
                .for_each(|triangles| triangles.sort_unstable());
        }
        list
    }
}

/// All triangulations of the part of a polygon between two corners.
fn all(i: usize, j: usize) -> Vec<Vec<[usize; 3]>> {
    if i + 1 >= j {
        return vec![Vec::new()];
    }
    let mut list = Vec::new();
    for k in i + 1..j {
        for left in all(i, k) {
            for right in all(k, j) {
                list.push([left.as_slice(), &right, &[[i, k, j]]].concat());
            }
        }
    }
    list
}

/// Returns the triangulations of a face's polygon that meet no edge, in order of preference:
/// first those that avoid the diagonals of polygons with many corners, then the triangulation of
/// the polygon on its own, then the others by cost.
pub(super) fn choices(
    polygons: Polygons<'_>,
    face: u32,
    triangulator: &mut Triangulator<'_>,
    catalogue: &mut Catalogue,
    edges: &[[u32; 2]],
    near_large: &[[u32; 2]],
) -> Vec<Choice> {
    let polygon = polygons.polygon(face);
    let n = polygon.len();
    let mut default = Vec::new();
    triangulator.cut_corners(polygon, |mut corners| {
        corners.sort_unstable();
        default.push(corners);
    });
    default.sort_unstable();
    let is_possible = |ends: &[u32; 2]| ends[0] != ends[1] && edges.binary_search(ends).is_err();
    let mut choices = Vec::new();
    for triangles in catalogue.of(n) {
        let sides = triangles
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [a, c]]);
        let mut inner: Vec<[usize; 2]> =
            sides.filter(|&[i, j]| i + 1 < j && j - i + 1 < n).collect();
        inner.sort_unstable();
        inner.dedup();
        let diagonals: Vec<[u32; 2]> = inner
            .iter()
            .map(|&[i, j]| polygons.ends(polygon, i, j))
            .collect();
        let mut distinct = diagonals.clone();
        distinct.sort_unstable();
        distinct.dedup();
        if distinct.len() < diagonals.len() || !diagonals.iter().all(is_possible) {
            continue;
        }
        let is_met = |ends: &&[u32; 2]| near_large.binary_search(ends).is_ok();
        let is_default = *triangles == default;
        choices.push(Choice {
            num_met: diagonals.iter().filter(is_met).count(),
            is_default,
            cost: cost(polygons, polygon, triangles, triangulator),
            triangles: triangles.clone(),
            diagonals,
        });
    }
    choices.sort_by(|a, b| {
        let rank = |choice: &Choice| (choice.num_met, !choice.is_default);
        rank(a)
            .cmp(&rank(b))
            .then_with(|| by_cost(&a.cost, &b.cost))
    });
    choices
}

fn cost(
    polygons: Polygons<'_>,
    polygon: &[u32],
    triangles: &[[usize; 3]],
    triangulator: &Triangulator<'_>,
) -> Cost {
    let is_turned = |&&t: &&[usize; 3]| triangulator.area(t) <= 0.0;
    let point = |i: usize| polygons.positions[polygon[i] as usize];
    let squares = triangles.iter().map(|&[a, b, c]| {
        let [a, b, c] = [a, b, c].map(point);
        (b - a).norm_squared() + (c - b).norm_squared() + (a - c).norm_squared()
    });
    Cost {
        worst: triangles.iter().filter(is_turned).count() as f64,
        sum: squares.sum(),
    }
}

fn by_cost(a: &Cost, b: &Cost) -> Ordering {
    a.worst.total_cmp(&b.worst).then(a.sum.total_cmp(&b.sum))
}

/// Orders polygons by the cost of not getting their first choice, highest first.
pub(super) fn by_regret(a: &[Choice], b: &[Choice]) -> Ordering {
    let regret = |choices: &[Choice]| match choices {
        [first, second, ..] => Cost {
            worst: second.cost.worst - first.cost.worst,
            sum: second.cost.sum - first.cost.sum,
        },
        _ => Cost {
            worst: f64::INFINITY,
            sum: f64::INFINITY,
        },
    };
    by_cost(&regret(b), &regret(a))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_as_many_triangulations_as_catalan_counts() {
        let mut catalogue = Catalogue::default();
        let numbers: Vec<usize> = (3..=8).map(|n| catalogue.of(n).len()).collect();
        assert_eq!(numbers, [1, 2, 5, 14, 42, 132]);
    }
}
