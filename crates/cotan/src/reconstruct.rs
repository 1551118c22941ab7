//! A shape from its two scalar fields.

use std::ops::ControlFlow;

use cotan_flow::{Acceleration, Flow, Reflect, Start, StepReport};
use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::HalfedgeMesh;

use crate::deform::Deformed;
use crate::error::Error;
use crate::handles::Handles;
use crate::options::{DeformOptions, OrientationKind};

/// Rebuilds the mesh from its Laplacian coefficients and the magnitudes of its Laplacian
/// coordinates, without their directions: the first solve has ℓ = 0.
///
/// A few handles (three to six) say where the shape is. `options` chooses the rest;
/// [`OrientationKind::Reflect`] with [`Acceleration::Off`] and full steps is the paper's experiment.
/// The membrane of [`OrientationKind::Hybrid`] knows the directions of the original edges, so the
/// hybrid is replaced by [`OrientationKind::Reflect`], whose first steps leave the collapsed start
/// best.
///
/// # Errors
/// As [`crate::deform()`].
///
/// **Source**: paper, section 3.4, figure 8 and table 2.
pub fn reconstruct<T: Scalar>(
    mesh: &HalfedgeMesh,
    positions: &Positions<T>,
    handles: &Handles<T>,
    options: &DeformOptions,
    observer: impl FnMut(&Flow<'_, T>, &StepReport) -> ControlFlow<()>,
) -> Result<Deformed<T>, Error> {
    let mut builder = Flow::builder(mesh, positions)
        .scheme(options.scheme.scheme())
        .updater(options.updater())
        .handles(handles.resolve(positions)?)
        .start(Start::Zero)
        .schedule(options.schedule)
        .tolerance(options.tolerance)
        .iteration_limit(options.iteration_limit);
    builder = if options.orientation == OrientationKind::Hybrid {
        builder
            .orientation(Reflect::new())
            .acceleration(Acceleration::Off)
    } else {
        builder
            .orientation(options.orientation())
            .acceleration(options.acceleration)
    };
    let mut flow = builder.build()?;
    let report = flow.run(observer)?;
    Ok(Deformed {
        positions: flow.positions(),
        report,
    })
}
