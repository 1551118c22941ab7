//! Analysis of a sparsity pattern: the complete structure of a factor, without its values.
//!
//! Elimination tree (Liu 1986), post-ordering, column counts (Gilbert, Ng, Peyton 1994),
//! supernodes with relaxed amalgamation (Ashcraft, Grimes 1989), and the subtrees that run in
//! parallel.

use super::numeric::Precision;
use super::packed;
use crate::error::SparseError;
use crate::lower::LowerTriangle;
use crate::ordering::order_of;

/// No parent: a root of the elimination forest.
pub(super) const ROOT: u32 = u32::MAX;

/// The structure of a Cholesky factor, shared by all matrices of one pattern.
pub struct Symbolic {
    /// `order[k]` is the unknown that is eliminated k-th.
    pub(super) order: Vec<u32>,
    /// The permuted lower triangle by columns: rows in elimination order, and the index of each
    /// value in the analysed matrix.
    pub(super) columns: Columns,
    /// The columns of supernode s are `starts[s]..starts[s + 1]`.
    pub(super) starts: Vec<u32>,
    /// The rows below the diagonal block of supernode s, in ascending order, are
    /// `rows[row_offsets[s]..row_offsets[s + 1]]`.
    pub(super) row_offsets: Vec<usize>,
    pub(super) rows: Vec<u32>,
    /// The parent of every supernode, or [`ROOT`]. Supernodes are post-ordered.
    pub(super) parents: Vec<u32>,
    /// The start of the values of supernode s in the factor: see `packed`.
    pub(super) value_offsets: Vec<usize>,
    pub(super) tasks: super::tasks::Tasks,
}

/// A permuted lower triangle.
pub(super) struct Columns {
    pub(super) offsets: Vec<usize>,
    pub(super) rows: Vec<u32>,
    pub(super) sources: Vec<u32>,
}

impl std::fmt::Debug for Symbolic {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Symbolic")
            .field("unknowns", &self.num_unknowns())
            .field("entries", &self.num_entries())
            .finish_non_exhaustive()
    }
}

impl Symbolic {
    /// Orders and analyses the pattern of `matrix`.
    ///
    /// # Errors
    /// [`SparseError::OutOfMemory`] if the number of entries in the matrix exceeds 32 bits.
    pub fn of(matrix: &LowerTriangle) -> Result<Self, SparseError> {
        // Both triangles count.
        if matrix.rows.len() > u32::MAX as usize / 2 {
            return Err(SparseError::OutOfMemory {
                unknowns: matrix.num_unknowns(),
                bytes: 8 * matrix.rows.len() as u64,
            });
        }
        Ok(Self::analyse(matrix, order_of(matrix)))
    }

    /// Memory of a factor in bytes, including its structure, the matrix if that is kept too, and
    /// the workspace of the factorization.
    pub fn bytes(&self, precision: Precision) -> u64 {
        let (entries, unknowns) = (self.columns.rows.len() as u64, self.num_unknowns() as u64);
        let kept = self.num_entries() as u64 * precision.bytes();
        kept + precision.bytes_beside(entries, unknowns) + self.work_bytes()
    }

    /// Returns `true` if the numbers of unknowns and of entries are those of the analysed matrix.
    pub(crate) fn is_of(&self, matrix: &LowerTriangle) -> bool {
        self.num_unknowns() == matrix.num_unknowns()
            && self.columns.rows.len() == matrix.num_entries()
    }

    /// Analyses the pattern of `matrix` for elimination in the given order.
    ///
    /// The order is first post-ordered, a permutation that changes neither entries nor
    /// operations.
    pub(crate) fn analyse(matrix: &LowerTriangle, order: Vec<u32>) -> Self {
        let columns = permute(matrix, &order);
        let tree = elimination_tree(&columns);
        let post = post_order(&tree);
        let order: Vec<u32> = post.iter().map(|&k| order[k as usize]).collect();
        let mut label = vec![0u32; post.len()];
        for (new, &old) in post.iter().enumerate() {
            label[old as usize] = new as u32;
        }
        let mut parents = vec![ROOT; post.len()];
        for (old, &parent) in tree.iter().enumerate() {
            if parent != ROOT {
                parents[label[old] as usize] = label[parent as usize];
            }
        }
        drop((columns, tree, post, label));
        let columns = permute(matrix, &order);
        let counts = column_counts(&columns, &parents);
        let starts = supernodes(&parents, &counts);
        Self::with_supernodes(order, columns, &parents, starts)
    }

