//! The parts that are close to each other, as a connected graph.
//!
//! A part is joined to all parts that are no farther than its nearest one and a bending length
//! more. Clusters that are still separate are joined by Borůvka's method, each to its nearest
//! neighbour. All queries use one tree over all triangles. A query that skips a cluster skips
//! whole subtrees.

use cotan_geometry::{ClosestTree, Marks};
use cotan_halfedge::DisjointSets;
use cotan_parallel as parallel;

use super::model::Model;

/// Two parts that are close.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Link {
    /// The two parts, ascending.
    pub(crate) parts: [u32; 2],
    /// A bound of their distance; the distance itself where one is the other's nearest.
    pub(crate) distance: f64,
    /// For each of the two: true if the other is among its nearest, so that it may follow it.
    pub(crate) sees: [bool; 2],
}

impl Link {
    fn seen(by: u32, other: u32, distance: f64) -> Self {
        Self {
            parts: [by.min(other), by.max(other)],
            distance,
            sees: [by < other, by > other],
        }
    }

    fn seen_also_by(mut self, part: u32) -> Self {
        self.sees[usize::from(part == self.parts[1])] = true;
        self
    }
}

/// Pairs of parts that are never tied, each ascending, and in order.
#[derive(Clone, Default, Debug)]
pub(crate) struct Untied(Vec<[u32; 2]>);

impl Untied {
    pub(crate) fn new(pairs: &[[usize; 2]]) -> Self {
        let mut pairs: Vec<[u32; 2]> = pairs
            .iter()
            .map(|[a, b]| [*a.min(b) as u32, *a.max(b) as u32])
            .collect();
        pairs.sort_unstable();
        pairs.dedup();
        Self(pairs)
    }

    pub(crate) fn contains(&self, a: u32, b: u32) -> bool {
        !self.0.is_empty() && self.0.binary_search(&[a.min(b), a.max(b)]).is_ok()
    }
}

/// The tree over all triangles of a model, labelled by parts.
pub(crate) fn tree(model: &Model) -> ClosestTree {
    let parts = model.parts.iter().enumerate();
    let (triangles, labels): (Vec<[u32; 3]>, Vec<u32>) = parts
        .flat_map(|(p, part)| part.triangles.iter().map(move |t| (*t, p as u32)))
        .unzip();
    ClosestTree::build(&triangles, &labels, &model.positions)
}

/// The links between the parts with `counts`; `reach` is a bending length.
pub(crate) fn links(
    model: &Model,
    tree: &ClosestTree,
    counts: &[bool],
    untied: &Untied,
    reach: f64,
) -> Vec<Link> {
    let finder = Finder {
        model,
        tree,
        untied,
    };
    // Parts that do not count share a mark that every query skips.
    let mut clusters: Vec<u32> = (0..counts.len() as u32).collect();
    for (cluster, counts) in clusters.iter_mut().zip(counts) {
        if !counts {
            *cluster = APART;
        }
    }
    let active: Vec<u32> = (0..counts.len() as u32)
        .filter(|p| counts[*p as usize])
        .collect();
    let marks = tree.marks(clusters.clone());
    let nearest = finder.nearest(&active, &marks);
    let mut links = finder.close(&active, &nearest, &marks, reach);
    let own = |p: &u32| nearest[*p as usize].map(|link| link.seen_also_by(*p));
    links.extend(active.iter().filter_map(own));
    loop {
        let mut roots = DisjointSets::new(counts.len());
        links
            .iter()
            .for_each(|link| roots.join(link.parts[0], link.parts[1]));
        for &p in &active {
            clusters[p as usize] = roots.root(p);
        }
        let first = active.first().map(|p| clusters[*p as usize]);
        if active.iter().all(|p| Some(clusters[*p as usize]) == first) {
            break;
        }
        let marks = tree.marks(clusters.clone());
        let nearest = finder.nearest(&active, &marks);
        // The nearest of each cluster.
        let mut best: Vec<Option<Link>> = vec![None; counts.len()];
        for link in nearest.iter().flatten() {
            for part in link.parts {
                let slot = &mut best[clusters[part as usize] as usize];
                if slot.is_none_or(|best| link.distance < best.distance) {
                    *slot = Some(*link);
                }
            }
        }
        let before = links.len();
        links.extend(best.into_iter().flatten());
        if links.len() == before {
            break;
        }
    }
    links.sort_by(|a, b| {
        a.parts
            .cmp(&b.parts)
            .then(a.distance.total_cmp(&b.distance))
    });
    links.dedup_by(|later, kept| {
        let is_same = later.parts == kept.parts;
        if is_same {
            (0..2).for_each(|k| kept.sees[k] |= later.sees[k]);
        }
        is_same
    });
    links
}

