//! Solves with a factor, for three right-hand sides at once or for one; the factor is streamed
//! twice.

use std::ops::Range;

use cotan_parallel::{self as parallel, Chunks};
use nalgebra::Vector3;
use pulp::{Simd, WithSimd};

use super::numeric::{Factor, Value, Values};
use super::packed;
use super::symbolic::Symbolic;

/// The memory of a solve, allocated once.
pub(crate) struct Buffers {
    /// The unknowns, group by group: see `Tasks`.
    vectors: Vec<[f64; 3]>,
    /// The same for one right-hand side; empty until there is one.
    numbers: Vec<[f64; 1]>,
    places: Places,
    /// Per group, and for the top: the unknowns of one front, axis by axis.
    fronts: Vec<Vec<f64>>,
}

/// The positions of the unknowns.
struct Places {
    /// For every unknown, its position in the buffers.
    of: Vec<u32>,
    /// The unknowns at the top, in their order there.
    top: Vec<u32>,
}

impl Buffers {
    pub(crate) fn new(symbolic: &Symbolic) -> Self {
        let tasks = &symbolic.tasks;
        let mut places = vec![0u32; symbolic.num_unknowns()];
        for (&unknown, &place) in symbolic.order.iter().zip(&tasks.places) {
            places[unknown as usize] = place;
        }
        let height = |s: usize| {
            let (_, width, rows) = symbolic.supernode(s);
            width + rows.len()
        };
        let tallest = |range: Range<usize>| range.map(height).max().unwrap_or(0);
        let of_top = tasks.top.iter().map(|&s| height(s as usize)).max();
        let fronts = tasks
            .subtrees
            .iter()
            .map(|range| tallest(range.clone()))
            .chain(std::iter::once(of_top.unwrap_or(0)))
            .map(|height| vec![0.0; 7 * axis_len(height)])
            .collect();
        let top_columns = tasks.top.iter().flat_map(|&s| {
            let (start, width, _) = symbolic.supernode(s as usize);
            &symbolic.order[start..start + width]
        });
        Self {
            vectors: vec![[0.0; 3]; tasks.lengths.iter().sum()],
            numbers: Vec::new(),
            places: Places {
                top: top_columns.copied().collect(),
                of: places,
            },
            fronts,
        }
    }
}

impl Factor {
    /// Overwrites right-hand sides with their solutions.
    pub(crate) fn solve(&self, rhs: &mut [Vector3<f64>], buffers: &mut Buffers) {
        self.solve_between(rhs, |_, b| *b, |_, x| x, buffers);
    }

    /// Like [`Self::solve`], but applies `before` to the index and value of every entry to get
    /// the right-hand side, and `after` to the solution to get the output.
    ///
    /// This saves passes over the vectors.
    pub(crate) fn solve_between(
        &self,
        x: &mut [Vector3<f64>],
        before: impl Fn(usize, &Vector3<f64>) -> Vector3<f64> + Sync,
        after: impl Fn(usize, Vector3<f64>) -> Vector3<f64> + Sync,
        buffers: &mut Buffers,
    ) {
        let Buffers {
            vectors,
            places,
            fronts,
            ..
        } = buffers;
        let before = |i: usize, b: &Vector3<f64>| before(i, b).into();
        let after = |i: usize, x: [f64; 3]| after(i, x.into());
        self.solve_for(x, &before, &after, vectors, places, fronts);
    }

    /// Overwrites one right-hand side with its solution.
    pub(crate) fn solve_one(&self, x: &mut [f64], buffers: &mut Buffers) {
        let Buffers {
            vectors,
            numbers,
            places,
            fronts,
        } = buffers;
        numbers.resize(vectors.len(), [0.0]);
        self.solve_for(x, &|_, b| [*b], &|_, [x]| x, numbers, places, fronts);
    }

    fn solve_for<X: Send + Sync, const A: usize>(
        &self,
        x: &mut [X],
        before: &(impl Fn(usize, &X) -> [f64; A] + Sync),
        after: &(impl Fn(usize, [f64; A]) -> X + Sync),
        vectors: &mut [[f64; A]],
        places: &Places,
        fronts: &mut [Vec<f64>],
    ) {
        match &self.values {
            Values::Double(values) => {
                let job = Job {
                    symbolic: &self.symbolic,
                    values,
                    places,
                };
                job.solve(x, before, after, vectors, fronts);
            }
            Values::Single(values) => {
                let job = Job {
                    symbolic: &self.symbolic,
                    values,
                    places,
                };
                job.solve(x, before, after, vectors, fronts);
            }
        }
    }
}

