//! Solves with a factor: three right-hand sides at once, the factor streamed twice.

use std::ops::Range;

use nalgebra::Vector3;
use rayon::prelude::*;

use super::numeric::{Factor, Value, Values};
use super::symbolic::Symbolic;

/// The memory of a solve, allocated once.
pub(crate) struct Buffers {
    /// The unknowns, group by group: see `Tasks`.
    vectors: Vec<[f64; 3]>,
    /// For every unknown its place there.
    places: Vec<u32>,
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
            .map(|height| vec![0.0; 3 * height])
            .collect();
        Self {
            vectors: vec![[0.0; 3]; tasks.lengths.iter().sum()],
            places,
            fronts,
        }
    }
}

impl Factor {
    /// Overwrites right-hand sides by their solutions.
    pub(crate) fn solve(&self, rhs: &mut [Vector3<f64>], buffers: &mut Buffers) {
        match &self.values {
            Values::Double(values) => solve(&self.symbolic, values, rhs, buffers),
            Values::Single(values) => solve(&self.symbolic, values, rhs, buffers),
        }
    }
}

fn solve<V: Value>(
    symbolic: &Symbolic,
    values: &[V],
    rhs: &mut [Vector3<f64>],
    buffers: &mut Buffers,
) {
    const CHUNK: usize = 1 << 13;
    let tasks = &symbolic.tasks;
    let Buffers {
        vectors,
        places,
        fronts,
    } = buffers;
    // The tails gather sums: they start from zero.
    let mut at = 0;
    for (range, &length) in tasks.subtrees.iter().zip(&tasks.lengths) {
        let columns = symbolic.num_columns(range.clone());
        vectors[at + columns..at + length].fill([0.0; 3]);
        at += length;
    }
    for (b, &place) in rhs.iter().zip(&*places) {
        vectors[place as usize] = [b.x, b.y, b.z];
    }
    let (mut groups, top) = parts(tasks.lengths.as_slice(), vectors);
    let (group_fronts, top_front) = fronts.split_at_mut(tasks.subtrees.len());
    let top_front = &mut top_front[0];

    groups
        .par_iter_mut()
        .zip(&mut *group_fronts)
        .zip(&tasks.subtrees)
        .with_max_len(1)
        .for_each(|((vectors, front), range)| {
            pulp::Arch::new().dispatch(
                #[inline(always)]
                || {
                    let mut column = 0;
                    for s in range.clone() {
                        column += forward(symbolic, values, s, column, vectors, front);
                    }
                },
            );
        });
    for (group, vectors) in groups.iter().enumerate() {
        let columns = symbolic.num_columns(tasks.subtrees[group].clone());
        for (x, &place) in vectors[columns..].iter().zip(tasks.tail(group)) {
            let target = &mut top[place as usize];
            for axis in 0..3 {
                target[axis] += x[axis];
            }
        }
    }
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || {
            let mut column = 0;
            for &s in &tasks.top {
                column += forward(symbolic, values, s as usize, column, top, top_front);
            }
            for &s in tasks.top.iter().rev() {
                column -= symbolic.supernode(s as usize).1;
                backward(symbolic, values, s as usize, column, top, top_front);
            }
        },
    );
    let top = &*top;
    groups
        .par_iter_mut()
        .zip(group_fronts)
        .enumerate()
        .with_max_len(1)
        .for_each(|(group, (vectors, front))| {
            pulp::Arch::new().dispatch(
                #[inline(always)]
                || {
                    let range = tasks.subtrees[group].clone();
                    let mut column = symbolic.num_columns(range.clone());
                    let tail = vectors[column..].iter_mut().zip(tasks.tail(group));
                    for (x, &place) in tail {
                        *x = top[place as usize];
                    }
                    for s in range.rev() {
                        column -= symbolic.supernode(s).1;
                        backward(symbolic, values, s, column, vectors, front);
                    }
                },
            );
        });
    drop(groups);
    let vectors = &*vectors;
    rhs.par_iter_mut()
        .zip(&*places)
        .with_min_len(CHUNK)
        .for_each(|(x, &place)| *x = Vector3::from(vectors[place as usize]));
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

