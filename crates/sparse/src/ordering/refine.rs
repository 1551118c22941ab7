//! Refinement of a separator by the moves of Fiduccia and Mattheyses (1982), in the form for
//! vertex separators (Ashcraft and Liu 1997).
//!
//! A move takes a vertex out of the separator to one side and pulls its neighbours on the other
//! side into the separator. The best move is made even if it makes the separator temporarily
//! worse. In the end, all moves after the best state seen are undone.

use std::collections::BinaryHeap;
use std::ops::Range;
use std::sync::atomic::AtomicU32;

use super::level::{Level, NONE, get, put};
use super::tree::Tree;

/// The cost of a separator: its weight, unless the sides are very uneven.
///
/// Among separators of equal weight, the more balanced one is better.
pub(super) fn badness(separator: u64, left: u64, right: u64) -> f64 {
    if left == 0 || right == 0 {
        return f64::INFINITY;
    }
    let unevenness = left.abs_diff(right) as f64 / (left + right) as f64;
    let excess = (unevenness - FREE_UNEVENNESS).max(0.0);
    separator as f64 * (1.0 + 100.0 * excess * excess) + 0.1 * unevenness
}

/// The effort of a refinement.
#[derive(Clone, Copy)]
pub(super) struct Effort {
    /// Maximum number of moves per pass without improvement, as a fraction of the separator's
    /// size.
    pub(super) patience: f64,
    /// Maximum number of passes over one separator.
    pub(super) passes: usize,
}

/// The labelled graph, shared by the refinement of all separators.
pub(super) struct Labelled<'a> {
    pub(super) level: &'a Level,
    pub(super) tree: &'a Tree,
    pub(super) effort: Effort,
    /// The tree node of each vertex.
    pub(super) labels: &'a [AtomicU32],
    /// Working memory: `NONE` everywhere between calls.
    pub(super) slots: &'a [AtomicU32],
}

/// The data of the nodes below one node, including itself.
pub(super) struct Nodes<'a> {
    /// The weight of the vertices with each label.
    pub(super) weights: &'a mut [u64],
    /// A superset of the vertices of each separator; some may have left it.
    pub(super) members: &'a mut [Vec<u32>],
}

/// Working memory of the refinement, reused from one separator to the next.
#[derive(Default)]
pub(super) struct Workspace {
    vertices: Vec<u32>,
    /// The weight that moving the vertex would pull into the separator.
    pulls: Vec<u32>,
    locked: Vec<bool>,
    /// The gain and slot of each move, packed: see [`pack`].
    offers: BinaryHeap<u64>,
    /// Vertex, label before, label after.
    log: Vec<(u32, u32, u32)>,
    pulled: Vec<u32>,
}

/// Refines the separator t in passes to alternating sides until neither improves it.
pub(super) fn refine(
    labelled: &Labelled<'_>,
    t: u32,
    nodes: &mut Nodes<'_>,
    space: &mut Workspace,
) -> f64 {
    let mut search = Search::new(labelled, t, nodes, space);
    let mut badness = search.badness();
    let mut failures = 0;
    for _ in 0..labelled.effort.passes {
        search.pass();
        search.side = 1 - search.side;
        let after = search.badness();
        failures = if after < badness { 0 } else { failures + 1 };
        badness = after;
        if failures == 2 {
            break;
        }
    }
    badness
}

/// The refinement of one separator.
struct Search<'a, 'b> {
    graph: &'a Labelled<'a>,
    t: u32,
    /// The first label of the right side, and one past the last.
    right: u32,
    end: u32,
    /// The weights of the separator, the left and the right side.
    separator: u64,
    sides: [u64; 2],
    /// The side to which vertices move in this pass: 0 is left, 1 right.
    side: usize,
    /// The labels on the side to which vertices move, and on the side from which they are pulled.
    near: Range<u32>,
    far: Range<u32>,
    nodes: &'a mut Nodes<'b>,
    space: &'a mut Workspace,
}

