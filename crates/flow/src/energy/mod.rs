//! Energies that a local step and the system's solve lower in turn.

mod bodies;
mod hybrid;
mod hybrid_passes;
mod stiffness;
mod struts;
mod tied;
mod volume;

use cotan_geometry::Scalar;
use cotan_halfedge::VertexMap;
use nalgebra::Vector3;

pub use hybrid::Hybrid;
pub use stiffness::Stiffness;
use struts::Strut;

use crate::error::FlowError;
use crate::four::Mat3;
use crate::rest::Rest;
use crate::start::FirstGuess;
use crate::state::FlowState;
use crate::winding::Winding;

/// An energy, as a sum in which terms cancel.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Energy {
    /// The energy that is left; never negative.
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

/// The step that follows a solve.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum NextStep {
    /// Its length is chosen so that the energy falls.
    Searched,
    /// It is taken as it is: handles have moved, and there is no energy to compare with.
    Taken,
}

/// An energy of the positions x and of a local state R (rotations, say) with
///
/// ```text
/// min over R of E(x, R) = |L⁰x − ℓ(R)|² + μ Σ_e s_e |e − e*(R)|² + const
/// ```
///
/// up to terms that x does not enter, and further terms of x that the solve does not know:
/// [`Self::fit`] minimises over R with x given (the *local*
/// step), the flow's solve over x with R given (the *global* step). E falls in turn, so the
/// iteration cannot oscillate; the flow descends it by L-BFGS, and never accepts a step that
/// raises it (with the springs of soft handles, and for the scalar field before the step).
///
/// s is half of [`Rest::membrane_weights`], and e*(R) the edges that the membrane wants. An energy
/// without a membrane returns μ = 0 and a tension of zeros.
///
/// The compiler asks for every method, so that one that wraps another cannot forget one.
/// Dyn-compatible, and forwarded through `Box<E>` and `&mut E`. A wrapper of [`Hybrid`] for one
/// scalar names it in methods without an argument of that scalar:
///
/// ```
/// use cotan_flow::{Energy, FirstGuess, FittedCells, FlowError, FlowState, Hybrid};
/// use cotan_flow::{LocalGlobal, NextStep, Rest, Winding};
/// use cotan_halfedge::VertexMap;
/// use nalgebra::Vector3;
///
/// /// The default energy, and how often it was fitted.
/// struct Counted(Hybrid, usize);
///
/// impl LocalGlobal<f64> for Counted {
///     fn begin(&mut self, rest: &Rest<f64>) -> Result<f64, FlowError> {
///         self.0.begin(rest)
///     }
///
///     fn point_radius(&self, rest: &Rest<f64>) -> f64 {
///         self.0.point_radius(rest)
///     }
///
///     fn start_from(&mut self, guess: &FirstGuess) {
///         LocalGlobal::<f64>::start_from(&mut self.0, guess);
///     }
///
///     fn wind(&mut self, winding: Option<&Winding>) {
///         LocalGlobal::<f64>::wind(&mut self.0, winding);
///     }
///
///     fn fit(
///         &mut self,
///         state: &FlowState<'_, f64>,
///         field: &VertexMap<f64>,
///         out: &mut VertexMap<Vector3<f64>>,
///     ) -> Result<Energy, FlowError> {
///         self.1 += 1;
///         self.0.fit(state, field, out)
///     }
///
///     fn wanted_tension(
///         &self,
///         rest: &Rest<f64>,
///         next: NextStep,
///         out: &mut VertexMap<Vector3<f64>>,
///     ) {
///         self.0.wanted_tension(rest, next, out);
///     }
///
///     fn cells(&self) -> Option<FittedCells<'_>> {
///         LocalGlobal::<f64>::cells(&self.0)
///     }
/// }
/// ```
pub trait LocalGlobal<T: Scalar>: Send + Sync {
    /// Takes the rest shape, before the system is assembled. Returns μ.
    ///
    /// # Errors
    /// [`FlowError::Setting`] for a setting out of range; the flow is not built then.
    fn begin(&mut self, rest: &Rest<T>) -> Result<f64, FlowError>;

    /// The distance along the surface, in box units, within which a handle of a single vertex
    /// pulls the vertices around it, so that it leaves no cone; 0 where the force is to act on the
    /// vertex alone. Called after [`Self::begin`]. Without a membrane it is 0 whatever is
    /// returned.
    fn point_radius(&self, rest: &Rest<T>) -> f64;