/// The input of a solve.
struct Job<'a, V> {
    symbolic: &'a Symbolic,
    values: &'a [V],
    places: &'a Places,
}

impl<V: Value> Job<'_, V> {
    fn solve<X: Send + Sync, const A: usize>(
        &self,
        x: &mut [X],
        before: &(impl Fn(usize, &X) -> [f64; A] + Sync),
        after: &(impl Fn(usize, [f64; A]) -> X + Sync),
        vectors: &mut [[f64; A]],
        fronts: &mut [Vec<f64>],
    ) {
        const CHUNKS: Chunks = Chunks::of(1 << 13);
        let Self {
            symbolic,
            values,
            places,
        } = *self;
        let tasks = &symbolic.tasks;
        let (mut groups, top) = parts(tasks.lengths.as_slice(), &mut *vectors);
        let (group_fronts, top_front) = fronts.split_at_mut(tasks.subtrees.len());
        let top_front = &mut top_front[0];

        let rhs = &*x;
        let take = |vectors: &mut [[f64; A]], unknowns: &[u32]| {
            for (vector, &unknown) in vectors.iter_mut().zip(unknowns) {
                let unknown = unknown as usize;
                *vector = before(unknown, &rhs[unknown]);
            }
        };
        let down = groups.iter_mut().zip(&mut *group_fronts);
        let down = down.zip(&tasks.subtrees).collect();
        parallel::tasks(down, |((vectors, front), range)| {
            let columns = symbolic.columns_of(range.clone());
            // The tail accumulates sums, so it starts from zero.
            vectors[columns.len()..].fill([0.0; A]);
            take(vectors, &symbolic.order[columns]);
            pulp::Arch::new().dispatch(Sweep {
                symbolic,
                values,
                vectors,
                front,
                direction: Direction::Forward,
                supernodes: range.clone(),
            });
        });
        take(top, &places.top);
        for (group, vectors) in groups.iter().enumerate() {
            let columns = symbolic.num_columns(tasks.subtrees[group].clone());
            for (x, &place) in vectors[columns..].iter().zip(tasks.tail(group)) {
                let target = &mut top[place as usize];
                for axis in 0..A {
                    target[axis] += x[axis];
                }
            }
        }
        for direction in [Direction::Forward, Direction::Backward] {
            pulp::Arch::new().dispatch(Sweep {
                symbolic,
                values,
                vectors: &mut *top,
                front: top_front,
                direction,
                supernodes: tasks.top.iter().map(|&s| s as usize),
            });
        }
        let top = &*top;
        let up = groups.iter_mut().zip(group_fronts).enumerate().collect();
        parallel::tasks(up, |(group, (vectors, front))| {
            let range = tasks.subtrees[group].clone();
            let columns = symbolic.num_columns(range.clone());
            for (x, &place) in vectors[columns..].iter_mut().zip(tasks.tail(group)) {
                *x = top[place as usize];
            }
            pulp::Arch::new().dispatch(Sweep {
                symbolic,
                values,
                vectors,
                front,
                direction: Direction::Backward,
                supernodes: range,
            });
        });
        drop(groups);
        let vectors = &*vectors;
        CHUNKS.update((x, &places.of[..]), |i, (x, &place)| {
            *x = after(i, vectors[place as usize]);
        });
    }
}

/// Splits the buffers into those of the groups and that of the top.
fn parts<'a, X>(lengths: &[usize], mut vectors: &'a mut [X]) -> (Vec<&'a mut [X]>, &'a mut [X]) {
    let mut groups = Vec::with_capacity(lengths.len());
    for &length in &lengths[..lengths.len() - 1] {
        let (group, rest) = vectors.split_at_mut(length);
        groups.push(group);
        vectors = rest;
    }
    (groups, vectors)
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Direction {
    Forward,
    Backward,
}

/// One sweep through some supernodes, compiled for the vector instructions of the machine.
struct Sweep<'a, V, I, const A: usize> {
    symbolic: &'a Symbolic,
    values: &'a [V],
    vectors: &'a mut [[f64; A]],
    front: &'a mut [f64],
    direction: Direction,
    supernodes: I,
}

impl<V: Value, I: DoubleEndedIterator<Item = usize> + Clone, const A: usize> WithSimd
    for Sweep<'_, V, I, A>
{
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            symbolic,
            values,
            vectors,
            front,
            direction,
            supernodes,
        } = self;
        match direction {
            Direction::Forward => {
                let mut column = 0;
                for s in supernodes {
                    forward(simd, symbolic, values, s, column, vectors, front);
                    column += symbolic.supernode(s).1;
                }
            }
            Direction::Backward => {
                let width = |s: usize| symbolic.supernode(s).1;
                let mut column: usize = supernodes.clone().map(width).sum();
                for s in supernodes.rev() {
                    column -= width(s);
                    backward(simd, symbolic, values, s, column, vectors, front);
                }
            }
        }
    }
}

