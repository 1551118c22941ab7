//! Recutting of polygons whose diagonals would meet edges or diagonals of other faces.
//!
//! Two polygons that share two corners which are adjacent in neither of them (two quads with two
//! common edges, a *doublet*, and any chain of such) must not both be cut there. Nor may a
//! polygon be cut where another face has an edge, because that edge would have three or four
//! triangles. Polygons without such a conflict keep the triangulation that each has on its own
//! ([`Triangulator`]).
//!
//! The others are recut in two steps. First, polygons of up to [`MAX_CORNERS`] corners that
//! could share a diagonal, directly or through others, are solved together. The candidates of
//! each polygon are all its triangulations, and a search with propagation and backtracking
//! selects one for each, so that no edge is used twice. It finds a solution if there is one,
//! within [`BUDGET`] steps; beyond that, the remaining polygons are cut as well as possible. For
//! quads this is 2-SAT, and propagation alone nearly always suffices. Second, larger polygons
//! that pass through no place twice are cut one at a time around everything else: optimally up to
//! [`MAX_OPTIMAL`](large::MAX_OPTIMAL) corners, beyond that by clipping ears.
//!
//! The result depends on the vertex indices of the polygons and on their first corners, but not
//! on the order of the faces.
//!
//! The files of this folder are one concept and use each other freely.

mod choices;
mod conflicts;
mod large;
mod search;

use cotan_halfedge::DisjointSets;
use nalgebra::Point3;

use crate::faces::FaceList;
use crate::triangulate::Triangulator;
use choices::{Choice, choices};
use conflicts::Conflicts;
use search::Problem;

/// Maximum number of corners of a polygon for which all triangulations are considered: 132 for
/// eight.
const MAX_CORNERS: usize = 8;

/// Maximum number of search steps over all polygons; a step blocks or frees one choice of one
/// polygon. Takes a few seconds.
const BUDGET: usize = 1 << 27;

/// Polygons with at least this many corners that pass through a place twice are not recut.
const LONG: usize = 1 << 12;

/// The polygons of a mesh as seen by the search, with vertices that may be welded.
#[derive(Clone, Copy)]
pub(crate) struct Polygons<'a> {
    /// The corners of every face; fewer than three for one that encloses nothing.
    pub(crate) faces: &'a FaceList,
    /// For each vertex, the first vertex at its place; empty if none are welded.
    pub(crate) places: &'a [u32],
    pub(crate) positions: &'a [Point3<f64>],
}

impl<'a> Polygons<'a> {
    fn place(&self, vertex: u32) -> u32 {
        let place = self.places.get(vertex as usize);
        place.copied().unwrap_or(vertex)
    }

    /// The places at two corners of a polygon, in ascending order.
    fn ends(&self, polygon: &[u32], i: usize, j: usize) -> [u32; 2] {
        let (a, b) = (self.place(polygon[i]), self.place(polygon[j]));
        [a.min(b), a.max(b)]
    }

    /// The places at the ends of the sides of a polygon.
    fn sides(&self, polygon: &'a [u32]) -> impl Iterator<Item = [u32; 2]> {
        let n = polygon.len();
        (0..n).map(move |i| self.ends(polygon, i, (i + 1) % n))
    }

    /// Returns `true` if a polygon is so long and tangled that its cut is not considered, since
    /// that would take seconds and there is no surface in any case.
    fn is_hopeless(&self, polygon: &[u32]) -> bool {
        polygon.len() > LONG && self.repeats(polygon)
    }

    /// Returns `true` if a polygon passes through a place twice.
    fn repeats(&self, polygon: &[u32]) -> bool {
        let mut places: Vec<u32> = polygon.iter().map(|&v| self.place(v)).collect();
        places.sort_unstable();
        places.windows(2).any(|pair| pair[0] == pair[1])
    }

    fn polygon(&self, face: u32) -> &'a [u32] {
        self.faces.get(face as usize).unwrap_or_default()
    }
}