    /// Collects the rows of every supernode.
    fn with_supernodes(
        order: Vec<u32>,
        columns: Columns,
        parents: &[u32],
        starts: Vec<u32>,
    ) -> Self {
        let num = starts.len() - 1;
        let mut supernode_of = vec![0u32; order.len()];
        for s in 0..num {
            supernode_of[starts[s] as usize..starts[s + 1] as usize].fill(s as u32);
        }
        let mut super_parents = vec![ROOT; num];
        let mut row_offsets = Vec::with_capacity(num + 1);
        let mut rows: Vec<u32> = Vec::new();
        let mut value_offsets = Vec::with_capacity(num + 1);
        let mut marked_for = vec![ROOT; order.len()];
        let mut first_child = vec![ROOT; num];
        let mut next_sibling = vec![ROOT; num];
        let mut num_values = 0usize;
        row_offsets.push(0);
        value_offsets.push(0);
        for s in 0..num {
            let (start, end) = (starts[s] as usize, starts[s + 1] as usize);
            let begin = rows.len();
            let mut child = first_child[s];
            while child != ROOT {
                let range = row_offsets[child as usize]..row_offsets[child as usize + 1];
                for k in range {
                    let i = rows[k];
                    if i as usize >= end && marked_for[i as usize] != s as u32 {
                        marked_for[i as usize] = s as u32;
                        rows.push(i);
                    }
                }
                child = next_sibling[child as usize];
            }
            for &i in &columns.rows[columns.offsets[start]..columns.offsets[end]] {
                if i as usize >= end && marked_for[i as usize] != s as u32 {
                    marked_for[i as usize] = s as u32;
                    rows.push(i);
                }
            }
            rows[begin..].sort_unstable();
            row_offsets.push(rows.len());
            let (width, below) = (end - start, rows.len() - begin);
            num_values += packed::len(width, width + below);
            value_offsets.push(num_values);
            let parent = parents[end - 1];
            if parent != ROOT {
                let p = supernode_of[parent as usize] as usize;
                super_parents[s] = p as u32;
                next_sibling[s] = first_child[p];
                first_child[p] = s as u32;
            }
        }
        rows.shrink_to_fit();
        let tasks = super::tasks::Tasks::new(&starts, &row_offsets, &rows, &super_parents);
        Self {
            order,
            columns,
            starts,
            row_offsets,
            rows,
            parents: super_parents,
            value_offsets,
            tasks,
        }
    }

    /// Number of unknowns.
    pub fn num_unknowns(&self) -> usize {
        self.order.len()
    }

    /// Number of values that a factor stores, including stored zeros.
    pub fn num_entries(&self) -> usize {
        self.value_offsets.last().copied().unwrap_or(0)
    }

    /// An upper bound on the temporary memory of a factorization in bytes, in addition to the
    /// values: the update squares waiting for the supernodes above, if all groups reached their
    /// peaks at once.
    pub(crate) fn work_bytes(&self) -> u64 {
        let tasks = &self.tasks;
        let groups: u64 = tasks.subtrees.iter().map(|r| self.peak_of(r.clone())).sum();
        let top = tasks.top.iter().map(|&s| self.square_below(s as usize));
        let panel = (0..self.num_supernodes())
            .map(|s| {
                let (_, width, rows) = self.supernode(s);
                width as u64 * (width + rows.len()) as u64
            })
            .max();
        8 * (groups + top.sum::<u64>() + panel.unwrap_or(0) * tasks.subtrees.len() as u64)
    }

    /// The peak number of waiting values in a group of subtrees.
    fn peak_of(&self, range: std::ops::Range<usize>) -> u64 {
        let (mut waiting, mut peak) = (0, 0);
        let mut of_children = vec![0; range.len()];
        for s in range.clone() {
            let own = self.square_below(s);
            waiting += own;
            peak = peak.max(waiting);
            waiting -= of_children[s - range.start];
            let parent = self.parents[s] as usize;
            if range.contains(&parent) {
                of_children[parent - range.start] += own;
            }
        }
        peak
    }

    /// Number of values that a supernode passes to its parent.
    fn square_below(&self, s: usize) -> u64 {
        let below = self.supernode(s).2.len() as u64;
        below * below
    }

    /// Number of values stored for some supernodes.
    pub(super) fn values_len(&self, range: std::ops::Range<usize>) -> usize {
        self.value_offsets[range.end] - self.value_offsets[range.start]
    }

