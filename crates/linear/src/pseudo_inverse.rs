//! M⁺ for M = LᵀL + μK without handles, by factors of one-ring matrices.
//!
//! With L = −D⁻¹W, W symmetric and K = (σ/μ) W,
//!
//! ```text
//! M = W D⁻² W            without a membrane
//! M = W (W + σ)          with one, for D = 1
//! ```
//!
//! W is singular: constants on every component. One vertex per component is its *ground*: the
//! entries off its diagonal are cut, and its right-hand side is set to 0. A right-hand side whose
//! sum over the component is zero is then solved exactly, up to a constant. The means of the
//! right-hand side and of the solution are subtracted, which makes M⁺ symmetric.

use std::sync::Arc;

use cotan_parallel as parallel;
use cotan_sparse::{Cholesky, LowerTriangle, Multigrid, Symbolic};
use nalgebra::Vector3;

use crate::components::GraphComponents;
use crate::error::LinearError;
use crate::one_ring;
use crate::problem::{Problem, Sheet, Stiffness};
use crate::storage::Storage;
use crate::strategy::Reason;
use crate::weights::Form;

pub(crate) struct PseudoInverse {
    components: Arc<GraphComponents>,
    /// D; empty if it is 1.
    scale: Vec<f64>,
    /// Σ D² of every component.
    squares: Vec<f64>,
    /// The ground of every component.
    grounds: Vec<usize>,
    /// W with the grounds cut off.
    grounded: Inverse,
    /// W + σ, if there is a membrane.
    shifted: Option<Inverse>,
    partial: Vec<Vector3<f64>>,
    sums: Vec<Vector3<f64>>,
}

/// The inverse of a one-ring matrix.
enum Inverse {
    Factor(Box<Cholesky>),
    Iteration(Box<Multigrid>),
}

impl Inverse {
    /// Overwrites x by what `after` makes of the solution for what `before` makes of x.
    fn solve_between(
        &mut self,
        x: &mut [Vector3<f64>],
        before: impl Fn(usize, &Vector3<f64>) -> Vector3<f64> + Sync + Send,
        after: impl Fn(usize, Vector3<f64>) -> Vector3<f64> + Sync + Send,
    ) -> Result<(), LinearError> {
        match self {
            Self::Factor(cholesky) => cholesky.solve_between(x, before, after),
            Self::Iteration(multigrid) => {
                parallel::update(&mut *x, |i, x| *x = before(i, x));
                multigrid.solve(x)?;
                parallel::update(x, |i, x| *x = after(i, *x));
            }
        }
        Ok(())
    }

    fn solve_one(&mut self, x: &mut [f64]) -> Result<(), LinearError> {
        match self {
            Self::Factor(cholesky) => cholesky.solve_one(x),
            Self::Iteration(multigrid) => {
                let mut vectors: Vec<_> = x.iter().map(|&x| Vector3::new(x, 0.0, 0.0)).collect();
                multigrid.solve(&mut vectors)?;
                x.iter_mut().zip(&vectors).for_each(|(x, v)| *x = v.x);
            }
        }
        Ok(())
    }

    /// The inverse of a matrix of the same pattern, of the same kind.
    fn like(&self, matrix: &LowerTriangle) -> Result<Self, LinearError> {
        Ok(match self {
            Self::Factor(cholesky) => Self::Factor(Box::new(cholesky.factor_like(matrix)?)),
            Self::Iteration(_) => Self::iteration(matrix)?,
        })
    }

    fn iteration(matrix: &LowerTriangle) -> Result<Self, LinearError> {
        Ok(Self::Iteration(Box::new(Multigrid::new(matrix)?)))
    }

    fn num_entries(&self) -> usize {
        match self {
            Self::Factor(cholesky) => cholesky.num_entries(),
            Self::Iteration(multigrid) => multigrid.num_entries(),
        }
    }
}

/// The means of inverting the one-ring matrices.
pub(crate) enum Means {
    Factor(Storage),
    Iteration,
}

/// The analysis that all one-ring matrices of a problem share.
pub(crate) fn analyse(problem: &Problem) -> Result<Arc<Symbolic>, LinearError> {
    let (graph, weights) = (&problem.graph, &problem.weights);
    let matrix = one_ring::assemble(graph, weights, |_| false, |_, sum| sum)?;
    Ok(Arc::new(Symbolic::of(&matrix)?))
}

/// Why these matrices cannot stand for the problem, if they cannot.
pub(crate) fn obstacle(problem: &Problem) -> Option<Reason> {
    if !problem.ties.is_empty() {
        return Some(Reason::Tied);
    }
    match (problem.weights.form(), &problem.membrane) {
        (Form::General, _) => Some(Reason::GeneralWeights),
        (Form::RowScaled(_), Some(_)) => Some(Reason::OtherMembrane),
        (
            Form::Symmetric,
            Some(Sheet {
                stiffness: Stiffness::PerEntry(_),
                ..
            }),
        ) => Some(Reason::OtherMembrane),
        _ => None,
    }
}

