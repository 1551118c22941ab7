//! Colours, and the figures for diagnostics.

use cotan::geometry::Readable;
use cotan_workspace::meter::Field;
use cotan_workspace::solver::Sample;
use eframe::egui;
use egui_plot::{Line, Plot, PlotPoints};

use super::Editor;

impl Editor {
    /// The choice of colours, and the diagnostics.
    pub(super) fn numbers(&mut self, ui: &mut egui::Ui) {
        let before = self.measuring.field;
        let list = egui::ComboBox::from_label("Colours")
            .selected_text(before.name())
            .show_ui(ui, |ui| {
                for (index, field) in Field::ALL.into_iter().enumerate() {
                    let choice =
                        ui.selectable_value(&mut self.measuring.field, field, field.name());
                    self.mark(&format!("colours-{index}"), choice.rect);
                }
            });
        self.mark("colours", list.response.rect);
        ui.collapsing("Diagnostics", |ui| self.diagnostics(ui));
    }

    fn diagnostics(&self, ui: &mut egui::Ui) {
        let errors = self.shown.reading().and_then(|r| r.errors);
        let samples = self.workspace.solver().samples();
        let last = samples.last();
        egui::Grid::new("numbers").num_columns(2).show(ui, |ui| {
            let mut row = |name: &str, value: String| {
                ui.label(name);
                ui.monospace(value);
                ui.end_row();
            };
            let number = |x: Option<f64>| x.map_or("–".to_owned(), |x| Readable(x).to_string());
            row("E_p (angles)", number(errors.map(|e| e.parameterization)));
            row("E_g (details)", number(errors.map(|e| e.geometry)));
            row("change / diagonal", number(last.map(|s| s.change)));
            let milliseconds = last.map(|s| format!("{:.2}", s.milliseconds));
            row(
                "ms per iteration",
                milliseconds.unwrap_or_else(|| "–".to_owned()),
            );
            row("iterations", samples.len().to_string());
        });
        let choice = self.workspace.solver().state().1;
        if !choice.is_empty() {
            ui.label(choice);
        }
        if samples.len() >= 2 {
            convergence(ui, &samples);
        }
    }
}

/// Plots how far the shape is from rest.
fn convergence(ui: &mut egui::Ui, samples: &[Sample]) {
    let floor = 1e-16_f64;
    let points: PlotPoints<'_> = samples
        .iter()
        .enumerate()
        .map(|(k, s)| [k as f64, s.residual.max(floor).log10()])
        .collect();
    Plot::new("convergence")
        .height(110.0)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .y_axis_label("log₁₀ step left")
        .show(ui, |plot| plot.line(Line::new("step left", points)));
}
