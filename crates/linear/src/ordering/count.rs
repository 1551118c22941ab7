//! What an ordering costs: entries of the factor and flops, by walking over the row subtrees of
//! the elimination tree (Liu 1990).

use super::Graph;

/// The size of a Cholesky factor.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Cost {
    /// Entries of the factor, diagonal included.
    pub(crate) entries: u64,
    /// The sum of the squares of the column lengths.
    pub(crate) flops: f64,
}

/// Takes time proportional to the entries of the factor.
pub(crate) fn cost(graph: &Graph<'_>, order: &[u32]) -> Cost {
    const NONE: u32 = u32::MAX;
    let n = order.len();
    let mut place = vec![0u32; n];
    for (k, &v) in order.iter().enumerate() {
        place[v as usize] = k as u32;
    }
    let mut parent = vec![NONE; n];
    let mut last_row = vec![NONE; n];
    let mut lengths = vec![1u64; n];
    for (i, &v) in order.iter().enumerate() {
        let i = i as u32;
        last_row[i as usize] = i;
        let ring = graph.offsets[v as usize] as usize..graph.offsets[v as usize + 1] as usize;
        for &u in &graph.neighbours[ring] {
            let mut j = place[u as usize];
            while j < i && last_row[j as usize] != i {
                last_row[j as usize] = i;
                lengths[j as usize] += 1;
                if parent[j as usize] == NONE {
                    parent[j as usize] = i;
                }
                j = parent[j as usize];
            }
        }
    }
    Cost {
        entries: lengths.iter().sum(),
        flops: lengths.iter().map(|&c| (c * c) as f64).sum(),
    }
}
