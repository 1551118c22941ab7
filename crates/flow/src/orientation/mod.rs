//! How a Laplacian coordinate is turned after a step.
//!
//! The scalar field says how long each Laplacian coordinate is to be; an [`Orientation`] gives it a
//! direction on the current mesh. The paper's rule is [`Reflect`]; the others converge where it
//! oscillates (measured in `docs/decisions`).

mod cells;
mod frame;
mod hybrid;
mod limited;
mod normal;
mod reflect;
mod rotation;

use cotan_geometry::Scalar;
use cotan_halfedge::{VertexId, VertexMap};
use nalgebra::{Matrix3, Vector3};

pub use hybrid::Hybrid;
pub use limited::Limited;
pub use normal::AlongNormal;
pub use reflect::{Reflect, ReflectFirst};
pub use rotation::BestRotation;

use crate::error::FlowError;
use crate::rest::Rest;
use crate::state::{FlowState, Quantities};
use crate::vectors::fill;

/// An energy, as a sum in which terms cancel.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Energy {
    /// What is left; never negative.
    pub value: f64,
    /// The sum of the sizes of the terms. The value is exact but for a few units in the last place
    /// of this, in double precision.
    pub size: f64,
}

impl Energy {
    /// Energies of positions of this precision that differ by less are the same but for rounding.
    pub fn rounding<T: Scalar>(&self) -> f64 {
        64.0 * (T::default_epsilon().as_f64() * self.value + f64::EPSILON * self.size)
    }
}

/// Turns the prescribed magnitudes into Laplacian coordinates on the current mesh.
///
/// Dyn-compatible, and forwarded through `Box<O>`. One that wraps another must forward all methods,
/// those with a default too.
pub trait Orientation<T: Scalar>: Send {
    /// Writes ℓ_i for every vertex, of the size that `field` prescribes or, where a rule limits parts
    /// of it, smaller. The built-in rules leave ℓ_i = 0 where ℓ⁰_i = 0: there is nothing to turn.
    ///
    /// **Shapes**: one entry a vertex. **Units**: box units.
    ///
    /// # Errors
    /// Whatever the orientation cannot do; it ends the flow.
    fn orient(
        &mut self,
        state: &FlowState<'_, T>,
        field: &VertexMap<T>,
        out: &mut VertexMap<Vector3<T>>,
    ) -> Result<(), FlowError>;

    /// Looks at its own settings, once, before anything is assembled.
    ///
    /// # Errors
    /// [`FlowError::Setting`] for a setting out of range.
    fn check(&self) -> Result<(), FlowError> {
        Ok(())
    }

    /// What of the current mesh it reads. All of it unless overridden.
    fn needs(&self) -> Quantities {
        Quantities::ALL
    }

    /// Looks at the original mesh, once, before the system is assembled. Returns the weight μ of
    /// the membrane term that the system is to gain: 0 (none) unless overridden.
    fn prepare(&mut self, _rest: &Rest<'_, T>) -> f64 {
        0.0
    }

    /// Writes Σ_j s_ij (x_j − x_i) over the edges as the last [`Self::orient`] or [`Self::start_from`]
    /// wants them, s being [`Rest::stiffness`]: what the membrane's edges pull beyond it is half the
    /// negative gradient of its energy, without μ. Called only where [`Self::prepare`] asked for a
    /// membrane.
    fn wanted_tension(&self, _rest: &Rest<'_, T>, out: &mut VertexMap<Vector3<f64>>) {
        out.values_mut().for_each(|t| *t = Vector3::zeros());
    }

    /// Takes a first guess of the rotation of every vertex, before the first solve.
    fn start_from(&mut self, _rotations: &VertexMap<Matrix3<f64>>) {}

    /// The energy at the last state, if `orient` minimises one over its rotations that the solve
    /// minimises over the positions. An accelerated flow then descends, and never accepts a step that
    /// raises it (with the springs of soft handles, and for the scalar field before the step).
    fn energy(&self) -> Option<Energy> {
        None
    }

    /// L⁰x at the positions that the last [`Self::orient`] saw, one entry a vertex, where the
    /// orientation computes it: the next solve then need not. `None` unless overridden.
    fn seen_laplacian(&self) -> Option<&[Vector3<f64>]> {
        None
    }
}

impl<T: Scalar, O: Orientation<T> + ?Sized> Orientation<T> for Box<O> {
    fn orient(
        &mut self,
        state: &FlowState<'_, T>,
        field: &VertexMap<T>,
        out: &mut VertexMap<Vector3<T>>,
    ) -> Result<(), FlowError> {
        (**self).orient(state, field, out)
    }

    fn check(&self) -> Result<(), FlowError> {
        (**self).check()
    }

    fn needs(&self) -> Quantities {
        (**self).needs()
    }

    fn prepare(&mut self, rest: &Rest<'_, T>) -> f64 {
        (**self).prepare(rest)
    }

    fn wanted_tension(&self, rest: &Rest<'_, T>, out: &mut VertexMap<Vector3<f64>>) {
        (**self).wanted_tension(rest, out);
    }

    fn start_from(&mut self, rotations: &VertexMap<Matrix3<f64>>) {
        (**self).start_from(rotations);
    }

    fn energy(&self) -> Option<Energy> {
        (**self).energy()
    }

    fn seen_laplacian(&self) -> Option<&[Vector3<f64>]> {
        (**self).seen_laplacian()
    }
}

/// Writes one Laplacian coordinate a vertex, in parallel.
pub(crate) fn write_each<T: Scalar>(
    out: &mut VertexMap<Vector3<T>>,
    ell: impl Fn(VertexId) -> Vector3<T> + Sync,
) {
    fill(out.as_mut_slice(), |i| ell(VertexId::new(i)));
}

/// field_i / |ℓ⁰_i|: by how much the scalar field scales the original; 0 where ℓ⁰ = 0.
pub(crate) fn field_scale<T: Scalar>(field: T, magnitude: T) -> T {
    if magnitude > T::zero() {
        field / magnitude
    } else {
        T::zero()
    }
}
