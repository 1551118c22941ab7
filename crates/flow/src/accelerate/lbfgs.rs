//! Limited-memory BFGS, preconditioned by the factorization, without a second solve.
//!
//! For an energy whose local–global step is x + d with d = A⁻¹ r and r half the negative gradient,
//! the inverse of A is the natural first guess of the inverse Hessian. Products of A⁻¹ with the
//! differences of gradients that the recursion needs are differences of the steps d, which are
//! known: so an iteration costs one solve, as a plain step does, and the plain step's length (the
//! true residual) is known at every iterate.
//!
//! The recursion is run on inner products, so that all vectors of the history are read twice an
//! iteration and none is written: once for their products with r, once to combine them. A⁻¹ is
//! symmetric, so products with the changes of d are products with r, and those with the change of
//! r are differences of products with r before and after: one product a vector is enough. The
//! history is kept in single precision, half the memory to read: it only says where to search, and
//! what is found there is judged in double precision.
//!
//! Source: the recursion is Nocedal's (1980); the factor as initial Hessian is that of Liu,
//! Bouaziz, Kavan, "Quasi-Newton methods for real-time simulation of hyperelastic materials",
//! 2017.

use std::collections::VecDeque;

use cotan_halfedge::VertexMap;
use nalgebra::Vector3;
use pulp::{Simd, WithSimd};

use super::Coarse;
use crate::vectors::{CHUNKS, flat, flat_mut, total};

type Field = VertexMap<Vector3<f64>>;

/// The changes over one step.
#[derive(Debug, Default)]
struct Pair {
    /// Step x' − x.
    s: Vec<Vector3<f32>>,
    /// A⁻¹ y, y being the change of the gradient, g' − g: that of the plain step, d − d'.
    z: Vec<Vector3<f32>>,
    /// 1 / (s·y).
    rho: f64,
    /// y·z.
    own: f64,
    /// (s_k·y, z_k·y) with the s_k and z_k of all older pairs, oldest first.
    with_older: Vec<[f64; 2]>,
    /// (s·r, z·r) with the latest r.
    with_r: [f64; 2],
    /// With a coarse correction φKφᵀ of A⁻¹: φᵀy and Kφᵀy.
    restricted: Vec<f64>,
    corrected: Vec<f64>,
}

/// The start of the last step.
#[derive(Debug, Default)]
struct Start {
    r: Field,
    d: Field,
    /// φᵀr.
    restricted: Vec<f64>,
}

/// Half the negative gradient as a coarse correction sees it: φᵀr and Kφᵀr.
#[derive(Clone, Debug)]
pub(crate) struct Restricted {
    pub(crate) r: Vec<f64>,
    pub(crate) corrected: Vec<f64>,
}

/// The history of a descent and the directions that it proposes.
#[derive(Debug)]
pub(crate) struct Lbfgs {
    memory: usize,
    /// Oldest first.
    pairs: VecDeque<Pair>,
    /// Scale of the initial inverse Hessian γA⁻¹.
    gamma: f64,
    /// The pair of the last step, of which only s is known yet.
    last: Option<Pair>,
    start: Start,
    /// A pair that is no longer used, for its memory.
    spare: Option<Pair>,
}

impl Lbfgs {
    pub(crate) fn new(memory: usize) -> Self {
        Self {
            memory,
            pairs: VecDeque::new(),
            gamma: 1.0,
            last: None,
            start: Start::default(),
            spare: None,
        }
    }

    /// Forgets the history: the next direction is the plain step.
    pub(crate) fn reset(&mut self) {
        self.gamma = 1.0;
        self.last = None;
        self.start.restricted.clear();
        self.spare = self.pairs.pop_front().or(self.spare.take());
        self.pairs.clear();
    }

    /// Takes up a coarse correction that was computed anew.
    pub(crate) fn refreshed(&mut self, coarse: &Coarse) {
        for pair in &mut self.pairs {
            if !pair.restricted.is_empty() {
                pair.corrected = coarse.apply(&pair.restricted);
            }
        }
    }

    /// Notes an accepted step, taken from where half the negative gradient was `r` and the plain
    /// step `d`, which are taken away. `step` writes the step; what changed over it is known at
    /// the next iterate.
    pub(crate) fn stepped(
        &mut self,
        step: impl FnOnce(&mut [Vector3<f32>]),
        r: &mut Field,
        d: &mut Field,
    ) {
        let n = r.len();
        let mut pair = self.spare.take().unwrap_or_default();
        pair.restricted.clear();
        pair.corrected.clear();
        for field in [&mut pair.s, &mut pair.z] {
            field.resize(n, Vector3::zeros());
        }
        for field in [&mut self.start.r, &mut self.start.d] {
            if field.len() != n {
                *field = VertexMap::filled(n, Vector3::zeros());
            }
        }
        step(&mut pair.s);
        std::mem::swap(&mut self.start.r, r);
        std::mem::swap(&mut self.start.d, d);
        self.last = Some(pair);
    }

