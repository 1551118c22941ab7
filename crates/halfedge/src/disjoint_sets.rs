//! Disjoint sets of indices (union–find).

/// Disjoint sets of the indices `0..len`. Each set is represented by its lowest index, so that the
/// result does not depend on the order in which sets are joined.
///
/// **Source**: Tarjan and van Leeuwen 1984, Worst-case analysis of set union algorithms: linking
/// by index with path halving.
///
/// ```
/// use cotan_halfedge::DisjointSets;
/// let mut sets = DisjointSets::new(4);
/// sets.join(3, 1);
/// assert_eq!([0, 1, 2, 3].map(|i| sets.root(i)), [0, 1, 2, 1]);
/// ```
#[derive(Clone, Debug)]
pub struct DisjointSets {
    parents: Vec<u32>,
}

impl DisjointSets {
    /// A set of its own for each index.
    #[must_use]
    pub fn new(len: usize) -> Self {
        Self {
            parents: (0..len as u32).collect(),
        }
    }

    /// The lowest index in the set of `index`.
    ///
    /// # Panics
    /// If `index` is not below the length.
    pub fn root(&mut self, mut index: u32) -> u32 {
        while self.parents[index as usize] != index {
            let grandparent = self.parents[self.parents[index as usize] as usize];
            self.parents[index as usize] = grandparent;
            index = grandparent;
        }
        index
    }

    /// Joins the sets of `a` and `b`.
    ///
    /// # Panics
    /// If `a` or `b` is not below the length.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parents[a.max(b) as usize] = a.min(b);
    }

    /// Per index the number of its set. Sets are numbered from 0 in the order of their lowest
    /// indices. Returns the number of sets too.
    #[must_use]
    pub fn numbered(mut self) -> (Vec<u32>, usize) {
        let mut numbers = Vec::with_capacity(self.parents.len());
        let mut count = 0;
        for index in 0..self.parents.len() as u32 {
            // The root comes first in its set.
            numbers.push(match self.root(index) {
                root if root == index => {
                    count += 1;
                    count - 1
                }
                root => numbers[root as usize],
            });
        }
        (numbers, count as usize)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn sets_are_the_components_of_the_graph_of_joins(
            joins in prop::collection::vec((0u32..20, 0u32..20), 0..30),
        ) {
            let mut sets = DisjointSets::new(20);
            joins.iter().for_each(|&(a, b)| sets.join(a, b));
            // The lowest index spreads along the joins until nothing changes.
            let mut lowest: Vec<u32> = (0..20).collect();
            for _ in 0..20 {
                for &(a, b) in &joins {
                    let least = lowest[a as usize].min(lowest[b as usize]);
                    lowest[a as usize] = least;
                    lowest[b as usize] = least;
                }
            }
            let roots: Vec<u32> = (0..20).map(|i| sets.root(i)).collect();
            prop_assert_eq!(&roots, &lowest);
            let (numbers, count) = sets.numbered();
            let mut distinct = roots.clone();
            distinct.sort_unstable();
            distinct.dedup();
            prop_assert_eq!(count, distinct.len());
            let expected = roots.iter().map(|r| distinct.binary_search(r).unwrap() as u32);
            prop_assert!(numbers.into_iter().eq(expected));
        }
    }
}
