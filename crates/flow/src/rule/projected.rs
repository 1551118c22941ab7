//! Solve, project: for jobs that keep a size, a place, or a surface.

use cotan_geometry::Scalar;

use super::Rule;
use crate::error::FlowError;
use crate::orientation::Orientation;
use crate::projection::Projection;
use crate::report::StepReport;
use crate::updater::ScalarFieldUpdater;
use crate::workspace::Workspace;

/// Plain steps, each carried back by a projection, which measures its length too. Handles say no
/// more than where the mesh is while nothing projects it.
pub(crate) struct Projected<T: Scalar> {
    updater: Box<dyn ScalarFieldUpdater<T>>,
    orientation: Box<dyn Orientation<T>>,
    projection: Box<dyn Projection<T>>,
}

impl<T: Scalar> Projected<T> {
    pub(crate) fn new(
        updater: Box<dyn ScalarFieldUpdater<T>>,
        orientation: Box<dyn Orientation<T>>,
        projection: Box<dyn Projection<T>>,
    ) -> Self {
        Self {
            updater,
            orientation,
            projection,
        }
    }
}

impl<T: Scalar> Rule<T> for Projected<T> {
    fn begin(&mut self, work: &mut Workspace<T>) -> Result<(), FlowError> {
        self.projection.start(&work.rest, work.current.write())
    }

    fn step(&mut self, work: &mut Workspace<T>) -> Result<StepReport, FlowError> {
        work.solve()?;
        let Some(step) = work.advance() else {
            return Ok(work.diverged());
        };
        work.move_by_correction(step.ratio);
        let next = work.current.write();
        let change = self.projection.project(&work.rest, &work.start, next)?;
        self.update(work)?;
        Ok(StepReport {
            change,
            residual: step.residual,
            converged: change < work.settings.tolerance,
            ..StepReport::new(work.iteration, 0.0)
        })
    }

    fn update(&mut self, work: &mut Workspace<T>) -> Result<(), FlowError> {
        work.update_field(&mut *self.updater)?;
        work.orient(|state, field, out| self.orientation.orient(state, field, out))
    }

    fn restart(&mut self, _: &mut Workspace<T>) {}

    fn pins_handles(&self) -> bool {
        false
    }
}
