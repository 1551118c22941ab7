//! Anderson acceleration of a fixed-point iteration u ← g(u), with a restart on growth.

use std::collections::VecDeque;

use cotan_halfedge::VertexMap;
use nalgebra::{DMatrix, DVector, Vector3};
use rayon::prelude::*;

use crate::vectors::{CHUNK, add_products, dots, flat, flat_mut, subtract, total};

type Field = VertexMap<Vector3<f64>>;

/// What was proposed as the next iterate.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Proposal {
    /// The image itself, u ← g(u).
    Plain,
    /// An extrapolation, or the last plain image after a rejected one.
    Accelerated,
}

/// What changed over one step.
#[derive(Debug, Default)]
struct Difference {
    /// Δg.
    image: Field,
    /// Δf.
    residual: Field,
    /// Products of Δf with those of all older differences and with itself, oldest first.
    products: Vec<f64>,
}

/// Keeps the last differences of images g(u) and of residuals f = g(u) − u, and proposes the
/// combination whose linearised residual is least.
#[derive(Debug)]
pub(crate) struct Anderson {
    memory: usize,
    /// Oldest first.
    history: VecDeque<Difference>,
    /// g and f of the step before, in place of their differences.
    last: Option<Difference>,
    /// One that is no longer used, for its memory.
    spare: Difference,
    last_norm: f64,
    steps: usize,
}

impl Anderson {
    /// A residual that grows by more than this rejects the extrapolation. Anything from 1.2 to 10
    /// was found alike.
    const GUARD: f64 = 1.5;
    /// On the diagonal of the normal equations, whose columns have unit length.
    const REGULARIZATION: f64 = 1e-10;
    /// After so many steps go on plainly: this cures the cases that hover.
    const MOST_STEPS: usize = 60;

    pub(crate) fn new(memory: usize) -> Self {
        Self {
            memory,
            history: VecDeque::new(),
            last: None,
            spare: Difference::default(),
            last_norm: f64::INFINITY,
            steps: 0,
        }
    }

    /// Forgets everything, as when a handle has moved.
    pub(crate) fn reset(&mut self) {
        self.clear();
        self.steps = 0;
    }

    fn clear(&mut self) {
        self.history.clear();
        self.last = None;
        self.last_norm = f64::INFINITY;
    }

    /// Whether it still looks at what it is shown, and proposes anything but the image.
    pub(crate) fn is_active(&self) -> bool {
        self.steps < Self::MOST_STEPS
    }

    /// Replaces `u`, whose image is `image`, by the next iterate. `plainly` asks for the image.
    pub(crate) fn propose(&mut self, u: &mut Field, image: &Field, plainly: bool) -> Proposal {
        if !self.is_active() {
            u.as_mut_slice().copy_from_slice(image.as_slice());
            return Proposal::Plain;
        }
        self.steps += 1;
        let mut now = std::mem::take(&mut self.spare);
        for field in [&mut now.image, &mut now.residual] {
            if field.len() != u.len() {
                *field = VertexMap::filled(u.len(), Vector3::zeros());
            }
        }
        let norm = look(u, image, &mut now);
        if norm > Self::GUARD * self.last_norm
            && let Some(last) = self.last.take()
        {
            *u = last.image;
            self.spare = now;
            self.clear();
            return Proposal::Accelerated;
        }
        self.last_norm = norm;
        let products = self.remember(&now);
        u.as_mut_slice().copy_from_slice(image.as_slice());
        self.last = Some(now);
        if self.history.is_empty() || plainly {
            return Proposal::Plain;
        }
        self.extrapolate(u, &products);
        Proposal::Accelerated
    }

    /// Completes the difference to the last step. Returns Δf_k·f for the whole history.
    fn remember(&mut self, now: &Difference) -> Vec<f64> {
        let Some(mut new) = self.last.take() else {
            return Vec::new();
        };
        let (f, g) = (flat(now.residual.as_slice()), flat(now.image.as_slice()));
        let history = &self.history;
        let sums: Vec<Vec<f64>> = flat_mut(new.residual.as_mut_slice())
            .par_chunks_mut(CHUNK)
            .zip(flat_mut(new.image.as_mut_slice()).par_chunks_mut(CHUNK))
            .enumerate()
            .map(|(chunk, (df, dg))| {
                let at = chunk * CHUNK..chunk * CHUNK + df.len();
                let f = &f[at.clone()];
                // The other way round, −Δ: signs cancel in all that is made of them.
                subtract(df, f);
                subtract(dg, &g[at.clone()]);
                let of_old =
                    |old: &Difference| dots(&flat(old.residual.as_slice())[at.clone()], [df, f]);
                let old = history.iter().flat_map(of_old);
                old.chain(dots(df, [df, f])).collect()
            })
            .collect();
        let sums = total(sums);
        new.products = sums.iter().step_by(2).copied().collect();
        self.history.push_back(new);
        let mut with_f: Vec<f64> = sums.iter().skip(1).step_by(2).copied().collect();
        if self.history.len() > self.memory {
            self.spare = self.history.pop_front().unwrap_or_default();
            with_f.remove(0);
            for difference in &mut self.history {
                difference.products.remove(0);
            }
        }
        with_f
    }

