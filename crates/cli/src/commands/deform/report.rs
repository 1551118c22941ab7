//! The report of an edit, as JSON and as a table.

use cotan::DeformOptions;
use cotan::flow::StopReason;
use serde::Serialize;

use super::edit::{Edited, HistoryEntry};
use crate::args::Precision;
use crate::parts::{self, PartFields};
use crate::report::{QualityFields, Report, Seconds, Table};
use crate::text::Text;

/// The machine-readable report of an edit.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct DeformReport {
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
    /// An estimate of the widest turn that the shape holds, if it lost one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) held_turn_degrees: Option<f64>,
    #[serde(flatten)]
    pub(crate) quality: QualityFields,
    pub(crate) scheme: &'static str,
    pub(crate) orientation: &'static str,
    /// The strategy for the linear system, and the reason for it.
    pub(crate) strategy: Option<&'static str>,
    pub(crate) strategy_reason: Option<&'static str>,
    pub(crate) precision: &'static str,
    pub(crate) seconds: PhaseSeconds,
    /// The parts of a model that has several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) parts: Vec<PartFields>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) history: Option<Vec<HistoryEntry>>,
}

/// Durations of the phases.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
pub(crate) struct PhaseSeconds {
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

/// The setting of an edit, reported in addition to its result.
#[derive(Clone, Debug)]
pub(crate) struct Setting<'a> {
    pub(crate) faces: usize,
    pub(crate) handles: usize,
    pub(crate) options: &'a DeformOptions,
    pub(crate) precision: Precision,
    pub(crate) parts: Vec<PartFields>,
}

impl DeformReport {
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
            lost_turn_degrees: flow.lost_turn.map(|lost| lost.back.to_degrees()),
            held_turn_degrees: flow.lost_turn.map(|lost| lost.held.to_degrees()),
            quality: QualityFields::from(&edited.quality),
            scheme: setting.options.scheme.name(),
            orientation: setting.options.orientation.name(),
            strategy: flow.solver.map(|choice| choice.method.name()),
            strategy_reason: flow.solver.map(|choice| choice.reason.as_str()),
            precision: setting.precision.name(),
            seconds: PhaseSeconds {
                factor: edited.seconds.factor,
                iterate: edited.seconds.iterate,
                ..PhaseSeconds::default()
            },
            parts: setting.parts,
            history: edited.history.clone(),
        }
    }
}

impl Report for DeformReport {
    fn set_seconds(&mut self, seconds: Seconds) {
        self.seconds.load = seconds.load;
        self.seconds.build = seconds.build;
        self.seconds.total = seconds.total;
    }

    fn table(&self) -> Text {
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
