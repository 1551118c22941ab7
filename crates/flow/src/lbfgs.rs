//! Limited-memory BFGS, preconditioned by the factorization, without a second solve.
//!
//! For an energy whose local–global step is x + d with d = A⁻¹ r and r half the negative gradient,
//! the inverse of A is the natural first guess of the inverse Hessian. Products of A⁻¹ with the
//! differences of gradients that the recursion needs are differences of the steps d, which are
//! known: so an iteration costs one solve, as a plain step does, and the plain step's length (the
//! true residual) is known at every iterate.
//!
//! The recursion is run on inner products, so that all vectors of the history are read twice an
//! iteration and none is written: once for their products with what is new, once to combine them.
//!
//! Source: the recursion is Nocedal's (1980); the factor as initial Hessian is that of Liu,
//! Bouaziz, Kavan, "Quasi-Newton methods for real-time simulation of hyperelastic materials",
//! 2017.

use std::collections::VecDeque;

use cotan_halfedge::VertexMap;
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::vectors::{CHUNK, add_products, dots, flat, flat_mut, subtract, total};

type Field = VertexMap<Vector3<f64>>;

/// What changed over one step.
#[derive(Debug, Default)]
struct Pair {
    /// Step x' − x.
    s: Field,
    /// Change of the gradient, g' − g.
    y: Field,
    /// A⁻¹ y.
    z: Field,
    /// 1 / (s·y).
    rho: f64,
    /// y·z.
    own: f64,
    /// (s_k·y, y_k·z) with the s_k and y_k of all older pairs, oldest first.
    with_older: Vec<[f64; 2]>,
}

