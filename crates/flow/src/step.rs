//! One iteration of a flow.

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::VertexMap;
use cotan_linear::{Handle, Hold};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::anderson::Proposal;
use crate::error::FlowError;
use crate::flow::{Accelerator, Flow, Parts};
use crate::lbfgs::Lbfgs;
use crate::report::StepReport;
use crate::state::FlowState;
use crate::vectors::{dot, max_norm};

/// Whether the scalar field follows the positions.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Field {
    Updated,
    Kept,
}

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
    /// What an updater, orientation or scheme reports. The shape is then somewhere between two steps.
    pub fn step(&mut self) -> Result<StepReport, FlowError> {
        self.solve();
        self.iteration += 1;
        let ratio = self.settings.schedule.ratio(self.since_move);
        let diagonal = self.parts.rest.diagonal().as_f64();
        let residual = self.longest_correction() / diagonal;
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
        let descends = matches!(self.accelerator, Accelerator::Lbfgs(_));
        let is_projected = self.parts.projection.is_some();
        if (self.parts.has_membrane || descends)
            && !is_projected
            && !is_first
            && !report.converged
            && ratio == 1.0
        {
            report.stalled = self.step_positions()? == Descent::Stalled;
        } else {
            if let Accelerator::Lbfgs(lbfgs) = &mut self.accelerator {
                // What it learned spans whole steps of its own only.
                lbfgs.reset();
            }
            self.move_by_correction(ratio);
            if let Some(projection) = &mut self.parts.projection {
                let change = projection.project(&self.parts.rest, &before, &mut self.positions)?;
                report.change = change;
                report.converged = change < self.settings.tolerance;
                self.update()?;
                report.energy = self.energy;
                return Ok(report);
            }
            self.step_laplacian(is_short, ratio)?;
        }
        report.change = self.longest_move(&before) / diagonal;
        report.energy = self.energy;
        Ok(report)
    }

    /// Computes the correction that a full plain step would make.
    fn solve(&mut self) {
        let has_membrane = self.parts.has_membrane;
        let Self {
            parts,
            terms,
            positions,
            laplacian,
            ..
        } = self;
        let rest = &parts.rest;
        if has_membrane {
            parts
                .orientation
                .tension(rest, positions, &mut terms.tension);
        }
        terms
            .mismatch
            .as_mut_slice()
            .par_iter_mut()
            .enumerate()
            .with_min_len(1 << 11)
            .for_each(|(i, y)| {
                *y =
                    laplacian.as_slice()[i].map(T::as_f64) - rest.operator().apply_at(positions, i);
            });
        for (handle, target) in parts.handles.iter().zip(&parts.targets) {
            if handle.hold != Hold::Hard {
                terms.pull[handle.vertex] = (target - positions[handle.vertex]).map(T::as_f64);
            }
        }
        let tension = has_membrane.then_some(&terms.tension);
        parts.system.correct(
            &terms.mismatch,
            tension,
            &terms.pull,
            &mut terms.residual,
            &mut terms.correction,
        );
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
    pub(crate) fn update(&mut self) -> Result<(), FlowError> {
        self.refresh(Field::Updated)
    }

    /// Updates Laplacian coordinates and energy, and the field if so asked.
    fn refresh(&mut self, field: Field) -> Result<(), FlowError> {
        let Parts {
            rest,
            scheme,
            updater,
            orientation,
            ..
        } = &mut self.parts;
        let wanted = match field {
            Field::Updated => updater.needs().or(orientation.needs()),
            Field::Kept => orientation.needs(),
        };
        self.measured
            .update(rest, &**scheme, &self.positions, wanted)?;
        let state = FlowState::new(rest, &self.positions, &self.measured, self.iteration);
        if field == Field::Updated {
            updater.update(&state, &mut self.field)?;
        }
        orientation.orient(&state, &self.field, &mut self.laplacian)?;
        self.energy = orientation
            .energy()
            .map(|energy| energy + self.spring_energy());
        Ok(())
    }

    /// Σ k² |x − u|² over the soft handles.
    fn spring_energy(&self) -> f64 {
        let Parts {
            handles,
            targets,
            system,
            ..
        } = &self.parts;
        let of_handle = |(handle, target): (&Handle, &Point3<T>)| match handle.hold {
            Hold::Hard => 0.0,
            Hold::Soft(_) => {
                let miss = (target - self.positions[handle.vertex]).norm_squared();
                system.spring(handle.vertex) * miss.as_f64()
            }
        };
        handles.iter().zip(targets).map(of_handle).sum()
    }

    /// The longest correction, each vertex by its own ratio.
    fn longest_correction(&self) -> f64 {
        match &self.settings.ratios {
            None => max_norm(self.terms.correction.as_slice()),
            Some(ratios) => {
                let scaled = self.terms.correction.values().zip(ratios.values());
                max_norm(&scaled.map(|(d, r)| d * r.as_f64()).collect::<Vec<_>>())
            }
        }
    }

    /// After a plain step: the new Laplacian coordinates, extrapolated where the orientation works
    /// on them alone. `is_short` asks for a plain step next, to check convergence by.
    fn step_laplacian(&mut self, is_short: bool, ratio: f64) -> Result<(), FlowError> {
        let extrapolates = matches!(self.accelerator, Accelerator::Anderson(_))
            && !self.parts.has_membrane
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

    /// A step of an orientation with an energy or a membrane, whose state is the positions: from x,
    /// whose plain image is x + δ, to the next x.
    fn step_positions(&mut self) -> Result<Descent, FlowError> {
        let mut accelerator = std::mem::replace(&mut self.accelerator, Accelerator::Off);
        let result = match &mut accelerator {
            Accelerator::Lbfgs(lbfgs) => self.descend(lbfgs),
            Accelerator::Off | Accelerator::Anderson(_) => {
                self.move_by_correction(1.0);
                self.update().map(|()| Descent::Went)
            }
        };
        self.accelerator = accelerator;
        result
    }

    /// One line search along the direction of the quasi-Newton model; the plain step where that
    /// fails. No step that raises the energy beyond rounding is accepted, the energy being that of
    /// the scalar field before the step.
    fn descend(&mut self, lbfgs: &mut Lbfgs) -> Result<Descent, FlowError> {
        /// Fraction of the predicted decrease that is asked for (Armijo).
        const SUFFICIENT: f64 = 1e-4;
        const MOST_TRIALS: usize = 10;
        let start = self.positions.clone();
        let energy = self.energy.unwrap_or(0.0);
        // Two sums that differ by less are the same: near the minimum every step is such a step.
        let rounding = 32.0 * T::default_epsilon().as_f64() * energy;
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
            self.refresh(Field::Kept)?;
            let rise = 0.5 * (self.energy.unwrap_or(0.0) - energy);
            if rise <= rounding - SUFFICIENT * length * rate {
                lbfgs.stepped(difference(&self.positions, &start), residual, correction);
                self.follow_field()?;
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
        self.refresh(Field::Kept)?;
        if self.energy.unwrap_or(0.0) <= energy + rounding {
            self.follow_field()?;
            return Ok(Descent::Went);
        }
        self.positions = start;
        self.refresh(Field::Kept)?;
        Ok(Descent::Stalled)
    }

    /// After a step that was judged with the field kept: lets the field follow.
    fn follow_field(&mut self) -> Result<(), FlowError> {
        if self.parts.updater.is_constant() {
            return Ok(());
        }
        self.update()
    }

    /// x ← start + length · direction.
    fn move_from(&mut self, start: &Positions<T>, direction: &[Vector3<f64>], length: f64) {
        for ((p, start), d) in self
            .positions
            .values_mut()
            .zip(start.values())
            .zip(direction)
        {
            *p = start + (d * length).map(T::of_f64);
        }
    }

    fn longest_move(&self, before: &Positions<T>) -> f64 {
        max_norm(&difference(&self.positions, before))
    }
}

/// a − b in double precision.
fn difference<T: Scalar>(a: &Positions<T>, b: &Positions<T>) -> Vec<Vector3<f64>> {
    a.values()
        .zip(b.values())
        .map(|(a, b)| (a - b).map(T::as_f64))
        .collect()
}

fn as_vectors<T: Scalar>(map: &VertexMap<Vector3<T>>) -> Vec<Vector3<f64>> {
    map.values().map(|v| v.map(T::as_f64)).collect()
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use cotan_geometry::shapes::icosphere;
    use cotan_geometry::{Shape, volume};
    use cotan_halfedge::VertexId;

    use super::*;
    use crate::{Acceleration, Limited, ScalarFieldUpdater, Schedule, Start, StopReason};

    /// The lowest vertices held, the highest pulled by half a radius.
    fn handles(shape: &Shape<f64>) -> Vec<(Handle, Point3<f64>)> {
        let surface = shape.surface();
        let low = surface.vertices_where(|p| p.z < -0.8);
        let high = surface.vertices_where(|p| p.z > 0.9);
        let hard = |v: &VertexId, lift| {
            (
                Handle::hard(*v),
                shape.positions[*v] + Vector3::new(0.0, 0.0, lift),
            )
        };
        low.iter()
            .map(|v| hard(v, 0.0))
            .chain(high.iter().map(|v| hard(v, 0.5)))
            .collect()
    }

    fn build<'a>(shape: &'a Shape<f64>) -> crate::FlowBuilder<'a, f64> {
        Flow::builder(&shape.mesh, &shape.positions).handles(handles(shape))
    }

    /// Half the energy's derivative along a direction is minus the residual's product with it.
    #[test]
    fn the_residual_is_half_the_negative_gradient() {
        let shape = icosphere::<f64>(2);
        let mut held = handles(&shape);
        let last = held.len() - 1;
        held[last].0.hold = Hold::Soft(0.3);
        let mut flow = build(&shape)
            .handles(held)
            .acceleration(Acceleration::Off)
            .build()
            .unwrap();
        for _ in 0..3 {
            flow.step().unwrap();
        }
        flow.solve();
        let residual = flow.terms.residual.clone();
        let start = flow.positions.clone();
        let mut direction: Vec<Vector3<f64>> = (0..start.len())
            .map(|i| Vector3::new((i as f64).sin(), (2.0 * i as f64).cos(), 0.3))
            .collect();
        for handle in flow.handles().iter().filter(|h| h.hold == Hold::Hard) {
            direction[handle.vertex.index()] = Vector3::zeros();
        }
        let step = 1e-5;
        let mut energy_at = |length: f64| {
            flow.move_from(&start, &direction, length);
            flow.update().unwrap();
            flow.energy.unwrap()
        };
        let slope = (energy_at(step) - energy_at(-step)) / (2.0 * step);
        let expected = -2.0 * dot(residual.as_slice(), &direction);
        assert!(
            (slope - expected).abs() < 1e-6 * expected.abs(),
            "{slope} {expected}"
        );
    }

    #[test]
    fn plain_and_accelerated_descents_meet() {
        let shape = icosphere::<f64>(3);
        let run = |acceleration| {
            let mut flow = build(&shape)
                .acceleration(acceleration)
                .tolerance(1e-9)
                .iteration_limit(5000)
                .build()
                .unwrap();
            let report = flow.run(|_, _| ControlFlow::Continue(())).unwrap();
            assert_eq!(report.stop, StopReason::Converged);
            (flow.positions(), report.iterations)
        };
        let (plain, many) = run(Acceleration::Off);
        let (accelerated, few) = run(Acceleration::default());
        assert!(2 * few < many, "{few} {many}");
        assert!(max_norm(&difference(&plain, &accelerated)) < 1e-5);
    }

    #[test]
    fn an_observer_stops_the_run_and_the_limit_ends_it() {
        let shape = icosphere::<f64>(2);
        let mut flow = build(&shape)
            .orientation(Limited::new())
            .tolerance(0.0)
            .iteration_limit(7)
            .build()
            .unwrap();
        let report = flow
            .run(|flow, step| {
                assert_eq!(flow.iteration(), step.iteration);
                if step.iteration == 3 {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                }
            })
            .unwrap();
        assert_eq!((report.stop, report.iterations), (StopReason::Cancelled, 3));
        let report = flow.run(|_, _| ControlFlow::Continue(())).unwrap();
        assert_eq!(
            (report.stop, report.iterations),
            (StopReason::IterationLimit, 7)
        );
    }

    #[test]
    fn a_vertex_with_ratio_zero_stays() {
        let shape = icosphere::<f64>(2);
        let still = shape.surface().vertices_where(|p| p.z.abs() < 0.05);
        let mut ratios = VertexMap::filled(shape.positions.len(), 1.0);
        still.iter().for_each(|v| ratios[*v] = 0.0);
        let mut flow = build(&shape)
            .orientation(Limited::new())
            .vertex_ratios(ratios)
            .build()
            .unwrap();
        let report = flow.run_to_end().unwrap();
        assert_eq!(report.stop, StopReason::Converged);
        let now = flow.positions();
        assert!(still.iter().all(|v| now[*v] == shape.positions[*v]));
        assert!(max_norm(&difference(&now, &shape.positions)) > 0.1);
    }

    #[test]
    fn damped_steps_are_shorter_and_say_so() {
        let shape = icosphere::<f64>(2);
        let mut flow = build(&shape)
            .orientation(Limited::new())
            .acceleration(Acceleration::Off)
            .schedule(Schedule::Constant(0.25))
            .build()
            .unwrap();
        for _ in 0..4 {
            let step = flow.step().unwrap();
            assert!((step.change - 0.25 * step.residual).abs() < 1e-12);
        }
    }

    #[test]
    fn a_moved_handle_is_followed_without_factorizing_again() {
        let shape = icosphere::<f64>(2);
        let mut flow = build(&shape).build().unwrap();
        let _ = flow.run(|_, _| ControlFlow::Continue(())).unwrap();
        let entries = flow.system().factor_entries();
        let original: Vec<Point3<f64>> = flow
            .handles()
            .iter()
            .map(|h| shape.positions[h.vertex])
            .collect();
        flow.set_targets(&original).unwrap();
        let report = flow.run(|_, _| ControlFlow::Continue(())).unwrap();
        assert_eq!(report.stop, StopReason::Converged);
        assert_eq!(flow.system().factor_entries(), entries);
        assert!(max_norm(&difference(&flow.positions(), &shape.positions)) < 5e-3);

        let free = shape.surface().vertices_where(|p| p.z.abs() < 0.05)[0];
        let error = flow.move_handles(&[(free, Point3::origin())]).unwrap_err();
        assert_eq!(error, FlowError::NotAHandle { vertex: free });
        let error = flow.set_targets(&original[1..]).unwrap_err();
        assert!(matches!(error, FlowError::TargetCount { .. }));
    }

    /// A shape from its scalar fields alone: zero vectors first.
    #[test]
    fn zero_vectors_come_back_to_the_original() {
        let shape = icosphere::<f64>(2);
        let corners = [0, 1, 2, 5].map(|i| {
            let v = VertexId::new(i);
            (Handle::hard(v), shape.positions[v])
        });
        let mut flow = Flow::builder(&shape.mesh, &shape.positions)
            .handles(corners)
            .start(Start::Zero)
            .orientation(crate::ReflectFirst::new(10))
            .tolerance(1e-7)
            .build()
            .unwrap();
        let first = flow.step().unwrap();
        assert!(first.change > 0.05, "the first solve collapses the shape");
        let report = flow.run(|_, _| ControlFlow::Continue(())).unwrap();
        assert_eq!(report.stop, StopReason::Converged);
        assert!(max_norm(&difference(&flow.positions(), &shape.positions)) < 1e-4);
    }

    /// A field that is no longer that of the original is obeyed.
    #[test]
    fn a_smaller_scalar_field_flattens_the_shape() {
        struct Halve;
        impl ScalarFieldUpdater<f64> for Halve {
            fn update(
                &mut self,
                state: &FlowState<'_, f64>,
                field: &mut VertexMap<f64>,
            ) -> Result<(), FlowError> {
                for (v, magnitude) in state.rest().magnitudes().iter() {
                    field[v] = 0.5 * magnitude;
                }
                Ok(())
            }
        }
        let shape = icosphere::<f64>(2);
        let held = shape.surface().vertices_where(|p| p.z < 0.0);
        let held: Vec<_> = held
            .into_iter()
            .map(|v| (Handle::hard(v), shape.positions[v]))
            .collect();
        let mut flow = Flow::builder(&shape.mesh, &shape.positions)
            .handles(held)
            .updater(Halve)
            .orientation(Limited::new())
            .build()
            .unwrap();
        let _ = flow.run(|_, _| ControlFlow::Continue(())).unwrap();
        let now = flow.positions();
        assert!(volume(&shape.surface().with_positions(&now)) < 0.95 * volume(&shape.surface()));
    }
}
