//! Recutting of polygons with many corners, one at a time, around everything else.

use std::collections::HashMap;

use foldhash::fast::RandomState;

use super::{Cutter, Polygons, Recuts};
use crate::ears::clip_short_ears;
use crate::optimal::{self, Cost};
use crate::triangulate::Triangulator;

/// Maximum number of corners of a polygon, or of the remainder after clipping ears, for which all
/// triangulations are compared: a few hundred thousand triangles.
pub(super) const MAX_OPTIMAL: usize = 128;

/// Recuts the polygons of these faces so that they meet as few edges and diagonals as possible.
pub(super) fn recut(polygons: Polygons<'_>, faces: &[u32], recuts: Recuts) -> Recuts {
    let mut taken = Taken::new(polygons, faces, &recuts);
    let mut order = faces.to_vec();
    order.sort_by_key(|&face| (polygons.polygon(face), face));
    let mut triangulator = Triangulator::new(polygons.positions, polygons.faces.num_corners());
    let mut list: Vec<(u32, Vec<[usize; 3]>)> = recuts
        .faces
        .iter()
        .filter_map(|&(face, _)| Some((face, recuts.get(face)?.to_vec())))
        .collect();
    for face in order {
        let polygon = polygons.polygon(face);
        let mut own = Vec::new();
        triangulator.cut_corners(polygon, |t| own.push(t));
        let ends = |[i, j]: [usize; 2]| polygons.ends(polygon, i, j);
        diagonals(&own, polygon.len()).for_each(|pair| taken.remove(ends(pair)));
        let is_free = |i: usize, j: usize| taken.is_free(ends([i, j]));
        let is_settled = diagonals(&own, polygon.len()).all(|[i, j]| is_free(i, j));
        if is_settled {
            // A polygon processed earlier may have made room.
        } else if let Some(triangles) = cut(polygons, polygon, &mut triangulator, is_free) {
            list.push((face, triangles.clone()));
            own = triangles;
        }
        diagonals(&own, polygon.len()).for_each(|pair| taken.add(ends(pair)));
    }
    list.sort_unstable_by_key(|(face, _)| *face);
    Recuts::from_sorted(list)
}

/// Cuts a polygon with allowed diagonals only.
///
/// While there are too many corners, ears are clipped, first those inside the outline, then the
/// shortest. The rest gets the optimal triangulation.
fn cut(
    polygons: Polygons<'_>,
    polygon: &[u32],
    triangulator: &mut Triangulator<'_>,
    is_free: impl Fn(usize, usize) -> bool,
) -> Option<Vec<[usize; 3]>> {
    let mut triangles = Vec::new();
    let mut rest: Vec<usize> = if polygon.len() > MAX_OPTIMAL {
        let rest = triangulator.clip_allowed(polygon, |ear| triangles.push(ear), &is_free);
        rest.to_vec()
    } else {
        triangulator.flatten(polygon);
        (0..polygon.len()).collect()
    };
    if rest.len() > MAX_OPTIMAL {
        let point = |i: usize| polygons.positions[polygon[i] as usize];
        clip_short_ears(&mut rest, MAX_OPTIMAL, &mut triangles, point, &is_free);
    }
    if rest.len() > MAX_OPTIMAL {
        return None;
    }
    let point = |i: usize| polygons.positions[polygon[rest[i]] as usize];
    let cost = |candidate: optimal::Candidate| {
        let [a, b, c] = candidate.corners.map(point);
        let is_turned = triangulator.area(candidate.corners.map(|i| rest[i])) <= 0.0;
        Cost {
            worst: if is_turned { 1.0 } else { 0.0 },
            sum: (b - a).norm_squared() + (c - b).norm_squared() + (a - c).norm_squared(),
        }
    };
    let found = optimal::triangulation(rest.len(), |i, j| is_free(rest[i], rest[j]), cost)?;
    triangles.extend(found.into_iter().map(|t| t.map(|i| rest[i])));
    Some(triangles)
}

/// The diagonals among the sides of triangles that cover a polygon, each once.
fn diagonals(triangles: &[[usize; 3]], n: usize) -> impl Iterator<Item = [usize; 2]> + '_ {
    triangles.iter().flat_map(move |&[a, b, c]| {
        [[a, b], [b, c], [c, a]]
            .into_iter()
            .filter(move |&[i, j]| i + 1 < j && j - i + 1 < n)
    })
}

/// The number of faces that have an edge or a diagonal between two places.
struct Taken {
    counts: HashMap<[u32; 2], u32, RandomState>,
}

impl Taken {
    /// Counts the edges and diagonals at the places of these faces.
    fn new(polygons: Polygons<'_>, faces: &[u32], recuts: &Recuts) -> Self {
        let mut is_marked = vec![false; polygons.positions.len()];
        for &face in faces {
            for &v in polygons.polygon(face) {
                is_marked[polygons.place(v) as usize] = true;
            }
        }
        let is_near = |ends: &[u32; 2]| ends.iter().all(|&place| is_marked[place as usize]);
        let mut taken = Self {
            counts: HashMap::default(),
        };
        let mut cutter = Cutter::new(polygons.positions, polygons.faces.num_corners(), recuts);
        for (face, polygon) in (0u32..).zip(polygons.faces.iter()) {
            for ends in polygons.sides(polygon).filter(is_near) {
                taken.add(ends);
            }
            if polygons.is_hopeless(polygon) {
                continue;
            }
            cutter.diagonals(face, polygon, |i, j| {
                let ends = polygons.ends(polygon, i, j);
                if is_near(&ends) {
                    taken.add(ends);
                }
            });
        }
        taken
    }

    fn add(&mut self, ends: [u32; 2]) {
        *self.counts.entry(ends).or_default() += 1;
    }

    fn remove(&mut self, ends: [u32; 2]) {
        if let Some(count) = self.counts.get_mut(&ends) {
            *count = count.saturating_sub(1);
        }
    }

    fn is_free(&self, ends: [u32; 2]) -> bool {
        ends[0] != ends[1] && self.counts.get(&ends).is_none_or(|&count| count == 0)
    }
}