/// The unknowns of a front, axis by axis, each padded to whole tiles.
struct Axes<'a, const A: usize> {
    axes: [&'a mut [f64]; A],
    /// Scratch memory for the values of a block.
    scratch: &'a mut [f64],
}

impl<'a, const A: usize> Axes<'a, A> {
    #[inline(always)]
    fn new(front: &'a mut [f64], height: usize) -> Self {
        let stride = axis_len(height);
        let mut axes: [&mut [f64]; A] = std::array::from_fn(|_| Default::default());
        let mut rest = front;
        for axis in &mut axes {
            (*axis, rest) = rest.split_at_mut(stride);
        }
        Self {
            axes,
            scratch: rest,
        }
    }

    /// Loads the front's columns.
    #[inline(always)]
    fn load(&mut self, columns: &[[f64; A]]) {
        for (k, v) in columns.iter().enumerate() {
            self.set(k, *v);
        }
    }

    /// Stores them back.
    #[inline(always)]
    fn store(&self, columns: &mut [[f64; A]]) {
        for (k, v) in columns.iter_mut().enumerate() {
            *v = self.get(k);
        }
    }

    #[inline(always)]
    fn set(&mut self, k: usize, v: [f64; A]) {
        for a in 0..A {
            self.axes[a][k] = v[a];
        }
    }

    #[inline(always)]
    fn get(&self, k: usize) -> [f64; A] {
        let mut v = [0.0; A];
        for a in 0..A {
            v[a] = self.axes[a][k];
        }
        v
    }

    #[inline(always)]
    fn clear_from(&mut self, k: usize) {
        for axis in &mut self.axes {
            axis[k..].fill(0.0);
        }
    }
}

/// Length of an axis, with room for a whole tile after every column.
fn axis_len(height: usize) -> usize {
    height + packed::TILE
}

/// Solves one front of L y = b.
#[inline(always)]
fn forward<S: Simd, V: Value, const A: usize>(
    simd: S,
    symbolic: &Symbolic,
    values: &[V],
    s: usize,
    column: usize,
    vectors: &mut [[f64; A]],
    front: &mut [f64],
) {
    let (_, width, rows) = symbolic.supernode(s);
    let mut stored = symbolic.values_of(s, values);
    let mut axes = Axes::new(front, width + rows.len());
    axes.load(&vectors[column..column + width]);
    axes.clear_from(width);
    let height = width + rows.len();
    let mut begin = 0;
    while begin + 4 <= width {
        stored = forward_block::<S, V, 4, A>(simd, stored, begin, height, &mut axes);
        begin += 4;
    }
    if begin + 2 <= width {
        stored = forward_block::<S, V, 2, A>(simd, stored, begin, height, &mut axes);
        begin += 2;
    }
    if begin < width {
        forward_block::<S, V, 1, A>(simd, stored, begin, height, &mut axes);
    }
    axes.store(&mut vectors[column..column + width]);
    for (k, &slot) in symbolic.slots(s).iter().enumerate() {
        let v = &mut vectors[slot as usize];
        let sum = axes.get(width + k);
        for a in 0..A {
            v[a] += sum[a];
        }
    }
}

/// Processes one block of columns; returns the values after it.
#[inline(always)]
fn forward_block<'v, S: Simd, V: Value, const B: usize, const A: usize>(
    simd: S,
    stored: &'v [V],
    column: usize,
    height: usize,
    axes: &mut Axes<'_, A>,
) -> &'v [V] {
    let below = column + B;
    let (square, rest) = stored.split_at(B * B);
    let (tiles, rest) = rest.split_at(B * (height - below).next_multiple_of(packed::TILE));
    let mut x = [[simd.splat_f64s(0.0); B]; A];
    for (x, axis) in x.iter_mut().zip(&mut axes.axes) {
        *x = minus(simd, &forward_square::<V, B>(square, &mut axis[column..]));
    }
    let padded = tiles.len() / B;
    let tiles = S::as_simd_f64s(V::widen(tiles, axes.scratch)).0;
    // Number of vectors in the height of a tile: 1 if a vector has four lanes.
    let step = packed::TILE / S::F64_LANES;
    let num = padded / S::F64_LANES;
    // Do not use `map`, whose closure is not compiled for wider vectors.
    let mut rows: [&mut [S::f64s]; A] = std::array::from_fn(|_| Default::default());
    for (rows, axis) in rows.iter_mut().zip(&mut axes.axes) {
        *rows = &mut S::as_mut_simd_f64s(&mut axis[below..][..padded]).0[..num];
    }
    for i in 0..num {
        let tile = &tiles[i / step * step * B + i % step..];
        for k in 0..B {
            let l = tile[k * step];
            for a in 0..A {
                rows[a][i] = simd.mul_add_f64s(l, x[a][k], rows[a][i]);
            }
        }
    }
    rest
}

