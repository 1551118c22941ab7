//! One iteration of a flow.

use cotan_geometry::Scalar;
use cotan_linear::{Handle, Hold, PreparedSystem};
use nalgebra::Point3;

use crate::anderson::Proposal;
use crate::descent::Descent;
use crate::error::FlowError;
use crate::flow::{Accelerator, Flow, Parts};
use crate::orientation::Energy;
use crate::report::StepReport;
use crate::state::FlowState;
use crate::vectors::{fill, longest, update_both};

/// Whether the scalar field follows the positions.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Field {
    Updated,
    Kept,
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
            energy: self.energy(),
            energy_rounding: self.energy.map_or(0.0, |energy| energy.rounding::<T>()),
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

        // Every way on writes all positions, from those at the start.
        std::mem::swap(&mut self.start, &mut self.positions);
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
                let change =
                    projection.project(&self.parts.rest, &self.start, &mut self.positions)?;
                report.change = change;
                report.converged = change < self.settings.tolerance;
                self.update()?;
                report.energy = self.energy();
                return Ok(report);
            }
            self.step_laplacian(is_short, ratio)?;
        }
        report.change = self.longest_move() / diagonal;
        report.energy = self.energy();
        Ok(report)
    }

    /// Computes the correction that a full plain step would make.
    pub(crate) fn solve(&mut self) {
        let (has_membrane, is_seen) = (self.parts.has_membrane, self.is_seen);
        let Self {
            parts,
            terms,
            positions,
            laplacian,
            accelerator,
            ..
        } = self;
        let rest = &parts.rest;
        let missed = |i: usize, now| laplacian.as_slice()[i].map(T::as_f64) - now;
        let mismatch = terms.mismatch.as_mut_slice();
        let seen = is_seen
            .then(|| parts.orientation.seen_laplacian())
            .flatten();
        if has_membrane {
            parts.orientation.wanted_tension(rest, &mut terms.tension);
            let tension = terms.tension.as_mut_slice();
            let of_seen = seen.filter(|_| rest.has_own_cotangents());
            if let Some(seen) = of_seen {
                update_both(mismatch, tension, |i, mismatch, tension| {
                    *mismatch = missed(i, seen[i]);
                    *tension = seen[i] * 0.5 - *tension;
                });
            } else {
                update_both(mismatch, tension, |i, mismatch, tension| {
                    let [now, pull] = rest.laplacian_and_pull(positions, i);
                    *mismatch = missed(i, now);
                    *tension = pull - *tension;
                });
            }
        } else if let Some(seen) = seen {
            fill(mismatch, |i| missed(i, seen[i]));
        } else {
            fill(mismatch, |i| {
                missed(i, rest.operator().apply_at(positions, i))
            });
        }
        for (handle, target) in parts.handles.iter().zip(&parts.targets) {
            if handle.hold != Hold::Hard {
                terms.pull[handle.vertex] = (target - positions[handle.vertex]).map(T::as_f64);
            }
        }
        let tension = has_membrane.then_some(&terms.tension);
        // The right-hand side is for those who descend.
        let descends = has_membrane || matches!(accelerator, Accelerator::Lbfgs(_));
        let correct = if descends {
            PreparedSystem::correct
        } else {
            PreparedSystem::correct_only
        };
        correct(
            &mut parts.system,
            &terms.mismatch,
            tension,
            &terms.pull,
            &mut terms.residual,
            &mut terms.correction,
        );
    }

    /// x ← start + s δ.
    pub(crate) fn move_by_correction(&mut self, ratio: f64) {
        self.is_seen = false;
        let ratios = self.settings.ratios.as_ref();
        let (start, correction) = (self.start.as_slice(), self.terms.correction.as_slice());
        fill(self.positions.as_mut_slice(), |v| {
            let own = ratios.map_or(1.0, |r| r.as_slice()[v].as_f64());
            start[v] + (correction[v] * (ratio * own)).map(T::of_f64)
        });
    }

    /// Updates field, Laplacian coordinates and energy from the current positions.
    pub(crate) fn update(&mut self) -> Result<(), FlowError> {
        self.refresh(Field::Updated)
    }

    /// Updates Laplacian coordinates and energy, and the field if so asked.
    pub(crate) fn refresh(&mut self, field: Field) -> Result<(), FlowError> {
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
        self.is_seen = false;
        self.measured
            .update(rest, &**scheme, &self.positions, wanted)?;
        let state = FlowState::new(rest, &self.positions, &self.measured, self.iteration);
        if field == Field::Updated {
            updater.update(&state, &mut self.field)?;
        }
        orientation.orient(&state, &self.field, &mut self.laplacian)?;
        self.is_seen = true;
        self.energy = orientation.energy().map(|energy| {
            let springs = self.spring_energy();
            Energy {
                value: energy.value + springs,
                size: energy.size + springs,
            }
        });
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
        let correction = self.terms.correction.as_slice();
        let ratios = self.settings.ratios.as_ref();
        let length = |v: usize| {
            let own = ratios.map_or(1.0, |r| r.as_slice()[v].as_f64());
            (correction[v] * own).norm_squared()
        };
        longest(correction.len(), length).sqrt()
    }

    /// After a plain step: the new Laplacian coordinates, extrapolated where the orientation works
    /// on them alone. `is_short` asks for a plain step next, to check convergence by.
    fn step_laplacian(&mut self, is_short: bool, ratio: f64) -> Result<(), FlowError> {
        let extrapolates = !self.parts.has_membrane
            && ratio == 1.0
            && matches!(&self.accelerator, Accelerator::Anderson(a) if a.is_active());
        if !extrapolates {
            self.is_plain = true;
            return self.update();
        }
        // All of it is written anew.
        std::mem::swap(&mut self.laplacian, &mut self.before);
        self.update()?;
        if let Accelerator::Anderson(anderson) = &mut self.accelerator {
            let proposal = anderson.propose(&self.before, &mut self.laplacian, is_short);
            self.is_plain = proposal == Proposal::Plain;
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

    /// By how much the step moved the vertex that it moved most.
    fn longest_move(&self) -> f64 {
        let (now, start) = (self.positions.as_slice(), self.start.as_slice());
        let length = |i: usize| (now[i] - start[i]).map(T::as_f64).norm_squared();
        longest(now.len(), length).sqrt()
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use std::ops::ControlFlow;

    use cotan_geometry::shapes::icosphere;
    use cotan_geometry::{Mesh, Positions, volume};
    use cotan_halfedge::{VertexId, VertexMap};
    use nalgebra::Vector3;

    use super::*;
    use crate::{Acceleration, Limited, ScalarFieldUpdater, Schedule, Start, StopReason};

    /// The lowest vertices held, the highest pulled by half a radius.
    pub(crate) fn handles(shape: &Mesh<f64>) -> Vec<(Handle, Point3<f64>)> {
        let surface = shape.surface();
        let low = surface.vertices_where(|p| p.z < -0.8);
        let high = surface.vertices_where(|p| p.z > 0.9);
        let hard = |v: &VertexId, lift| {
            (
                Handle::hard(*v),
                shape.positions()[*v] + Vector3::new(0.0, 0.0, lift),
            )
        };
        low.iter()
            .map(|v| hard(v, 0.0))
            .chain(high.iter().map(|v| hard(v, 0.5)))
            .collect()
    }

    pub(crate) fn farthest(a: &Positions<f64>, b: &Positions<f64>) -> f64 {
        longest(a.len(), |i| (a.as_slice()[i] - b.as_slice()[i]).norm())
    }

    pub(crate) fn build<'a>(shape: &'a Mesh<f64>) -> crate::FlowBuilder<'a, f64> {
        Flow::builder(shape.connectivity(), shape.positions()).handles(handles(shape))
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
        let mut ratios = VertexMap::filled(shape.positions().len(), 1.0);
        still.iter().for_each(|v| ratios[*v] = 0.0);
        let mut flow = build(&shape)
            .orientation(Limited::new())
            .vertex_ratios(ratios)
            .build()
            .unwrap();
        let report = flow.run_to_end().unwrap();
        assert_eq!(report.stop, StopReason::Converged);
        let now = flow.positions();
        assert!(still.iter().all(|v| now[*v] == shape.positions()[*v]));
        assert!(farthest(&now, shape.positions()) > 0.1);
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
            .map(|h| shape.positions()[h.vertex])
            .collect();
        flow.set_targets(&original).unwrap();
        let report = flow.run(|_, _| ControlFlow::Continue(())).unwrap();
        assert_eq!(report.stop, StopReason::Converged);
        assert_eq!(flow.system().factor_entries(), entries);
        assert!(farthest(&flow.positions(), shape.positions()) < 5e-3);

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
            (Handle::hard(v), shape.positions()[v])
        });
        let mut flow = Flow::builder(shape.connectivity(), shape.positions())
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
        assert!(farthest(&flow.positions(), shape.positions()) < 1e-4);
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
            .map(|v| (Handle::hard(v), shape.positions()[v]))
            .collect();
        let mut flow = Flow::builder(shape.connectivity(), shape.positions())
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
