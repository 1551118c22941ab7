//! Shared by `remesh`, `decimate` and `subdivide`, which write a mesh of another connectivity: the
//! attributes that it takes from the file, the report, and the picture.

pub(crate) mod args;
mod base;
mod report;

use std::path::Path;

use cotan::surface::TessellationError;

pub(crate) use base::Base;
pub(crate) use report::{TessellationReport, picture};

use crate::args::MeshArgs;
use crate::error::CliError;
use crate::pipeline::Plan;
use crate::prepare::Source;

use args::OutcomeArgs;

/// The files of such a command.
pub(crate) fn plan<'a>(mesh: &'a MeshArgs, outcome: &'a OutcomeArgs) -> Plan<'a, Source> {
    Plan {
        sources: Source::from(mesh),
        output: &mesh.output,
        embed: mesh.embed,
        threads: outcome.threads,
        report: outcome.report.as_ref(),
        iterations: None,
    }
}

/// The error of a change of triangles, with the name of the file.
pub(crate) fn refuse(path: &Path, source: TessellationError) -> CliError {
    CliError::Tessellation {
        path: path.to_owned(),
        source,
    }
}
