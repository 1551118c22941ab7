//! Division of the elimination forest into subtrees that are processed in parallel.

use std::ops::Range;

use super::symbolic::ROOT;

/// Disjoint groups of subtrees, and the supernodes above them that are processed afterwards.
///
/// The division depends only on the pattern, not on the number of threads, so that every sum has
/// a fixed order.
pub(super) struct Tasks {
    /// Groups of subtrees, as ranges of supernodes, in elimination order.
    pub(super) subtrees: Vec<Range<usize>>,
    /// The supernodes above, in elimination order.
    pub(super) top: Vec<u32>,
    /// Parallel to `Symbolic::rows`: the position of each row during a solve, in the buffer of
    /// its group (columns, then tail) or in that of the top.
    pub(super) slots: Vec<u32>,
    /// The lengths of these buffers: one per group, then that of the top.
    pub(super) lengths: Vec<usize>,
    /// For every column, its position in the concatenated buffers.
    pub(super) places: Vec<u32>,
    /// The concatenated tails of the groups, as positions in the buffer of the top.
    tail_offsets: Vec<usize>,
    tails: Vec<u32>,
}

/// Subtrees with at least this share of the work are divided.
const SHARE: f64 = 1.0 / 8.0;
/// Minimum work to be divided, in entries of the factor.
const MIN_WORK: f64 = 2e5;

impl Tasks {
    pub(super) fn new(
        starts: &[u32],
        row_offsets: &[usize],
        rows: &[u32],
        parents: &[u32],
    ) -> Self {
        let (subtrees, top) = divide(starts, row_offsets, parents);
        let n = starts.last().map_or(0, |&n| n as usize);
        let columns = |s: usize| starts[s]..starts[s + 1];

        // The positions of the top's columns, first relative to the top; in `places` they follow
        // the groups.
        let mut in_top = vec![u32::MAX; n];
        let mut top_length = 0u32;
        for &s in &top {
            for k in columns(s as usize) {
                in_top[k as usize] = top_length;
                top_length += 1;
            }
        }
        let mut places = vec![0u32; n];
        let mut slots = vec![0u32; rows.len()];
        let mut lengths = Vec::with_capacity(subtrees.len() + 1);
        let (mut tail_offsets, mut tails) = (vec![0], Vec::new());
        let mut seen = vec![u32::MAX; n];
        let mut total = 0u32;
        for range in &subtrees {
            let (begin, end) = (starts[range.start], starts[range.end]);
            for k in begin..end {
                places[k as usize] = total + k - begin;
            }
            let mut length = end - begin;
            for e in row_offsets[range.start]..row_offsets[range.end] {
                let row = rows[e];
                slots[e] = if row < end {
                    row - begin
                } else {
                    let slot = &mut seen[row as usize];
                    if *slot == u32::MAX {
                        *slot = length;
                        length += 1;
                        tails.push(in_top[row as usize]);
                    }
                    *slot
                };
            }
            for e in row_offsets[range.start]..row_offsets[range.end] {
                seen[rows[e] as usize] = u32::MAX;
            }
            tail_offsets.push(tails.len());
            lengths.push(length as usize);
            total += length;
        }
        lengths.push(top_length as usize);
        for &s in &top {
            for k in columns(s as usize) {
                places[k as usize] = total + in_top[k as usize];
            }
            for e in row_offsets[s as usize]..row_offsets[s as usize + 1] {
                slots[e] = in_top[rows[e] as usize];
            }
        }
        Self {
            subtrees,
            top,
            slots,
            lengths,
            places,
            tail_offsets,
            tails,
        }
    }

    /// The tail of a group, as positions in the top's buffer.
    pub(super) fn tail(&self, group: usize) -> &[u32] {
        &self.tails[self.tail_offsets[group]..self.tail_offsets[group + 1]]
    }
}

/// Divides the supernodes into the groups and the top.
fn divide(starts: &[u32], row_offsets: &[usize], parents: &[u32]) -> (Vec<Range<usize>>, Vec<u32>) {
    let num = parents.len();
    // Entries measure the work, since solves are far more frequent than factorizations.
    let mut work: Vec<f64> = (0..num)
        .map(|s| {
            let width = f64::from(starts[s + 1] - starts[s]);
            let below = (row_offsets[s + 1] - row_offsets[s]) as f64;
            width * (0.5 * width + below + 4.0)
        })
        .collect();
    let mut total = 0.0;
    for s in 0..num {
        match parents[s] {
            ROOT => total += work[s],
            p => work[p as usize] += work[s],
        }
    }
    let most = if total < MIN_WORK {
        f64::INFINITY
    } else {
        SHARE * total
    };
    let (mut subtrees, mut top) = (Vec::<Range<usize>>::new(), Vec::new());
    // The start of the current group, and its work so far.
    let (mut begin, mut sum) = (0, 0.0);
    for s in 0..num {
        let is_heavy = work[s] >= most;
        let is_root = parents[s] == ROOT || work[parents[s] as usize] >= most;
        if is_heavy {
            if begin < s {
                subtrees.push(begin..s);
            }
            top.push(s as u32);
            (begin, sum) = (s + 1, 0.0);
        } else if is_root {
            sum += work[s];
            if sum >= most {
                subtrees.push(begin..s + 1);
                (begin, sum) = (s + 1, 0.0);
            }
        }
    }
    if begin < num {
        subtrees.push(begin..num);
    }
    (subtrees, top)
}
