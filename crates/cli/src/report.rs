//! The report of an edit, as JSON and as a table.

use std::io;

use cotan::flow::{StepReport, StopReason};
use cotan::geometry::Readable;
use cotan::{DeformOptions, Extent, Quality, ShapeErrors};
use serde::Serialize;

use crate::args::{OutputPath, Precision};
use crate::edit::Edited;
use crate::error::CliError;
use crate::files;
use crate::parts::{self, PartFields};
use crate::text::Text;

/// The machine-readable report of an edit. The fields are stable; more may be added.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct Report {
    /// Vertices and faces (triangles) of the surface that was edited.
    pub(crate) vertices: usize,
    pub(crate) faces: usize,
    /// Number of handle vertices.
    pub(crate) handles: usize,
    pub(crate) iterations: usize,
    pub(crate) stop_reason: &'static str,
    pub(crate) converged: bool,
    /// The largest displacement of a vertex in the last step, over the diagonal of the bounding
    /// box.
    pub(crate) max_relative_change: f64,
    /// The largest displacement that one more full step would make, in the same unit.
    pub(crate) residual: f64,
    pub(crate) energy: Option<f64>,
    /// The angle by which a part turned back, if a specified turn of more than 180° was not kept.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) lost_turn_degrees: Option<f64>,
    #[serde(flatten)]
    pub(crate) quality: QualityFields,
    pub(crate) scheme: &'static str,
    pub(crate) orientation: &'static str,
    /// The strategy for the linear system, and the reason for it.
    pub(crate) strategy: Option<&'static str>,
    pub(crate) strategy_reason: Option<&'static str>,
    pub(crate) precision: &'static str,
    pub(crate) seconds: Seconds,
    /// The parts of a model that has several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) parts: Vec<PartFields>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) history: Option<Vec<HistoryEntry>>,
}

/// [`Quality`] under the names of the report.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct QualityFields {
    /// E_p and E_g of the paper.
    pub(crate) parameterization_error: f64,
    pub(crate) geometry_error: f64,
    /// E_g over the square root of the number of vertices.
    pub(crate) geometry_error_rms: f64,
    pub(crate) edge_distortion_rms: f64,
    pub(crate) area_distortion_rms: f64,
    /// `null` for an open mesh.
    pub(crate) volume_ratio: Option<f64>,
    pub(crate) flipped_faces: usize,
    pub(crate) folded_edges: usize,
    pub(crate) degenerate_faces: usize,
    pub(crate) self_intersecting_faces: usize,
    /// The largest change of an angle between neighbouring faces.
    pub(crate) max_dihedral_change_degrees: f64,
    /// σ1 of the faces.
    pub(crate) stretch: ExtentFields,
    /// 1/σ2 of the faces.
    pub(crate) compression: ExtentFields,
    pub(crate) arap_energy: f64,
}

/// [`Extent`] under the names of the report. Infinite values are `null` in JSON.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub(crate) struct ExtentFields {
    pub(crate) p99: f64,
    pub(crate) max: f64,
}

impl From<Extent> for ExtentFields {
    fn from(Extent { p99, max }: Extent) -> Self {
        Self { p99, max }
    }
}

impl From<&Quality> for QualityFields {
    fn from(quality: &Quality) -> Self {
        Self {
            parameterization_error: quality.errors.parameterization,
            geometry_error: quality.errors.geometry,
            geometry_error_rms: quality.errors.geometry_rms,
            edge_distortion_rms: quality.edge_distortion_rms,
            area_distortion_rms: quality.area_distortion_rms,
            volume_ratio: quality.volume_ratio,
            flipped_faces: quality.flipped_faces,
            folded_edges: quality.folded_edges,
            degenerate_faces: quality.degenerate_faces,
            self_intersecting_faces: quality.self_intersecting_faces,
            max_dihedral_change_degrees: quality.max_dihedral_change,
            stretch: quality.stretch.into(),
            compression: quality.compression.into(),
            arap_energy: quality.arap_energy,
        }
    }
}

/// Durations of the phases.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
pub(crate) struct Seconds {
    /// File to document.
    pub(crate) load: f64,
    /// Document to half-edge mesh.
    pub(crate) build: f64,
    /// Weights, assembly and factorization.
    pub(crate) factor: f64,
    /// All iterations, without the measurements of the history.
    pub(crate) iterate: f64,
    /// From the start of the command to the written mesh.
    pub(crate) total: f64,
}

/// One iteration.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub(crate) struct HistoryEntry {
    pub(crate) iteration: usize,
    pub(crate) change: f64,
    pub(crate) parameterization_error: f64,
    pub(crate) geometry_error: f64,
}