/// The history of a descent and the directions that it proposes.
#[derive(Debug)]
pub(crate) struct Lbfgs {
    memory: usize,
    /// Oldest first.
    pairs: VecDeque<Pair>,
    /// Scale of the initial inverse Hessian γA⁻¹.
    gamma: f64,
    /// The pair of the last step, with r and d from where it started in place of y and z.
    last: Option<Pair>,
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
            spare: None,
        }
    }

    /// Forgets the history: the next direction is the plain step.
    pub(crate) fn reset(&mut self) {
        self.gamma = 1.0;
        self.last = None;
        self.spare = self.pairs.pop_front().or(self.spare.take());
        self.pairs.clear();
    }

    /// Notes an accepted step, taken from where half the negative gradient was `r` and the plain
    /// step `d`, which are taken away. `step` writes the step; what changed over it is known at the
    /// next iterate.
    pub(crate) fn stepped(
        &mut self,
        step: impl FnOnce(&mut [Vector3<f64>]),
        r: &mut Field,
        d: &mut Field,
    ) {
        let mut pair = self.spare.take().unwrap_or_default();
        for field in [&mut pair.s, &mut pair.y, &mut pair.z] {
            if field.len() != r.len() {
                *field = VertexMap::filled(r.len(), Vector3::zeros());
            }
        }
        step(pair.s.as_mut_slice());
        std::mem::swap(&mut pair.y, r);
        std::mem::swap(&mut pair.z, d);
        self.last = Some(pair);
    }

    /// Completes the pair of the last step, and multiplies what is new with the history: s_k·r and
    /// y_k·d of all pairs.
    fn remember(&mut self, r: &[f64], d: &[f64]) -> Vec<[f64; 2]> {
        let pairs = &self.pairs;
        let Some(mut new) = self.last.take() else {
            return products(pairs, r, d);
        };
        /// Of the new pair: s·y, s·s, s·r, y·y, y·z, y·d.
        const OWN: usize = 6;
        let s = flat(new.s.as_slice());
        let sums = flat_mut(new.y.as_mut_slice())
            .par_chunks_mut(CHUNK)
            .zip(flat_mut(new.z.as_mut_slice()).par_chunks_mut(CHUNK))
            .enumerate()
            .map(|(chunk, (y, z))| {
                let at = chunk * CHUNK..chunk * CHUNK + y.len();
                let (r, d, s) = (&r[at.clone()], &d[at.clone()], &s[at.clone()]);
                subtract(y, r);
                subtract(z, d);
                let mut sums = Vec::with_capacity(OWN + 4 * pairs.len());
                sums.extend(dots(s, [y, s, r]));
                sums.extend(dots(y, [y, z, d]));
                for pair in pairs {
                    sums.extend(dots(&flat(pair.s.as_slice())[at.clone()], [r, y]));
                    sums.extend(dots(&flat(pair.y.as_slice())[at.clone()], [d, z]));
                }
                sums
            })
            .collect::<Vec<_>>();
        let sums = total(sums);
        let (own, old) = sums.split_at(OWN);
        let &[sy, ss, sr, yy, yz, yd] = own else {
            return Vec::new();
        };
        let mut at_hand: Vec<[f64; 2]> = old.chunks(4).map(|p| [p[0], p[2]]).collect();
        // Skip pairs without positive curvature beyond rounding.
        if !(sy > 1e-12 * (ss * yy).sqrt()) {
            self.spare = Some(new);
            return at_hand;
        }
        if yz > 0.0 {
            self.gamma = sy / yz;
        }
        (new.rho, new.own) = (1.0 / sy, yz);
        new.with_older = old.chunks(4).map(|p| [p[1], p[3]]).collect();
        at_hand.push([sr, yd]);
        self.pairs.push_back(new);
        if self.pairs.len() > self.memory {
            self.spare = self.pairs.pop_front();
            at_hand.remove(0);
            for pair in &mut self.pairs {
                pair.with_older.remove(0);
            }
        }
        at_hand
    }

    /// Writes the direction to go from where half the negative gradient is `r` and the plain step
    /// `d`. Returns its product with `r`: the rate at which half the energy falls along it.
    pub(crate) fn direction(&mut self, r: &Field, d: &Field, out: &mut Field) -> f64 {
        let (r, d) = (flat(r.as_slice()), flat(d.as_slice()));
        let at_hand = self.remember(r, d);
        let [of_steps, of_changes] = self.coefficients(&at_hand);
        let partial: Vec<f64> = flat_mut(out.as_mut_slice())
            .par_chunks_mut(CHUNK)
            .enumerate()
            .map(|(chunk, out)| {
                let at = chunk * CHUNK..chunk * CHUNK + out.len();
                for (out, d) in out.iter_mut().zip(&d[at.clone()]) {
                    *out = self.gamma * d;
                }
                for ((pair, s), z) in self.pairs.iter().zip(&of_steps).zip(&of_changes) {
                    let step = &flat(pair.s.as_slice())[at.clone()];
                    let change = &flat(pair.z.as_slice())[at.clone()];
                    add_products(out, [(*s, step), (*z, change)]);
                }
                let [rate] = dots(&r[at], [out]);
                rate
            })
            .collect();
        partial.into_iter().sum()
    }

    /// The recursion: the factors of all s and z in the direction γd + Σ a_k s_k + Σ b_k z_k.
    fn coefficients(&self, at_hand: &[[f64; 2]]) -> [Vec<f64>; 2] {
        let m = self.pairs.len();
        // s_k·y_j and y_k·z_j of pairs k before j.
        let sy = |k: usize, j: usize| self.pairs[j].with_older[k][0];
        let yz = |k: usize, j: usize| match k.cmp(&j) {
            std::cmp::Ordering::Less => self.pairs[j].with_older[k][1],
            std::cmp::Ordering::Equal => self.pairs[k].own,
            std::cmp::Ordering::Greater => self.pairs[k].with_older[j][1],
        };
        // Signs: all vectors are those of descent, so the recursion runs on −q.
        let mut alphas = vec![0.0; m];
        for k in (0..m).rev() {
            let newer: f64 = (k + 1..m).map(|j| alphas[j] * sy(k, j)).sum();
            alphas[k] = self.pairs[k].rho * (at_hand[k][0] - newer);
        }
        let of_changes: Vec<f64> = alphas.iter().map(|alpha| -self.gamma * alpha).collect();
        let mut of_steps = vec![0.0; m];
        for k in 0..m {
            let mut product = self.gamma * at_hand[k][1];
            product += (0..m).map(|j| of_changes[j] * yz(k, j)).sum::<f64>();
            product += (0..k).map(|j| of_steps[j] * sy(j, k)).sum::<f64>();
            of_steps[k] = alphas[k] - self.pairs[k].rho * product;
        }
        [of_steps, of_changes]
    }
}

/// s_k·r and y_k·d of all pairs.
fn products(pairs: &VecDeque<Pair>, r: &[f64], d: &[f64]) -> Vec<[f64; 2]> {
    let dot = |a: &Field, b: &[f64]| {
        let of_chunk = |(a, b): (&[f64], &[f64])| dots(a, [b])[0];
        let chunks = flat(a.as_slice()).par_chunks(CHUNK);
        let partial: Vec<f64> = chunks.zip(b.par_chunks(CHUNK)).map(of_chunk).collect();
        partial.into_iter().sum()
    };
    pairs
        .iter()
        .map(|pair| [dot(&pair.s, r), dot(&pair.y, d)])
        .collect()
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
            lbfgs.direction(&r, &d, &mut p);
            x.iter_mut().zip(p.values()).for_each(|(x, p)| *x += p);
            lbfgs.stepped(|s| s.copy_from_slice(p.as_slice()), &mut r, &mut d);
        }
        let error = x.iter().map(|x| (x - goal).norm()).fold(0.0, f64::max);
        assert!(error < 1e-8, "{error}");
    }
}
