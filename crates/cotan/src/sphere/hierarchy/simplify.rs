//! Simplification to a tetrahedron, level by level.

use crate::sphere::corners::{face_of, prev};
use crate::sphere::layout::{Layout, upright};

/// The data for rebuilding the whole mesh from a tetrahedron.
#[derive(Clone, Debug, Default)]
pub(in crate::sphere) struct Hierarchy {
    /// For each level, its collapsed halfedges in order.
    pub(in crate::sphere) levels: Vec<Vec<u32>>,
    /// The vertices that were never removed, followed by those that were reinserted.
    pub(in crate::sphere) left: Vec<u32>,
    /// The face weights that collapses overwrote, in the order of the collapses.
    pub(super) weights: Vec<f64>,
}

/// The collapses that simplification may perform.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(in crate::sphere) enum Collapses {
    /// All collapses that leave a triangulated sphere, down to a tetrahedron.
    Any,
    /// Collapses after which all faces are upright at the current positions, as far down as they
    /// go.
    Upright,
}

impl Collapses {
    fn allow(self, layout: &Layout, halfedge: u32) -> bool {
        self == Self::Any || flips_after(layout, halfedge) == 0
    }

    /// The smallest number of collapses that makes a level worthwhile.
    fn least(self, left: usize) -> usize {
        match self {
            Self::Any => 1,
            Self::Upright => 1 + left / 50,
        }
    }
}

/// The number of changed faces that are not upright after a collapse.
pub(in crate::sphere) fn flips_after(layout: &Layout, halfedge: u32) -> usize {
    let table = &layout.table;
    let lost = table.lost_faces(halfedge);
    let at = |v: u32| layout.place[v as usize];
    let target = at(table.target(halfedge));
    let changed = table
        .outgoing_from(halfedge)
        .filter(|&h| !lost.contains(&face_of(h)));
    changed
        .filter(|&h| !upright(&target, &at(table.target(h)), &at(table.origin(prev(h)))))
        .count()
}

/// Collapses edges of the layout until four vertices are left or no further level is worthwhile.
/// Face weights are transferred to the remaining faces.
pub(in crate::sphere) fn simplify(layout: &mut Layout, which: Collapses) -> Hierarchy {
    let mut hierarchy = Hierarchy {
        left: (0..layout.table.num_vertices() as u32).collect(),
        ..Hierarchy::default()
    };
    let mut gone = vec![false; hierarchy.left.len()];
    while hierarchy.left.len() > 4 {
        let least = which.least(hierarchy.left.len());
        let level = hierarchy.take_level(layout, &mut gone, which);
        let enough = level.len() >= least;
        hierarchy.levels.push(level);
        hierarchy.left.retain(|&v| !gone[v as usize]);
        if !enough {
            break;
        }
    }
    hierarchy
}

impl Hierarchy {
    /// Removes independent vertices from those that represent the least area.
    fn take_level(&mut self, layout: &mut Layout, gone: &mut [bool], which: Collapses) -> Vec<u32> {
        let mut candidates: Vec<(f64, u32)> = self
            .left
            .iter()
            .map(|&v| (star_weight(layout, v), v))
            .collect();
        candidates.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let wanted = (self.left.len() * 2 / 3).max(FEW);
        let mut locked = vec![false; gone.len()];
        let mut level = Vec::new();
        for (i, &(_, v)) in candidates.iter().enumerate() {
            if self.left.len() - level.len() <= 4 || (i >= wanted && !level.is_empty()) {
                break;
            }
            if locked[v as usize] || layout.table.valence(v) > MAX_VALENCE {
                continue;
            }
            let Some(halfedge) = best_collapse(layout, v, which) else {
                continue;
            };
            for w in layout.table.ring(v) {
                locked[w as usize] = true;
            }
            self.take_out(layout, halfedge);
            gone[v as usize] = true;
            level.push(halfedge);
        }
        level
    }

    /// Collapses `halfedge` and distributes the weight of the faces around its origin to the
    /// remaining faces, mostly in proportion to their new areas.
    pub(in crate::sphere) fn take_out(&mut self, layout: &mut Layout, halfedge: u32) {
        let lost = layout.table.lost_faces(halfedge);
        let v = layout.table.origin(halfedge);
        let total = star_weight(layout, v);
        let faces: Vec<usize> = layout
            .table
            .outgoing_from(halfedge)
            .map(face_of)
            .filter(|f| !lost.contains(f))
            .collect();
        layout.table.collapse(halfedge);
        let areas: Vec<f64> = faces.iter().map(|&f| source_area(layout, f)).collect();
        let sum: f64 = areas.iter().sum();
        for (&face, area) in faces.iter().zip(areas) {
            let even = 1.0 / faces.len() as f64;
            let share = if sum > 0.0 { area / sum } else { even };
            self.weights.push(layout.rest[face].weight);
            layout.rest[face].weight = total * ((1.0 - EVEN) * share + EVEN * even);
        }
    }
}

/// The area represented by the faces around a vertex.
fn star_weight(layout: &Layout, v: u32) -> f64 {
    let faces = layout.table.outgoing(v).map(face_of);
    faces.map(|f| layout.rest[f].weight).sum()
}

/// The valid collapse of `v` that leaves the best triangles.
fn best_collapse(layout: &Layout, v: u32, which: Collapses) -> Option<u32> {
    let legal = |h: &u32| layout.table.may_collapse(*h) && which.allow(layout, *h);
    let costs = layout
        .table
        .outgoing(v)
        .filter(legal)
        .map(|h| (cost(layout, h), h));
    costs
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, halfedge)| halfedge)
}

/// The worst ratio of squared sides to area among the triangles that a collapse creates,
/// increased for targets with many edges.
pub(in crate::sphere) fn cost(layout: &Layout, halfedge: u32) -> f64 {
    let table = &layout.table;
    let target = table.target(halfedge);
    let lost = table.lost_faces(halfedge);
    let u = layout.source[target as usize];
    let faces = table
        .outgoing_from(halfedge)
        .filter(|&h| !lost.contains(&face_of(h)));
    let worst = faces.map(|h| {
        let p = layout.source[table.target(h) as usize] - u;
        let q = layout.source[table.origin(prev(h)) as usize] - u;
        let squares = p.norm_squared() + q.norm_squared() + (q - p).norm_squared();
        squares / p.cross(&q).norm().max(f64::MIN_POSITIVE)
    });
    let crowd = f64::from(table.valence(target)) / CROWDED;
    worst.fold(0.0, f64::max).min(f64::MAX.sqrt()) * crowd.max(1.0).powi(4)
}

/// Twice the area of a face in the source.
fn source_area(layout: &Layout, face: usize) -> f64 {
    let [a, b, c] = layout
        .table
        .triangle(face)
        .map(|v| layout.source[v as usize]);
    (b - a).cross(&(c - a)).norm()
}

/// Vertices with more edges are skipped for now; there is always one with at most five.
const MAX_VALENCE: u32 = 9;
/// Vertices with at least this valence are poor targets.
const CROWDED: f64 = 8.0;
/// Levels with fewer vertices are not selected by area.
const FEW: usize = 16;
/// The fraction of the weight that is distributed evenly, so that every face gets some.
const EVEN: f64 = 0.1;