    /// Completes the pair of the last step, and multiplies all pairs with r.
    fn remember(&mut self, r: &[f64], d: &[f64], coarse: Option<(&Coarse, &Restricted)>) {
        let Some(mut new) = self.last.take() else {
            let sums = self.products(None, r, d);
            for (pair, with_r) in self.pairs.iter_mut().zip(sums.as_chunks().0) {
                pair.with_r = *with_r;
            }
            return;
        };
        let sums = self.products(Some(&mut new), r, d);
        let (own, old) = sums.split_at(OWN);
        let mut with_older = Vec::with_capacity(self.memory);
        for (pair, with_r) in self.pairs.iter_mut().zip(old.as_chunks().0) {
            let [s, z] = pair.with_r;
            with_older.push([s - with_r[0], z - with_r[1]]);
            pair.with_r = *with_r;
        }
        let &[sy, ss, sr, yy, zy, zr] = own else {
            return;
        };
        // Skip pairs without positive curvature beyond rounding.
        if !(sy > 1e-12 * (ss * yy).sqrt()) {
            self.spare = Some(new);
            return;
        }
        if let Some((coarse, restricted)) = coarse {
            let change = self.start.restricted.iter().zip(&restricted.r);
            new.restricted = change.map(|(start, r)| start - r).collect();
            new.corrected = coarse.apply(&new.restricted);
        } else if zy > 0.0 {
            self.gamma = sy / zy;
        }
        (new.rho, new.own) = (1.0 / sy, zy);
        new.with_older = with_older;
        new.with_r = [sr, zr];
        self.pairs.push_back(new);
        if self.pairs.len() > self.memory {
            self.spare = self.pairs.pop_front();
            for pair in &mut self.pairs {
                pair.with_older.remove(0);
            }
        }
    }

    /// The products of a new pair, if there is one, whose z is written; then s·r and z·r of all
    /// others.
    fn products(&self, new: Option<&mut Pair>, r: &[f64], d: &[f64]) -> Vec<f64> {
        let pairs = &self.pairs;
        let lists = if let Some(new) = new {
            let (r_start, d_start) = (&self.start.r, &self.start.d);
            let (r_start, d_start) = (flat(r_start.as_slice()), flat(d_start.as_slice()));
            let s: &[f32] = bytemuck::cast_slice(&new.s);
            let z: &mut [f32] = bytemuck::cast_slice_mut(&mut new.z);
            CHUNKS.map((z, s, r), |first, (z, s, r)| {
                let at = first..first + r.len();
                let new = Some(NewPair {
                    s,
                    z,
                    d: &d[at.clone()],
                    r_start: &r_start[at.clone()],
                    d_start: &d_start[at],
                });
                pulp::Arch::new().dispatch(Products {
                    pairs,
                    new,
                    r,
                    first,
                })
            })
        } else {
            CHUNKS.map(r, |first, r| {
                let new = None;
                pulp::Arch::new().dispatch(Products {
                    pairs,
                    new,
                    r,
                    first,
                })
            })
        };
        total(lists)
    }

    /// Writes the direction to go from where half the negative gradient is `r` and the plain step
    /// `d`. Returns its product with `r`: the rate at which half the energy falls along it.
    ///
    /// With a coarse correction the first guess is A⁻¹ + φKφᵀ: the vector q is returned as well,
    /// and φq is to be added to the direction.
    pub(crate) fn direction(
        &mut self,
        r: &Field,
        d: &Field,
        coarse: Option<(&Coarse, &Restricted)>,
        out: &mut Field,
    ) -> (f64, Vec<f64>) {
        let (r, d) = (flat(r.as_slice()), flat(d.as_slice()));
        self.remember(r, d, coarse);
        let [of_steps, of_changes] = self.coefficients(coarse.map(|(_, restricted)| restricted));
        let out = flat_mut(out.as_mut_slice());
        let partial = CHUNKS.map((out, r, d), |first, (out, r, d)| {
            pulp::Arch::new().dispatch(Combination {
                pairs: &self.pairs,
                of_steps: &of_steps,
                of_changes: &of_changes,
                gamma: self.gamma,
                r,
                d,
                first,
                out,
            })
        });
        let mut rate = partial.into_iter().sum();
        let mut q = Vec::new();
        if let Some((_, restricted)) = coarse {
            q.clone_from(&restricted.corrected);
            for (pair, factor) in self.pairs.iter().zip(&of_changes) {
                for (q, x) in q.iter_mut().zip(&pair.corrected) {
                    *q += factor * x;
                }
            }
            rate += small_dot(&restricted.r, &q);
            self.start.restricted.clone_from(&restricted.r);
        }
        (rate, q)
    }

