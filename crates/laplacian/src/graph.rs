//! The graph of an operator: its rows, and the neighbours of each.

use std::sync::OnceLock;

use cotan_halfedge::VertexId;

/// Rows and their neighbours, each pair of neighbours in both rows: the sparsity pattern of an
/// operator.
///
/// One row is one unknown. The graph of a mesh has a row per vertex and a pair per edge
/// ([`crate::OneRings`]); other graphs may have further pairs (between the parts of a model, say),
/// or rows that several vertices of a mesh share.
///
/// The entries of row `i` are [`Self::range`]`(i)` of all arrays that are given row after row.
#[derive(Clone, Debug)]
pub struct Graph {
    offsets: Vec<u32>,
    neighbours: Vec<RowId>,
    /// Found when it is first asked for.
    reverse: OnceLock<Vec<u32>>,
}

impl PartialEq for Graph {
    fn eq(&self, other: &Self) -> bool {
        self.offsets == other.offsets && self.neighbours == other.neighbours
    }
}

impl Eq for Graph {}

/// The index of a row: of one unknown.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct RowId(u32);

impl RowId {
    /// The row with this index.
    ///
    /// # Panics
    /// If it has more than 32 bits.
    #[inline]
    pub fn new(index: usize) -> Self {
        Self(u32::try_from(index).expect("an operator has fewer than 2³² rows"))
    }

    /// Its index.
    #[inline(always)]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// In the default construction a vertex is its own row.
impl From<VertexId> for RowId {
    #[inline]
    fn from(vertex: VertexId) -> Self {
        // An id has 32 bits.
        Self(vertex.index() as u32)
    }
}

impl Graph {
    /// The graph with these pairs of neighbours. A pair that comes twice, in either order, is one;
    /// a row is no neighbour of itself.
    ///
    /// # Panics
    /// If a pair names a row that does not exist.
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

    /// From symmetric rows whose neighbours ascend.
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

    /// Number of entries beside the diagonal: two per pair of neighbours.
    #[inline]
    pub fn num_entries(&self) -> usize {
        self.neighbours.len()
    }

    /// The places of row `i` in what is given row after row.
    #[inline(always)]
    pub fn range(&self, i: usize) -> std::ops::Range<usize> {
        self.offsets[i] as usize..self.offsets[i + 1] as usize
    }

    /// The neighbours of row `i`, ascending, each with its place.
    #[inline]
    pub fn row(&self, i: usize) -> impl ExactSizeIterator<Item = (RowId, usize)> + '_ {
        let range = self.range(i);
        let neighbours = self.neighbours[range.clone()].iter().copied();
        neighbours.zip(range)
    }

    /// The neighbours of all rows, row after row.
    #[inline(always)]
    pub fn neighbours(&self) -> &[RowId] {
        &self.neighbours
    }

    /// For the place of every entry (i, j) that of (j, i).
    pub fn reverse(&self) -> &[u32] {
        self.reverse.get_or_init(|| {
            // Row after row each entry is the next one of its neighbour's row that points back.
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
