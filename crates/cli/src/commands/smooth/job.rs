//! The job of `smooth`, `denoise` and `detail`: moves the vertices by a filter, and measures the
//! result.

use std::time::Instant;

use cotan::geometry::{Positions, Surface};

use super::args::KeepArgs;
use super::report::SmoothReport;
use crate::args::{MeshArgs, OutputPath};
use crate::error::CliError;
use crate::picture::curvature_picture;
use crate::pipeline::{Context, Finished, Job, Output, Plan};
use crate::prepare::{Prepared, Source, Surfaces};
use crate::report::counted;
use crate::same_faces::other_positions;

/// A filter of the positions of a mesh.
pub(crate) trait Filter: Sync {
    /// Computes the new positions.
    fn run(&self, mesh: &Prepared, context: &Context<'_>) -> Result<Filtered, CliError>;
}

/// The new positions, and the report with the fields that only the filter knows.
pub(crate) struct Filtered {
    pub(crate) positions: Positions<f64>,
    pub(crate) report: SmoothReport,
}

/// The application of a filter to a mesh file.
pub(crate) struct FilterJob<'a, F> {
    pub(crate) mesh: &'a MeshArgs,
    pub(crate) keep: &'a KeepArgs,
    pub(crate) filter: F,
}

impl<F: Filter> Job for FilterJob<'_, F> {
    type Meshes = Prepared;
    type Report = SmoothReport;
    /// The positions that the document stores.
    type Rest = Positions<f64>;

    fn plan(&self) -> Plan<'_, Source> {
        Plan {
            sources: Source::from(self.mesh).surfaces(Surfaces::Any),
            output: &self.mesh.output,
            embed: self.mesh.embed,
            threads: self.keep.threads,
            report: self.keep.report.as_ref(),
            iterations: None,
        }
    }

    fn run(
        &self,
        mesh: &mut Prepared,
        context: &Context<'_>,
    ) -> Result<Finished<SmoothReport, Positions<f64>>, CliError> {
        let console = context.console;
        if mesh.processing.mesh().components().count() > 1 {
            // Parts in several pieces will be fixed although welding would join them.
            mesh.warn_weldable(console);
        }
        let clock = Instant::now();
        let Filtered {
            positions,
            mut report,
        } = self.filter.run(mesh, context)?;
        report.seconds.smooth = clock.elapsed().as_secs_f64();
        let truth = self.keep.truth.as_ref();
        let truth = truth
            .map(|path| other_positions(mesh, path, console))
            .transpose()?;
        let stored = mesh.set_positions(&positions)?;
        let processing = &mesh.processing;
        Surface::new(processing.mesh(), processing.positions())
            .map_err(cotan::Error::from)
            .and_then(|surface| report.measure(&surface, &stored, truth.as_ref()))
            .map_err(|error| mesh.refuse(error))?;
        Ok(Finished {
            mesh: Output::InPlace,
            report,
            rest: stored,
        })
    }

    fn after_save(
        &self,
        _: &Prepared,
        finished: &mut Finished<SmoothReport, Positions<f64>>,
        context: &Context<'_>,
    ) -> Result<(), CliError> {
        let flipped = finished.report.flipped_faces;
        if flipped > 0 {
            context.console.warn(format_args!(
                "{} flipped against the neighbours",
                counted(flipped, "face")
            ));
        }
        Ok(())
    }

    fn picture(
        &self,
        mesh: &Prepared,
        finished: &Finished<SmoothReport, Positions<f64>>,
    ) -> Option<(&OutputPath, Vec<u8>)> {
        let path = self.keep.picture.as_ref()?;
        let (mesh, before) = (mesh.processing.mesh(), mesh.processing.positions());
        Some((path, curvature_picture(mesh, before, &finished.rest)))
    }
}
