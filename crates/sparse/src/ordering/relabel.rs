//! Renumbering of the vertices by breadth-first search, with unusual vertices set aside.
//!
//! All later passes walk over vertices in ascending order. If neighbours are close to each other
//! in memory, they run at the speed of the cache. With the random order of some scans, they would
//! wait for memory at every edge.

use cotan_parallel::Chunks;

use super::Graph;
use super::level::{Level, NONE};

/// The vertices in three groups, and the graph of the middle one.
pub(super) struct Relabelled {
    /// Vertices without neighbours, other than dense ones.
    pub(super) isolated: Vec<u32>,
    /// The vertices of `level`, by their index in it.
    pub(super) connected: Vec<u32>,
    /// Vertices of very high degree.
    pub(super) dense: Vec<u32>,
    pub(super) level: Level,
}

impl Relabelled {
    pub(super) fn new(graph: &Graph<'_>) -> Self {
        let n = graph.offsets.len().saturating_sub(1);
        // The bound of AMD: such a vertex soon becomes connected to nearly everything.
        let bound = (10.0 * (n as f64).sqrt()).max(16.0) as usize;
        let mut numbers = vec![NONE; n];
        let mut dense = Vec::new();
        for v in 0..n {
            if graph.ring(v as u32).len() > bound {
                numbers[v] = DENSE;
                dense.push(v as u32);
            }
        }
        let mut isolated = Vec::new();
        let connected = search(graph, &mut numbers, &mut isolated);
        let level = renumber(graph, &connected, &numbers);
        Self {
            isolated,
            connected,
            dense,
            level,
        }
    }
}

/// Searches all components breadth-first; a vertex that reaches no other is isolated.
fn search(graph: &Graph<'_>, numbers: &mut [u32], isolated: &mut Vec<u32>) -> Vec<u32> {
    let mut found: Vec<u32> = Vec::with_capacity(numbers.len());
    for start in 0..numbers.len() {
        if numbers[start] != NONE {
            continue;
        }
        let mut next = found.len();
        let first = next;
        numbers[start] = next as u32;
        found.push(start as u32);
        while next < found.len() {
            for &u in graph.ring(found[next]) {
                if numbers[u as usize] == NONE {
                    numbers[u as usize] = found.len() as u32;
                    found.push(u);
                }
            }
            next += 1;
        }
        if found.len() == first + 1 {
            numbers[start] = ISOLATED;
            isolated.push(start as u32);
            found.pop();
        }
    }
    found
}

/// The graph of the connected vertices with their new indices.
fn renumber(graph: &Graph<'_>, connected: &[u32], numbers: &[u32]) -> Level {
    const CHUNKS: Chunks = Chunks::of(1 << 14);
    let kept = |v: u32| {
        let number = numbers[v as usize];
        (number < DENSE).then_some(number)
    };
    let blocks = CHUNKS.map(connected, |first, vertices| {
        let mut ends = Vec::with_capacity(vertices.len());
        let mut neighbours = Vec::with_capacity(vertices.len() * 6);
        for (i, &v) in vertices.iter().enumerate() {
            let own = (first + i) as u32;
            let ring = graph.ring(v).iter();
            neighbours.extend(ring.filter_map(|&u| kept(u)).filter(|&u| u != own));
            ends.push(neighbours.len() as u32);
        }
        (ends, neighbours)
    });
    let (offsets, neighbours) = join_blocks(blocks);
    Level {
        offsets,
        neighbours,
        weights: vec![1; connected.len()],
    }
}

/// Concatenates rows that were created in blocks.
///
/// Each block holds the ends of its rows, relative to its own start, and their entries.
pub(super) fn join_blocks(blocks: Vec<(Vec<u32>, Vec<u32>)>) -> (Vec<u32>, Vec<u32>) {
    let num_rows: usize = blocks.iter().map(|b| b.0.len()).sum();
    let num_entries = blocks.iter().map(|b| b.1.len()).sum();
    let mut offsets = Vec::with_capacity(num_rows + 1);
    let mut entries: Vec<u32> = Vec::with_capacity(num_entries);
    offsets.push(0);
    for (ends, block) in blocks {
        let start = entries.len() as u32;
        offsets.extend(ends.iter().map(|end| start + end));
        entries.extend(block);
    }
    (offsets, entries)
}

/// Markers for vertices without an index, above all indices and below `NONE`.
const DENSE: u32 = NONE - 2;
const ISOLATED: u32 = NONE - 1;