impl<'a, 'b> Search<'a, 'b> {
    fn new(
        graph: &'a Labelled<'a>,
        t: u32,
        nodes: &'a mut Nodes<'b>,
        space: &'a mut Workspace,
    ) -> Self {
        let (right, end) = (graph.tree.right(t), graph.tree.end(t));
        let split = (right - t) as usize;
        let sides = [
            nodes.weights[1..split].iter().sum(),
            nodes.weights[split..].iter().sum(),
        ];
        Self {
            graph,
            t,
            right,
            end,
            separator: nodes.weights[0],
            sides,
            side: usize::from(sides[0] > sides[1]),
            near: 0..0,
            far: 0..0,
            nodes,
            space,
        }
    }

    fn badness(&self) -> f64 {
        badness(self.separator, self.sides[0], self.sides[1])
    }

    /// Moves vertices as long as it seems promising, then returns to the best state.
    fn pass(&mut self) {
        (self.near, self.far) = (self.t + 1..self.right, self.right..self.end);
        if self.side == 1 {
            std::mem::swap(&mut self.near, &mut self.far);
        }
        self.start();
        let size = self.space.vertices.len();
        let patience =
            3.0 + self.graph.effort.patience * size as f64 * (size as f64 / 40.0).min(2.0);
        let patience = patience.min(MAX_PATIENCE) as usize;
        let mut best = (self.badness(), 0);
        let mut moves_since_best = 0;
        while let Some(v) = self.best_move() {
            self.make(v);
            moves_since_best += 1;
            // The badness is at least the separator's weight, which suffices to judge most moves.
            if (self.separator as f64) < best.0 && self.badness() < best.0 {
                best = (self.badness(), self.space.log.len());
                moves_since_best = 0;
            } else if moves_since_best > patience {
                break;
            }
        }
        while self.space.log.len() > best.1 {
            if let Some((v, before, after)) = self.space.log.pop() {
                self.relabel(v, after, before);
            }
        }
        self.stop();
    }

    fn start(&mut self) {
        self.space.log.clear();
        let members = std::mem::take(&mut self.nodes.members[0]);
        for &v in &members {
            if get(self.graph.labels, v) == self.t && get(self.graph.slots, v) == NONE {
                self.add_slot(v);
            }
        }
        self.nodes.members[0] = members;
        let mut offers = std::mem::take(&mut self.space.offers).into_vec();
        offers.clear();
        for slot in 0..self.space.vertices.len() as u32 {
            let pulls = self.count_pulls(self.space.vertices[slot as usize]);
            self.space.pulls[slot as usize] = pulls;
            offers.push(pack(self.gain(slot), slot));
        }
        self.space.offers = offers.into();
    }

    fn add_slot(&mut self, v: u32) {
        put(self.graph.slots, v, self.space.vertices.len() as u32);
        self.space.vertices.push(v);
        self.space.pulls.push(0);
        self.space.locked.push(false);
    }

    fn count_pulls(&self, v: u32) -> u32 {
        let level = self.graph.level;
        let far = self.far.clone();
        let ring = level.ring(v).iter();
        let pulled = ring.filter(|&&u| far.contains(&get(self.graph.labels, u)));
        pulled.map(|&u| level.weight(u)).sum()
    }

    /// The decrease of the separator's weight if the vertex moves.
    fn gain(&self, slot: u32) -> i64 {
        let weight = self.graph.level.weight(self.space.vertices[slot as usize]);
        i64::from(weight) - i64::from(self.space.pulls[slot as usize])
    }

    /// Adds a move to the heap; offers with outdated gains are skipped when popped.
    fn offer(&mut self, slot: u32) {
        if !self.space.locked[slot as usize] {
            let offer = pack(self.gain(slot), slot);
            self.space.offers.push(offer);
        }
    }