/// The polygons that are not cut as each would be on its own.
#[derive(Clone, Debug, Default)]
pub(crate) struct Recuts {
    /// The faces in ascending order, each with the end of its triangles.
    faces: Vec<(u32, u32)>,
    /// The triangles, as 0-based corners of the polygon.
    triangles: Vec<[usize; 3]>,
}

impl Recuts {
    pub(crate) fn new(polygons: Polygons<'_>) -> Self {
        let mut recuts = Self::default();
        if polygons.faces.iter().all(|polygon| polygon.len() <= 3) {
            return recuts;
        }
        let conflicts = Conflicts::new(polygons, &recuts);
        if conflicts.faces.is_empty() {
            return recuts;
        }
        recuts = small(polygons, &conflicts);
        let conflicts = match recuts.is_empty() {
            true => conflicts,
            false => Conflicts::new(polygons, &recuts),
        };
        let is_large = |face: &u32| {
            let polygon = polygons.polygon(*face);
            polygon.len() > MAX_CORNERS && !polygons.repeats(polygon)
        };
        let found: Vec<u32> = conflicts.faces.into_iter().filter(is_large).collect();
        if !found.is_empty() {
            recuts = large::recut(polygons, &found, recuts);
        }
        recuts
    }

    /// Returns `true` if every polygon is cut as it would be on its own.
    pub(crate) fn is_empty(&self) -> bool {
        self.faces.is_empty()
    }

    fn get(&self, face: u32) -> Option<&[[usize; 3]]> {
        if self.is_empty() {
            return None;
        }
        let at = self.faces.binary_search_by_key(&face, |&(f, _)| f).ok()?;
        let start = at.checked_sub(1).map_or(0, |before| self.faces[before].1);
        let end = self.faces[at].1;
        self.triangles.get(start as usize..end as usize)
    }

    fn from_sorted(list: impl IntoIterator<Item = (u32, Vec<[usize; 3]>)>) -> Self {
        let mut recuts = Self::default();
        for (face, triangles) in list {
            recuts.triangles.extend(triangles);
            recuts.faces.push((face, recuts.triangles.len() as u32));
        }
        recuts
    }
}

/// Cuts the polygons of a mesh, taking the others into account.
pub(crate) struct Cutter<'a> {
    triangulator: Triangulator<'a>,
    recuts: &'a Recuts,
}

impl<'a> Cutter<'a> {
    pub(crate) fn new(
        positions: &'a [Point3<f64>],
        num_corners: usize,
        recuts: &'a Recuts,
    ) -> Self {
        Self {
            triangulator: Triangulator::new(positions, num_corners),
            recuts,
        }
    }

    /// Cuts the polygon of a face, given by indices of positions.
    pub(crate) fn cut(&mut self, face: u32, polygon: &[u32], mut triangle: impl FnMut([u32; 3])) {
        self.cut_corners(face, polygon, |corners| {
            triangle(corners.map(|i| polygon[i]));
        });
    }

    /// Cuts the polygon of a face into triangles of its 0-based corners.
    fn cut_corners(&mut self, face: u32, polygon: &[u32], triangle: impl FnMut([usize; 3])) {
        match self.recuts.get(face) {
            Some(triangles) => triangles.iter().copied().for_each(triangle),
            None => self.triangulator.cut_corners(polygon, triangle),
        }
    }

    /// Visits the diagonals of a polygon's cut, by their corners.
    fn diagonals(&mut self, face: u32, polygon: &[u32], mut found: impl FnMut(usize, usize)) {
        let n = polygon.len();
        if n <= 3 {
            return;
        }
        // Each diagonal belongs to two triangles, which traverse it in opposite directions.
        self.cut_corners(face, polygon, |[a, b, c]| {
            for (i, j) in [(a, b), (b, c), (c, a)] {
                if i + 1 < j && j - i + 1 < n {
                    found(i, j);
                }
            }
        });
    }
}

