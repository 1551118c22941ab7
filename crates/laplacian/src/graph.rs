//! The graph of an operator: its rows and their neighbours.

use std::sync::OnceLock;

use cotan_halfedge::VertexId;

/// The sparsity pattern of an operator: rows and their neighbours. Each pair of neighbours
/// appears in both rows.
///
/// A row stands for one unknown. The graph of a mesh has one row per vertex and one pair per edge
/// ([`crate::OneRings`]). Other graphs may have additional pairs (between the parts of a model,
/// for example), or rows shared by several vertices of a mesh.
///
/// In every array stored row by row, the entries of row `i` are those in [`Self::range`]`(i)`.
#[derive(Clone, Debug)]
pub struct Graph {
    offsets: Vec<u32>,
    neighbours: Vec<RowId>,
    /// Computed on first use.
    reverse: OnceLock<Vec<u32>>,
}

impl PartialEq for Graph {
    fn eq(&self, other: &Self) -> bool {
        self.offsets == other.offsets && self.neighbours == other.neighbours
    }
}

impl Eq for Graph {}

/// The index of a row, that is, of one unknown.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct RowId(u32);

impl RowId {
    /// Creates the row id with this index.
    ///
    /// # Panics
    /// If the index does not fit into 32 bits.
    #[inline]
    pub fn new(index: usize) -> Self {
        Self(u32::try_from(index).expect("an operator has fewer than 2³² rows"))
    }

    /// The index as a `usize`.
    #[inline(always)]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// In the default construction each vertex is its own row.
impl From<VertexId> for RowId {
    #[inline]
    fn from(vertex: VertexId) -> Self {
        // Ids have 32 bits.
        Self(vertex.index() as u32)
    }
}

impl Graph {
    /// Builds the graph with these pairs of neighbours. Duplicate pairs, in either order, count
    /// once, and pairs of a row with itself are ignored.
    ///
    /// # Panics
    /// If a pair refers to a row that does not exist.
    pub fn from_pairs(num_rows: usize, pairs: &[[RowId; 2]]) -> Self {
        let mut entries: Vec<[RowId; 2]> = pairs
            .iter()
            .filter(|[a, b]| a != b)
            .flat_map(|&[a, b]| [[a, b], [b, a]])
            .collect();
        assert!(
            entries.iter().all(|[a, _]| a.index() < num_rows),
            "every pair is one of rows"
        );
        entries.sort_unstable();
        entries.dedup();
        let mut offsets = vec![0; num_rows + 1];
        for [row, _] in &entries {
            offsets[row.index() + 1] += 1;
        }
        for i in 0..num_rows {
            offsets[i + 1] += offsets[i];
        }
        Self::from_rows(offsets, entries.iter().map(|[_, column]| *column).collect())
    }

    /// Builds the graph from symmetric rows with ascending neighbours.
    pub(crate) fn from_rows(offsets: Vec<u32>, neighbours: Vec<RowId>) -> Self {
        Self {
            offsets,
            neighbours,
            reverse: OnceLock::new(),
        }
    }

    /// Number of rows.
    #[inline]
    pub fn num_rows(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Number of off-diagonal entries: two per pair of neighbours.
    #[inline]
    pub fn num_entries(&self) -> usize {
        self.neighbours.len()
    }

    /// The range of row `i` in arrays stored row by row.
    #[inline(always)]
    pub fn range(&self, i: usize) -> std::ops::Range<usize> {
        self.offsets[i] as usize..self.offsets[i + 1] as usize
    }

    /// The neighbours of row `i` in ascending order, each with its entry index.
    #[inline]
    pub fn row(&self, i: usize) -> impl ExactSizeIterator<Item = (RowId, usize)> + '_ {
        let range = self.range(i);
        let neighbours = self.neighbours[range.clone()].iter().copied();
        neighbours.zip(range)
    }

    /// The neighbours of all rows, row by row.
    #[inline(always)]
    pub fn neighbours(&self) -> &[RowId] {
        &self.neighbours
    }

    /// For the index of each entry (i, j), the index of (j, i).
    pub fn reverse(&self) -> &[u32] {
        self.reverse.get_or_init(|| {
            // When rows are visited in order, each entry is the next unused one in its
            // neighbour's row.
            let mut next = self.offsets.clone();
            let mut reverse = vec![0; self.neighbours.len()];
            for (back, j) in reverse.iter_mut().zip(&self.neighbours) {
                let there = &mut next[j.index()];
                *back = *there;
                *there += 1;
            }
            reverse
        })
    }
}

#[cfg(test)]
mod tests {
    use cotan_geometry::testing::surfaces;
    use proptest::prelude::*;

    use super::*;
    use crate::OneRings;

    proptest! {
        #[test]
        fn the_pairs_of_a_mesh_are_its_one_rings(shape in surfaces()) {
            let mesh = shape.connectivity();
            let pairs: Vec<[RowId; 2]> = mesh
                .edges()
                .map(|e| mesh.edge_vertices(e).map(RowId::from))
                .collect();
            let graph = Graph::from_pairs(mesh.num_vertices(), &pairs);
            let rings = OneRings::new(mesh);
            prop_assert_eq!(&graph, &**rings.graph());
            for i in 0..graph.num_rows() {
                for (j, k) in graph.row(i) {
                    let back = graph.reverse()[k] as usize;
                    prop_assert_eq!(graph.neighbours()[back].index(), i);
                    prop_assert!(graph.range(j.index()).contains(&back));
                    prop_assert_eq!(rings.halfedges()[back], rings.halfedges()[k].twin());
                }
            }
        }
    }

    #[test]
    fn a_pair_that_comes_twice_is_one() {
        let [a, b, c] = [0, 1, 2].map(RowId::new);
        let graph = Graph::from_pairs(4, &[[a, b], [b, a], [c, c], [c, a]]);
        let rows: Vec<Vec<usize>> = (0..4)
            .map(|i| graph.row(i).map(|(j, _)| j.index()).collect())
            .collect();
        assert_eq!(rows, [vec![1, 2], vec![0], vec![0], vec![]]);
    }
}
