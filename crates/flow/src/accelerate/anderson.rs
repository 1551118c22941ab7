//! Anderson acceleration of a fixed-point iteration u ← g(u), with a restart on growth.

use std::collections::VecDeque;

use cotan_geometry::Scalar;
use cotan_halfedge::VertexMap;
use cotan_parallel as parallel;
use nalgebra::{DMatrix, DVector, Vector3};

use crate::vectors::{CHUNKS, dots, flat, total};

type Field = VertexMap<Vector3<f64>>;

/// The proposal for the next iterate.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Proposal {
    /// The image itself, u ← g(u).
    Plain,
    /// An extrapolation, or the last plain image after a rejected one.
    Accelerated,
}

/// The changes over one step.
#[derive(Debug, Default)]
struct Difference {
    /// Δf.
    residual: Field,
    /// Δg, in single precision: it is only added to an image, and grows as small as Δf.
    image: Vec<Vector3<f32>>,
    /// Products of Δf with those of all older differences and with itself, oldest first.
    products: Vec<f64>,
    /// Δf·f with the latest f.
    with_f: f64,
}

/// The last step.
#[derive(Debug, Default)]
struct Last {
    image: Field,
    residual: Field,
}

/// Keeps the last differences of images g(u) and of residuals f = g(u) − u, and proposes the
/// combination whose linearised residual is least.
#[derive(Debug)]
pub(crate) struct Anderson {
    memory: usize,
    /// Oldest first.
    history: VecDeque<Difference>,
    /// g and f of the step before; of no meaning if there was none.
    last: Last,
    has_last: bool,
    last_norm: f64,
    /// A difference that is no longer used, kept for its memory.
    spare: Difference,
    next: Last,
    steps: usize,
}

impl Anderson {
    /// A residual that grows by more than this rejects the extrapolation. Anything from 1.2 to 10
    /// was found alike.
    const GUARD: f64 = 1.5;
    /// On the diagonal of the normal equations, whose columns have unit length.
    const REGULARIZATION: f64 = 1e-10;
    /// After so many steps go on plainly: this cures the cases that hover.
    const MAX_STEPS: usize = 60;

