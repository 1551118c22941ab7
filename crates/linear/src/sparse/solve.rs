//! Solves with a factor: three right-hand sides at once, the factor streamed twice.

use std::ops::Range;

use nalgebra::Vector3;
use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::numeric::{Factor, Value, Values};
use super::packed;
use super::symbolic::Symbolic;

/// The memory of a solve, allocated once.
pub(crate) struct Buffers {
    /// The unknowns, group by group: see `Tasks`.
    vectors: Vec<[f64; 3]>,
    /// For every unknown its place there.
    places: Vec<u32>,
    /// The unknowns at the top, in their order there.
    top: Vec<u32>,
    /// Per group, and for the top: the unknowns of one front, axis by axis.
    fronts: Vec<Vec<f64>>,
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
            places,
            top: top_columns.copied().collect(),
            fronts,
        }
    }
}

impl Factor {
    /// Overwrites right-hand sides by their solutions.
    pub(crate) fn solve(&self, rhs: &mut [Vector3<f64>], buffers: &mut Buffers) {
        self.solve_between(rhs, |_, b| *b, |_, x| x, buffers);
    }

    /// As [`Self::solve`]: the right-hand side is what `before` makes of the number and the value of every
    /// entry, and what is written is what `after` makes of the solution. So passes over the vectors are
    /// saved.
    pub(crate) fn solve_between(
        &self,
        x: &mut [Vector3<f64>],
        before: impl Fn(usize, &Vector3<f64>) -> Vector3<f64> + Sync,
        after: impl Fn(usize, Vector3<f64>) -> Vector3<f64> + Sync,
        buffers: &mut Buffers,
    ) {
        match &self.values {
            Values::Double(values) => {
                solve(&self.symbolic, values, x, &before, &after, buffers);
            }
            Values::Single(values) => {
                solve(&self.symbolic, values, x, &before, &after, buffers);
            }
        }
    }
}

