//! The side panel: tools, handles, jobs and figures.

use cotan::flow::{Acceleration, Schedule};
use cotan::geometry::Readable;
use cotan::linear::Hold;
use cotan::smooth::SmoothMethod;
use cotan::{DetailSize, OrientationKind, SchemeKind};
use eframe::egui::{self, Slider};
use egui_plot::{Line, Plot, PlotPoints};

use super::viewport::{GizmoTool, Tool};
use super::{Editor, Tab};
use crate::meter::Field;
use crate::scene::Role;

impl Editor {
    pub(super) fn panels(&mut self, ui: &mut egui::Ui) {
        let panel = egui::Panel::left("jobs")
            .default_size(270.0)
            .resizable(true);
        panel.show_inside(ui, |ui| {
            egui::ScrollArea::vertical().show(ui, |ui| {
                ui.add_space(4.0);
                ui.horizontal(|ui| {
                    for (tab, name) in [
                        (Tab::Deform, "Deform"),
                        (Tab::Smooth, "Smooth"),
                        (Tab::Sphere, "Sphere"),
                    ] {
                        let response = ui.selectable_label(self.jobs.tab == tab, name);
                        if response.clicked() {
                            self.jobs.tab = tab;
                            if tab != Tab::Sphere {
                                self.jobs.map = None;
                            }
                        }
                        self.mark(&format!("tab-{}", name.to_lowercase()), response.rect);
                    }
                });
                ui.separator();
                ui.add_enabled_ui(self.open.is_some(), |ui| match self.jobs.tab {
                    Tab::Deform => self.deform_page(ui),
                    Tab::Smooth => self.smooth_page(ui),
                    Tab::Sphere => self.sphere_page(ui),
                });
                ui.separator();
                self.numbers(ui);
            });
        });
    }

    fn deform_page(&mut self, ui: &mut egui::Ui) {
        self.tools(ui);
        ui.add_space(6.0);
        self.handle_list(ui);
        ui.add_space(6.0);
        self.deform_settings(ui);
    }

    fn tools(&mut self, ui: &mut egui::Ui) {
        ui.horizontal_wrapped(|ui| {
            ui.label("Select by");
            for (tool, name) in [
                (Tool::Select, "Click"),
                (Tool::Brush, "Brush"),
                (Tool::Lasso, "Lasso"),
            ] {
                let response = ui.selectable_value(&mut self.tool, tool, name);
                self.mark(&format!("tool-{}", name.to_lowercase()), response.rect);
            }
        });
        match self.tool {
            Tool::Brush => {
                let radius = self.pick.brush_radius_mut();
                ui.add(
                    Slider::new(radius, 4.0..=200.0)
                        .text("brush, points")
                        .logarithmic(true),
                );
            }
            Tool::Lasso => {
                ui.checkbox(&mut self.pick.is_through, "through the surface");
            }
            Tool::Select => {}
        }
        ui.horizontal(|ui| {
            let is_selected = !self.selection.is_empty();
            let handle = ui.add_enabled(is_selected, egui::Button::new("Make handle (H)"));
            let fix = ui.add_enabled(is_selected, egui::Button::new("Fix (X)"));
            self.mark("make-handle", handle.rect);
            self.mark("fix", fix.rect);
            if handle.clicked() {
                self.make_handle(Role::Movable);
            }
            if fix.clicked() {
                self.make_handle(Role::Fixed);
            }
        });
        ui.horizontal(|ui| {
            ui.label("Gizmo");
            for (tool, name) in [
                (GizmoTool::Move, "Move"),
                (GizmoTool::Rotate, "Rotate"),
                (GizmoTool::Scale, "Scale"),
            ] {
                ui.selectable_value(&mut self.gizmo_tool, tool, name);
            }
        });
        let is_open_mesh = self
            .open
            .as_ref()
            .is_some_and(|open| !open.mesh.processing.mesh().is_closed());
        if is_open_mesh {
            let mut is_fixed = self.boundary_handle().is_some();
            if ui.checkbox(&mut is_fixed, "Open boundary fixed").changed() {
                self.fix_boundary(is_fixed);
            }
        }
    }

