//! The loop over the steps of a flow, and why it ends.

use std::ops::ControlFlow;

use cotan_geometry::Scalar;

use crate::error::FlowError;
use crate::flow::Flow;
use crate::report::{Report, StepReport, StopReason};

impl<T: Scalar> Flow<T> {
    /// Performs one iteration: a solve, and the step that the rule makes of it.
    ///
    /// # Errors
    /// Errors of the updater, orientation or scheme. The shape is then somewhere between two
    /// steps.
    pub fn step(&mut self) -> Result<StepReport, FlowError> {
        self.rule.step(&mut self.work)
    }

    /// Iterates until convergence or the iteration limit.
    ///
    /// # Errors
    /// As from [`Flow::step`].
    pub fn run_to_end(&mut self) -> Result<Report, FlowError> {
        self.run(|_, _| ControlFlow::Continue(()))
    }

    /// Iterates until convergence, the iteration limit, or until the observer breaks.
    ///
    /// The observer sees the flow after every step; [`Flow::positions`] and the error measures are
    /// computed when it asks for them.
    ///
    /// # Errors
    /// As from [`Flow::step`]. Reaching the iteration limit is a stop reason, not an error.
    pub fn run(
        &mut self,
        mut observer: impl FnMut(&Self, &StepReport) -> ControlFlow<()>,
    ) -> Result<Report, FlowError> {
        let mut report = Report {
            energy: self.energy(),
            solver: Some(self.work.system.choice()),
            ..Report::default()
        };
        while report.iterations < self.work.settings.iteration_limit {
            let step = self.step()?;
            report.iterations += 1;
            report.change = step.change;
            report.residual = step.residual;
            report.energy = step.energy;
            let cancelled = observer(self, &step).is_break();
            let stop = if !step.residual.is_finite() {
                Some(StopReason::Diverged)
            } else if step.converged {
                Some(StopReason::Converged)
            } else if step.stalled {
                Some(StopReason::Stalled)
            } else {
                cancelled.then_some(StopReason::Cancelled)
            };
            if let Some(stop) = stop {
                report.stop = stop;
                break;
            }
        }
        report.lost_turn = self.rule.lost_turn();
        tracing::debug!(
            iterations = report.iterations,
            stop = report.stop.as_str(),
            "flow ended"
        );
        Ok(report)
    }
}

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::icosphere;

    use super::*;
    use crate::Limited;
    use crate::flow::tests::build;

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
}
