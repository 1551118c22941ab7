//! The scalar field: the magnitude that each Laplacian coordinate takes next.

use cotan_geometry::Scalar;
use cotan_halfedge::VertexMap;

use crate::error::FlowError;
use crate::state::FlowState;

/// Prescribes the scalar field: the signed magnitude d_i that each Laplacian coordinate takes in
/// the next step. This is the *geometry* part of a shape (paper, section 3.1).
///
/// Dyn-compatible, and forwarded through `Box<U>` and `&mut U`.
///
/// ```
/// use cotan_flow::{FlowError, FlowState, ScalarFieldUpdater};
/// use cotan_geometry::{Scalar, scalar};
/// use cotan_halfedge::VertexMap;
///
/// /// Halves every detail.
/// struct Halve;
///
/// impl<T: Scalar> ScalarFieldUpdater<T> for Halve {
///     fn update(
///         &mut self,
///         state: &FlowState<'_, T>,
///         field: &mut VertexMap<T>,
///     ) -> Result<(), FlowError> {
///         for (vertex, magnitude) in state.rest().magnitudes().iter() {
///             field[vertex] = *magnitude * scalar(0.5);
///         }
///         Ok(())
///     }
/// }
/// ```
pub trait ScalarFieldUpdater<T: Scalar>: Send + Sync {
    /// Writes d_i for every vertex.
    ///
    /// **Shapes**: `field` has one entry per vertex and holds the values of the previous step
    /// (|ℓ⁰| before the first). **Units**: those of ℓ, a length, in box units.
    ///
    /// # Errors
    /// Whatever the updater cannot do; it ends the flow.
    fn update(
        &mut self,
        state: &FlowState<'_, T>,
        field: &mut VertexMap<T>,
    ) -> Result<(), FlowError>;

    /// Returns `true` if the field never changes once set, which saves a descent an update per
    /// step. A wrapper that does not forward it is slower, not wrong.
    fn is_constant(&self) -> bool {
        false
    }
}

/// d = |ℓ⁰|: keep every detail's size (paper, section 3.2).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct KeepMagnitude;

impl<T: Scalar> ScalarFieldUpdater<T> for KeepMagnitude {
    fn update(
        &mut self,
        state: &FlowState<'_, T>,
        field: &mut VertexMap<T>,
    ) -> Result<(), FlowError> {
        field
            .as_mut_slice()
            .copy_from_slice(state.rest().magnitudes().as_slice());
        Ok(())
    }

    fn is_constant(&self) -> bool {
        true
    }
}

/// d = |ℓ⁰| √(A / A⁰): details grow and shrink with the surface around them (paper, section 3.3).
///
/// A vertex whose original triangles have no area keeps its magnitude.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct RescaleByArea;

impl<T: Scalar> ScalarFieldUpdater<T> for RescaleByArea {
    fn update(
        &mut self,
        state: &FlowState<'_, T>,
        field: &mut VertexMap<T>,
    ) -> Result<(), FlowError> {
        let areas = state.areas();
        for (vertex, magnitude) in state.rest().magnitudes().iter() {
            let (now, before) = (areas[vertex], state.rest().areas()[vertex]);
            let scale = if before > T::zero() {
                (now / before).sqrt()
            } else {
                T::one()
            };
            field[vertex] = *magnitude * scale;
        }
        Ok(())
    }
}

/// A field that is known before the flow starts, in box units.
#[derive(Clone, PartialEq, Debug)]
pub struct PrescribedField<T: Scalar>(pub VertexMap<T>);

impl<T: Scalar> ScalarFieldUpdater<T> for PrescribedField<T> {
    fn update(&mut self, _: &FlowState<'_, T>, field: &mut VertexMap<T>) -> Result<(), FlowError> {
        if self.0.len() != field.len() {
            return Err(FlowError::Setting {
                setting: "number of values of the prescribed field",
                range: "one per vertex",
                value: self.0.len() as f64,
            });
        }
        field.as_mut_slice().copy_from_slice(self.0.as_slice());
        Ok(())
    }

    fn is_constant(&self) -> bool {
        true
    }
}

macro_rules! forward {
    ($pointer:ty) => {
        impl<T: Scalar, U: ScalarFieldUpdater<T> + ?Sized> ScalarFieldUpdater<T> for $pointer {
            fn update(
                &mut self,
                state: &FlowState<'_, T>,
                field: &mut VertexMap<T>,
            ) -> Result<(), FlowError> {
                (**self).update(state, field)
            }

            fn is_constant(&self) -> bool {
                (**self).is_constant()
            }
        }
    };
}

forward!(Box<U>);
forward!(&mut U);