    fn handle_list(&mut self, ui: &mut egui::Ui) {
        let handles = match self.scene() {
            Some(scene) if !scene.handles.is_empty() => std::sync::Arc::clone(&scene.handles),
            _ => {
                ui.weak(
                    "Click a vertex and press X to fix it, another and H to make a handle, \
                     then drag its round mark.",
                );
                return;
            }
        };
        for (index, group) in handles.iter().enumerate() {
            ui.horizontal(|ui| {
                let kind = match group.role {
                    Role::Fixed => "■",
                    // The only round symbol of this kind in the font.
                    Role::Movable => "⏺",
                };
                let text = format!("{kind} {} ({})", group.name, group.vertices.len());
                if ui
                    .selectable_label(self.active == Some(index), text)
                    .clicked()
                {
                    self.active = Some(index);
                    self.tint();
                }
                let mut is_soft = group.hold != Hold::Hard;
                if ui.checkbox(&mut is_soft, "soft").changed() {
                    let weight = self.jobs.soft_weight;
                    self.set_hold(
                        index,
                        if is_soft {
                            Hold::Soft(weight)
                        } else {
                            Hold::Hard
                        },
                    );
                }
                if ui.small_button("✖").on_hover_text("let go").clicked() {
                    self.remove_handle(index);
                }
            });
            if let Hold::Soft(mut weight) = group.hold
                && self.active == Some(index)
            {
                let slider = Slider::new(&mut weight, 0.01..=1e4)
                    .logarithmic(true)
                    .text("weight");
                let response = ui.add(slider);
                if response.drag_stopped() || (response.changed() && !response.dragged()) {
                    self.jobs.soft_weight = weight;
                    self.set_hold(index, Hold::Soft(weight));
                }
            }
        }
    }

    fn deform_settings(&mut self, ui: &mut egui::Ui) {
        let Some(scene) = self.scene() else {
            return;
        };
        let before = scene.options.clone();
        let mut options = before.clone();
        ui.collapsing("How it follows", |ui| {
            choice(
                ui,
                "Orientation",
                &mut options.orientation,
                OrientationKind::ALL,
                |k| k.name(),
            );
            choice(ui, "Weights", &mut options.scheme, SchemeKind::ALL, |k| {
                k.name()
            });
            let mut is_rescaled = options.detail_size == DetailSize::Rescale;
            ui.checkbox(&mut is_rescaled, "details grow with the area");
            options.detail_size = match is_rescaled {
                true => DetailSize::Rescale,
                false => DetailSize::Keep,
            };
            let mut is_paper = options.schedule == Schedule::PAPER;
            if ui
                .checkbox(&mut is_paper, "the paper's way to rest")
                .changed()
            {
                let usual = crate::scene::editor_options();
                (options.schedule, options.acceleration) = match is_paper {
                    true => (Schedule::PAPER, Acceleration::Off),
                    false => (usual.schedule, usual.acceleration),
                };
            }
        });
        if options != before {
            self.set_options("Change how it follows", options);
        }
        ui.horizontal(|ui| {
            if ui.button("To rest / stop (Space)").clicked() {
                self.settle_or_stop();
            }
            if ui.button("Rest shape").clicked() {
                self.reset_shape();
            }
        });
    }

