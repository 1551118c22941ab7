//! Tests of the whole ordering.

use std::collections::BTreeSet;

use cotan_geometry::shapes;
use cotan_halfedge::HalfedgeMesh;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;
use proptest::prelude::*;

use super::count::column_lengths;
use super::level::Level;
use super::{Graph, dissection_order, order};

/// The size of a Cholesky factor.
#[derive(Debug)]
struct Cost {
    entries: u64,
    flops: f64,
}

fn cost(graph: &Graph<'_>, order: &[u32]) -> Cost {
    let level = Level {
        offsets: graph.offsets.to_vec(),
        neighbours: graph.neighbours.to_vec(),
        weights: vec![1; order.len()],
    };
    let lengths = column_lengths(&level, order);
    Cost {
        entries: lengths.iter().sum(),
        flops: lengths.iter().map(|&c| (c * c) as f64).sum(),
    }
}

/// A graph that owns its arrays.
pub(super) struct Owned {
    offsets: Vec<u32>,
    neighbours: Vec<u32>,
}

impl Owned {
    fn of_edges(n: usize, edges: impl IntoIterator<Item = (u32, u32)>) -> Self {
        let mut rings = vec![BTreeSet::new(); n];
        for (a, b) in edges.into_iter().filter(|(a, b)| a != b) {
            rings[a as usize].insert(b);
            rings[b as usize].insert(a);
        }
        let mut offsets = vec![0];
        let mut neighbours = Vec::new();
        for ring in rings {
            neighbours.extend(ring);
            offsets.push(neighbours.len() as u32);
        }
        Self {
            offsets,
            neighbours,
        }
    }

    /// The edges of a mesh with randomly ordered vertices.
    fn of_mesh(mesh: &HalfedgeMesh) -> Self {
        let n = mesh.num_vertices();
        let mut numbers: Vec<u32> = (0..n as u32).collect();
        let mut random = Random(7);
        for i in (1..n).rev() {
            numbers.swap(i, random.below(i + 1));
        }
        let edges = mesh.edges().map(|e| {
            let [a, b] = mesh.edge_vertices(e);
            (numbers[a.index()], numbers[b.index()])
        });
        Self::of_edges(n, edges)
    }

    /// Neighbours and their neighbours: the graph of LᵀL.
    fn squared(&self) -> Self {
        let graph = self.graph();
        let n = graph.offsets.len() - 1;
        let ring = |v: u32| {
            &self.neighbours
                [self.offsets[v as usize] as usize..self.offsets[v as usize + 1] as usize]
        };
        let edges = (0..n as u32).flat_map(|v| {
            let two = ring(v).iter().flat_map(|&u| ring(u));
            ring(v).iter().chain(two).map(move |&u| (v, u))
        });
        Self::of_edges(n, edges)
    }

    pub(super) fn graph(&self) -> Graph<'_> {
        Graph {
            offsets: &self.offsets,
            neighbours: &self.neighbours,
        }
    }

    fn own_cost(&self) -> Cost {
        cost(&self.graph(), &dissection_order(&self.graph()))
    }

    fn amd_cost(&self) -> Cost {
        let n = self.offsets.len() - 1;
        let pattern =
            SymbolicSparseColMatRef::new_checked(n, n, &self.offsets, None, &self.neighbours);
        let request = amd::order_scratch::<u32>(n, self.neighbours.len());
        let (mut order, mut inverse) = (vec![0u32; n], vec![0u32; n]);
        amd::order(
            &mut order,
            &mut inverse,
            pattern,
            amd::Control::default(),
            MemStack::new(&mut MemBuffer::new(request)),
        )
        .unwrap();
        cost(&self.graph(), &order)
    }
}

/// Pseudo-random numbers (Marsaglia's xorshift).
struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % bound as u64) as usize
    }
}

/// An icosphere of 10 · 4^k + 2 vertices with random flips, a third as many as vertices, which
/// leave valences from 3 on.
pub(super) fn irregular_sphere(subdivisions: u32) -> Owned {
    let (mut mesh, _) = shapes::icosphere::<f64>(subdivisions).into_parts();
    let edges: Vec<_> = mesh.edges().collect();
    let mut random = Random(1);
    for _ in 0..mesh.num_vertices() / 3 {
        // A flip that the mesh rejects has no effect.
        let _ = mesh.flip_edge(edges[random.below(edges.len())]);
    }
    Owned::of_mesh(&mesh)
}

fn assert_permutation(order: &[u32], n: usize) {
    let mut sorted = order.to_vec();
    sorted.sort_unstable();
    assert!(sorted.into_iter().eq(0..n as u32), "no permutation");
}

/// Small graphs are not dissected, but dissection must not rely on this.
fn assert_both_order(owned: &Owned, n: usize) {
    assert_permutation(&order(&owned.graph()), n);
    assert_permutation(&dissection_order(&owned.graph()), n);
}

fn assert_ordered(n: usize, edges: impl IntoIterator<Item = (u32, u32)>) {
    let owned = Owned::of_edges(n, edges);
    assert_both_order(&owned, n);
}

