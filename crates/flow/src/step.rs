//! One iteration of a flow.

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::VertexMap;
use cotan_linear::Hold;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::anderson::Proposal;
use crate::error::FlowError;
use crate::flow::{Accelerator, Flow, Parts};
use crate::lbfgs::Lbfgs;
use crate::report::StepReport;
use crate::state::FlowState;
use crate::vectors::{add_scaled, dot, max_norm};

/// Whether a descent found a lower energy.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Descent {
    Went,
    Stalled,
}

impl<T: Scalar> Flow<'_, T> {
    /// One iteration: a solve, then the update of field and orientation.
    ///
    /// # Errors
    /// What an updater, orientation or scheme reports.
    pub fn step(&mut self) -> Result<StepReport, FlowError> {
        self.solve();
        self.iteration += 1;
        let ratio = self.settings.schedule.ratio(self.since_move);
        let diagonal = self.parts.rest.diagonal().as_f64();
        let residual = max_norm(self.terms.correction.as_slice()) / diagonal;
        let mut report = StepReport {
            iteration: self.iteration,
            change: f64::NAN,
            residual,
            energy: self.energy,
            converged: false,
            stalled: false,
        };
        if !residual.is_finite() {
            return Ok(report);
        }
        // The first solve after a move answers to the handles, not to the shape: its length says
        // nothing about convergence.
        let is_first = self.since_move == 0;
        let is_short = ratio * residual < self.settings.tolerance;
        report.converged = is_short && self.is_plain && !is_first;
        self.since_move += 1;

        let before = self.positions.clone();
        if self.has_membrane() && !is_first && !report.converged && ratio == 1.0 {
            report.stalled = self.step_positions()? == Descent::Stalled;
        } else {
            self.move_by_correction(ratio);
            self.step_laplacian(is_short, ratio)?;
        }
        report.change = self.longest_move(&before) / diagonal;
        report.energy = self.energy;
        Ok(report)
    }

    /// Computes the correction that a full plain step would make.
    fn solve(&mut self) {
        let has_membrane = self.has_membrane();
        let Self { parts, terms, positions, laplacian, .. } = self;
        let rest = &parts.rest;
        if has_membrane {
            parts.orientation.tension(rest, positions, &mut terms.tension);
        }
        terms.mismatch.as_mut_slice().par_iter_mut().enumerate().with_min_len(1 << 11).for_each(
            |(i, y)| {
                *y = laplacian.as_slice()[i].map(T::as_f64) - rest.apply_operator(positions, i);
            },
        );
        for (handle, target) in parts.handles.iter().zip(&parts.targets) {
            if handle.hold != Hold::Hard {
                terms.pull[handle.vertex] = (target - positions[handle.vertex]).map(T::as_f64);
            }
        }
        let tension = has_membrane.then_some(&terms.tension);
        parts.system.residual(&terms.mismatch, tension, &terms.pull, &mut terms.residual);
        parts.system.solve(&terms.residual, &mut terms.correction);
    }

    /// x ← x + s δ.
    fn move_by_correction(&mut self, ratio: f64) {
        let ratios = self.settings.ratios.as_ref();
        for (v, p) in self.positions.values_mut().enumerate() {
            let own = ratios.map_or(1.0, |r| r.as_slice()[v].as_f64());
            *p += (self.terms.correction.as_slice()[v] * (ratio * own)).map(T::of_f64);
        }
    }

    /// Updates field, Laplacian coordinates and energy from the current positions.
    fn update(&mut self) -> Result<(), FlowError> {
        let Parts { rest, scheme, updater, orientation, .. } = &mut self.parts;
        let wanted = updater.needs().or(orientation.needs());
        self.measured.update(rest, &**scheme, &self.positions, wanted)?;
        let state = FlowState::new(rest, &self.positions, &self.measured, self.iteration);
        updater.update(&state, &mut self.field)?;
        orientation.orient(&state, &self.field, &mut self.laplacian)?;
        self.energy = orientation.energy();
        Ok(())
    }

    /// After a plain step: the new Laplacian coordinates, extrapolated where the orientation works
    /// on them alone. `is_short` asks for a plain step next, to check convergence by.
    fn step_laplacian(&mut self, is_short: bool, ratio: f64) -> Result<(), FlowError> {
        let extrapolates = matches!(self.accelerator, Accelerator::Anderson(_))
            && !self.has_membrane()
            && ratio == 1.0;
        if !extrapolates {
            return self.update();
        }
        let mut u = as_vectors(&self.laplacian);
        self.update()?;
        let image = as_vectors(&self.laplacian);
        if let Accelerator::Anderson(anderson) = &mut self.accelerator {
            self.is_plain = anderson.propose(&mut u, image, is_short) == Proposal::Plain;
        }
        for (ell, u) in self.laplacian.values_mut().zip(&u) {
            *ell = u.map(T::of_f64);
        }
        Ok(())
    }

    /// A step of an orientation with a membrane: from x, whose plain image is x + δ, to the next x.
    fn step_positions(&mut self) -> Result<Descent, FlowError> {
        let mut accelerator = std::mem::replace(&mut self.accelerator, Accelerator::Off);
        let result = match &mut accelerator {
            Accelerator::Lbfgs(lbfgs) => self.descend(lbfgs),
            Accelerator::Anderson(anderson) => {
                let mut x: Vec<Vector3<f64>> =
                    self.positions.values().map(|p| p.coords.map(T::as_f64)).collect();
                let mut image = x.clone();
                add_scaled(&mut image, 1.0, self.terms.correction.as_slice());
                // The plain residual is known at every iterate: no check step is needed.
                anderson.propose(&mut x, image, false);
                for (p, x) in self.positions.values_mut().zip(&x) {
                    *p = Point3::from(x.map(T::of_f64));
                }
                self.update().map(|()| Descent::Went)
            }
            Accelerator::Off => {
                self.move_by_correction(1.0);
                self.update().map(|()| Descent::Went)
            }
        };
        self.accelerator = accelerator;
        result
    }

    /// One line search along the direction of the quasi-Newton model; the plain step where that
    /// fails. No step that raises the energy is accepted.
    fn descend(&mut self, lbfgs: &mut Lbfgs) -> Result<Descent, FlowError> {
        /// Fraction of the predicted decrease that is asked for (Armijo).
        const SUFFICIENT: f64 = 1e-4;
        const MOST_TRIALS: usize = 10;
        let start = self.positions.clone();
        let energy = self.energy.unwrap_or(0.0);
        let residual = self.terms.residual.as_slice();
        let correction = self.terms.correction.as_slice();
        let mut direction = lbfgs.direction(residual, correction);
        // Half the energy falls at this rate along the direction.
        let mut rate = dot(residual, &direction);
        if !(rate > 0.0) {
            lbfgs.reset();
            direction = correction.to_vec();
            rate = dot(residual, &direction);
        }
        let (residual, correction) = (residual.to_vec(), correction.to_vec());

        let mut length = 1.0;
        for _ in 0..MOST_TRIALS {
            self.move_from(&start, &direction, length);
            self.update()?;
            let rise = 0.5 * (self.energy.unwrap_or(0.0) - energy);
            if rise <= -SUFFICIENT * length * rate {
                lbfgs.stepped(difference(&self.positions, &start), residual, correction);
                return Ok(Descent::Went);
            }
            // Minimum of the parabola through value, slope and the new value.
            let parabola = rate * length * length / (2.0 * (rise + length * rate));
            length = if parabola.is_finite() {
                parabola.clamp(0.1 * length, 0.5 * length)
            } else {
                0.1 * length
            };
        }
        lbfgs.reset();
        self.move_from(&start, &correction, 1.0);
        self.update()?;
        if self.energy.unwrap_or(0.0) <= energy {
            return Ok(Descent::Went);
        }
        self.positions = start;
        self.update()?;
        Ok(Descent::Stalled)
    }

    /// x ← start + length · direction.
    fn move_from(&mut self, start: &Positions<T>, direction: &[Vector3<f64>], length: f64) {
        for ((p, start), d) in self.positions.values_mut().zip(start.values()).zip(direction) {
            *p = start + (d * length).map(T::of_f64);
        }
    }

    fn longest_move(&self, before: &Positions<T>) -> f64 {
        max_norm(&difference(&self.positions, before))
    }
}

/// a − b in double precision.
fn difference<T: Scalar>(a: &Positions<T>, b: &Positions<T>) -> Vec<Vector3<f64>> {
    a.values().zip(b.values()).map(|(a, b)| (a - b).map(T::as_f64)).collect()
}

fn as_vectors<T: Scalar>(map: &VertexMap<Vector3<T>>) -> Vec<Vector3<f64>> {
    map.values().map(|v| v.map(T::as_f64)).collect()
}