    /// The values stored for a supernode.
    pub(super) fn values_of<'v, V>(&self, s: usize, values: &'v [V]) -> &'v [V] {
        &values[self.value_offsets[s]..self.value_offsets[s + 1]]
    }

    /// Number of columns of some supernodes.
    pub(super) fn num_columns(&self, range: std::ops::Range<usize>) -> usize {
        self.columns_of(range).len()
    }

    /// The columns of some supernodes, as positions in the order.
    pub(super) fn columns_of(&self, range: std::ops::Range<usize>) -> std::ops::Range<usize> {
        self.starts[range.start] as usize..self.starts[range.end] as usize
    }

    /// The positions of the rows of a supernode during a solve: see `Tasks::slots`.
    pub(super) fn slots(&self, s: usize) -> &[u32] {
        &self.tasks.slots[self.row_offsets[s]..self.row_offsets[s + 1]]
    }

    /// Number of supernodes.
    pub(super) fn num_supernodes(&self) -> usize {
        self.starts.len() - 1
    }

    /// First column, width and rows below of a supernode.
    pub(super) fn supernode(&self, s: usize) -> (usize, usize, &[u32]) {
        let (start, end) = (self.starts[s] as usize, self.starts[s + 1] as usize);
        let rows = &self.rows[self.row_offsets[s]..self.row_offsets[s + 1]];
        (start, end - start, rows)
    }
}

/// The matrix with rows and columns in elimination order, lower triangle, by columns.
fn permute(matrix: &LowerTriangle, order: &[u32]) -> Columns {
    let n = order.len();
    let mut position = vec![0u32; n];
    for (k, &v) in order.iter().enumerate() {
        position[v as usize] = k as u32;
    }
    let entries = || {
        (0..n).flat_map(|c| {
            let range = matrix.offsets[c]..matrix.offsets[c + 1];
            range.map(move |e| (c, e))
        })
    };
    let place = |c: usize, e: usize| {
        let (a, b) = (position[c], position[matrix.rows[e] as usize]);
        (a.min(b), a.max(b))
    };
    let mut offsets = vec![0usize; n + 1];
    for (c, e) in entries() {
        offsets[place(c, e).0 as usize + 1] += 1;
    }
    for k in 0..n {
        offsets[k + 1] += offsets[k];
    }
    let mut next = offsets.clone();
    let mut rows = vec![0u32; matrix.rows.len()];
    let mut sources = vec![0u32; matrix.rows.len()];
    for (c, e) in entries() {
        let (column, row) = place(c, e);
        let slot = &mut next[column as usize];
        rows[*slot] = row;
        sources[*slot] = e as u32;
        *slot += 1;
    }
    Columns {
        offsets,
        rows,
        sources,
    }
}

/// The parent of every column: the first row below the diagonal of its column of the factor.
fn elimination_tree(columns: &Columns) -> Vec<u32> {
    let n = columns.offsets.len() - 1;
    // Rows of the lower triangle are needed, so transpose the pattern.
    let mut offsets = vec![0usize; n + 1];
    for &i in &columns.rows {
        offsets[i as usize + 1] += 1;
    }
    for k in 0..n {
        offsets[k + 1] += offsets[k];
    }
    let mut next = offsets.clone();
    let mut lower = vec![0u32; columns.rows.len()];
    for j in 0..n {
        for &i in &columns.rows[columns.offsets[j]..columns.offsets[j + 1]] {
            lower[next[i as usize]] = j as u32;
            next[i as usize] += 1;
        }
    }
    let mut parents = vec![ROOT; n];
    let mut ancestors = vec![ROOT; n];
    for i in 0..n {
        for &j in &lower[offsets[i]..offsets[i + 1]] {
            let mut j = j as usize;
            // Climb to the root of the current tree, with path compression.
            while j < i {
                let next = ancestors[j];
                ancestors[j] = i as u32;
                if next == ROOT {
                    parents[j] = i as u32;
                    break;
                }
                j = next as usize;
            }
        }
    }
    parents
}

/// Children before parents, each subtree contiguous: `post[k]` is the column that comes k-th.
fn post_order(parents: &[u32]) -> Vec<u32> {
    let n = parents.len();
    let mut first_child = vec![ROOT; n];
    let mut next_sibling = vec![ROOT; n];
    for j in (0..n).rev() {
        if parents[j] != ROOT {
            next_sibling[j] = std::mem::replace(&mut first_child[parents[j] as usize], j as u32);
        }
    }
    let mut post = Vec::with_capacity(n);
    let mut stack = Vec::new();
    for root in (0..n).filter(|&j| parents[j] == ROOT) {
        stack.push(root as u32);
        while let Some(&j) = stack.last() {
            let child = std::mem::replace(&mut first_child[j as usize], ROOT);
            if child == ROOT {
                stack.pop();
                post.push(j);
                let sibling = next_sibling[j as usize];
                if sibling != ROOT {
                    stack.push(sibling);
                }
            } else {
                stack.push(child);
            }
        }
    }
    post
}

