//! Numeric factorization, front by front (multifrontal method, Duff and Reid 1983).

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use cotan_parallel as parallel;

use super::dense::{NotPositive, eliminate};
use super::packed;
use super::symbolic::{ROOT, Symbolic};

/// Storage precision of the values of a factor. All arithmetic is in double precision.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Precision {
    /// Eight bytes per value.
    #[default]
    Double,
    /// Four bytes per value, which halves the memory.
    ///
    /// Every solve is refined by a second one, which leaves errors of about 1e-12 for one-ring
    /// matrices, but too large ones for the normal equations of large meshes.
    Single,
}

impl Precision {
    /// Size of a value in bytes.
    pub fn bytes(self) -> u64 {
        match self {
            Self::Double => 8,
            Self::Single => 4,
        }
    }

    /// Bytes that a factor needs in addition to its values, for a matrix with this many stored
    /// entries.
    pub(crate) fn bytes_beside(self, entries: u64, unknowns: u64) -> u64 {
        let pattern = 8 * entries + 40 * unknowns;
        match self {
            Self::Double => pattern,
            // The matrix, both triangles, and two vectors.
            Self::Single => pattern + 24 * entries + 56 * unknowns,
        }
    }
}

/// A Cholesky factor.
pub(crate) struct Factor {
    pub(super) symbolic: Arc<Symbolic>,
    pub(super) values: Values,
}

pub(super) enum Values {
    Double(Vec<f64>),
    Single(Vec<f32>),
}

/// A number of a factor as it is stored.
pub(super) trait Value: Copy + Default + Send + Sync + Into<f64> {
    fn of(value: f64) -> Self;

    fn zeros(len: usize) -> Vec<Self>;

    /// Values in double precision: borrowed unchanged, or converted into `scratch`.
    fn widen<'a>(values: &'a [Self], scratch: &'a mut [f64]) -> &'a [f64];
}

impl Value for f64 {
    #[inline(always)]
    fn of(value: f64) -> Self {
        value
    }

    fn zeros(len: usize) -> Vec<Self> {
        vec![0.0; len]
    }

    #[inline(always)]
    fn widen<'a>(values: &'a [Self], _: &'a mut [f64]) -> &'a [f64] {
        values
    }
}

impl Value for f32 {
    #[inline(always)]
    fn of(value: f64) -> Self {
        value as Self
    }

    fn zeros(len: usize) -> Vec<Self> {
        vec![0.0; len]
    }

    #[inline(always)]
    fn widen<'a>(values: &'a [Self], scratch: &'a mut [f64]) -> &'a [f64] {
        let wide = &mut scratch[..values.len()];
        for (x, &value) in wide.iter_mut().zip(values) {
            *x = f64::from(value);
        }
        wide
    }
}

/// The reason why a factorization failed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum FactorError {
    /// A pivot is not positive.
    NotPositive,
    /// The memory for the values is not available.
    OutOfMemory,
}

impl From<NotPositive> for FactorError {
    fn from(_: NotPositive) -> Self {
        Self::NotPositive
    }
}

impl Factor {
    /// Factorizes the matrix with the analysed pattern, given its values in pattern order.
    pub(crate) fn new(
        symbolic: Arc<Symbolic>,
        values: &[f64],
        precision: Precision,
    ) -> Result<Self, FactorError> {
        let len = symbolic.num_entries();
        let stored = match precision {
            Precision::Double => Values::Double(zeros(len)?),
            Precision::Single => Values::Single(zeros(len)?),
        };
        let mut factor = Self {
            symbolic,
            values: stored,
        };
        factor.refactor(values)?;
        Ok(factor)
    }

    /// Factorizes another matrix of the same pattern.
    pub(crate) fn refactor(&mut self, values: &[f64]) -> Result<(), FactorError> {
        match &mut self.values {
            Values::Double(stored) => factorize(&self.symbolic, values, stored)?,
            Values::Single(stored) => factorize(&self.symbolic, values, stored)?,
        }
        Ok(())
    }

