//! Common to the reports of all commands: the trait, the JSON, tables, and common fields.
//!
//! The fields and the table of one command are in `report.rs` of its folder.

mod defects;
mod mesh;
mod quality;
mod table;

use std::io;

use serde::Serialize;

pub(crate) use defects::{Defect, listed};
pub(crate) use mesh::MeshCounts;
pub(crate) use quality::QualityFields;
pub(crate) use table::{Table, counted, number};

use crate::args::OutputPath;
use crate::error::CliError;
use crate::files;
use crate::text::Text;

/// The report of a job: its serialization is the JSON of `--report`, its table the summary on the
/// terminal.
///
/// The fields are stable; more may be added.
pub(crate) trait Report: Serialize {
    /// Sets the durations, which are known when the mesh has been written.
    fn set_seconds(&mut self, seconds: Seconds);

    /// The report as a short table.
    fn table(&self) -> Text;
}

/// Durations of the steps that all jobs share.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Seconds {
    /// Files to documents.
    pub(crate) load: f64,
    /// Documents to half-edge meshes, including repairs.
    pub(crate) build: f64,
    /// From the start of the job to the written mesh.
    pub(crate) total: f64,
}

/// Writes a report as indented JSON.
pub(crate) fn write_json(path: &OutputPath, value: &impl Serialize) -> Result<(), CliError> {
    let text = Text::json(value).map_err(|e| CliError::Write {
        path: path.to_path_buf(),
        source: e.into(),
    })?;
    files::write(path, text.as_str().as_bytes())
}

/// Indented JSON for standard output.
pub(crate) fn json_text(value: &impl Serialize) -> Result<Text, CliError> {
    Text::json(value).map_err(|e| CliError::Output(io::Error::from(e)))
}