/// One front of L y = b. Returns its number of columns.
#[inline(always)]
fn forward<V: Value>(
    symbolic: &Symbolic,
    values: &[V],
    s: usize,
    column: usize,
    vectors: &mut [[f64; 3]],
    front: &mut [f64],
) -> usize {
    let (_, width, rows) = symbolic.supernode(s);
    let height = width + rows.len();
    let panel = &values[symbolic.value_offsets[s]..symbolic.value_offsets[s + 1]];
    let (fx, rest) = front.split_at_mut(height);
    let (fy, rest) = rest.split_at_mut(height);
    let fz = &mut rest[..height];
    for (k, v) in vectors[column..column + width].iter().enumerate() {
        (fx[k], fy[k], fz[k]) = (v[0], v[1], v[2]);
    }
    fx[width..].fill(0.0);
    fy[width..].fill(0.0);
    fz[width..].fill(0.0);
    let mut j = 0;
    while j + 4 <= width {
        let l = |k: usize| &panel[(j + k) * height..(j + k + 1) * height];
        let (l0, l1, l2, l3) = (l(0), l(1), l(2), l(3));
        for f in [&mut *fx, &mut *fy, &mut *fz] {
            let a = f[j] / l0[j].into();
            let b = (f[j + 1] - l0[j + 1].into() * a) / l1[j + 1].into();
            let c = (f[j + 2] - l0[j + 2].into() * a - l1[j + 2].into() * b) / l2[j + 2].into();
            let d = (f[j + 3] - l0[j + 3].into() * a - l1[j + 3].into() * b - l2[j + 3].into() * c)
                / l3[j + 3].into();
            (f[j], f[j + 1], f[j + 2], f[j + 3]) = (a, b, c, d);
        }
        let x = [fx[j], fx[j + 1], fx[j + 2], fx[j + 3]];
        let y = [fy[j], fy[j + 1], fy[j + 2], fy[j + 3]];
        let z = [fz[j], fz[j + 1], fz[j + 2], fz[j + 3]];
        j += 4;
        let m = height - j;
        let (l0, l1, l2, l3) = (&l0[j..][..m], &l1[j..][..m], &l2[j..][..m], &l3[j..][..m]);
        let (fx, fy, fz) = (&mut fx[j..][..m], &mut fy[j..][..m], &mut fz[j..][..m]);
        for i in 0..m {
            let (a, b, c, d): (f64, f64, f64, f64) =
                (l0[i].into(), l1[i].into(), l2[i].into(), l3[i].into());
            fx[i] -= (a * x[0] + b * x[1]) + (c * x[2] + d * x[3]);
            fy[i] -= (a * y[0] + b * y[1]) + (c * y[2] + d * y[3]);
            fz[i] -= (a * z[0] + b * z[1]) + (c * z[2] + d * z[3]);
        }
    }
    while j < width {
        let l = &panel[j * height..(j + 1) * height];
        let inverse = 1.0 / l[j].into();
        let (x, y, z) = (fx[j] * inverse, fy[j] * inverse, fz[j] * inverse);
        (fx[j], fy[j], fz[j]) = (x, y, z);
        j += 1;
        let m = height - j;
        let l = &l[j..][..m];
        let (fx, fy, fz) = (&mut fx[j..][..m], &mut fy[j..][..m], &mut fz[j..][..m]);
        for i in 0..m {
            let a: f64 = l[i].into();
            fx[i] -= a * x;
            fy[i] -= a * y;
            fz[i] -= a * z;
        }
    }
    for (k, v) in vectors[column..column + width].iter_mut().enumerate() {
        *v = [fx[k], fy[k], fz[k]];
    }
    let slots = symbolic.slots(s);
    let (fx, fy, fz) = (&fx[width..], &fy[width..], &fz[width..]);
    for (((&slot, x), y), z) in slots.iter().zip(fx).zip(fy).zip(fz) {
        let v = &mut vectors[slot as usize];
        *v = [v[0] + x, v[1] + y, v[2] + z];
    }
    width
}