    fn smooth_page(&mut self, ui: &mut egui::Ui) {
        let ctx = ui.ctx().clone();
        let before = self.jobs.smooth.method;
        choice(
            ui,
            "Method",
            &mut self.jobs.smooth.method,
            SmoothMethod::ALL,
            |k| k.name(),
        );
        let method = self.jobs.smooth.method;
        if method != before {
            self.jobs.smooth.iterations = None;
        }
        let mut iterations = self
            .jobs
            .smooth
            .iterations
            .unwrap_or_else(|| method.smoother().unwrap_or_default().default_iterations());
        let often = ui.add(Slider::new(&mut iterations, 0..=100).text("iterations"));
        self.mark("smooth-iterations", often.rect);
        if often.changed() {
            self.jobs.smooth.iterations = Some(iterations);
        }
        let slider = Slider::new(&mut self.jobs.strength, 0.0..=1.0).text("strength");
        let strong = ui.add(slider);
        let strong =
            strong.on_hover_text("0.5: as firmly anchored as the noise of the mesh allows");
        self.mark("smooth-strength", strong.rect);
        // Anchors from firm to loose. The middle of the slider is the default of the method.
        self.jobs.smooth.anchor = match self.jobs.strength {
            s if (s - 0.5).abs() < 0.01 => None,
            s => Some(10_f64.powf(2.0 - 4.0 * s)),
        };
        let run = ui.button("Smooth");
        self.mark("smooth", run.rect);
        if run.clicked() {
            // Start from the current shape, not from the starting point of the previous run.
            self.jobs.base = None;
            self.smooth(&ctx);
        } else if self
            .jobs
            .base
            .as_ref()
            .is_some_and(|base| base.name == "Smooth")
            && (method != before || self.is_moved(&often) || self.is_moved(&strong))
        {
            self.smooth(&ctx);
        }
        ui.separator();
        ui.label("Details");
        let slider = Slider::new(&mut self.jobs.detail, 0.0..=3.0).text("times their size");
        let slider = ui.add(slider);
        self.mark("detail", slider.rect);
        if self.is_moved(&slider) {
            self.scale_details(&ctx);
        }
        ui.weak("What a slider does goes on from the shape before it; undo brings that back.");
    }

    /// Returns `true` if a slider should start its job: while it is dragged, whenever the
    /// previous job is done; and when it is released.
    fn is_moved(&self, slider: &egui::Response) -> bool {
        let is_let_go = slider.drag_stopped() || (slider.changed() && !slider.dragged());
        is_let_go || (slider.changed() && self.task.is_none())
    }

    fn sphere_page(&mut self, ui: &mut egui::Ui) {
        let ctx = ui.ctx().clone();
        let authalic = Slider::new(&mut self.jobs.sphere.authalic, 0.0..=1.0);
        ui.add(authalic.text("angles … areas"));
        let run = ui.button("Map to the sphere");
        self.mark("map", run.rect);
        if run.clicked() {
            self.map_to_sphere(&ctx);
        }
        let Some(view) = &self.jobs.map else {
            return;
        };
        ui.label(&view.report);
        let mut share = view.share;
        let slider = ui.add(Slider::new(&mut share, 0.0..=1.0).text("mesh … sphere"));
        self.mark("morph", slider.rect);
        if slider.changed() {
            self.set_morph(share);
        }
        ui.horizontal(|ui| {
            let keep = ui.button("Keep this shape");
            self.mark("keep-morph", keep.rect);
            if keep.clicked() {
                self.keep_morph();
            }
            if ui.button("Back to the mesh").clicked() {
                self.jobs.map = None;
            }
        });
    }

    /// Colours, live figures and the plot.
    fn numbers(&mut self, ui: &mut egui::Ui) {
        let before = self.looks.field;
        let list = egui::ComboBox::from_label("Colours")
            .selected_text(before.name())
            .show_ui(ui, |ui| {
                for (index, field) in Field::ALL.into_iter().enumerate() {
                    let choice = ui.selectable_value(&mut self.looks.field, field, field.name());
                    self.mark(&format!("colours-{index}"), choice.rect);
                }
            });
        self.mark("colours", list.response.rect);
        let errors = self.reading.as_ref().and_then(|r| r.errors);
        let samples = self.solver.samples();
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
        if samples.len() < 2 {
            return;
        }
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
}

/// A combo box of named values.
fn choice<K: Copy + PartialEq + 'static>(
    ui: &mut egui::Ui,
    label: &str,
    value: &mut K,
    all: &[K],
    name: impl Fn(K) -> &'static str,
) {
    egui::ComboBox::from_label(label)
        .selected_text(name(*value))
        .show_ui(ui, |ui| {
            for &kind in all {
                ui.selectable_value(value, kind, name(kind));
            }
        });
}
