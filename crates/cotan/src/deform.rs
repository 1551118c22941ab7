//! Deformation in one call.

use cotan_flow::{FlowBuilder, Report};
use cotan_geometry::{Positions, Scalar, Surface};

use crate::error::Error;
use crate::handles::Handles;
use crate::options::DeformOptions;
use crate::parts::PartReport;
use crate::session::Session;

/// A deformed mesh and the report of the iteration.
#[derive(Clone, PartialEq, Debug)]
#[must_use = "the report says whether the shape converged"]
pub struct Deformed<T: Scalar> {
    /// The new positions, in the units of the input.
    pub positions: Positions<T>,
    /// The report of the iteration.
    pub report: Report,
    /// The roles of the components and how well they follow; see [`Session::parts`].
    pub parts: Vec<PartReport>,
}

/// Moves `handles` and lets the surface follow. Its details are rotated and scaled as it bends.
///
/// The surface may have boundaries and several components. Those without handles follow the others,
/// as [`DeformOptions::parts`] says. It need not be manifold or consistently oriented: a mesh that
/// was cut into pieces
/// ([`MeshBuilder::cut_into_pieces`](crate::MeshBuilder::cut_into_pieces)) deforms as one surface,
/// and copies of a vertex stay together. The struts and the volume of [`cotan_flow::Stiffness`] are
/// those of the joined surface, wherever it was cut; a one-sided one has neither. Orientations that
/// need normals ([`OrientationKind`](crate::OrientationKind)) refuse such a mesh.
///
/// # Errors
/// [`Error`] for a mesh that is not a valid surface, and for handles that do not exist,
/// contradict each other or, with [`Parts::Still`](crate::Parts::Still), leave a component free.
/// Reaching the iteration limit is not an error: see [`Deformed::report`].
///
/// **Source**: paper, section 3.2. The default orientation differs from the paper, whose
/// reflection does not reach a fixed point on detailed meshes. The settings of the paper are
/// [`DeformOptions::paper`].
pub fn deform<'m, T: Scalar>(
    surface: impl Into<Surface<'m, T>>,
    handles: &Handles<T>,
    options: &DeformOptions,
) -> Result<Deformed<T>, Error> {
    finish(Session::new(surface, handles, options)?)
}

/// Like [`deform()`], but with a flow that has any scheme, updater, orientation or energy,
/// including custom ones. Every component needs a handle.
///
/// # Errors
/// Same as [`deform()`], and an error for an updater that the energy of the flow would not use
/// ([`cotan_flow::FlowError::MutedUpdater`]).
pub fn deform_with<T: Scalar>(
    flow: FlowBuilder<T>,
    handles: &Handles<T>,
) -> Result<Deformed<T>, Error> {
    finish(Session::from_flow(flow, handles)?)
}

fn finish<T: Scalar>(mut session: Session<T>) -> Result<Deformed<T>, Error> {
    let report = session.run()?;
    Ok(Deformed {
        positions: session.positions(),
        parts: session.parts(),
        report,
    })
}