/// −x, each broadcast to a whole vector.
#[inline(always)]
fn minus<S: Simd, const B: usize>(simd: S, x: &[f64; B]) -> [S::f64s; B] {
    let mut out = [simd.splat_f64s(0.0); B];
    for k in 0..B {
        out[k] = simd.splat_f64s(-x[k]);
    }
    out
}

#[inline(always)]
fn forward_square<V: Value, const B: usize>(square: &[V], axis: &mut [f64]) -> [f64; B] {
    let mut x = [0.0; B];
    for k in 0..B {
        let mut sum = axis[k];
        for j in 0..k {
            sum -= square[j * B + k].into() * x[j];
        }
        x[k] = sum * square[k * B + k].into();
        axis[k] = x[k];
    }
    x
}

/// Solves one front of Lᵀ x = y.
#[inline(always)]
fn backward<S: Simd, V: Value, const A: usize>(
    simd: S,
    symbolic: &Symbolic,
    values: &[V],
    s: usize,
    column: usize,
    vectors: &mut [[f64; A]],
    front: &mut [f64],
) {
    let (_, width, rows) = symbolic.supernode(s);
    let mut stored = symbolic.values_of(s, values);
    let height = width + rows.len();
    let mut axes = Axes::new(front, height);
    axes.load(&vectors[column..column + width]);
    for (k, &slot) in symbolic.slots(s).iter().enumerate() {
        axes.set(width + k, vectors[slot as usize]);
    }
    axes.clear_from(height);
    // Process the blocks from last to first: one of width one, one of width two, then those of
    // four.
    let mut column_end = width;
    if width % 2 == 1 {
        column_end -= 1;
        stored = backward_block::<S, V, 1, A>(simd, stored, column_end, height, &mut axes);
    }
    if width % 4 >= 2 {
        column_end -= 2;
        stored = backward_block::<S, V, 2, A>(simd, stored, column_end, height, &mut axes);
    }
    while column_end > 0 {
        column_end -= 4;
        stored = backward_block::<S, V, 4, A>(simd, stored, column_end, height, &mut axes);
    }
    axes.store(&mut vectors[column..column + width]);
}

/// Processes one block of columns, the last of `stored`; returns the values before it.
#[inline(always)]
fn backward_block<'v, S: Simd, V: Value, const B: usize, const A: usize>(
    simd: S,
    stored: &'v [V],
    column: usize,
    height: usize,
    axes: &mut Axes<'_, A>,
) -> &'v [V] {
    let below = column + B;
    let tiles_len = B * (height - below).next_multiple_of(packed::TILE);
    let (rest, block) = stored.split_at(stored.len() - B * B - tiles_len);
    let (square, tiles) = block.split_at(B * B);
    let padded = tiles.len() / B;
    let tiles = S::as_simd_f64s(V::widen(tiles, axes.scratch)).0;
    let step = packed::TILE / S::F64_LANES;
    let num = padded / S::F64_LANES;
    let mut rows = [&[] as &[S::f64s]; A];
    for a in 0..A {
        rows[a] = &S::as_simd_f64s(&axes.axes[a][below..][..padded]).0[..num];
    }
    let mut sums = [[simd.splat_f64s(0.0); A]; B];
    // From the end, so that the factor is read as one descending stream.
    for i in (0..num).rev() {
        let tile = &tiles[i / step * step * B + i % step..];
        for k in 0..B {
            let l = tile[k * step];
            for a in 0..A {
                sums[k][a] = simd.mul_add_f64s(l, rows[a][i], sums[k][a]);
            }
        }
    }
    for (a, values) in axes.axes.iter_mut().enumerate() {
        for k in (0..B).rev() {
            let mut sum = values[column + k] - simd.reduce_sum_f64s(sums[k][a]);
            for j in k + 1..B {
                sum -= square[k * B + j].into() * values[column + j];
            }
            values[column + k] = sum * square[k * B + k].into();
        }
    }
    rest
}