    /// image −= ΔG γ with γ = argmin |f − ΔF γ|.
    fn extrapolate(&self, image: &mut Field, products: &[f64]) {
        let m = self.history.len();
        let product = |a: usize, b: usize| self.history[a].products[b];
        let lengths: Vec<f64> = (0..m)
            .map(|a| product(a, a).sqrt().max(f64::MIN_POSITIVE))
            .collect();
        let gram = DMatrix::from_fn(m, m, |a, b| match a.cmp(&b) {
            std::cmp::Ordering::Less => 0.0,
            std::cmp::Ordering::Equal => {
                product(a, a) / (lengths[a] * lengths[a]) + Self::REGULARIZATION
            }
            std::cmp::Ordering::Greater => product(a, b) / (lengths[a] * lengths[b]),
        });
        let rhs = DVector::from_fn(m, |a, _| products[a] / lengths[a]);
        // Only the lower triangle is read.
        let Some(factor) = gram.cholesky() else {
            return;
        };
        let gamma = factor.solve(&rhs);
        flat_mut(image.as_mut_slice())
            .par_chunks_mut(CHUNK)
            .enumerate()
            .for_each(|(chunk, image)| {
                let at = chunk * CHUNK..chunk * CHUNK + image.len();
                for (a, difference) in self.history.iter().enumerate() {
                    let dg = &flat(difference.image.as_slice())[at.clone()];
                    add_products(image, [(-gamma[a] / lengths[a], dg)]);
                }
            });
    }
}

/// Notes g and f = g − u. Returns |f|.
fn look(u: &Field, image: &Field, out: &mut Difference) -> f64 {
    let (u, g) = (flat(u.as_slice()), flat(image.as_slice()));
    let squares: Vec<f64> = flat_mut(out.residual.as_mut_slice())
        .par_chunks_mut(CHUNK)
        .zip(flat_mut(out.image.as_mut_slice()).par_chunks_mut(CHUNK))
        .enumerate()
        .map(|(chunk, (f, noted))| {
            let at = chunk * CHUNK..chunk * CHUNK + f.len();
            noted.copy_from_slice(&g[at.clone()]);
            f.copy_from_slice(&g[at.clone()]);
            subtract(f, &u[at]);
            dots(f, [f])[0]
        })
        .collect();
    squares.into_iter().sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A linear contraction with eigenvalues up to 0.95 needs hundreds of plain steps.
    #[test]
    fn solves_a_linear_problem_in_few_steps() {
        let rates: Vec<f64> = (0..5).map(|i| 0.55 + 0.1 * f64::from(i)).collect();
        let fixed = Vector3::new(1.0, -2.0, 3.0);
        let mut u = VertexMap::filled(5, Vector3::zeros());
        let mut anderson = Anderson::new(5);
        for _ in 0..20 {
            let image = u
                .values()
                .zip(&rates)
                .map(|(u, rate)| fixed + (u - fixed) * *rate)
                .collect();
            anderson.propose(&mut u, &image, false);
        }
        let error = u.values().map(|u| (u - fixed).norm()).fold(0.0, f64::max);
        assert!(error < 1e-6, "{error}");
        assert!(
            0.95f64.powi(20) > 0.3,
            "plain steps would still be far away"
        );
    }

    #[test]
    fn a_growing_residual_returns_to_the_last_plain_image() {
        let mut anderson = Anderson::new(3);
        let mut u = VertexMap::filled(1, Vector3::zeros());
        let image = VertexMap::filled(1, Vector3::x());
        assert_eq!(anderson.propose(&mut u, &image, false), Proposal::Plain);
        assert_eq!(u, image);
        let far = VertexMap::filled(1, Vector3::x() * 100.0);
        assert_eq!(anderson.propose(&mut u, &far, false), Proposal::Accelerated);
        assert_eq!(u, image);
    }
}
