//! The pages of the jobs: smoothing, details and the sphere.

use cotan::smooth::SmoothMethod;
use cotan_workspace::{Command, Job, Paint};
use eframe::egui::{self, Slider};

use super::Editor;
use super::panels::choice;

impl Editor {
    pub(super) fn smooth_page(&mut self, ui: &mut egui::Ui) {
        self.masks(ui);
        ui.separator();
        let Some(of_scene) = self.scene().map(|scene| scene.settings().smooth) else {
            return;
        };
        let before = self.pages.smooth.unwrap_or(of_scene);
        let mut smooth = before;
        choice(ui, "Method", &mut smooth.method, SmoothMethod::ALL, |k| {
            k.name()
        });
        if smooth.method != before.method {
            smooth.iterations = None;
        }
        let mut iterations = smooth.num_iterations();
        let often = ui.add(Slider::new(&mut iterations, 0..=100).text("iterations"));
        self.mark("smooth-iterations", often.rect);
        if often.changed() {
            smooth.iterations = Some(iterations);
        }
        let strong = ui.add(Slider::new(&mut smooth.strength, 0.0..=1.0).text("strength"));
        let strong =
            strong.on_hover_text("0.5: as firmly anchored as the noise of the mesh allows");
        self.mark("smooth-strength", strong.rect);
        let run = ui.button("Smooth");
        self.mark("smooth", run.rect);
        if run.clicked() {
            self.run(Command::Smooth);
        } else if self.is_smoothed() {
            let is_moved =
                smooth.method != before.method || self.is_moved(&often) || self.is_moved(&strong);
            let is_held = often.dragged() || strong.dragged();
            self.pages.smooth = self.kept(smooth, is_held || is_moved);
            if is_moved {
                self.run(Command::AdjustSmooth { smooth });
            }
        } else {
            self.pages.smooth = None;
            if smooth != before {
                self.run(Command::SetSmooth { smooth });
            }
        }
        ui.separator();
        self.details(ui);
        ui.weak(
            "Moving a slider again starts from the shape before it. Undo returns to that shape.",
        );
    }

    fn details(&mut self, ui: &mut egui::Ui) {
        let of_scene = self.scene().map_or(1.0, |scene| scene.settings().detail);
        let mut factor = self.pages.detail.unwrap_or(of_scene);
        ui.label("Details");
        let slider = ui.add(Slider::new(&mut factor, 0.0..=3.0).text("times their size"));
        self.mark("detail", slider.rect);
        let is_moved = self.is_moved(&slider);
        self.pages.detail = self.kept(factor, slider.dragged() || is_moved);
        if is_moved {
            self.run(Command::ScaleDetails { factor });
        }
    }

    /// The value that a slider goes on to show: its own while it is held or its job runs, or that
    /// of the scene.
    fn kept<T>(&self, value: T, is_held: bool) -> Option<T> {
        (is_held || self.workspace.job().is_some()).then_some(value)
    }

    /// Returns `true` if the present step is a smoothing, which the sliders repeat.
    fn is_smoothed(&self) -> bool {
        let step = self
            .workspace
            .model()
            .map(|model| model.history().present());
        matches!(
            step.and_then(|step| step.command.as_ref()),
            Some(Command::Finish {
                job: Job::Smooth(_) | Job::SmoothAgain(_),
                ..
            })
        )
    }

    /// Returns `true` if a slider should start its job: while it is dragged, whenever the
    /// previous job is done; and when it is released.
    fn is_moved(&self, slider: &egui::Response) -> bool {
        let is_let_go = slider.drag_stopped() || (slider.changed() && !slider.dragged());
        is_let_go || (slider.changed() && self.workspace.job().is_none())
    }

