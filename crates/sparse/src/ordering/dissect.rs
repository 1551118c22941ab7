//! Construction of the tree of separators, from the coarsest level to the finest.

use std::sync::atomic::AtomicU32;

use cotan_parallel::{self as parallel, Chunks};

use super::bisect::{Bisector, LEFT, RIGHT, SEPARATOR};
use super::coarsen::{Clustering, Coarsening, coarsen};
use super::count::flops;
use super::leaf::{approximate_minimum_degree, order_leaf};
use super::level::{Level, NONE, get, put, shared};
use super::refine::{Effort, Labelled, Nodes, Workspace, refine};
use super::tree::Tree;

/// Returns a permutation of low fill: entry k is the vertex that is eliminated k-th.
///
/// Returns `None` if minimum degree promises less fill.
pub(super) fn dissect(finest: &Level) -> Option<Vec<u32>> {
    let dissection = Dissection::new(finest, 0, VARIANTS[0])?;
    Some(dissection.order(finest))
}

/// A level with its tree of separators.
struct Dissection {
    tree: Tree,
    /// The tree node of each vertex.
    labels: Vec<AtomicU32>,
}

impl Dissection {
    /// Dissects a level that was coarsened `depth` times; `None` if minimum degree promises less
    /// fill.
    fn new(level: &Level, depth: usize, clustering: Clustering) -> Option<Self> {
        let slots = shared(level.num_vertices(), NONE);
        let (effort, largest) = match depth {
            0 => (FINEST_EFFORT, FINEST_LEAF),
            1 => (FINE_EFFORT, LEAF),
            _ => (EFFORT, LEAF),
        };
        let coarsening = if level.num_vertices() > COARSEST {
            coarsen(level, clustering)
        } else {
            None
        };
        let (tree, labels) = match coarsening {
            None => (Tree::leaf(), shared(level.num_vertices(), 0)),
            Some(coarsening) => {
                let coarse = Self::below(&coarsening, depth + 1, clustering)?;
                let labels = project(&coarsening.cluster_of, &coarse.labels);
                refine_all(level, &coarse.tree, &labels, &slots, effort);
                (coarse.tree, labels)
            }
        };
        let tree = split_leaves(level, tree, &labels, &slots, largest);
        Some(Self { tree, labels })
    }

    /// Dissects the next coarser level. At one depth, several variants are tried from there on,
    /// and the best one is kept.
    ///
    /// The result varies by a few percent with the smallest change of the clusters. Coarse levels
    /// are cheap, so several variants are tried and judged by the flops of the level.
    fn below(coarsening: &Coarsening, depth: usize, clustering: Clustering) -> Option<Self> {
        let level = &coarsening.level;
        if depth != DEPTH_OF_VARIANTS {
            return Self::new(level, depth, clustering);
        }
        let tried = parallel::tasks(VARIANTS.to_vec(), |clustering| {
            let dissection = Self::new(level, depth, clustering)?;
            let flops = flops(level, &dissection.order(level));
            Some((flops, dissection))
        });
        let tried = tried.into_iter().flatten();
        let (least, best) = tried.min_by(|a, b| a.0.total_cmp(&b.0))?;
        if level.num_vertices() >= TELLING {
            let other = flops(level, &approximate_minimum_degree(&level.graph()));
            if other < CLEARLY_LESS * least {
                return None;
            }
        }
        Some(best)
    }

    /// Orders the leaves and puts every separator after the parts that it separates.
    fn order(&self, level: &Level) -> Vec<u32> {
        let slots = shared(level.num_vertices(), NONE);
        assemble(level, &self.tree, &self.labels, &slots)
    }
}

/// Gives every vertex the label of its cluster.
fn project(cluster_of: &[u32], labels: &[AtomicU32]) -> Vec<AtomicU32> {
    let label = |&c: &u32| AtomicU32::new(get(labels, c));
    cluster_of.iter().map(label).collect()
}

/// The vertices of each node, in ascending order.
fn vertices_of_nodes(labels: &[AtomicU32], num_nodes: usize) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0u32; num_nodes + 1];
    for v in 0..labels.len() as u32 {
        starts[get(labels, v) as usize + 1] += 1;
    }
    for t in 0..num_nodes {
        starts[t + 1] += starts[t];
    }
    let mut next = starts.clone();
    let mut vertices = vec![0; labels.len()];
    for v in 0..labels.len() as u32 {
        let next = &mut next[get(labels, v) as usize];
        vertices[*next as usize] = v;
        *next += 1;
    }
    (starts, vertices)
}

