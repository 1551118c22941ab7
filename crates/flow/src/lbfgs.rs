//! Limited-memory BFGS, preconditioned by the factorization, without a second solve.
//!
//! For an energy whose local–global step is x + d with d = A⁻¹ r and r half the negative gradient,
//! the inverse of A is the natural first guess of the inverse Hessian. Products of A⁻¹ with the
//! differences of gradients that the recursion needs are differences of the steps d, which are
//! known: so an iteration costs one solve, as a plain step does, and the plain step's length (the
//! true residual) is known at every iterate.
//!
//! Source: the recursion is Nocedal's (1980); the factor as initial Hessian is that of Liu,
//! Bouaziz, Kavan, "Quasi-Newton methods for real-time simulation of hyperelastic materials",
//! 2017.

use std::collections::VecDeque;

use nalgebra::Vector3;

use crate::vectors::{add_scaled, dot};

#[derive(Debug)]
struct Pair {
    /// Step x' − x.
    s: Vec<Vector3<f64>>,
    /// Change of the gradient, g' − g.
    y: Vec<Vector3<f64>>,
    /// A⁻¹ y.
    z: Vec<Vector3<f64>>,
    /// 1 / (s·y).
    rho: f64,
}

/// The history of a descent and the directions that it proposes.
#[derive(Debug)]
pub(crate) struct Lbfgs {
    memory: usize,
    pairs: VecDeque<Pair>,
    /// Scale of the initial inverse Hessian γA⁻¹.
    gamma: f64,
    /// The last step, and r and d from where it started.
    last: Option<[Vec<Vector3<f64>>; 3]>,
}

impl Lbfgs {
    pub(crate) fn new(memory: usize) -> Self {
        Self {
            memory,
            pairs: VecDeque::new(),
            gamma: 1.0,
            last: None,
        }
    }

    /// Forgets the history: the next direction is the plain step.
    pub(crate) fn reset(&mut self) {
        self.pairs.clear();
        self.gamma = 1.0;
        self.last = None;
    }

    /// Notes an accepted step, taken from where half the negative gradient was `r` and the plain
    /// step `d`. What changed over it is known at the next iterate.
    pub(crate) fn stepped(
        &mut self,
        step: Vec<Vector3<f64>>,
        r: Vec<Vector3<f64>>,
        d: Vec<Vector3<f64>>,
    ) {
        self.last = Some([step, r, d]);
    }

    /// Completes the pair of the last step.
    fn remember(&mut self, r: &[Vector3<f64>], d: &[Vector3<f64>]) {
        let Some([s, r_before, d_before]) = self.last.take() else {
            return;
        };
        let minus = |a: Vec<Vector3<f64>>, b: &[Vector3<f64>]| -> Vec<Vector3<f64>> {
            a.into_iter().zip(b).map(|(a, b)| a - b).collect()
        };
        let (y, z) = (minus(r_before, r), minus(d_before, d));
        let curvature = dot(&s, &y);
        // Skip pairs without positive curvature beyond rounding.
        if !(curvature > 1e-12 * (dot(&s, &s) * dot(&y, &y)).sqrt()) {
            return;
        }
        let length = dot(&y, &z);
        if length > 0.0 {
            self.gamma = curvature / length;
        }
        self.pairs.push_back(Pair {
            s,
            y,
            z,
            rho: 1.0 / curvature,
        });
        if self.pairs.len() > self.memory {
            self.pairs.pop_front();
        }
    }

    /// The direction to go from where half the negative gradient is `r` and the plain step `d`.
    pub(crate) fn direction(
        &mut self,
        r: &[Vector3<f64>],
        d: &[Vector3<f64>],
    ) -> Vec<Vector3<f64>> {
        self.remember(r, d);
        // Signs: all vectors are those of descent, so the recursion runs on −q.
        let mut q = r.to_vec();
        let mut p = d.to_vec();
        let mut alphas = Vec::with_capacity(self.pairs.len());
        for pair in self.pairs.iter().rev() {
            let alpha = pair.rho * dot(&pair.s, &q);
            add_scaled(&mut q, -alpha, &pair.y);
            add_scaled(&mut p, -alpha, &pair.z);
            alphas.push(alpha);
        }
        p.iter_mut().for_each(|p| *p *= self.gamma);
        for (pair, alpha) in self.pairs.iter().zip(alphas.into_iter().rev()) {
            let beta = pair.rho * dot(&pair.y, &p);
            add_scaled(&mut p, alpha - beta, &pair.s);
        }
        p
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
        let gradient_step = |x: &[Vector3<f64>]| -> Vec<Vector3<f64>> {
            x.iter().zip(h).map(|(x, h)| (goal - x) * h).collect()
        };
        let mut x = vec![Vector3::zeros(); 4];
        let mut lbfgs = Lbfgs::new(8);
        for _ in 0..15 {
            let r = gradient_step(&x);
            let p = lbfgs.direction(&r, &r);
            add_scaled(&mut x, 1.0, &p);
            lbfgs.stepped(p, r.clone(), r);
        }
        let error = x.iter().map(|x| (x - goal).norm()).fold(0.0, f64::max);
        assert!(error < 1e-8, "{error}");
    }
}
