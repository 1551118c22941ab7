//! A priority queue whose entries never fall below the last one taken: a radix heap.
//!
//! Entries are kept by the highest bit in which they differ from the last one taken and move
//! towards it a few times in all, through memory in order, where a binary heap of millions of
//! edges misses the cache at every level.
//!
//! **Source**: R. Ahuja, K. Mehlhorn, J. Orlin, R. Tarjan, "Faster algorithms for the shortest
//! path problem", J. ACM 37 (1990).

/// The smallest entry is taken first.
#[derive(Clone, Debug)]
pub(super) struct RadixHeap {
    /// Bucket 0 has entries equal to `last`, bucket k those that differ in bit k − 1 and not
    /// above.
    buckets: Vec<Vec<u64>>,
    last: u64,
}

impl RadixHeap {
    /// A queue of the given entries.
    pub(super) fn new(entries: impl IntoIterator<Item = u64>) -> Self {
        let mut heap = Self {
            buckets: vec![Vec::new(); 65],
            last: 0,
        };
        for entry in entries {
            heap.push(entry);
        }
        heap
    }

    /// Adds an entry. One below the last entry taken is next.
    #[inline]
    pub(super) fn push(&mut self, entry: u64) {
        let bucket = bucket(entry, self.last);
        self.buckets[if entry < self.last { 0 } else { bucket }].push(entry);
    }

    /// Takes the smallest entry.
    #[inline]
    pub(super) fn pop(&mut self) -> Option<u64> {
        if self.buckets[0].is_empty() {
            let first = self.buckets.iter().position(|b| !b.is_empty())?;
            let mut entries = std::mem::take(&mut self.buckets[first]);
            self.last = entries.iter().copied().min()?;
            for &entry in &entries {
                self.buckets[bucket(entry, self.last)].push(entry);
            }
            // Reuse the memory for the next entries of this bucket.
            entries.clear();
            self.buckets[first] = entries;
        }
        self.buckets[0].pop()
    }
}

#[inline]
fn bucket(entry: u64, last: u64) -> usize {
    64 - (entry ^ last).leading_zeros() as usize
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn entries_leave_in_order(entries in proptest::collection::vec(any::<u64>(), 0..200)) {
            let mut heap = RadixHeap::new(entries.iter().copied());
            let mut sorted = entries;
            sorted.sort_unstable();
            for expected in sorted {
                prop_assert_eq!(heap.pop(), Some(expected));
            }
            prop_assert_eq!(heap.pop(), None);
        }

        #[test]
        fn entries_above_the_last_may_be_added(steps in proptest::collection::vec(0..1000_u64, 1..100)) {
            let mut heap = RadixHeap::new(steps.iter().copied());
            let mut last = 0;
            for step in steps {
                let taken = heap.pop();
                prop_assert!(taken.is_some_and(|x| x >= last));
                last = taken.unwrap_or(last);
                heap.push(last + step);
            }
        }
    }
}