impl HistoryEntry {
    pub(crate) fn new(step: &StepReport, errors: &ShapeErrors) -> Self {
        Self {
            iteration: step.iteration,
            change: step.change,
            parameterization_error: errors.parameterization,
            geometry_error: errors.geometry,
        }
    }
}

/// The setting of an edit, reported in addition to its result.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Setting<'a> {
    pub(crate) faces: usize,
    pub(crate) handles: usize,
    pub(crate) options: &'a DeformOptions,
    pub(crate) precision: Precision,
    pub(crate) seconds: Seconds,
    pub(crate) parts: &'a [PartFields],
}

impl Report {
    pub(crate) fn new(edited: &Edited, setting: Setting<'_>) -> Self {
        let flow = &edited.flow;
        Self {
            vertices: edited.positions.len(),
            faces: setting.faces,
            handles: setting.handles,
            iterations: flow.iterations,
            stop_reason: flow.stop.as_str(),
            converged: flow.stop == StopReason::Converged,
            max_relative_change: flow.change,
            residual: flow.residual,
            energy: flow.energy,
            lost_turn_degrees: flow.lost_turn.map(f64::to_degrees),
            quality: QualityFields::from(&edited.quality),
            scheme: setting.options.scheme.name(),
            orientation: setting.options.orientation.name(),
            strategy: flow.solver.map(|choice| choice.method.name()),
            strategy_reason: flow.solver.map(|choice| choice.reason.as_str()),
            precision: setting.precision.name(),
            seconds: setting.seconds,
            parts: setting.parts.to_vec(),
            history: edited.history.clone(),
        }
    }

    /// Writes the report as JSON.
    pub(crate) fn write(&self, path: &OutputPath) -> Result<(), CliError> {
        write_json(path, self)
    }

    /// The report as a short table.
    pub(crate) fn table(&self) -> Text {
        let mut table = Table::default();
        table.row(
            "vertices, faces",
            format!("{}, {}", self.vertices, self.faces),
        );
        table.row("handle vertices", self.handles);
        table.row(
            "iterations",
            format!("{} ({})", self.iterations, self.stop_reason),
        );
        if let (Some(strategy), Some(reason)) = (self.strategy, self.strategy_reason) {
            table.row("system solved by", format!("{strategy} ({reason})"));
        }
        if let Some(summary) = parts::summary(&self.parts) {
            table.row("parts", summary);
        }
        table.quality(&self.quality);
        let s = &self.seconds;
        table.row(
            "seconds",
            format!(
                "{:.3} (load {:.3}, build {:.3}, factor {:.3}, iterate {:.3})",
                s.total, s.load, s.build, s.factor, s.iterate
            ),
        );
        table.text
    }
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

/// Lines with a name and a value.
#[derive(Clone, Debug, Default)]
pub(crate) struct Table {
    pub(crate) text: Text,
}

impl Table {
    pub(crate) fn row(&mut self, name: &str, value: impl std::fmt::Display) {
        self.text.line(format_args!("{name:<23} {value}"));
    }

    pub(crate) fn quality(&mut self, quality: &QualityFields) {
        self.row(
            "E_p (parameterization)",
            number(quality.parameterization_error),
        );
        self.row("E_g (geometry)", number(quality.geometry_error));
        self.row("edge distortion, rms", number(quality.edge_distortion_rms));
        self.row("area distortion, rms", number(quality.area_distortion_rms));
        match quality.volume_ratio {
            Some(ratio) => self.row("volume ratio", number(ratio)),
            None => self.row("volume ratio", "none (the mesh is open)"),
        }
        self.row("flipped faces", quality.flipped_faces);
        self.row("folded edges", quality.folded_edges);
        self.row("degenerate faces", quality.degenerate_faces);
        self.row("intersecting faces", quality.self_intersecting_faces);
        self.row(
            "dihedral change, max",
            format!("{}°", number(quality.max_dihedral_change_degrees)),
        );
        for (name, extent) in [
            ("stretch σ1", quality.stretch),
            ("compression 1/σ2", quality.compression),
        ] {
            let [p99, max] = [extent.p99, extent.max].map(number);
            self.row(name, format!("99 % below {p99}, max {max}"));
        }
        self.row("ARAP energy", number(quality.arap_energy));
    }
}

/// A count with its noun.
pub(crate) fn counted(count: usize, thing: &str) -> String {
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}

/// A number for a table.
pub(crate) fn number(x: f64) -> String {
    Readable(x).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_thing_is_not_many() {
        assert_eq!(counted(1, "face"), "1 face");
        assert_eq!(counted(0, "face"), "0 faces");
    }
}