/// Number of entries in every column of the factor, including the diagonal. Columns are
/// post-ordered.
fn column_counts(columns: &Columns, parents: &[u32]) -> Vec<u32> {
    let n = parents.len();
    let mut first: Vec<u32> = (0..n as u32).collect();
    let mut delta = vec![0i64; n];
    for j in 0..n {
        // A leaf of the tree.
        if first[j] == j as u32 {
            delta[j] = 1;
        }
        if parents[j] != ROOT {
            let p = parents[j] as usize;
            first[p] = first[p].min(first[j]);
        }
    }
    let mut ancestors: Vec<u32> = (0..n as u32).collect();
    let mut last_first = vec![ROOT; n];
    let mut last_leaf = vec![ROOT; n];
    for j in 0..n {
        if parents[j] != ROOT {
            delta[parents[j] as usize] -= 1;
        }
        for &i in &columns.rows[columns.offsets[j]..columns.offsets[j + 1]] {
            let i = i as usize;
            if i == j || (last_first[i] != ROOT && first[j] <= last_first[i]) {
                continue;
            }
            // j is a leaf of the row subtree of i.
            last_first[i] = first[j];
            delta[j] += 1;
            let previous = std::mem::replace(&mut last_leaf[i], j as u32);
            if previous != ROOT {
                let mut common = previous as usize;
                while ancestors[common] as usize != common {
                    common = ancestors[common] as usize;
                }
                let mut at = previous as usize;
                while at != common {
                    at = std::mem::replace(&mut ancestors[at], common as u32) as usize;
                }
                delta[common] -= 1;
            }
        }
        if parents[j] != ROOT {
            ancestors[j] = parents[j];
        }
    }
    for j in 0..n {
        if parents[j] != ROOT {
            delta[parents[j] as usize] += delta[j];
        }
    }
    delta.into_iter().map(|c| c as u32).collect()
}

/// The first columns of the supernodes.
///
/// Supernodes are runs of columns with the same structure; small children are merged into the
/// parent that follows them as long as few zeros are stored for it.
fn supernodes(parents: &[u32], counts: &[u32]) -> Vec<u32> {
    let n = parents.len();
    /// A finished supernode, which ends where the next one begins.
    struct Run {
        start: usize,
        width: u64,
        /// Number of rows of the front, including its columns.
        height: u64,
        /// Number of stored zeros.
        zeros: u64,
    }
    let mut runs: Vec<Run> = Vec::new();
    let mut j = 0;
    while j < n {
        let start = j;
        while j + 1 < n && parents[j] == j as u32 + 1 && counts[j] == counts[j + 1] + 1 {
            j += 1;
        }
        let width = (j + 1 - start) as u64;
        let mut run = Run {
            start,
            width,
            height: u64::from(counts[start]),
            zeros: 0,
        };
        // The last child ends right before its parent begins.
        while let Some(child) = runs.last() {
            let last = child.start + child.width as usize - 1;
            if parents[last] == ROOT || parents[last] as usize >= run.start + run.width as usize {
                break;
            }
            let below = child.height - child.width;
            let height = child.width + run.height;
            let added = child.width * (run.height - below);
            let zeros = child.zeros + run.zeros + added;
            let width = child.width + run.width;
            let stored = width * height - width * (width - 1) / 2;
            let share = zeros as f64 / stored as f64;
            let is_few = match width {
                0..=4 => true,
                5..=16 => share < MAX_ZEROS[0],
                17..=48 => share < MAX_ZEROS[1],
                _ => share < MAX_ZEROS[2],
            };
            if !is_few {
                break;
            }
            run = Run {
                start: child.start,
                width,
                height,
                zeros,
            };
            runs.pop();
        }
        runs.push(run);
        j += 1;
    }
    let mut starts: Vec<u32> = runs.iter().map(|run| run.start as u32).collect();
    starts.push(n as u32);
    starts
}

/// Maximum shares of stored zeros for merging into supernodes of at most 16, at most 48, and more
/// columns (as in CHOLMOD; wider and narrower tables performed about the same).
const MAX_ZEROS: [f64; 3] = [0.8, 0.1, 0.05];