impl PseudoInverse {
    /// Factorizes; the ground of a component is its handle with the lowest number.
    pub(crate) fn factor(problem: &Problem, means: &Means) -> Result<Self, LinearError> {
        let components = &problem.components;
        let mut grounds = vec![usize::MAX; components.len()];
        for handle in &problem.held.handles {
            let i = handle.vertex.index();
            let ground = &mut grounds[components.of(i)];
            *ground = (*ground).min(i);
        }
        Self::assemble(problem, grounds, |matrices| match means {
            Means::Factor(storage) => {
                let storage = Storage {
                    analysis: Some(storage.analysed(&matrices[0])?),
                    ..storage.clone()
                };
                side_by_side(matrices, |matrix| {
                    let cholesky = storage.factor(matrix)?;
                    Ok(Inverse::Factor(Box::new(cholesky)))
                })
            }
            Means::Iteration => side_by_side(matrices, Inverse::iteration),
        })
    }

    /// For other weights: the analysis is shared.
    pub(crate) fn refactor(&self, problem: &Problem) -> Result<Self, LinearError> {
        Self::assemble(problem, self.grounds.clone(), |matrices| {
            side_by_side(matrices, |matrix| self.grounded.like(matrix))
        })
    }

    fn assemble(
        problem: &Problem,
        grounds: Vec<usize>,
        invert: impl Fn(&[LowerTriangle]) -> Result<Vec<Inverse>, LinearError>,
    ) -> Result<Self, LinearError> {
        let (graph, weights) = (&problem.graph, &problem.weights);
        let components = problem.components.clone();
        let scale = match weights.form() {
            Form::RowScaled(scale) => scale.clone(),
            Form::Symmetric | Form::General => Vec::new(),
        };
        let square = |i: &u32| scale.get(*i as usize).map_or(1.0, |d| d * d);
        let squares = (0..components.len())
            .map(|c| components.members(c).iter().map(square).sum())
            .collect();
        let is_ground = |i: usize| grounds[components.of(i)] == i;
        // Rows that are cut off keep a diagonal of the usual size, so that norms do not change.
        let usual = |sum: f64| if sum > 0.0 { sum } else { 1.0 };
        let cut = |i: usize, sum: f64| if is_ground(i) { usual(sum) } else { sum };
        let mut matrices = vec![one_ring::assemble(graph, weights, is_ground, cut)?];
        if let Some(Sheet {
            weight,
            stiffness: Stiffness::OfWeights(c),
        }) = &problem.membrane
        {
            let shifted = |_, sum| sum + weight * c;
            matrices.push(one_ring::assemble(graph, weights, |_| false, shifted)?);
        }
        let mut inverses = invert(&matrices)?;
        let shifted = (inverses.len() > 1).then(|| inverses.pop()).flatten();
        let grounded = inverses.remove(0);
        Ok(Self {
            scale,
            squares,
            grounds,
            grounded,
            shifted,
            partial: components.partial_sums(),
            sums: vec![Vector3::zeros(); components.len()],
            components,
        })
    }

    pub(crate) fn num_entries(&self) -> usize {
        let shifted = self.shifted.as_ref();
        self.grounded.num_entries() + shifted.map_or(0, Inverse::num_entries)
    }

    /// δ₀ = M⁺(Lᵀy + μt), up to a constant a component: the correction that nothing holds.
    ///
    /// Without a membrane W δ₀ = −D y + a D², a such that the sums vanish: what no shape can
    /// fulfil of y is left. With one, (W + σ) δ₀ = W⁺μt − y less its mean.
    pub(crate) fn free_correction(
        &mut self,
        mismatch: &[Vector3<f64>],
        tension: Option<(f64, &[Vector3<f64>])>,
        out: &mut [Vector3<f64>],
    ) -> Result<(), LinearError> {
        if self.shifted.is_none() {
            if self.scale.is_empty() {
                return self.solve_grounded(out, |i, _| -mismatch[i], |_, x| x);
            }
            return self.solve_balanced(out, |i, _, scale| mismatch[i] * -scale);
        }
        match tension {
            Some((weight, tension)) => {
                let (of_tension, less) = (
                    |i: usize, _: &Vector3<f64>| tension[i] * weight,
                    |i: usize, x: Vector3<f64>| x - mismatch[i],
                );
                self.solve_grounded(out, of_tension, less)?;
            }
            None => parallel::fill(out, |i| -mismatch[i]),
        }
        self.solve_shifted(out)
    }

    /// M⁺e of up to three vertices at once, each in its own coordinate.
    pub(crate) fn columns(
        &mut self,
        vertices: &[usize],
        out: &mut [Vector3<f64>],
    ) -> Result<(), LinearError> {
        out.fill(Vector3::zeros());
        for (lane, &vertex) in vertices.iter().enumerate() {
            out[vertex][lane] = 1.0;
        }
        self.solve_grounded(out, |_, x| *x, |_, x| x)?;
        if self.shifted.is_some() {
            self.solve_shifted(out)?;
        } else if self.scale.is_empty() {
            self.solve_grounded(out, |_, x| *x, |_, x| x)?;
        } else {
            self.solve_balanced(out, |_, x, scale| x * (scale * scale))?;
        }
        self.center(out);
        Ok(())
    }

