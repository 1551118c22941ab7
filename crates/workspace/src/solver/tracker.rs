//! The steps of the solver, and what the window sees of them.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

use cotan::flow::StepReport;
use cotan::geometry::Surface;

use super::prepared::Prepared;
use super::{Goal, Sample, Shared, State, Update};
use crate::newest::lock;
use crate::shape::Shape;

/// Runs steps and publishes their results.
pub(super) struct Tracker<'a> {
    pub(super) shared: &'a Shared,
    /// The time when the current goal was taken up.
    pub(super) taken: Instant,
}

impl Tracker<'_> {
    /// Runs one step. Returns the final state of the goal if it has ended.
    pub(super) fn step(&mut self, prepared: &mut Prepared<'_>, goal: &Goal) -> Option<State> {
        assert!(
            !self.shared.panics.swap(false, Ordering::Relaxed),
            "provoked by a test"
        );
        let clock = Instant::now();
        let step = match prepared.session.step() {
            Ok(step) => step,
            Err(error) => return Some(State::Failed(error.to_string())),
        };
        let milliseconds = 1e3 * clock.elapsed().as_secs_f64();
        if !step.residual.is_finite() {
            return Some(State::Failed(
                "the shape ran away; move the handle back, or choose another orientation or scheme"
                    .to_owned(),
            ));
        }
        let state = if step.converged || step.stalled {
            State::Settled
        } else {
            State::Running
        };
        self.publish(prepared, goal, &state);
        let mut samples = lock(&self.shared.samples);
        if samples.len() == MOST_SAMPLES {
            samples.drain(..MOST_SAMPLES / 2);
        }
        samples.push(sample(&step, milliseconds));
        drop(samples);
        if state == State::Settled {
            return Some(state);
        }
        self.shared.tell(state);
        None
    }

    fn publish(&self, prepared: &Prepared<'_>, goal: &Goal, state: &State) {
        let shape = prepared.shape(goal);
        let normals = match Surface::new(goal.mesh.mesh(), &shape) {
            Ok(surface) => surface.vertex_normals(),
            // A step to an invalid shape was already reported above.
            Err(_) => return,
        };
        *lock(&self.shared.latest) = Some(Update {
            tag: goal.tag,
            shape: Shape::new(shape),
            normals: Arc::new(normals),
            state: state.clone(),
            times: [goal.posted, self.taken, Instant::now()],
        });
    }
}

/// The limit of the recorded steps. The plot shows no more, and a handle may be held for hours.
const MOST_SAMPLES: usize = 4000;

fn sample(step: &StepReport, milliseconds: f64) -> Sample {
    Sample {
        iteration: step.iteration,
        change: step.change,
        residual: step.residual,
        energy: step.energy,
        milliseconds,
    }
}