    pub(crate) fn symbolic(&self) -> &Arc<Symbolic> {
        &self.symbolic
    }

    pub(crate) fn precision(&self) -> Precision {
        match &self.values {
            Values::Double(_) => Precision::Double,
            Values::Single(_) => Precision::Single,
        }
    }
}

/// Allocates zeroed memory that the system provides without touching it, so that it is written
/// only once. Returns an error if there is not enough memory.
fn zeros<V: Value>(len: usize) -> Result<Vec<V>, FactorError> {
    Vec::<V>::new()
        .try_reserve_exact(len)
        .map_err(|_| FactorError::OutOfMemory)?;
    Ok(V::zeros(len))
}

/// The update that a front passes to its parent: the square below its columns, column-major.
struct Update {
    supernode: u32,
    values: Vec<f64>,
}

fn factorize<V: Value>(
    symbolic: &Symbolic,
    matrix: &[f64],
    mut stored: &mut [V],
) -> Result<(), NotPositive> {
    // The panels of the groups, and those of the top between them.
    let mut groups = Vec::new();
    let mut top = Vec::new();
    let mut next_top = symbolic.tasks.top.iter().peekable();
    for range in symbolic
        .tasks
        .subtrees
        .iter()
        .cloned()
        .chain(std::iter::once(
            symbolic.num_supernodes()..symbolic.num_supernodes(),
        ))
    {
        while let Some(&&s) = next_top.peek()
            && (s as usize) < range.start
        {
            next_top.next();
            let (panel, rest) =
                stored.split_at_mut(symbolic.values_len(s as usize..s as usize + 1));
            top.push((s as usize, panel));
            stored = rest;
        }
        let (panels, rest) = stored.split_at_mut(symbolic.values_len(range.clone()));
        stored = rest;
        groups.push((range, panels));
    }
    let updates = parallel::tasks(groups, |(range, panels)| {
        pulp::Arch::new().dispatch(Group {
            symbolic,
            matrix,
            range,
            panels,
        })
    });
    let updates: Vec<Vec<Update>> = updates.into_iter().collect::<Result<_, _>>()?;
    let mut pending: HashMap<u32, Vec<Update>> = HashMap::new();
    for update in updates.into_iter().flatten() {
        let parent = symbolic.parents[update.supernode as usize];
        pending.entry(parent).or_default().push(update);
    }
    let mut front = Front::new(symbolic.num_unknowns());
    for (s, panel) in top {
        let children = pending.remove(&(s as u32)).unwrap_or_default();
        let below = symbolic.supernode(s).2.len();
        let mut values = vec![0.0; below * below];
        front.assemble_and_eliminate(
            symbolic,
            matrix,
            s,
            panel,
            &mut values,
            children.iter().map(|u| (u.supernode, &u.values[..])),
        )?;
        if symbolic.parents[s] != ROOT {
            let update = Update {
                supernode: s as u32,
                values,
            };
            pending.entry(symbolic.parents[s]).or_default().push(update);
        }
    }
    Ok(())
}

/// The work of one group, compiled for the vector instructions of the machine.
struct Group<'a, V> {
    symbolic: &'a Symbolic,
    matrix: &'a [f64],
    range: Range<usize>,
    panels: &'a mut [V],
}

impl<V: Value> pulp::NullaryFnOnce for Group<'_, V> {
    type Output = Result<Vec<Update>, NotPositive>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        factorize_group(self.symbolic, self.matrix, self.range, self.panels)
    }
}