    /// M⁺e of one vertex: as [`Self::columns`], by solves of one right-hand side.
    pub(crate) fn column(&mut self, vertex: usize, out: &mut [f64]) -> Result<(), LinearError> {
        let Self {
            components,
            scale,
            squares,
            grounds,
            grounded,
            shifted,
            ..
        } = self;
        let c = components.of(vertex);
        let (members, ground) = (components.members(c), grounds[c]);
        let each = || members.iter().map(|&i| i as usize);
        let center = |x: &mut [f64]| {
            let mean = each().map(|i| x[i]).sum::<f64>() / members.len() as f64;
            each().for_each(|i| x[i] -= mean);
        };
        // Other components are left alone: there all stays 0.
        out.fill(0.0);
        out[vertex] = 1.0;
        center(out);
        out[ground] = 0.0;
        grounded.solve_one(out)?;
        if let Some(shifted) = shifted {
            center(out);
            shifted.solve_one(out)?;
        } else {
            if scale.is_empty() {
                center(out);
            } else {
                each().for_each(|i| out[i] *= scale[i] * scale[i]);
                let share = each().map(|i| out[i]).sum::<f64>() / squares[c];
                each().for_each(|i| out[i] -= share * (scale[i] * scale[i]));
            }
            out[ground] = 0.0;
            grounded.solve_one(out)?;
        }
        center(out);
        Ok(())
    }

    /// x with W x = what `of` makes of x less its mean over every component, and x = 0 at the
    /// grounds; then what `after` makes of it.
    fn solve_grounded(
        &mut self,
        x: &mut [Vector3<f64>],
        of: impl Fn(usize, &Vector3<f64>) -> Vector3<f64> + Sync + Send,
        after: impl Fn(usize, Vector3<f64>) -> Vector3<f64> + Sync + Send,
    ) -> Result<(), LinearError> {
        self.means(|i| of(i, &x[i]));
        let Self {
            components,
            grounds,
            grounded,
            sums,
            ..
        } = self;
        let before = |i: usize, x: &Vector3<f64>| {
            let c = components.of(i);
            if grounds[c] == i {
                Vector3::zeros()
            } else {
                of(i, x) - sums[c]
            }
        };
        grounded.solve_between(x, before, after)
    }

    /// As [`Self::solve_grounded`], less a multiple of D² such that the sum over every component
    /// is 0. `of` is given the entry of D as well.
    fn solve_balanced(
        &mut self,
        x: &mut [Vector3<f64>],
        of: impl Fn(usize, &Vector3<f64>, f64) -> Vector3<f64> + Sync + Send,
    ) -> Result<(), LinearError> {
        let scale = &self.scale;
        let term = |i: usize| of(i, &x[i], scale[i]);
        self.components.sum(term, &mut self.partial, &mut self.sums);
        let Self {
            components,
            scale,
            squares,
            grounds,
            grounded,
            sums,
            ..
        } = self;
        let before = |i: usize, x: &Vector3<f64>| {
            let c = components.of(i);
            if grounds[c] == i {
                Vector3::zeros()
            } else {
                of(i, x, scale[i]) - sums[c] * (scale[i] * scale[i] / squares[c])
            }
        };
        grounded.solve_between(x, before, |_, x| x)
    }

    /// (W + σ)⁻¹ of x less its mean over every component.
    fn solve_shifted(&mut self, x: &mut [Vector3<f64>]) -> Result<(), LinearError> {
        self.means(|i| x[i]);
        let (components, means) = (&self.components, &self.sums);
        match &mut self.shifted {
            Some(shifted) => shifted.solve_between(x, |i, x| x - means[components.of(i)], |_, x| x),
            None => Ok(()),
        }
    }

    /// Subtracts the mean over every component.
    fn center(&mut self, x: &mut [Vector3<f64>]) {
        self.means(|i| x[i]);
        let (components, means) = (&self.components, &self.sums);
        parallel::update(x, |i, x| *x -= means[components.of(i)]);
    }

    /// Leaves the mean of a term over every component in `sums`.
    fn means(&mut self, term: impl Fn(usize) -> Vector3<f64> + Sync) {
        self.components.sum(term, &mut self.partial, &mut self.sums);
        for (c, sum) in self.sums.iter_mut().enumerate() {
            *sum /= self.components.members(c).len() as f64;
        }
    }
}

/// The inverses of some matrices.
fn side_by_side(
    matrices: &[LowerTriangle],
    invert: impl Fn(&LowerTriangle) -> Result<Inverse, LinearError> + Sync + Send,
) -> Result<Vec<Inverse>, LinearError> {
    // In a list first: of two errors the first counts, whichever comes first.
    let inverses = parallel::tasks(matrices.iter().collect(), invert);
    inverses.into_iter().collect()
}
