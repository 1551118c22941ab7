//! Solve, update the field, orient: the paper's iteration, for any orientation.

use cotan_geometry::Scalar;
use cotan_halfedge::VertexMap;
use nalgebra::Vector3;

use super::Rule;
use crate::accelerate::{Anderson, Proposal};
use crate::error::FlowError;
use crate::orientation::Orientation;
use crate::report::StepReport;
use crate::updater::ScalarFieldUpdater;
use crate::workspace::Workspace;

/// The fixed-point iteration of the Laplacian coordinates ℓ ← orient(update(solve(ℓ))),
/// accelerated by Anderson's method while steps are full ones.
///
/// **Source**: paper, section 3.2.
pub(crate) struct FixedPoint<T: Scalar> {
    updater: Box<dyn ScalarFieldUpdater<T>>,
    orientation: Box<dyn Orientation<T>>,
    anderson: Option<Anderson>,
    /// The Laplacian coordinates before the current update; empty without acceleration.
    before: VertexMap<Vector3<T>>,
    /// The aim of the next solve: a plain image or an extrapolation.
    aim: Proposal,
}

impl<T: Scalar> FixedPoint<T> {
    /// With a memory of so many steps; 0 is the plain iteration.
    pub(crate) fn new(
        updater: Box<dyn ScalarFieldUpdater<T>>,
        orientation: Box<dyn Orientation<T>>,
        memory: usize,
    ) -> Self {
        Self {
            updater,
            orientation,
            anderson: (memory > 0).then(|| Anderson::new(memory)),
            before: VertexMap::default(),
            aim: Proposal::Plain,
        }
    }
}

impl<T: Scalar> Rule<T> for FixedPoint<T> {
    fn begin(&mut self, work: &mut Workspace<T>) -> Result<(), FlowError> {
        work.pin();
        Ok(())
    }

    fn step(&mut self, work: &mut Workspace<T>) -> Result<StepReport, FlowError> {
        work.solve()?;
        let Some(step) = work.advance() else {
            return Ok(work.diverged());
        };
        let is_short = step.ratio * step.residual < work.settings.tolerance;
        let converged = is_short && self.aim == Proposal::Plain && !step.is_first;
        work.move_by_correction(step.ratio);
        match &self.anderson {
            Some(anderson) if step.ratio == 1.0 && anderson.is_active() => {
                // All of it is written anew.
                if self.before.len() != work.laplacian.len() {
                    self.before = work.laplacian.clone();
                }
                std::mem::swap(&mut work.laplacian, &mut self.before);
                self.update(work)?;
                if let Some(anderson) = &mut self.anderson {
                    // A short step asks for a plain one next, to check convergence by.
                    self.aim = anderson.propose(&self.before, &mut work.laplacian, is_short);
                }
            }
            _ => {
                self.aim = Proposal::Plain;
                self.update(work)?;
            }
        }
        Ok(StepReport {
            change: work.longest_move(),
            residual: step.residual,
            converged,
            ..StepReport::new(work.iteration, 0.0)
        })
    }

    fn update(&mut self, work: &mut Workspace<T>) -> Result<(), FlowError> {
        work.update_field(&mut *self.updater)?;
        work.orient(|state, field, out| self.orientation.orient(state, field, out))
    }

    fn restart(&mut self, work: &mut Workspace<T>) {
        work.pin();
        self.aim = Proposal::Plain;
        if let Some(anderson) = &mut self.anderson {
            anderson.reset();
        }
    }

    fn pins_handles(&self) -> bool {
        true
    }
}