    /// Takes a first guess of the rotation of every vertex, before the first solve. Not called
    /// where there is none: the state is then that of the rest shape.
    fn start_from(&mut self, guess: &FirstGuess);

    /// Takes the winding of the handles where two of them are stated to turn by more than half a
    /// turn relative to each other, and `None` where they no longer do. Called after
    /// [`Self::start_from`], and again whenever the handles have moved. An energy that holds such
    /// turns as it holds others ignores it.
    fn wind(&mut self, winding: Option<&Winding>);

    /// Minimises over R at the current positions. Writes ℓ(R), for the magnitudes that `field`
    /// prescribes, and returns the energy.
    ///
    /// **Shapes**: one entry per vertex. **Units**: box units.
    ///
    /// # Errors
    /// Whatever the energy cannot do; it ends the flow.
    fn fit(
        &mut self,
        state: &FlowState<'_, T>,
        field: &VertexMap<T>,
        out: &mut VertexMap<Vector3<T>>,
    ) -> Result<Energy, FlowError>;

    /// Writes Σ_j s_ij e*_ij over the edges at every vertex, as the last [`Self::fit`] or
    /// [`Self::start_from`] wants them: what the membrane's edges pull beyond it is half the
    /// negative gradient of its energy, without μ.
    ///
    /// An energy may have further terms: half of their gradient, over μ, is added here. The system
    /// knows nothing of them, so that a step may go too far; `next` says whether that would be
    /// noticed.
    fn wanted_tension(&self, rest: &Rest<T>, next: NextStep, out: &mut VertexMap<Vector3<f64>>);

    /// The rotations that the last fit found. Only [`Hybrid`] can make these, and an energy that
    /// wraps it forwards them; others return `None`. Without them the descent is right and may be
    /// slow.
    fn cells(&self) -> Option<FittedCells<'_>>;
}

/// The rotations that an energy fits, and what it fits them to: by these a descent foresees how
/// they follow when a part of the mesh moves as a whole.
#[derive(Clone, Copy, Debug)]
pub struct FittedCells<'a> {
    /// R, as fitted last.
    pub(crate) rotations: &'a [Mat3],
    /// The covariance of the cells at i is Σ_j (x_j − x_i) g_ijᵀ + (L⁰x)_i ℓᵢᵀ, and that of a
    /// strut.
    pub(crate) gradients: &'a [[f64; 3]],
    /// μ.
    pub(crate) weight: f64,
    size: f64,
    struts: &'a [Strut],
}

impl FittedCells<'_> {
    /// The Laplacian coordinate that vertex `i` wants before it is turned.
    #[inline]
    pub(crate) fn wanted<T: Scalar>(
        &self,
        rest: &Rest<T>,
        field: &VertexMap<T>,
        i: usize,
    ) -> Vector3<f64> {
        hybrid_passes::wanted(rest, field.as_slice(), i, self.size).into()
    }

    /// Returns `true` if struts keep the walls apart.
    pub(crate) fn has_struts(&self) -> bool {
        !self.struts.is_empty()
    }

    /// The strut of vertex `i` and its weight.
    #[inline]
    pub(crate) fn strut(&self, i: usize) -> Option<(&Strut, f64)> {
        let strut = self.struts.get(i).filter(|s| s.weight > 0.0)?;
        Some((strut, self.weight * strut.weight))
    }
}

macro_rules! forward {
    ($pointer:ty) => {
        impl<T: Scalar, E: LocalGlobal<T> + ?Sized> LocalGlobal<T> for $pointer {
            fn begin(&mut self, rest: &Rest<T>) -> Result<f64, FlowError> {
                (**self).begin(rest)
            }

            fn point_radius(&self, rest: &Rest<T>) -> f64 {
                (**self).point_radius(rest)
            }

            fn start_from(&mut self, guess: &FirstGuess) {
                (**self).start_from(guess);
            }

            fn wind(&mut self, winding: Option<&Winding>) {
                (**self).wind(winding);
            }

            fn fit(
                &mut self,
                state: &FlowState<'_, T>,
                field: &VertexMap<T>,
                out: &mut VertexMap<Vector3<T>>,
            ) -> Result<Energy, FlowError> {
                (**self).fit(state, field, out)
            }

            fn wanted_tension(
                &self,
                rest: &Rest<T>,
                next: NextStep,
                out: &mut VertexMap<Vector3<f64>>,
            ) {
                (**self).wanted_tension(rest, next, out);
            }

            fn cells(&self) -> Option<FittedCells<'_>> {
                (**self).cells()
            }
        }
    };
}

forward!(Box<E>);
forward!(&mut E);
