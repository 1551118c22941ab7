//! Projections, which carry every step back to the shapes that a job allows.

use cotan_geometry::{Positions, Scalar};

use crate::error::FlowError;
use crate::rest::Rest;

/// Carries the positions after every step back to what a job keeps: a size, a place, a surface
/// that the vertices lie on.
///
/// A flow with a projection takes plain steps. Its handles only fix the position of the mesh
/// before it is projected. It has converged when a step is shorter, *as the projection
/// measures it*, than the tolerance. Dyn-compatible, and forwarded through `Box<P>` and `&mut P`.
pub trait Projection<T: Scalar>: Send + Sync {
    /// Looks at the original positions, or those from which the flow starts, and may move
    /// them, before anything is solved.
    ///
    /// # Errors
    /// Whatever the projection cannot do; the flow is not built then.
    fn start(&mut self, rest: &Rest<T>, positions: &mut Positions<T>) -> Result<(), FlowError>;

    /// Replaces `next`, where the step leads from `before`, by the projected positions. Returns
    /// the length of the step, which is compared with the tolerance; infinite while the flow has
    /// to continue in any case.
    ///
    /// **Shapes**: one position per vertex. **Units**: box units, or those of what it projects to.
    ///
    /// # Errors
    /// Whatever the projection cannot do; it ends the flow.
    fn project(
        &mut self,
        rest: &Rest<T>,
        before: &Positions<T>,
        next: &mut Positions<T>,
    ) -> Result<f64, FlowError>;
}

macro_rules! forward {
    ($pointer:ty) => {
        impl<T: Scalar, P: Projection<T> + ?Sized> Projection<T> for $pointer {
            fn start(
                &mut self,
                rest: &Rest<T>,
                positions: &mut Positions<T>,
            ) -> Result<(), FlowError> {
                (**self).start(rest, positions)
            }

            fn project(
                &mut self,
                rest: &Rest<T>,
                before: &Positions<T>,
                next: &mut Positions<T>,
            ) -> Result<f64, FlowError> {
                (**self).project(rest, before, next)
            }
        }
    };
}

forward!(Box<P>);
forward!(&mut P);
