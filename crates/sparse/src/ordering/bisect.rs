//! Bisection of a part from scratch.
//!
//! The vertices are sorted by the difference of their distances to two vertices that are far
//! apart. The best cut in this sequence of level sets yields a separator, which is then refined.
//! Several pairs are tried.

use std::sync::atomic::AtomicU32;

use super::level::{Level, get, put, shared};
use super::refine::{Effort, Labelled, Nodes, Workspace, badness, refine};
use super::tree::Tree;

/// The labels of a part that was split: the separator and its two sides.
pub(super) const SEPARATOR: u32 = 0;
pub(super) const LEFT: u32 = 1;
pub(super) const RIGHT: u32 = 2;

/// Working memory of bisections, reused from one to the next.
pub(super) struct Bisector {
    total: u64,
    tree: Tree,
    space: Workspace,
}

impl Bisector {
    /// Creates a bisector for parts of a graph with this total weight.
    pub(super) fn new(total: u64) -> Self {
        Self {
            total,
            tree: Tree::above(&Tree::leaf(), &Tree::leaf()),
            space: Workspace::default(),
        }
    }

    /// Creates one for another thread.
    pub(super) fn another(&self) -> Self {
        Self::new(self.total)
    }

    /// Returns a label for every vertex; `None` if no separator is worthwhile.
    pub(super) fn bisect(&mut self, part: &Level) -> Option<Vec<u32>> {
        if part.num_vertices() < 4 {
            return None;
        }
        let first = distances(part, 0);
        if first.order.len() < part.num_vertices() {
            return self.bisect_components(part);
        }
        let (_, labels) = self.bisect_connected(part, first)?;
        Some(labels)
    }

    /// Bisects a connected part, using the best of a few tries.
    fn bisect_connected(&mut self, part: &Level, first: Distances) -> Option<(f64, Vec<u32>)> {
        let slots = shared(part.num_vertices(), super::level::NONE);
        let n = part.num_vertices();
        let share = part.total_weight() as f64 / self.total as f64;
        let tries = if share > LARGE_SHARE { 6 } else { 1 };
        let first = if share > LARGE_SHARE {
            distances(part, first.farthest())
        } else {
            first
        };
        let mut best: Option<(f64, Vec<u32>)> = None;
        let mut from_a = first;
        for k in 0..tries {
            // The first start is the first vertex, which in breadth-first order lies at an end of
            // the part; the others lie anywhere.
            if k > 0 {
                from_a = distances(part, from_a.order[n * k / tries]);
            }
            let from_b = distances(part, from_a.farthest());
            if let Some((found, labels)) = self.cut(part, &from_a, &from_b, &slots)
                && best.as_ref().is_none_or(|(b, _)| found < *b)
            {
                best = Some((found, labels));
            }
        }
        best.filter(|(_, labels)| is_worth_it(part, labels))
    }

    /// Cuts between the two ends and refines the separator.
    fn cut(
        &mut self,
        part: &Level,
        a: &Distances,
        b: &Distances,
        slots: &[AtomicU32],
    ) -> Option<(f64, Vec<u32>)> {
        let n = part.num_vertices();
        let shift = n as u32;
        let ends = a.of.iter().zip(&b.of);
        let keys: Vec<u32> = ends.map(|(a, b)| a + shift - b).collect();
        let key = |v: u32| keys[v as usize];
        let mut low = u32::MAX;
        let mut high = 0;
        for v in 0..n as u32 {
            low = low.min(key(v));
            high = high.max(key(v));
        }
        // For the cut before key c, the right side has the keys from c on, and the separator
        // consists of the vertices below c with a neighbour at or above c.
        let len = (high - low + 2) as usize;
        let mut below = vec![0u64; len + 1];
        let mut change = vec![0i64; len + 1];
        for v in 0..n as u32 {
            let own = (key(v) - low) as usize;
            let weight = part.weight(v);
            below[own + 1] += u64::from(weight);
            let top = part.ring(v).iter().map(|&u| (key(u) - low) as usize).max();
            if let Some(top) = top.filter(|&top| top > own) {
                change[own + 1] += i64::from(weight);
                change[top + 1] -= i64::from(weight);
            }
        }
        let total = part.total_weight();
        let mut best = (f64::INFINITY, 0);
        let (mut left, mut separator) = (0, 0i64);
        for c in 1..len {
            left += below[c];
            separator += change[c];
            let width = separator.max(0) as u64;
            let found = badness(width, left.saturating_sub(width), total - left);
            if found < best.0 {
                best = (found, c);
            }
        }
        if best.1 == 0 {
            return None;
        }
        let cut = low + best.1 as u32;
        let labels = shared(n, RIGHT);
        let mut members = vec![Vec::new(); 3];
        let mut weights = [0u64; 3];
        for v in 0..n as u32 {
            let label = if key(v) >= cut {
                RIGHT
            } else if key(v) + 2 >= cut && part.ring(v).iter().any(|&u| key(u) >= cut) {
                // Keys of neighbours differ by at most 2.
                members[0].push(v);
                SEPARATOR
            } else {
                LEFT
            };
            put(&labels, v, label);
            weights[label as usize] += u64::from(part.weight(v));
        }
        let labelled = Labelled {
            level: part,
            tree: &self.tree,
            effort: EFFORT,
            labels: &labels,
            slots,
        };
        let mut nodes = Nodes {
            weights: &mut weights,
            members: &mut members,
        };
        let found = refine(&labelled, 0, &mut nodes, &mut self.space);
        Some((found, (0..n as u32).map(|v| get(&labels, v)).collect()))
    }