/// Refines all separators, parents before children.
fn refine_all(
    level: &Level,
    tree: &Tree,
    labels: &[AtomicU32],
    slots: &[AtomicU32],
    effort: Effort,
) {
    let mut weights = vec![0u64; tree.len()];
    let mut members = vec![Vec::new(); tree.len()];
    for v in 0..level.num_vertices() as u32 {
        let t = get(labels, v);
        weights[t as usize] += u64::from(level.weight(v));
        if !tree.is_leaf(t) {
            members[t as usize].push(v);
        }
    }
    let labelled = Labelled {
        level,
        tree,
        effort,
        labels,
        slots,
    };
    let nodes = Nodes {
        weights: &mut weights,
        members: &mut members,
    };
    refine_below(&labelled, 0, nodes, &mut Workspace::default());
}

fn refine_below(graph: &Labelled<'_>, t: u32, mut nodes: Nodes<'_>, space: &mut Workspace) {
    if graph.tree.is_leaf(t) {
        return;
    }
    refine(graph, t, &mut nodes, space);
    let right = graph.tree.right(t);
    let split = (right - t) as usize;
    let (weights, right_weights) = nodes.weights.split_at_mut(split);
    let (members, right_members) = nodes.members.split_at_mut(split);
    let left_nodes = Nodes {
        weights: &mut weights[1..],
        members: &mut members[1..],
    };
    let right_nodes = Nodes {
        weights: right_weights,
        members: right_members,
    };
    if graph.tree.end(t) - t > PARALLEL_NODES {
        parallel::join(
            || refine_below(graph, t + 1, left_nodes, space),
            || refine_below(graph, right, right_nodes, &mut Workspace::default()),
        );
    } else {
        refine_below(graph, t + 1, left_nodes, space);
        refine_below(graph, right, right_nodes, space);
    }
}

/// Splits all leaves with more than `largest` vertices.
fn split_leaves(
    level: &Level,
    tree: Tree,
    labels: &[AtomicU32],
    slots: &[AtomicU32],
    largest: usize,
) -> Tree {
    let (starts, vertices) = vertices_of_nodes(labels, tree.len());
    let of_node = |t: u32| &vertices[starts[t as usize] as usize..starts[t as usize + 1] as usize];
    let leaves: Vec<u32> = (0..tree.len() as u32)
        .filter(|&t| tree.is_leaf(t))
        .collect();
    let total = level.total_weight();
    let split: Vec<(Tree, Vec<u32>)> = ONE_BY_ONE.map_with(
        &leaves[..],
        || Bisector::new(total),
        |bisector, _, leaf| {
            let t = leaf[0];
            let vertices = of_node(t);
            if vertices.len() <= largest {
                return (Tree::leaf(), Vec::new());
            }
            let part = level.part(vertices, t, labels, slots);
            split(&part, largest, bisector)
        },
    );
    let (trees, inner): (Vec<_>, Vec<_>) = split.into_iter().unzip();
    let (tree, numbers) = tree.replace_leaves(&trees);
    parallel::update(labels, |_, label| {
        use std::sync::atomic::Ordering::Relaxed;
        label.store(numbers[label.load(Relaxed) as usize], Relaxed);
    });
    for (&t, inner) in leaves.iter().zip(&inner) {
        for (&v, label) in of_node(t).iter().zip(inner) {
            put(labels, v, numbers[t as usize] + label);
        }
    }
    for slot in slots.iter() {
        slot.store(NONE, std::sync::atomic::Ordering::Relaxed);
    }
    tree
}

/// Splits a part until every piece has at most `largest` vertices or cannot be split. Returns the
/// tree and the label of every vertex, or no labels if the part stays whole.
fn split(part: &Level, largest: usize, bisector: &mut Bisector) -> (Tree, Vec<u32>) {
    if part.num_vertices() <= largest {
        return (Tree::leaf(), Vec::new());
    }
    let Some(sides) = bisector.bisect(part) else {
        return (Tree::leaf(), Vec::new());
    };
    let shared_sides: Vec<AtomicU32> = sides.iter().map(|&s| AtomicU32::new(s)).collect();
    let slots = shared(part.num_vertices(), NONE);
    let of_side = |side: u32| -> Vec<u32> {
        let all = 0..sides.len() as u32;
        all.filter(|&v| sides[v as usize] == side).collect()
    };
    let [left, right] = [LEFT, RIGHT].map(of_side);
    let half = |vertices: &[u32], side| part.part(vertices, side, &shared_sides, &slots);
    let (left_part, right_part) = (half(&left, LEFT), half(&right, RIGHT));
    let (left_split, right_split) = if part.num_vertices() > PARALLEL_VERTICES {
        let mut second = bisector.another();
        parallel::join(
            || split(&left_part, largest, bisector),
            || split(&right_part, largest, &mut second),
        )
    } else {
        let left_split = split(&left_part, largest, bisector);
        (left_split, split(&right_part, largest, bisector))
    };
    let tree = Tree::above(&left_split.0, &right_split.0);
    let mut labels = vec![SEPARATOR; part.num_vertices()];
    for (vertices, root, inner) in [
        (&left, 1, &left_split.1),
        (&right, tree.right(0), &right_split.1),
    ] {
        for (i, &v) in vertices.iter().enumerate() {
            labels[v as usize] = root + inner.get(i).copied().unwrap_or(0);
        }
    }
    (tree, labels)
}