    pub(crate) fn new(memory: usize) -> Self {
        Self {
            memory,
            history: VecDeque::new(),
            last: Last::default(),
            has_last: false,
            last_norm: f64::INFINITY,
            spare: Difference::default(),
            next: Last::default(),
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
        self.has_last = false;
        self.last_norm = f64::INFINITY;
    }

    /// Returns `true` while it learns from the images and proposes anything else.
    pub(crate) fn is_active(&self) -> bool {
        self.steps < Self::MAX_STEPS
    }

    /// Replaces `image`, that of `u`, by the next iterate. `plainly` asks for the image.
    pub(crate) fn propose<T: Scalar>(
        &mut self,
        u: &VertexMap<Vector3<T>>,
        image: &mut VertexMap<Vector3<T>>,
        plainly: bool,
    ) -> Proposal {
        if !self.is_active() {
            return Proposal::Plain;
        }
        self.steps += 1;
        let sums = self.look(u, image);
        let norm = sums[0].sqrt();
        if norm > Self::GUARD * self.last_norm && self.has_last {
            let last = self.last.image.as_slice();
            parallel::fill(image.as_mut_slice(), |i| last[i].map(T::of_f64));
            self.clear();
            return Proposal::Accelerated;
        }
        self.last_norm = norm;
        if std::mem::replace(&mut self.has_last, true) {
            self.remember(&sums);
        }
        std::mem::swap(&mut self.last, &mut self.next);
        if self.history.is_empty() || plainly {
            return Proposal::Plain;
        }
        self.extrapolate(image);
        Proposal::Accelerated
    }

    /// Notes g and f = g − u in `next`, and the differences to the last step, if there is one, in
    /// `spare`. Returns |f|², Δf·Δf, Δf·f and Δf_k·f of the history.
    fn look<T: Scalar>(
        &mut self,
        u: &VertexMap<Vector3<T>>,
        image: &VertexMap<Vector3<T>>,
    ) -> Vec<f64> {
        let n = u.len();
        let Self {
            history,
            last,
            has_last,
            spare,
            next,
            ..
        } = self;
        for field in [
            &mut last.image,
            &mut last.residual,
            &mut next.image,
            &mut next.residual,
            &mut spare.residual,
        ] {
            if field.len() != n {
                *field = VertexMap::filled(n, Vector3::zeros());
            }
        }
        spare.image.resize(n, Vector3::zeros());
        let (u, image, has_last) = (u.as_slice(), image.as_slice(), *has_last);
        let (last_g, last_f) = (last.image.as_slice(), last.residual.as_slice());
        let outputs = (
            next.image.as_mut_slice(),
            next.residual.as_mut_slice(),
            spare.residual.as_mut_slice(),
            &mut spare.image[..],
        );
        let sums = CHUNKS.map(outputs, |first, (g, f, df, dg)| {
            for k in 0..g.len() {
                let now = image[first + k].map(T::as_f64);
                (g[k], f[k]) = (now, now - u[first + k].map(T::as_f64));
            }
            if has_last {
                for k in 0..g.len() {
                    // The other way round, −Δ: signs cancel in all that is made of them.
                    df[k] = last_f[first + k] - f[k];
                    dg[k] = (last_g[first + k] - g[k]).map(|x| x as f32);
                }
            }
            let at = 3 * first..3 * (first + f.len());
            let (f, df) = (bytemuck::cast_slice(f), bytemuck::cast_slice(df));
            let mut sums = Vec::with_capacity(3 + history.len());
            sums.extend(dots(f, [f]));
            sums.extend(dots(df, [df, f]));
            for old in &*history {
                sums.extend(dots(&flat(old.residual.as_slice())[at.clone()], [f]));
            }
            sums
        });
        total(sums)
    }

    /// Takes the differences in `spare` into the history.
    fn remember(&mut self, sums: &[f64]) {
        let mut new = std::mem::take(&mut self.spare);
        new.products.clear();
        for (old, &with_f) in self.history.iter_mut().zip(&sums[3..]) {
            // With −Δf = f before − f now.
            new.products.push(old.with_f - with_f);
            old.with_f = with_f;
        }
        new.products.push(sums[1]);
        new.with_f = sums[2];
        self.history.push_back(new);
        if self.history.len() > self.memory {
            self.spare = self.history.pop_front().unwrap_or_default();
            for difference in &mut self.history {
                difference.products.remove(0);
            }
        }
    }

    /// image −= ΔG γ with γ = argmin |f − ΔF γ|.
    fn extrapolate<T: Scalar>(&self, image: &mut VertexMap<Vector3<T>>) {
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
        let rhs = DVector::from_fn(m, |a, _| self.history[a].with_f / lengths[a]);
        // Only the lower triangle is read.
        let Some(factor) = gram.cholesky() else {
            return;
        };
        let gamma = factor.solve(&rhs);
        CHUNKS.for_each(image.as_mut_slice(), |first, image| {
            let mut sums = [Vector3::zeros(); CHUNKS.size()];
            for (a, difference) in self.history.iter().enumerate() {
                let factor = gamma[a] / lengths[a];
                let dg = &difference.image[first..first + image.len()];
                for (sum, dg) in sums.iter_mut().zip(dg) {
                    *sum += dg.map(f64::from) * factor;
                }
            }
            for (image, sum) in image.iter_mut().zip(&sums) {
                *image = (image.map(T::as_f64) - sum).map(T::of_f64);
            }
        });
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
        let mut u = VertexMap::filled(5, Vector3::zeros());
        let mut anderson = Anderson::new(5);
        for _ in 0..20 {
            let mut image = u
                .values()
                .zip(&rates)
                .map(|(u, rate)| fixed + (u - fixed) * *rate)
                .collect();
            anderson.propose(&u, &mut image, false);
            u = image;
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
        let zero = VertexMap::filled(1, Vector3::<f64>::zeros());
        let first = VertexMap::filled(1, Vector3::x());
        let mut u = first.clone();
        assert_eq!(anderson.propose(&zero, &mut u, false), Proposal::Plain);
        assert_eq!(u, first);
        let mut far = VertexMap::filled(1, Vector3::x() * 100.0);
        let proposal = anderson.propose(&u, &mut far, false);
        assert_eq!((proposal, far), (Proposal::Accelerated, first));
    }
}