    /// Splits a part of several components between them. A component is cut only if it makes up
    /// nearly all of the part, in which case the others fill the lighter side.
    fn bisect_components(&mut self, part: &Level) -> Option<Vec<u32>> {
        let components = components(part);
        let weigh = |c: &Vec<u32>| c.iter().map(|&v| u64::from(part.weight(v))).sum::<u64>();
        let mut by_weight: Vec<(u64, Vec<u32>)> =
            components.into_iter().map(|c| (weigh(&c), c)).collect();
        by_weight.sort_by_key(|c| std::cmp::Reverse(c.0));
        let mut labels = vec![LEFT; part.num_vertices()];
        let mut sides = [0u64; 2];
        let mut rest = &by_weight[..];
        if let Some((weight, largest)) = by_weight.first()
            && *weight as f64 > LARGE_COMPONENT * part.total_weight() as f64
        {
            rest = &rest[1..];
            let all_labels = shared(part.num_vertices(), 1);
            for &v in largest {
                put(&all_labels, v, 0);
            }
            let slots = shared(part.num_vertices(), 0);
            let inner = part.part(largest, 0, &all_labels, &slots);
            let first = distances(&inner, 0);
            let (_, inner_labels) = self.bisect_connected(&inner, first)?;
            for (i, &v) in largest.iter().enumerate() {
                labels[v as usize] = inner_labels[i];
                match inner_labels[i] {
                    LEFT => sides[0] += u64::from(part.weight(v)),
                    RIGHT => sides[1] += u64::from(part.weight(v)),
                    _ => {}
                }
            }
        }
        for (weight, component) in rest {
            let side = usize::from(sides[1] < sides[0]);
            sides[side] += weight;
            for &v in component {
                labels[v as usize] = [LEFT, RIGHT][side];
            }
        }
        Some(labels)
    }
}

/// Returns `true` if a separator is narrow, and both sides are large enough for a recursion over
/// them to terminate soon.
fn is_worth_it(part: &Level, labels: &[u32]) -> bool {
    let mut weights = [0u64; 3];
    for (&label, &weight) in labels.iter().zip(&part.weights) {
        weights[label as usize] += u64::from(weight);
    }
    let total = part.total_weight() as f64;
    let [separator, left, right] = weights.map(|weight| weight as f64 / total);
    separator < WORST_SEPARATOR && left.min(right) > SMALLEST_SIDE
}

/// Breadth-first distances from one vertex.
struct Distances {
    /// The number of edges to each reachable vertex.
    of: Vec<u32>,
    /// The reachable vertices, nearest first.
    order: Vec<u32>,
}

impl Distances {
    fn farthest(&self) -> u32 {
        self.order.last().copied().unwrap_or(0)
    }
}

fn distances(part: &Level, start: u32) -> Distances {
    let mut of = vec![super::level::NONE; part.num_vertices()];
    let mut order = Vec::with_capacity(part.num_vertices());
    spread(part, start, &mut of, &mut order);
    Distances { of, order }
}

/// Appends all vertices that are reachable from `start` and have no distance yet.
fn spread(part: &Level, start: u32, of: &mut [u32], order: &mut Vec<u32>) {
    let mut next = order.len();
    of[start as usize] = 0;
    order.push(start);
    while let Some(&v) = order.get(next) {
        next += 1;
        let distance = of[v as usize] + 1;
        for &u in part.ring(v) {
            if of[u as usize] == super::level::NONE {
                of[u as usize] = distance;
                order.push(u);
            }
        }
    }
}

fn components(part: &Level) -> Vec<Vec<u32>> {
    let mut of = vec![super::level::NONE; part.num_vertices()];
    let mut order = Vec::with_capacity(part.num_vertices());
    let mut components = Vec::new();
    for v in 0..part.num_vertices() as u32 {
        if of[v as usize] == super::level::NONE {
            let start = order.len();
            spread(part, v, &mut of, &mut order);
            components.push(order[start..].to_vec());
        }
    }
    components
}

/// Parts with more than this share of the whole graph are worth several tries.
const LARGE_SHARE: f64 = 0.05;
/// A separator found here is refined again on the finer levels.
const EFFORT: Effort = Effort {
    patience: 0.5,
    passes: 4,
};
/// A separator with more than this share of its part is not worthwhile.
const WORST_SEPARATOR: f64 = 0.4;
/// A side needs at least this share of its part.
const SMALLEST_SIDE: f64 = 0.05;
/// A component with more than this share of its part is split.
const LARGE_COMPONENT: f64 = 0.75;