fn assemble(level: &Level, tree: &Tree, labels: &[AtomicU32], slots: &[AtomicU32]) -> Vec<u32> {
    let (starts, mut vertices) = vertices_of_nodes(labels, tree.len());
    for t in (0..tree.len() as u32).filter(|&t| tree.is_leaf(t)) {
        let leaf = &vertices[starts[t as usize] as usize..starts[t as usize + 1] as usize];
        for (i, &v) in leaf.iter().enumerate() {
            put(slots, v, i as u32);
        }
    }
    let mut rest = &mut vertices[..];
    let mut pieces = Vec::with_capacity(tree.len());
    for t in 0..tree.len() {
        let (piece, tail) = rest.split_at_mut((starts[t + 1] - starts[t]) as usize);
        rest = tail;
        pieces.push(piece);
    }
    ONE_BY_ONE.update(&mut pieces[..], |t, piece| {
        if tree.is_leaf(t as u32) {
            order_leaf(level, piece, t as u32, labels, slots);
        }
    });
    let mut order = Vec::with_capacity(labels.len());
    emit(tree, 0, &pieces, &mut order);
    order
}

/// Appends both sides, then the separator.
fn emit(tree: &Tree, t: u32, pieces: &[&mut [u32]], order: &mut Vec<u32>) {
    if !tree.is_leaf(t) {
        emit(tree, t + 1, pieces, order);
        emit(tree, tree.right(t), pieces, order);
    }
    order.extend_from_slice(pieces[t as usize]);
}

/// One leaf per chunk, since leaves differ in size.
const ONE_BY_ONE: Chunks = Chunks::of(1);

/// Clustering variants; the first is used for the finest levels.
const VARIANTS: [Clustering; 2] = [
    Clustering {
        enough: 5,
        full: 5.0,
    },
    Clustering {
        enough: 4,
        full: 5.0,
    },
];
/// The level from which on all variants are tried; it has about a twentieth of the vertices.
const DEPTH_OF_VARIANTS: usize = 2;
/// A level of at least this size determines if minimum degree is better.
const TELLING: usize = 200;
/// Minimum degree is chosen if it takes less than this fraction of the flops on the coarse level.
///
/// On real models with limbs the ratio was 0.60 to 0.86 where minimum degree was also better on
/// the finest level, by 8 to 16 %. It was 1.17 to 1.8 on rounder ones, where minimum degree takes
/// 1.4 to 2.6 times the flops.
const CLEARLY_LESS: f64 = 0.95;
/// The hierarchy ends at a level of at most this size.
const COARSEST: usize = 150;
/// Parts are split while they have more vertices of the current level than this.
const LEAF: usize = 60;
/// The same on the finest level, where parts are then ordered by minimum degree.
const FINEST_LEAF: usize = 250;
/// High effort is cheap on coarse levels.
const EFFORT: Effort = Effort {
    patience: 2.0,
    passes: 3,
};
/// The effort one level above the finest.
const FINE_EFFORT: Effort = Effort {
    patience: 1.0,
    passes: 2,
};
/// A third pass would gain less than the random variation between clusterings.
const FINEST_EFFORT: Effort = Effort {
    patience: 1.0,
    passes: 2,
};
/// Trees with more nodes than this are refined by two threads.
const PARALLEL_NODES: u32 = 64;
/// Parts with more vertices than this are split by two threads.
const PARALLEL_VERTICES: usize = 4096;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ordering::relabel::Relabelled;
    use crate::ordering::tests::irregular_sphere;

    /// If an edge ran from one side of a separator to the other, elimination would fill in parts
    /// that are empty according to the tree.
    #[test]
    fn separators_separate() {
        let sphere = irregular_sphere(5);
        let level = Relabelled::new(&sphere.graph()).level;
        let dissection = Dissection::new(&level, 0, VARIANTS[0]).unwrap();
        let (tree, labels) = (&dissection.tree, &dissection.labels);
        assert!(tree.len() > 50);
        for v in 0..level.num_vertices() as u32 {
            for &u in level.ring(v) {
                let (a, b) = (get(labels, u), get(labels, v));
                assert!(tree.is_below(a, b) || tree.is_below(b, a), "{a} and {b}");
            }
        }
    }
}