/// Recuts polygons with few corners.
fn small(polygons: Polygons<'_>, conflicts: &Conflicts) -> Recuts {
    let components = components(polygons, conflicts);
    let mut is_marked = vec![false; polygons.positions.len()];
    for &(_, face) in &components {
        for &v in polygons.polygon(face) {
            is_marked[polygons.place(v) as usize] = true;
        }
    }
    let mut edges: Vec<[u32; 2]> = Vec::new();
    let is_near = |ends: &[u32; 2]| ends.iter().all(|&place| is_marked[place as usize]);
    for polygon in polygons.faces.iter() {
        edges.extend(polygons.sides(polygon).filter(is_near));
    }
    edges.sort_unstable();
    edges.dedup();
    let near_large = conflicts.near_large(polygons, is_near);
    let mut triangulator = Triangulator::new(polygons.positions, polygons.faces.num_corners());
    let mut catalogue = choices::Catalogue::default();
    let mut budget = BUDGET;
    let mut recuts: Vec<(u32, Vec<[usize; 3]>)> = Vec::new();
    for component in components.chunk_by(|a, b| a.0 == b.0) {
        let mut variables: Vec<(u32, Vec<Choice>)> = component
            .iter()
            .map(|&(_, face)| {
                let list = choices(
                    polygons,
                    face,
                    &mut triangulator,
                    &mut catalogue,
                    &edges,
                    &near_large,
                );
                (face, list)
            })
            .collect();
        // A polygon without choices cannot be fixed, but its neighbours can.
        variables.retain(|(_, choices)| !choices.is_empty());
        variables.sort_by(|a, b| {
            let regret = choices::by_regret(&a.1, &b.1);
            let corners = |face: u32| polygons.polygon(face);
            regret.then_with(|| (corners(a.0), a.0).cmp(&(corners(b.0), b.0)))
        });
        let problem = Problem::new(variables.iter().map(|(_, choices)| choices.as_slice()));
        let solution = problem.solve(&mut budget);
        for ((face, choices), taken) in variables.iter().zip(solution) {
            let Some(choice) = taken.and_then(|taken| choices.get(taken)) else {
                continue;
            };
            if !choice.is_default {
                recuts.push((*face, choice.triangles.clone()));
            }
        }
    }
    recuts.sort_unstable_by_key(|(face, _)| *face);
    Recuts::from_sorted(recuts)
}

/// Finds the polygons with few corners that could share a diagonal with one in conflict, directly
/// or through others. Returns each with the index of its set, grouped by set.
fn components(polygons: Polygons<'_>, conflicts: &Conflicts) -> Vec<(u32, u32)> {
    let is_small = |polygon: &[u32]| (4..=MAX_CORNERS).contains(&polygon.len());
    let mut diagonals: Vec<([u32; 2], u32)> = Vec::new();
    for (face, polygon) in (0u32..).zip(polygons.faces.iter()) {
        let n = polygon.len();
        if !is_small(polygon) {
            continue;
        }
        for i in 0..n - 2 {
            let last = if i == 0 { n - 1 } else { n };
            for j in i + 2..last {
                diagonals.push((polygons.ends(polygon, i, j), face));
            }
        }
    }
    diagonals.sort_unstable();
    let mut sets = DisjointSets::new(polygons.faces.len());
    for shared in diagonals.chunk_by(|a, b| a.0 == b.0) {
        for pair in shared.windows(2) {
            sets.join(pair[0].1, pair[1].1);
        }
    }
    let mut is_asked = vec![false; polygons.faces.len()];
    for &face in &conflicts.faces {
        is_asked[sets.root(face) as usize] = true;
    }
    let mut components = Vec::new();
    for (face, polygon) in (0u32..).zip(polygons.faces.iter()) {
        let root = sets.root(face);
        if is_asked[root as usize] && is_small(polygon) {
            components.push((root, face));
        }
    }
    components.sort_unstable();
    components
}

#[cfg(test)]
mod tests;