    /// The masks, one of which may restrict the jobs.
    fn masks(&mut self, ui: &mut egui::Ui) {
        let Some(scene) = self.scene() else {
            return;
        };
        let props = std::sync::Arc::clone(&scene.props);
        let is_selected = !props.selection.is_empty();
        ui.label(match (is_selected, props.mask) {
            (true, _) => "On the selection; fixed regions stay.",
            (false, Some(_)) => "On the mask; fixed regions stay.",
            (false, None) => "On the whole model; fixed regions stay.",
        });
        let mut border = props.settings.border;
        let slider = Slider::new(&mut border, 0.0..=0.5).text("border");
        if ui
            .add(slider)
            .on_hover_text("of the longest side")
            .changed()
        {
            self.run(Command::SetBorder { border });
        }
        for (mask, named) in props.masks.iter().enumerate() {
            ui.horizontal(|ui| {
                let is_used = props.mask == Some(mask);
                if ui.selectable_label(is_used, &named.name).clicked() {
                    let mask = (!is_used).then_some(mask);
                    self.run(Command::UseMask { mask });
                }
                if ui.small_button("Select").clicked() {
                    self.run(Command::SelectMask { mask });
                }
                if ui.small_button("✖").clicked() {
                    self.run(Command::RemoveMask { mask });
                }
            });
        }
        let button = egui::Button::new("Mask of the selection");
        if ui.add_enabled(is_selected, button).clicked() {
            let is_free = |name: &String| props.masks.iter().all(|m| m.name != *name);
            let mut names = (1..).map(|k| format!("Mask {k}"));
            let name = names.find(is_free).unwrap_or_default();
            self.run(Command::MakeMask { name });
        }
    }

    /// The brush that paints the curvature field.
    pub(super) fn paint_page(&mut self, ui: &mut egui::Ui) {
        let Some(before) = self.scene().map(|scene| scene.settings().brush) else {
            return;
        };
        self.masks(ui);
        ui.separator();
        let mut brush = before;
        egui::ComboBox::from_label("Brush")
            .selected_text(brush.paint.name())
            .show_ui(ui, |ui| {
                for paint in [
                    Paint::Detail(1.5),
                    Paint::Smooth(0.02),
                    Paint::Flatten,
                    Paint::Inflate(5.0),
                ] {
                    let is_chosen = paint.name() == brush.paint.name();
                    if ui.selectable_label(is_chosen, paint.name()).clicked() && !is_chosen {
                        brush.paint = paint;
                    }
                }
            });
        match &mut brush.paint {
            Paint::Detail(factor) => {
                ui.add(Slider::new(factor, 0.0..=2.5).text("times as strong"));
            }
            Paint::Smooth(size) => {
                let slider = Slider::new(size, 0.001..=0.2).logarithmic(true);
                ui.add(slider.text("size"))
                    .on_hover_text("bumps narrower than this share of the longest side go");
            }
            Paint::Flatten => {}
            Paint::Inflate(by) => {
                ui.add(Slider::new(by, -20.0..=20.0).text("in, out"));
            }
        }
        let radius = Slider::new(&mut brush.radius, 0.005..=0.5).logarithmic(true);
        let radius = ui.add(radius.text("radius"));
        self.mark("brush-radius", radius.rect);
        ui.add(Slider::new(&mut brush.falloff, 0.0..=1.0).text("falloff"));
        ui.add(Slider::new(&mut brush.strength, 0.0..=1.0).text("strength"));
        if brush != before {
            self.run(Command::SetBrush { brush });
        }
        ui.weak("Draw on the surface: the stroke takes effect when it ends.");
    }

    pub(super) fn sphere_page(&mut self, ui: &mut egui::Ui) {
        let Some(scene) = self.scene() else {
            return;
        };
        let mut areas = scene.settings().areas;
        let slider = Slider::new(&mut areas, 0.0..=1.0).text("angles … areas");
        if ui.add(slider).changed() {
            self.run(Command::SetAreas { areas });
        }
        let run = ui.button("Map to the sphere");
        self.mark("map", run.rect);
        if run.clicked() {
            self.run(Command::MapToSphere);
        }
        let Some(morph) = self.workspace.morph() else {
            return;
        };
        ui.label(morph.report());
        let mut share = morph.share();
        let slider = ui.add(Slider::new(&mut share, 0.0..=1.0).text("mesh … sphere"));
        self.mark("morph", slider.rect);
        if slider.changed() {
            self.run(Command::Morph { share });
        }
        ui.horizontal(|ui| {
            let keep = ui.button("Keep this shape");
            self.mark("keep-morph", keep.rect);
            if keep.clicked() {
                self.run(Command::KeepMorph);
            }
            if ui.button("Back to the mesh").clicked() {
                self.run(Command::LeaveMorph);
            }
        });
    }
}
