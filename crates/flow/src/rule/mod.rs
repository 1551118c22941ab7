//! The rules by which a flow steps: one file each.
//!
//! All of them solve the same system for a correction of the current positions, and rebuild its
//! right-hand side after. They differ in what they do between a solve and the next:
//!
//! - [`FixedPoint`]: take the step, update the field, orient; extrapolate what is solved for next;
//! - [`Descent`]: search along a direction for a lower energy;
//! - [`Projected`]: take the step, and carry the positions back to what a job keeps.

mod descent;
mod fixed_point;
mod projected;

use cotan_geometry::Scalar;

pub(crate) use descent::Descent;
pub(crate) use fixed_point::FixedPoint;
pub(crate) use projected::Projected;

use crate::error::FlowError;
use crate::report::{LostTurn, StepReport};
use crate::winding::Winding;
use crate::workspace::Workspace;

/// Makes steps and reports them.
pub(crate) trait Rule<T: Scalar>: Send + Sync {
    /// Takes the first positions, which are in `work`, before anything is solved.
    fn begin(&mut self, work: &mut Workspace<T>) -> Result<(), FlowError>;

    /// One iteration: one solve.
    fn step(&mut self, work: &mut Workspace<T>) -> Result<StepReport, FlowError>;

    /// Rebuilds field and Laplacian coordinates from the current positions.
    fn update(&mut self, work: &mut Workspace<T>) -> Result<(), FlowError>;

    /// Forgets what earlier steps taught: handles have moved, or the positions were exchanged.
    fn restart(&mut self, work: &mut Workspace<T>);

    /// Returns `true` if hard handles are exactly at their targets.
    fn pins_handles(&self) -> bool;

    /// Takes the winding of the handles, or that they have none; after [`Self::begin`] and
    /// [`Self::restart`].
    fn wind(&mut self, _winding: Option<Winding>) {}

    /// The turn that a shape lost after it was wound up, if any.
    fn lost_turn(&self) -> Option<LostTurn> {
        None
    }

    /// The energy of the current positions, if there is one and it is known.
    fn energy(&self) -> Option<f64> {
        None
    }
}