/// Factorizes a range of supernodes; returns the updates for the supernodes above.
#[inline(always)]
fn factorize_group<V: Value>(
    symbolic: &Symbolic,
    matrix: &[f64],
    range: Range<usize>,
    mut panels: &mut [V],
) -> Result<Vec<Update>, NotPositive> {
    let mut out = Vec::new();
    let mut front = Front::new(symbolic.num_unknowns());
    // A stack of updates waiting for their parents; children are on top.
    let mut stack: Vec<f64> = Vec::new();
    let mut waiting: Vec<(u32, usize)> = Vec::new();
    for s in range.clone() {
        let below = symbolic.supernode(s).2.len();
        let (panel, rest) = panels.split_at_mut(symbolic.values_len(s..s + 1));
        panels = rest;
        let is_child = |&&(c, _): &&(u32, usize)| symbolic.parents[c as usize] == s as u32;
        let num_children = waiting.iter().rev().take_while(is_child).count();
        let children = &waiting[waiting.len() - num_children..];
        let end = stack.len();
        let base = children.first().map_or(end, |&(_, offset)| offset);
        stack.resize(end + below * below, 0.0);
        let (done, update) = stack.split_at_mut(end);
        front.assemble_and_eliminate(
            symbolic,
            matrix,
            s,
            panel,
            update,
            children.iter().map(|&(c, offset)| {
                let side = symbolic.supernode(c as usize).2.len();
                (c, &done[offset..offset + side * side])
            }),
        )?;
        waiting.truncate(waiting.len() - num_children);
        let parent = symbolic.parents[s];
        if parent == ROOT {
            stack.truncate(base);
        } else if range.contains(&(parent as usize)) {
            stack.copy_within(end.., base);
            stack.truncate(base + below * below);
            waiting.push((s as u32, base));
        } else {
            out.push(Update {
                supernode: s as u32,
                values: stack[end..].to_vec(),
            });
            stack.truncate(base);
        }
    }
    Ok(out)
}

/// The memory of one front at a time.
struct Front {
    /// For the rows of the current front, their positions in it.
    places: Vec<u32>,
    /// The positions of a child's rows.
    relative: Vec<u32>,
    /// The front's first columns.
    panel: Vec<f64>,
}

impl Front {
    fn new(num_unknowns: usize) -> Self {
        Self {
            places: vec![0; num_unknowns],
            relative: Vec::new(),
            panel: Vec::new(),
        }
    }

    /// Sums the matrix entries and the children's updates, and eliminates the front's columns.
    #[inline(always)]
    fn assemble_and_eliminate<'a, V: Value>(
        &mut self,
        symbolic: &Symbolic,
        matrix: &[f64],
        s: usize,
        stored: &mut [V],
        update: &mut [f64],
        children: impl Iterator<Item = (u32, &'a [f64])>,
    ) -> Result<(), NotPositive> {
        let (start, width, rows) = symbolic.supernode(s);
        let (height, below) = (width + rows.len(), rows.len());
        let Self {
            places,
            relative,
            panel,
        } = self;
        for (k, place) in places[start..start + width].iter_mut().enumerate() {
            *place = k as u32;
        }
        for (k, &row) in rows.iter().enumerate() {
            places[row as usize] = (width + k) as u32;
        }
        panel.clear();
        panel.resize(height * width, 0.0);
        let columns = &symbolic.columns;
        for (k, column) in panel.chunks_exact_mut(height).enumerate() {
            let entries = columns.offsets[start + k]..columns.offsets[start + k + 1];
            let rows = &columns.rows[entries.clone()];
            for (&row, &source) in rows.iter().zip(&columns.sources[entries]) {
                column[places[row as usize] as usize] += matrix[source as usize];
            }
        }
        for (child, values) in children {
            let rows = symbolic.supernode(child as usize).2;
            relative.clear();
            relative.extend(rows.iter().map(|&row| places[row as usize]));
            let side = rows.len();
            for (b, column) in values.chunks_exact(side.max(1)).enumerate() {
                let place = relative[b] as usize;
                let (target, shift) = if place < width {
                    (&mut panel[place * height..(place + 1) * height], 0)
                } else {
                    let column = place - width;
                    (&mut update[column * below..(column + 1) * below], width)
                };
                for (x, &row) in column[b..].iter().zip(&relative[b..]) {
                    target[row as usize - shift] += x;
                }
            }
        }
        eliminate(panel, height, width, update)?;
        packed::pack(panel, height, width, stored);
        Ok(())
    }
}
