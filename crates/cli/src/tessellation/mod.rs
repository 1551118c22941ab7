//! Shared by `remesh`, `decimate` and `subdivide`, which write a mesh of another connectivity: the
//! job, the attributes that it takes from the file, the report, and the picture.

pub(crate) mod args;
mod base;
mod report;

use std::path::Path;

use cotan::Mesh;
use cotan::surface::TessellationError;
use cotan_io::Document;

pub(crate) use base::Base;
pub(crate) use report::TessellationReport;

use crate::args::{MeshArgs, OutputPath};
use crate::console::Console;
use crate::error::CliError;
use crate::pipeline::{self, Context, Finished, Job, Output, Plan};
use crate::prepare::{Prepared, Source};

use args::OutcomeArgs;

/// A command that changes the triangles of a mesh.
pub(crate) trait Tessellate: Sync {
    /// The options that all of these commands have.
    fn args(&self) -> (&MeshArgs, &OutcomeArgs);

    /// Makes the new mesh.
    fn tessellate(&self, mesh: &Prepared, context: &Context<'_>) -> Result<Tessellated, CliError>;
}

/// A mesh of another connectivity.
pub(crate) struct Tessellated {
    pub(crate) document: Document,
    pub(crate) report: TessellationReport,
    /// The triangles, for the picture.
    pub(crate) triangles: Mesh<f64>,
}

/// Runs such a command.
pub(crate) fn run(command: &impl Tessellate, console: &Console) -> Result<(), CliError> {
    pipeline::execute(&TessellationJob(command), console)
}

struct TessellationJob<'a, C>(&'a C);

impl<C: Tessellate> Job for TessellationJob<'_, C> {
    type Meshes = Prepared;
    type Report = TessellationReport;
    /// The new triangles.
    type Rest = Mesh<f64>;

    fn plan(&self) -> Plan<'_, Source> {
        let (mesh, outcome) = self.0.args();
        Plan {
            sources: Source::from(mesh),
            output: &mesh.output,
            embed: mesh.embed,
            threads: outcome.threads,
            report: outcome.report.as_ref(),
            iterations: None,
        }
    }

    fn run(
        &self,
        mesh: &mut Prepared,
        context: &Context<'_>,
    ) -> Result<Finished<TessellationReport, Self::Rest>, CliError> {
        let made = self.0.tessellate(mesh, context)?;
        Ok(Finished {
            mesh: Output::New(made.document),
            report: made.report,
            rest: made.triangles,
        })
    }

    fn after_save(
        &self,
        _: &Prepared,
        finished: &mut Finished<TessellationReport, Self::Rest>,
        context: &Context<'_>,
    ) -> Result<(), CliError> {
        let (mesh, _) = self.0.args();
        finished.report.warn(&mesh.output, context.console);
        Ok(())
    }

    fn picture(
        &self,
        mesh: &Prepared,
        finished: &Finished<TessellationReport, Self::Rest>,
    ) -> Option<(&OutputPath, Vec<u8>)> {
        let (_, outcome) = self.0.args();
        let path = outcome.picture.as_ref()?;
        let png = report::picture(&mesh.processing.surface(), &finished.rest.surface());
        Some((path, png))
    }
}

/// The error of a change of triangles, with the name of the file.
pub(crate) fn refuse(path: &Path, source: TessellationError) -> CliError {
    CliError::Tessellation {
        path: path.to_owned(),
        source,
    }
}
