//! Reconstruction of a shape from its two scalar fields.

use std::ops::ControlFlow;

use cotan_flow::{Flow, StepReport};
use cotan_geometry::{Scalar, Surface};

use crate::deform::Deformed;
use crate::error::Error;
use crate::handles::Handles;
use crate::options::DeformOptions;
use crate::session::Session;

/// Rebuilds the mesh from its Laplacian coefficients and the magnitudes of its Laplacian
/// coordinates, without their directions: the first solve has ℓ = 0.
///
/// A few handles (three to six) determine the position of the shape. The settings are
/// [`DeformOptions::for_reconstruction`] of `options`. The experiment in the paper uses
/// [`crate::OrientationKind::Reflect`], no acceleration and full steps.
///
/// # Errors
/// Same as [`crate::deform()`].
///
/// **Source**: paper, section 3.4, figure 8 and table 2.
pub fn reconstruct<'m, T: Scalar>(
    surface: impl Into<Surface<'m, T>>,
    handles: &Handles<T>,
    options: &DeformOptions,
) -> Result<Deformed<T>, Error> {
    reconstruct_observed(surface, handles, options, |_, _| ControlFlow::Continue(()))
}

/// Like [`reconstruct`], with an observer that is called after each step and may stop the run.
///
/// # Errors
/// Same as [`reconstruct`].
pub fn reconstruct_observed<'m, T: Scalar>(
    surface: impl Into<Surface<'m, T>>,
    handles: &Handles<T>,
    options: &DeformOptions,
    observer: impl FnMut(&Flow<T>, &StepReport) -> ControlFlow<()>,
) -> Result<Deformed<T>, Error> {
    let options = options.clone().for_reconstruction();
    let mut session = Session::new(surface, handles, &options)?;
    let report = session.run_observed(observer)?;
    Ok(Deformed {
        parts: Vec::new(),
        positions: session.positions(),
        report,
    })
}