    /// Pops the best current move that leaves some weight on the far side.
    fn best_move(&mut self) -> Option<u32> {
        while let Some(offer) = self.space.offers.pop() {
            let slot = offer as u32;
            let pulls = u64::from(self.space.pulls[slot as usize]);
            let v = self.space.vertices[slot as usize];
            if !self.space.locked[slot as usize]
                && offer == pack(self.gain(slot), slot)
                && pulls < self.sides[1 - self.side]
            {
                self.space.locked[slot as usize] = true;
                return Some(v);
            }
        }
        None
    }

    /// Moves v out of the separator.
    fn make(&mut self, v: u32) {
        let graph = self.graph;
        let ring = graph.level.ring(v);
        let (near, far) = (self.near.clone(), self.far.clone());
        let home = if graph.tree.is_leaf(near.start) {
            near.start
        } else {
            let around = ring.iter().map(|&u| get(graph.labels, u));
            let inside = around.filter(|label| near.contains(label));
            graph.tree.home(near.start, inside)
        };
        self.space.log.push((v, self.t, home));
        self.relabel(v, self.t, home);
        let mut pulled = std::mem::take(&mut self.space.pulled);
        for &u in ring {
            let label = get(graph.labels, u);
            if far.contains(&label) {
                self.space.log.push((u, label, self.t));
                self.relabel(u, label, self.t);
                if get(graph.slots, u) == NONE {
                    self.add_slot(u);
                }
                pulled.push(u);
            }
        }
        for &u in &pulled {
            self.take_in(u);
        }
        pulled.clear();
        self.space.pulled = pulled;
    }

    /// Updates a vertex that was pulled in: it is no longer pulled by others, and can itself
    /// move.
    fn take_in(&mut self, u: u32) {
        let graph = self.graph;
        let far = self.far.clone();
        let mut pulls = 0;
        for &x in graph.level.ring(u) {
            let label = get(graph.labels, x);
            if label == self.t {
                let slot = get(graph.slots, x);
                let old = self.space.pulls[slot as usize];
                self.space.pulls[slot as usize] = old.saturating_sub(graph.level.weight(u));
                self.offer(slot);
            } else if far.contains(&label) {
                pulls += graph.level.weight(x);
            }
        }
        let slot = get(graph.slots, u);
        self.space.pulls[slot as usize] = pulls;
        self.offer(slot);
    }

    fn relabel(&mut self, v: u32, before: u32, after: u32) {
        let weight = u64::from(self.graph.level.weight(v));
        put(self.graph.labels, v, after);
        self.nodes.weights[(before - self.t) as usize] -= weight;
        self.nodes.weights[(after - self.t) as usize] += weight;
        *self.total(before) -= weight;
        *self.total(after) += weight;
    }

    /// The weight of the separator or of the side that contains a label.
    fn total(&mut self, label: u32) -> &mut u64 {
        if label == self.t {
            &mut self.separator
        } else {
            &mut self.sides[usize::from(label >= self.right)]
        }
    }

    /// Clears the slots and updates the members of all separators.
    fn stop(&mut self) {
        let space = &mut *self.space;
        let members = &mut *self.nodes.members;
        members[0].clear();
        for &v in &space.vertices {
            put(self.graph.slots, v, NONE);
            let label = get(self.graph.labels, v);
            if !self.graph.tree.is_leaf(label) {
                members[(label - self.t) as usize].push(v);
            }
        }
        space.vertices.clear();
        space.pulls.clear();
        space.locked.clear();
    }
}

/// Packs an offer into a number. Offers with a higher gain are greater; among equals, the later
/// slot is.
fn pack(gain: i64, slot: u32) -> u64 {
    let gain = gain.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) - i64::from(i32::MIN);
    (gain as u64) << 32 | u64::from(slot)
}

/// Maximum number of moves per pass without improvement.
const MAX_PATIENCE: f64 = 300.0;
/// Sides of 65 : 35 are as good as even ones.
const FREE_UNEVENNESS: f64 = 0.3;