    /// The recursion: the factors of all s and z in the direction γd + Σ a_k s_k + Σ b_k z_k.
    fn coefficients(&self, restricted: Option<&Restricted>) -> [Vec<f64>; 2] {
        let m = self.pairs.len();
        // s_k·y_j and y_k·z_j = z_k·y_j of pairs k before j.
        let sy = |k: usize, j: usize| self.pairs[j].with_older[k][0];
        let fine = |k: usize, j: usize| match k.cmp(&j) {
            std::cmp::Ordering::Less => self.pairs[j].with_older[k][1],
            std::cmp::Ordering::Equal => self.pairs[k].own,
            std::cmp::Ordering::Greater => self.pairs[k].with_older[j][1],
        };
        let yz = |k: usize, j: usize| {
            fine(k, j) + small_dot(&self.pairs[k].restricted, &self.pairs[j].corrected)
        };
        let zr = |k: usize| {
            let coarse =
                restricted.map_or(0.0, |r| small_dot(&self.pairs[k].restricted, &r.corrected));
            self.pairs[k].with_r[1] + coarse
        };
        // Signs: all vectors are those of descent, so the recursion runs on −q.
        let mut alphas = vec![0.0; m];
        for k in (0..m).rev() {
            let newer: f64 = (k + 1..m).map(|j| alphas[j] * sy(k, j)).sum();
            alphas[k] = self.pairs[k].rho * (self.pairs[k].with_r[0] - newer);
        }
        let of_changes: Vec<f64> = alphas.iter().map(|alpha| -self.gamma * alpha).collect();
        let mut of_steps = vec![0.0; m];
        for k in 0..m {
            // y_k·d = z_k·r.
            let mut product = self.gamma * zr(k);
            product += (0..m).map(|j| of_changes[j] * yz(k, j)).sum::<f64>();
            product += (0..k).map(|j| of_steps[j] * sy(j, k)).sum::<f64>();
            of_steps[k] = alphas[k] - self.pairs[k].rho * product;
        }
        [of_steps, of_changes]
    }
}

/// Σ a_i b_i of two short vectors; 0 if either is empty.
fn small_dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Products of a new pair with itself and with r: s·y, s·s, s·r, y·y, z·y, z·r.
const OWN: usize = 6;

/// Numbers that are added up side by side.
const LANES: usize = 8;

/// One chunk of a pair that is being completed.
struct NewPair<'a> {
    s: &'a [f32],
    z: &'a mut [f32],
    d: &'a [f64],
    r_start: &'a [f64],
    d_start: &'a [f64],
}

/// The products of one chunk: see [`Lbfgs::products`].
struct Products<'a> {
    pairs: &'a VecDeque<Pair>,
    new: Option<NewPair<'a>>,
    r: &'a [f64],
    /// The index of the chunk's first coordinate.
    first: usize,
}

impl WithSimd for Products<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<f64> {
        let Self {
            pairs,
            new,
            r,
            first,
        } = self;
        let mut sums = Vec::with_capacity(OWN + 2 * pairs.len());
        if let Some(new) = new {
            sums.extend(complete(new, r));
        }
        let at = first..first + r.len();
        for pair in pairs {
            let s = &bytemuck::cast_slice::<_, f32>(&pair.s)[at.clone()];
            let z = &bytemuck::cast_slice::<_, f32>(&pair.z)[at.clone()];
            sums.extend(products_with(s, z, r));
        }
        sums
    }
}