/// The mark of parts that are left out.
pub(crate) const APART: u32 = u32::MAX;

struct Finder<'a> {
    model: &'a Model,
    tree: &'a ClosestTree,
    untied: &'a Untied,
}

/// Parts with more vertices than this are searched one by one.
const LARGE: usize = 4096;

/// A range of the vertices of a part, so that large parts are divided among threads.
pub(super) const STRETCH: usize = 512;

/// Vertices that are left out together where nothing is near their bounding box.
pub(super) const RUN: usize = 16;

impl Finder<'_> {
    /// The vertices of these parts in ranges, with their part.
    fn stretches(&self, parts: &[u32]) -> Vec<(u32, &[u32])> {
        let mut stretches = Vec::new();
        for &p in parts {
            let vertices = &self.model.parts[p as usize].vertices;
            stretches.extend(vertices.chunks(STRETCH).map(|chunk| (p, chunk)));
        }
        stretches
    }

    /// For every part the nearest one with another mark, by distances from its own vertices and
    /// from those of the others.
    fn nearest(&self, parts: &[u32], marks: &Marks) -> Vec<Option<Link>> {
        let mut nearest: Vec<Option<Link>> = vec![None; self.model.parts.len()];
        // Small parts first: large ones then know how near their neighbours are.
        let is_large = |p: &u32| self.model.parts[*p as usize].vertices.len() > LARGE;
        let (large, small): (Vec<u32>, Vec<u32>) = parts.iter().partition(|p| is_large(p));
        for some in std::iter::once(&small[..]).chain(large.chunks(1)) {
            let found = self.nearest_of(some, marks, &nearest);
            for link in found {
                for part in link.parts {
                    let slot = &mut nearest[part as usize];
                    if slot.is_none_or(|known| link.distance < known.distance) {
                        *slot = Some(link);
                    }
                }
            }
        }
        nearest
    }

    /// The parts that are nearer than those known, by distances from their own vertices.
    fn nearest_of(&self, parts: &[u32], marks: &Marks, known: &[Option<Link>]) -> Vec<Link> {
        let found = parallel::tasks(self.stretches(parts), |(part, vertices)| {
            let own = marks.of(part);
            let known = known[part as usize].map(|link| link.distance);
            let (mut reach, mut best) = (known.unwrap_or(f64::INFINITY), None);
            let skips = |least, most| least == most && (least == own || least == APART);
            let counts = |label| !self.untied.contains(part, label);
            for run in vertices.chunks(RUN) {
                let bounds = self.model.bounds(run);
                if !self.tree.may_reach(bounds, reach, marks, skips) {
                    continue;
                }
                for &v in run {
                    let point = self.model.at(v);
                    if let Some(closest) = self.tree.closest(point, reach, marks, skips, counts)
                        && closest.distance < reach
                    {
                        reach = closest.distance;
                        best = Some(Link {
                            sees: [false; 2],
                            ..Link::seen(part, closest.label, reach)
                        });
                    }
                }
            }
            best
        });
        found.into_iter().flatten().collect()
    }

    /// The links to everything that is at most `reach` farther than the nearest part.
    fn close(
        &self,
        parts: &[u32],
        nearest: &[Option<Link>],
        marks: &Marks,
        reach: f64,
    ) -> Vec<Link> {
        let found = parallel::tasks(self.stretches(parts), |(part, vertices)| {
            let Some(link) = nearest[part as usize] else {
                return Vec::new();
            };
            // A few units in the last place more, so that the nearest one itself is included.
            let limit = (link.distance + reach) * (1.0 + 1e-12);
            let mut is_known = vec![false; self.model.parts.len()];
            is_known[part as usize] = true;
            let mut links = Vec::new();
            let skips = |is_known: &[bool], least: u32, most: u32| {
                least == most && (least == APART || is_known[least as usize])
            };
            let counts = |label| !self.untied.contains(part, label);
            for run in vertices.chunks(RUN) {
                let bounds = self.model.bounds(run);
                let skip = |least, most| skips(&is_known, least, most);
                if !self.tree.may_reach(bounds, limit, marks, skip) {
                    continue;
                }
                for &v in run {
                    let point = self.model.at(v);
                    loop {
                        let skip = |least, most| skips(&is_known, least, most);
                        let closest = self.tree.closest(point, limit, marks, skip, counts);
                        let Some(closest) = closest else { break };
                        is_known[closest.label as usize] = true;
                        links.push(Link::seen(part, closest.label, closest.distance));
                    }
                }
            }
            links
        });
        found.into_iter().flatten().collect()
    }
}