fn grid(width: u32, height: u32) -> impl Iterator<Item = (u32, u32)> {
    (0..width * height).flat_map(move |v| {
        let right = (v % width + 1 < width).then_some((v, v + 1));
        let up = (v / width + 1 < height).then_some((v, v + width));
        right.into_iter().chain(up)
    })
}

#[test]
fn unusual_graphs_are_ordered() {
    assert_ordered(0, []);
    assert_ordered(1, []);
    assert_ordered(1000, []);
    // A star whose hub is too dense, and one whose hub is not.
    assert_ordered(5000, (1..5000).map(|v| (0, v)));
    assert_ordered(50, (1..50).map(|v| (0, v)));
    // A clique, a path, a cycle, many pairs.
    assert_ordered(600, (0..600).flat_map(|a| (0..a).map(move |b| (a, b))));
    assert_ordered(20_000, (1..20_000).map(|v| (v - 1, v)));
    assert_ordered(20_000, (0..20_000).map(|v| (v, (v + 1) % 20_000)));
    assert_ordered(20_000, (0..10_000).map(|v| (2 * v, 2 * v + 1)));
    // Stars around hubs along a path.
    assert_ordered(
        10_000,
        (1..10_000).map(|v| (v, if v < 100 { v - 1 } else { v % 100 })),
    );
    // The same at a larger size, and a caterpillar whose body grows thicker.
    assert_ordered(
        200_000,
        (1..200_000).map(|v| (v, if v < 200 { v - 1 } else { v % 200 })),
    );
    assert_ordered(50_000, (1..50_000u32).map(|v| (v, v - v.isqrt())));
    // A complete bipartite graph, and two grids, one of which is small.
    assert_ordered(
        1200,
        (0..600).flat_map(|a| (600..1200).map(move |b| (a, b))),
    );
    let small = grid(30, 30).map(|(a, b)| (a + 10_000, b + 10_000));
    assert_ordered(10_900, grid(100, 100).chain(small));
}

#[test]
fn a_graph_without_good_separators_is_ordered() {
    let mut random = Random(3);
    let n = 3000;
    let edges: Vec<_> = (0..6 * n)
        .map(|_| (random.below(n) as u32, random.below(n) as u32))
        .collect();
    let owned = Owned::of_edges(n, edges);
    assert_both_order(&owned, n);
    let (own, amd) = (owned.own_cost(), owned.amd_cost());
    assert!(own.flops < 1.05 * amd.flops, "{own:?} {amd:?}");
}

#[test]
fn a_path_fills_in_almost_nothing() {
    let n = 10_000;
    let owned = Owned::of_edges(n, (1..n as u32).map(|v| (v - 1, v)));
    assert!(owned.own_cost().entries < 3 * n as u64);
}

#[test]
fn round_meshes_take_far_less_than_with_minimum_degree() {
    let sphere = irregular_sphere(6);
    let (own, amd) = (sphere.own_cost(), sphere.amd_cost());
    assert!(own.flops < 0.75 * amd.flops, "{own:?} {amd:?}");
}

#[test]
fn limbed_meshes_take_no_more_than_with_minimum_degree() {
    let creature = Owned::of_mesh(shapes::creature::<f64>(96).connectivity());
    let (own, amd) = (creature.own_cost(), creature.amd_cost());
    assert!(own.flops < 1.05 * amd.flops, "{own:?} {amd:?}");
    let squared = creature.squared();
    let (own, amd) = (squared.own_cost(), squared.amd_cost());
    assert!(own.flops < 1.05 * amd.flops, "{own:?} {amd:?}");
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let sphere = irregular_sphere(5);
    let with = |threads| cotan_parallel::on_threads(threads, || order(&sphere.graph())).unwrap();
    let one = with(1);
    assert_eq!(one, with(2));
    assert_eq!(one, with(5));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn random_graphs_are_ordered(
        n in 1usize..1500,
        degree in 0usize..8,
        hubs in 0usize..3,
        seed in 1u64..u64::MAX,
    ) {
        let mut random = Random(seed);
        let mut edges: Vec<(u32, u32)> = (0..n * degree / 2)
            .map(|_| (random.below(n) as u32, random.below(n) as u32))
            .collect();
        for hub in 0..hubs.min(n) as u32 {
            edges.extend((0..n as u32).filter(|v| v % 2 == 0).map(|v| (hub, v)));
        }
        let owned = Owned::of_edges(n, edges);
        assert_both_order(&owned, n);
    }

    /// Graphs with local edges only are dissected to the end.
    #[test]
    fn bands_are_ordered(n in 1usize..4000, width in 1usize..40, seed in 1u64..u64::MAX) {
        let mut random = Random(seed);
        let edges: Vec<(u32, u32)> = (0..n * 3)
            .map(|_| {
                let a = random.below(n);
                (a as u32, (a + random.below(width)).min(n - 1) as u32)
            })
            .collect();
        let owned = Owned::of_edges(n, edges);
        assert_both_order(&owned, n);
    }
}