fn solve<V: Value>(
    symbolic: &Symbolic,
    values: &[V],
    x: &mut [Vector3<f64>],
    before: &(impl Fn(usize, &Vector3<f64>) -> Vector3<f64> + Sync),
    after: &(impl Fn(usize, Vector3<f64>) -> Vector3<f64> + Sync),
    buffers: &mut Buffers,
) {
    const CHUNK: usize = 1 << 13;
    let tasks = &symbolic.tasks;
    let Buffers {
        vectors,
        places,
        top: top_columns,
        fronts,
    } = buffers;
    let (mut groups, top) = parts(tasks.lengths.as_slice(), vectors);
    let (group_fronts, top_front) = fronts.split_at_mut(tasks.subtrees.len());
    let top_front = &mut top_front[0];

    let rhs = &*x;
    let take = |vectors: &mut [[f64; 3]], unknowns: &[u32]| {
        for (vector, &unknown) in vectors.iter_mut().zip(unknowns) {
            let unknown = unknown as usize;
            *vector = before(unknown, &rhs[unknown]).into();
        }
    };
    groups
        .par_iter_mut()
        .zip(&mut *group_fronts)
        .zip(&tasks.subtrees)
        .with_max_len(1)
        .for_each(|((vectors, front), range)| {
            let columns = symbolic.columns_of(range.clone());
            // The tail gathers sums: it starts from zero.
            vectors[columns.len()..].fill([0.0; 3]);
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
    take(top, top_columns);
    for (group, vectors) in groups.iter().enumerate() {
        let columns = symbolic.num_columns(tasks.subtrees[group].clone());
        for (x, &place) in vectors[columns..].iter().zip(tasks.tail(group)) {
            let target = &mut top[place as usize];
            for axis in 0..3 {
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
    groups
        .par_iter_mut()
        .zip(group_fronts)
        .enumerate()
        .with_max_len(1)
        .for_each(|(group, (vectors, front))| {
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
    x.par_iter_mut()
        .zip(&*places)
        .enumerate()
        .with_min_len(CHUNK)
        .for_each(|(i, (x, &place))| *x = after(i, Vector3::from(vectors[place as usize])));
}

/// The buffers of the groups and that of the top.
fn parts<'a>(
    lengths: &[usize],
    mut vectors: &'a mut [[f64; 3]],
) -> (Vec<&'a mut [[f64; 3]]>, &'a mut [[f64; 3]]) {
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

/// One way through some supernodes, compiled for the vector instructions that the machine has.
struct Sweep<'a, V, I> {
    symbolic: &'a Symbolic,
    values: &'a [V],
    vectors: &'a mut [[f64; 3]],
    front: &'a mut [f64],
    direction: Direction,
    supernodes: I,
}

impl<V: Value, I: DoubleEndedIterator<Item = usize> + Clone> WithSimd for Sweep<'_, V, I> {
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

/// The unknowns of a front, axis by axis, each filled up to whole tiles.
struct Axes<'a> {
    x: &'a mut [f64],
    y: &'a mut [f64],
    z: &'a mut [f64],
    /// Room for the values of a block.
    scratch: &'a mut [f64],
}

impl<'a> Axes<'a> {
    #[inline(always)]
    fn new(front: &'a mut [f64], height: usize) -> Self {
        let stride = axis_len(height);
        let (x, rest) = front.split_at_mut(stride);
        let (y, rest) = rest.split_at_mut(stride);
        let (z, scratch) = rest.split_at_mut(stride);
        Self { x, y, z, scratch }
    }

    /// Takes the front's columns.
    #[inline(always)]
    fn load(&mut self, columns: &[[f64; 3]]) {
        for (k, v) in columns.iter().enumerate() {
            self.set(k, *v);
        }
    }

    /// Gives them back.
    #[inline(always)]
    fn store(&self, columns: &mut [[f64; 3]]) {
        for (k, v) in columns.iter_mut().enumerate() {
            *v = self.get(k);
        }
    }

    #[inline(always)]
    fn set(&mut self, k: usize, v: [f64; 3]) {
        (self.x[k], self.y[k], self.z[k]) = (v[0], v[1], v[2]);
    }

    #[inline(always)]
    fn get(&self, k: usize) -> [f64; 3] {
        [self.x[k], self.y[k], self.z[k]]
    }
}

/// Length of an axis: whole tiles behind every column.
fn axis_len(height: usize) -> usize {
    height + packed::TILE
}

/// One front of L y = b.
#[inline(always)]
fn forward<S: Simd, V: Value>(
    simd: S,
    symbolic: &Symbolic,
    values: &[V],
    s: usize,
    column: usize,
    vectors: &mut [[f64; 3]],
    front: &mut [f64],
) {
    let (_, width, rows) = symbolic.supernode(s);
    let mut stored = symbolic.values_of(s, values);
    let mut axes = Axes::new(front, width + rows.len());
    axes.load(&vectors[column..column + width]);
    for axis in [&mut *axes.x, &mut *axes.y, &mut *axes.z] {
        axis[width..].fill(0.0);
    }
    let height = width + rows.len();
    let mut begin = 0;
    while begin + 4 <= width {
        stored = forward_block::<S, V, 4>(simd, stored, begin, height, &mut axes);
        begin += 4;
    }
    if begin + 2 <= width {
        stored = forward_block::<S, V, 2>(simd, stored, begin, height, &mut axes);
        begin += 2;
    }
    if begin < width {
        forward_block::<S, V, 1>(simd, stored, begin, height, &mut axes);
    }
    axes.store(&mut vectors[column..column + width]);
    for (k, &slot) in symbolic.slots(s).iter().enumerate() {
        let v = &mut vectors[slot as usize];
        let sum = axes.get(width + k);
        *v = [v[0] + sum[0], v[1] + sum[1], v[2] + sum[2]];
    }
}

/// One block of columns; returns the values behind it.
#[inline(always)]
fn forward_block<'v, S: Simd, V: Value, const B: usize>(
    simd: S,
    stored: &'v [V],
    column: usize,
    height: usize,
    axes: &mut Axes<'_>,
) -> &'v [V] {
    let below = column + B;
    let (square, rest) = stored.split_at(B * B);
    let (tiles, rest) = rest.split_at(B * (height - below).next_multiple_of(packed::TILE));
    let x = forward_square::<V, B>(square, &mut axes.x[column..]);
    let y = forward_square::<V, B>(square, &mut axes.y[column..]);
    let z = forward_square::<V, B>(square, &mut axes.z[column..]);
    let padded = tiles.len() / B;
    let tiles = S::as_simd_f64s(V::widen(tiles, axes.scratch)).0;
    let ax = S::as_mut_simd_f64s(&mut axes.x[below..][..padded]).0;
    let ay = S::as_mut_simd_f64s(&mut axes.y[below..][..padded]).0;
    let az = S::as_mut_simd_f64s(&mut axes.z[below..][..padded]).0;
    // Vectors in the height of a tile: 1 where a vector has four lanes.
    let step = packed::TILE / S::F64_LANES;
    let (x, y, z) = (minus(simd, &x), minus(simd, &y), minus(simd, &z));
    let rows = ax.iter_mut().zip(ay).zip(az).enumerate();
    for (i, ((ax, ay), az)) in rows {
        let tile = &tiles[i / step * step * B + i % step..];
        for k in 0..B {
            let l = tile[k * step];
            *ax = simd.mul_add_f64s(l, x[k], *ax);
            *ay = simd.mul_add_f64s(l, y[k], *ay);
            *az = simd.mul_add_f64s(l, z[k], *az);
        }
    }
    rest
}

/// −x, each in a whole vector.
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

/// One front of Lᵀ x = y.
#[inline(always)]
fn backward<S: Simd, V: Value>(
    simd: S,
    symbolic: &Symbolic,
    values: &[V],
    s: usize,
    column: usize,
    vectors: &mut [[f64; 3]],
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
    for axis in [&mut *axes.x, &mut *axes.y, &mut *axes.z] {
        axis[height..].fill(0.0);
    }
    // The blocks from the last to the first: one of one, one of two, then those of four.
    let mut column_end = width;
    if width % 2 == 1 {
        column_end -= 1;
        stored = backward_block::<S, V, 1>(simd, stored, column_end, height, &mut axes);
    }
    if width % 4 >= 2 {
        column_end -= 2;
        stored = backward_block::<S, V, 2>(simd, stored, column_end, height, &mut axes);
    }
    while column_end > 0 {
        column_end -= 4;
        stored = backward_block::<S, V, 4>(simd, stored, column_end, height, &mut axes);
    }
    axes.store(&mut vectors[column..column + width]);
}

/// One block of columns, the last of `stored`; returns the values before it.
#[inline(always)]
fn backward_block<'v, S: Simd, V: Value, const B: usize>(
    simd: S,
    stored: &'v [V],
    column: usize,
    height: usize,
    axes: &mut Axes<'_>,
) -> &'v [V] {
    let below = column + B;
    let tiles_len = B * (height - below).next_multiple_of(packed::TILE);
    let (rest, block) = stored.split_at(stored.len() - B * B - tiles_len);
    let (square, tiles) = block.split_at(B * B);
    let padded = tiles.len() / B;
    let tiles = S::as_simd_f64s(V::widen(tiles, axes.scratch)).0;
    let ax = S::as_simd_f64s(&axes.x[below..][..padded]).0;
    let ay = S::as_simd_f64s(&axes.y[below..][..padded]).0;
    let az = S::as_simd_f64s(&axes.z[below..][..padded]).0;
    let step = packed::TILE / S::F64_LANES;
    let mut sums = [[simd.splat_f64s(0.0); 3]; B];
    // From the end: the factor is read as one descending stream.
    for (i, ((x, y), z)) in ax.iter().zip(ay).zip(az).enumerate().rev() {
        let tile = &tiles[i / step * step * B + i % step..];
        for k in 0..B {
            let l = tile[k * step];
            sums[k][0] = simd.mul_add_f64s(l, *x, sums[k][0]);
            sums[k][1] = simd.mul_add_f64s(l, *y, sums[k][1]);
            sums[k][2] = simd.mul_add_f64s(l, *z, sums[k][2]);
        }
    }
    for (axis, values) in [&mut *axes.x, &mut *axes.y, &mut *axes.z]
        .into_iter()
        .enumerate()
    {
        for k in (0..B).rev() {
            let mut sum = values[column + k] - simd.reduce_sum_f64s(sums[k][axis]);
            for j in k + 1..B {
                sum -= square[k * B + j].into() * values[column + j];
            }
            values[column + k] = sum * square[k * B + k].into();
        }
    }
    rest
}