/// One front of Lᵀ x = y.
#[inline(always)]
fn backward<V: Value>(
    symbolic: &Symbolic,
    values: &[V],
    s: usize,
    column: usize,
    vectors: &mut [[f64; 3]],
    front: &mut [f64],
) {
    let (_, width, rows) = symbolic.supernode(s);
    let height = width + rows.len();
    let panel = &values[symbolic.value_offsets[s]..symbolic.value_offsets[s + 1]];
    let (fx, rest) = front.split_at_mut(height);
    let (fy, rest) = rest.split_at_mut(height);
    let fz = &mut rest[..height];
    for (k, v) in vectors[column..column + width].iter().enumerate() {
        (fx[k], fy[k], fz[k]) = (v[0], v[1], v[2]);
    }
    for (k, &slot) in symbolic.slots(s).iter().enumerate() {
        let v = vectors[slot as usize];
        (fx[width + k], fy[width + k], fz[width + k]) = (v[0], v[1], v[2]);
    }
    let mut j = width;
    while j >= 2 {
        j -= 2;
        let l0 = &panel[j * height..(j + 1) * height];
        let l1 = &panel[(j + 1) * height..(j + 2) * height];
        let i = j + 2;
        let m = height - i;
        let [a, b] = dots(
            &l0[i..][..m],
            &l1[i..][..m],
            &fx[i..][..m],
            &fy[i..][..m],
            &fz[i..][..m],
        );
        let (d0, l10, d1): (f64, f64, f64) = (l0[j].into(), l0[j + 1].into(), l1[j + 1].into());
        for (axis, f) in [&mut *fx, &mut *fy, &mut *fz].into_iter().enumerate() {
            let second = (f[j + 1] - b[axis]) / d1;
            f[j + 1] = second;
            f[j] = (f[j] - a[axis] - l10 * second) / d0;
        }
    }
    if j == 1 {
        let l = &panel[..height];
        let m = height - 1;
        let [a, _] = dots(
            &l[1..][..m],
            &l[1..][..m],
            &fx[1..][..m],
            &fy[1..][..m],
            &fz[1..][..m],
        );
        let d: f64 = l[0].into();
        (fx[0], fy[0], fz[0]) = ((fx[0] - a[0]) / d, (fy[0] - a[1]) / d, (fz[0] - a[2]) / d);
    }
    for (k, v) in vectors[column..column + width].iter_mut().enumerate() {
        *v = [fx[k], fy[k], fz[k]];
    }
}

/// Products of two columns with the three right-hand sides.
#[inline(always)]
fn dots<V: Value>(l0: &[V], l1: &[V], fx: &[f64], fy: &[f64], fz: &[f64]) -> [[f64; 3]; 2] {
    const LANES: usize = 4;
    let m = l0.len();
    let (mut ax, mut ay, mut az) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    let (mut bx, mut by, mut bz) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    let whole = m - m % LANES;
    let chunks = l0[..whole]
        .chunks_exact(LANES)
        .zip(l1[..whole].chunks_exact(LANES))
        .zip(fx[..whole].chunks_exact(LANES))
        .zip(fy[..whole].chunks_exact(LANES))
        .zip(fz[..whole].chunks_exact(LANES));
    for ((((a, b), x), y), z) in chunks {
        for k in 0..LANES {
            let (a, b): (f64, f64) = (a[k].into(), b[k].into());
            ax[k] += a * x[k];
            ay[k] += a * y[k];
            az[k] += a * z[k];
            bx[k] += b * x[k];
            by[k] += b * y[k];
            bz[k] += b * z[k];
        }
    }
    let sum = |v: [f64; LANES]| (v[0] + v[1]) + (v[2] + v[3]);
    let mut out = [[sum(ax), sum(ay), sum(az)], [sum(bx), sum(by), sum(bz)]];
    for i in whole..m {
        let (a, b): (f64, f64) = (l0[i].into(), l1[i].into());
        for (out, l) in out.iter_mut().zip([a, b]) {
            out[0] += l * fx[i];
            out[1] += l * fy[i];
            out[2] += l * fz[i];
        }
    }
    out
}
