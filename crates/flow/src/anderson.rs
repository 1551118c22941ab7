//! Anderson acceleration of a fixed-point iteration u ← g(u), with a restart on growth.

use std::collections::VecDeque;

use nalgebra::{DMatrix, DVector, Vector3};

use crate::vectors::{add_scaled, dot};

/// Two vectors over all vertices that belong together.
type Pair = (Vec<Vector3<f64>>, Vec<Vector3<f64>>);

/// What was proposed as the next iterate.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Proposal {
    /// The image itself, u ← g(u).
    Plain,
    /// An extrapolation, or the last plain image after a rejected one.
    Accelerated,
}

/// Keeps the last differences of iterates and of residuals f = g(u) − u, and proposes the
/// combination whose linearised residual is least.
#[derive(Debug)]
pub(crate) struct Anderson {
    memory: usize,
    /// Pairs (Δu + Δf, Δf), oldest first.
    history: VecDeque<Pair>,
    /// u and f of the step before.
    previous: Option<Pair>,
    last_image: Option<Vec<Vector3<f64>>>,
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
            previous: None,
            last_image: None,
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
        self.previous = None;
        self.last_image = None;
        self.last_norm = f64::INFINITY;
    }

    /// Replaces `u`, whose image is `image`, by the next iterate. `plainly` asks for the image.
    pub(crate) fn propose(
        &mut self,
        u: &mut Vec<Vector3<f64>>,
        image: Vec<Vector3<f64>>,
        plainly: bool,
    ) -> Proposal {
        self.steps += 1;
        if self.steps > Self::MOST_STEPS {
            *u = image;
            return Proposal::Plain;
        }
        let f: Vec<_> = image.iter().zip(&*u).map(|(g, u)| g - u).collect();
        let norm = dot(&f, &f).sqrt();
        if norm > Self::GUARD * self.last_norm
            && let Some(last) = self.last_image.take()
        {
            *u = last;
            self.clear();
            return Proposal::Accelerated;
        }
        self.last_norm = norm;
        self.remember(u, &f);
        self.last_image = Some(image.clone());
        if self.history.is_empty() || plainly {
            *u = image;
            return Proposal::Plain;
        }
        *u = image;
        self.extrapolate(u, &f);
        Proposal::Accelerated
    }

    fn remember(&mut self, u: &[Vector3<f64>], f: &[Vector3<f64>]) {
        if let Some((u_before, f_before)) = self.previous.replace((u.to_vec(), f.to_vec())) {
            let df: Vec<_> = f.iter().zip(f_before).map(|(f, b)| f - b).collect();
            let dg = u
                .iter()
                .zip(u_before)
                .zip(&df)
                .map(|((u, b), df)| u - b + df)
                .collect();
            self.history.push_back((dg, df));
            if self.history.len() > self.memory {
                self.history.pop_front();
            }
        }
    }

    /// image −= ΔG γ with γ = argmin |f − ΔF γ|.
    fn extrapolate(&self, image: &mut [Vector3<f64>], f: &[Vector3<f64>]) {
        let m = self.history.len();
        let lengths: Vec<f64> = self
            .history
            .iter()
            .map(|(_, df)| dot(df, df).sqrt().max(f64::MIN_POSITIVE))
            .collect();
        let gram = DMatrix::from_fn(m, m, |a, b| {
            if a < b {
                return 0.0;
            }
            let entry = dot(&self.history[a].1, &self.history[b].1) / (lengths[a] * lengths[b]);
            if a == b {
                entry + Self::REGULARIZATION
            } else {
                entry
            }
        });
        let rhs = DVector::from_fn(m, |a, _| dot(&self.history[a].1, f) / lengths[a]);
        // Only the lower triangle is read.
        if let Some(factor) = gram.cholesky() {
            let gamma = factor.solve(&rhs);
            for (a, (dg, _)) in self.history.iter().enumerate() {
                add_scaled(image, -gamma[a] / lengths[a], dg);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A linear contraction with eigenvalues up to 0.95 needs hundreds of plain steps.
    #[test]
    fn solves_a_linear_problem_in_few_steps() {
        let rates: Vec<f64> = (0..5).map(|i| 0.55 + 0.1 * f64::from(i)).collect();
        let fixed = Vector3::new(1.0, -2.0, 3.0);
        let mut u = vec![Vector3::zeros(); 5];
        let mut anderson = Anderson::new(5);
        for _ in 0..20 {
            let image = u
                .iter()
                .zip(&rates)
                .map(|(u, rate)| fixed + (u - fixed) * *rate)
                .collect();
            anderson.propose(&mut u, image, false);
        }
        let error = u.iter().map(|u| (u - fixed).norm()).fold(0.0, f64::max);
        assert!(error < 1e-6, "{error}");
        assert!(
            0.95f64.powi(20) > 0.3,
            "plain steps would still be far away"
        );
    }

    #[test]
    fn a_growing_residual_returns_to_the_last_plain_image() {
        let mut anderson = Anderson::new(3);
        let mut u = vec![Vector3::zeros()];
        let image = vec![Vector3::x()];
        assert_eq!(
            anderson.propose(&mut u, image.clone(), false),
            Proposal::Plain
        );
        assert_eq!(u, image);
        let far = vec![Vector3::x() * 100.0];
        assert_eq!(anderson.propose(&mut u, far, false), Proposal::Accelerated);
        assert_eq!(u, image);
    }
}
