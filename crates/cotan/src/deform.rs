//! Deformation in one call.

use cotan_flow::{FlowBuilder, Report};
use cotan_geometry::{Positions, Scalar, Surface};

use crate::error::Error;
use crate::handles::Handles;
use crate::options::DeformOptions;
use crate::session::Session;

/// A deformed mesh and how the iteration ended.
#[derive(Clone, PartialEq, Debug)]
#[must_use = "the report says whether the shape converged"]
pub struct Deformed<T: Scalar> {
    /// The new positions, in the units of the input.
    pub positions: Positions<T>,
    /// How the iteration ended.
    pub report: Report,
}

/// Moves `handles` and lets the surface follow, its details turned and sized as it bends.
///
/// The surface may have boundaries; every component needs a handle.
///
/// # Errors
/// [`Error`] for a mesh that is no surface, and for handles that do not exist, contradict each
/// other or leave a component free. Reaching the iteration limit is no error: see
/// [`Deformed::report`].
///
/// **Source**: paper, section 3.2; the default orientation is ours (`docs/decisions`), the paper's
/// own settings are [`DeformOptions::paper`].
pub fn deform<'m, T: Scalar>(
    surface: impl Into<Surface<'m, T>>,
    handles: &Handles<T>,
    options: &DeformOptions,
) -> Result<Deformed<T>, Error> {
    deform_with(options.flow(surface), handles)
}

/// As [`deform()`], by a flow with any scheme, updater, orientation or energy, yours included.
///
/// # Errors
/// As [`deform()`]; and an updater that the flow's energy would not ask
/// ([`cotan_flow::FlowError::MutedUpdater`]).
pub fn deform_with<T: Scalar>(
    flow: FlowBuilder<T>,
    handles: &Handles<T>,
) -> Result<Deformed<T>, Error> {
    let mut session = Session::from_flow(flow, handles)?;
    let report = session.run()?;
    Ok(Deformed {
        positions: session.positions(),
        report,
    })
}
