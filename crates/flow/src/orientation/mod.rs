//! Rules that turn the Laplacian coordinates after a step.
//!
//! The scalar field says how long each Laplacian coordinate is to be; an [`Orientation`] gives it
//! a direction on the current mesh. The paper's rule is [`Reflect`]; the others converge where it
//! oscillates (on detailed meshes, where |ℓ| is small compared to the one-ring), and so does the
//! descent of an energy ([`crate::LocalGlobal`]).

mod frame;
mod limited;
mod normal;
mod reflect;
mod rotation;

use cotan_geometry::Scalar;
use cotan_halfedge::{VertexId, VertexMap};
use cotan_parallel as parallel;
use nalgebra::Vector3;

pub use limited::Limited;
pub use normal::AlongNormal;
pub use reflect::{Reflect, ReflectFirst};
pub use rotation::BestRotation;

use crate::error::FlowError;
use crate::rest::Rest;
use crate::state::FlowState;

/// Turns the prescribed magnitudes into Laplacian coordinates on the current mesh.
///
/// There is one method, and nothing that must be called before it: what is measured once on the
/// original mesh is kept in a [`crate::PerRest`]. One that wraps another calls its `orient` from
/// its own. Dyn-compatible, and forwarded through `Box<O>` and `&mut O`.
///
/// ```
/// use cotan_flow::{FlowError, FlowState, Orientation};
/// use cotan_geometry::{Scalar, scalar};
/// use cotan_halfedge::VertexMap;
/// use nalgebra::Vector3;
///
/// /// Half of what another orientation wants, half of what is there.
/// struct Damped<O>(O);
///
/// impl<T: Scalar, O: Orientation<T>> Orientation<T> for Damped<O> {
///     fn orient(
///         &mut self,
///         state: &FlowState<'_, T>,
///         field: &VertexMap<T>,
///         out: &mut VertexMap<Vector3<T>>,
///     ) -> Result<(), FlowError> {
///         self.0.orient(state, field, out)?;
///         let now = state.laplacian()?;
///         for (wanted, now) in out.values_mut().zip(now.values()) {
///             *wanted = (*wanted + now) * scalar::<T>(0.5);
///         }
///         Ok(())
///     }
/// }
/// ```
pub trait Orientation<T: Scalar>: Send + Sync {
    /// Called once an iteration, after the field was updated; it may keep a state from one to the
    /// next. Writes ℓ_i for every vertex, of the size that `field` prescribes or, where a rule
    /// limits parts of it, smaller. The built-in rules leave ℓ_i = 0 where ℓ⁰_i = 0: there is
    /// nothing to turn.
    ///
    /// **Shapes**: one entry per vertex; all of `out` is overwritten. **Units**: box units.
    ///
    /// # Errors
    /// Whatever the orientation cannot do; it ends the flow.
    fn orient(
        &mut self,
        state: &FlowState<'_, T>,
        field: &VertexMap<T>,
        out: &mut VertexMap<Vector3<T>>,
    ) -> Result<(), FlowError>;
}

macro_rules! forward {
    ($pointer:ty) => {
        impl<T: Scalar, O: Orientation<T> + ?Sized> Orientation<T> for $pointer {
            fn orient(
                &mut self,
                state: &FlowState<'_, T>,
                field: &VertexMap<T>,
                out: &mut VertexMap<Vector3<T>>,
            ) -> Result<(), FlowError> {
                (**self).orient(state, field, out)
            }
        }
    };
}

forward!(Box<O>);
forward!(&mut O);

/// Refuses a mesh whose copies of a vertex share rows: their normals are sums over pieces that may
/// be oriented differently.
fn refuse_copies<T: Scalar>(rest: &Rest<T>, rule: &'static str) -> Result<(), FlowError> {
    match rest.mesh().has_copies() {
        true => Err(FlowError::NeedsOneSurface {
            rule,
            instead: "the default orientation",
        }),
        false => Ok(()),
    }
}

/// Writes one Laplacian coordinate per vertex, in parallel.
pub(crate) fn write_each<T: Scalar>(
    out: &mut VertexMap<Vector3<T>>,
    ell: impl Fn(VertexId) -> Vector3<T> + Sync,
) {
    parallel::fill(out.as_mut_slice(), |i| ell(VertexId::new(i)));
}

/// field_i / |ℓ⁰_i|: by how much the scalar field scales the original; 0 where ℓ⁰ = 0.
pub(crate) fn field_scale<T: Scalar>(field: T, magnitude: T) -> T {
    if magnitude > T::zero() {
        field / magnitude
    } else {
        T::zero()
    }
}