/// Writes z. Returns the products of the new pair.
#[inline(always)]
fn complete(new: NewPair<'_>, r: &[f64]) -> [f64; OWN] {
    let NewPair {
        s,
        z,
        d,
        r_start,
        d_start,
    } = new;
    let mut sums = [[0.0; LANES]; OWN];
    let mut add = |lane: usize, s: f32, z: &mut f32, r: f64, d: f64, r_start: f64, d_start: f64| {
        let y = r_start - r;
        *z = (d_start - d) as f32;
        let (s, z) = (f64::from(s), f64::from(*z));
        let terms = [s * y, s * s, s * r, y * y, z * y, z * r];
        for (sum, term) in sums.iter_mut().zip(terms) {
            sum[lane] += term;
        }
    };
    let whole = r.len() / LANES * LANES;
    for start in (0..whole).step_by(LANES) {
        let (s, z) = (&s[start..start + LANES], &mut z[start..start + LANES]);
        let (r, d) = (&r[start..start + LANES], &d[start..start + LANES]);
        let r_start = &r_start[start..start + LANES];
        let d_start = &d_start[start..start + LANES];
        for k in 0..LANES {
            add(k, s[k], &mut z[k], r[k], d[k], r_start[k], d_start[k]);
        }
    }
    for k in whole..r.len() {
        add(0, s[k], &mut z[k], r[k], d[k], r_start[k], d_start[k]);
    }
    sums.map(|sum| sum.iter().sum())
}

/// s·r and z·r.
#[inline(always)]
fn products_with(s: &[f32], z: &[f32], r: &[f64]) -> [f64; 2] {
    let mut sums = [[0.0; LANES]; 2];
    let (s, s_left) = s.as_chunks::<LANES>();
    let (z, z_left) = z.as_chunks::<LANES>();
    let (r, r_left) = r.as_chunks::<LANES>();
    for ((s, z), r) in s.iter().zip(z).zip(r) {
        for k in 0..LANES {
            sums[0][k] += f64::from(s[k]) * r[k];
            sums[1][k] += f64::from(z[k]) * r[k];
        }
    }
    for ((s, z), r) in s_left.iter().zip(z_left).zip(r_left) {
        sums[0][0] += f64::from(*s) * r;
        sums[1][0] += f64::from(*z) * r;
    }
    sums.map(|sum| sum.iter().sum())
}

/// Writes one chunk of a direction: see [`Lbfgs::direction`].
struct Combination<'a> {
    pairs: &'a VecDeque<Pair>,
    of_steps: &'a [f64],
    of_changes: &'a [f64],
    gamma: f64,
    r: &'a [f64],
    d: &'a [f64],
    first: usize,
    out: &'a mut [f64],
}

impl WithSimd for Combination<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        let Self { out, r, d, .. } = self;
        for (out, d) in out.iter_mut().zip(d) {
            *out = self.gamma * d;
        }
        let at = self.first..self.first + out.len();
        let factors = self.of_steps.iter().zip(self.of_changes);
        for (pair, (a, b)) in self.pairs.iter().zip(factors) {
            let s = &bytemuck::cast_slice::<_, f32>(&pair.s)[at.clone()];
            let z = &bytemuck::cast_slice::<_, f32>(&pair.z)[at.clone()];
            for ((out, s), z) in out.iter_mut().zip(s).zip(z) {
                *out += a * f64::from(*s) + b * f64::from(*z);
            }
        }
        let mut sums = [0.0; LANES];
        let (whole, left) = out.as_chunks::<LANES>();
        let (r, r_left) = r.as_chunks::<LANES>();
        for (out, r) in whole.iter().zip(r) {
            for k in 0..LANES {
                sums[k] += out[k] * r[k];
            }
        }
        for (out, r) in left.iter().zip(r_left) {
            sums[0] += out * r;
        }
        sums.iter().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Minimises ½ Σ h_i |x_i − 1|² with A = 1: the history must learn h.
    #[test]
    fn learns_a_quadratic() {
        let h = [1.0, 0.3, 0.1, 0.03];
        let goal = Vector3::new(1.0, 1.0, 1.0);
        let zeros = VertexMap::filled(4, Vector3::zeros());
        let mut x = [Vector3::zeros(); 4];
        let mut lbfgs = Lbfgs::new(8);
        for _ in 0..15 {
            let mut r: Field =
                VertexMap::from_vec(x.iter().zip(h).map(|(x, h)| (goal - x) * h).collect());
            let (mut d, mut p) = (r.clone(), zeros.clone());
            lbfgs.direction(&r, &d, None, &mut p);
            x.iter_mut().zip(p.values()).for_each(|(x, p)| *x += p);
            let write = |s: &mut [Vector3<f32>]| {
                s.iter_mut()
                    .zip(p.values())
                    .for_each(|(s, p)| *s = p.map(|x| x as f32));
            };
            lbfgs.stepped(write, &mut r, &mut d);
        }
        let error = x.iter().map(|x| (x - goal).norm()).fold(0.0, f64::max);
        assert!(error < 1e-8, "{error}");
    }
}
