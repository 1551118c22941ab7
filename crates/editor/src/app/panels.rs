//! The side panel, and its page of tools and handles.

use cotan::linear::Hold;
use cotan::{OrientationKind, SchemeKind};
use cotan_workspace::{Command, Details, Follow, HandleGroup, Others, Role, Way};
use eframe::egui::{self, Slider};

use super::Editor;
use super::pages::Tab;
use super::pointer::{GizmoTool, Tool};
use super::typing::Axes;

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
                        (Tab::Paint, "Paint"),
                        (Tab::Sphere, "Sphere"),
                    ] {
                        let response = ui.selectable_label(self.pages.tab == tab, name);
                        if response.clicked() {
                            self.pages.tab = tab;
                            self.pointer.tool = match tab {
                                Tab::Paint => Tool::Paint,
                                _ if self.pointer.tool == Tool::Paint => Tool::Select,
                                _ => self.pointer.tool,
                            };
                            if tab != Tab::Sphere {
                                self.run(Command::LeaveMorph);
                            }
                        }
                        self.mark(&format!("tab-{}", name.to_lowercase()), response.rect);
                    }
                });
                ui.separator();
                let is_open = self.workspace.model().is_some();
                ui.add_enabled_ui(is_open, |ui| match self.pages.tab {
                    Tab::Deform => self.deform_page(ui),
                    Tab::Smooth => self.smooth_page(ui),
                    Tab::Paint => self.paint_page(ui),
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
                let response = ui.selectable_value(&mut self.pointer.tool, tool, name);
                self.mark(&format!("tool-{}", name.to_lowercase()), response.rect);
            }
        });
        match self.pointer.tool {
            Tool::Brush => {
                let radius = Slider::new(&mut self.pointer.brush_radius, 4.0..=200.0);
                ui.add(radius.text("brush, points").logarithmic(true));
            }
            Tool::Lasso => {
                ui.checkbox(&mut self.pointer.is_through, "through the surface");
            }
            Tool::Select | Tool::Paint => {}
        }
        let is_selected = self.is_selected();
        ui.horizontal(|ui| {
            for (name, text, role) in [
                ("make-handle", "Make handle (H)", Role::Movable),
                ("fix", "Fix (X)", Role::Fixed),
            ] {
                let button = ui.add_enabled(is_selected, egui::Button::new(text));
                self.mark(name, button.rect);
                if button.clicked() {
                    self.make_handle(role);
                }
            }
        });
        ui.horizontal(|ui| {
            let near = Slider::new(&mut self.pages.near, 0.0..=1.0).show_value(false);
            ui.add(near)
                .on_hover_text("along the surface, of the longest side");
            let text = format!("Select near ({:.0} %)", 100.0 * self.pages.near);
            let button = ui.add_enabled(is_selected, egui::Button::new(text));
            if let Some(model) = self.workspace.model().filter(|_| button.clicked()) {
                let distance = self.pages.near * model.side();
                self.run(Command::SelectWithin { distance });
            }
        });
        ui.horizontal(|ui| {
            ui.label("Gizmo");
            for (tool, name) in [
                (GizmoTool::Move, "Move"),
                (GizmoTool::Rotate, "Rotate"),
                (GizmoTool::Scale, "Scale"),
            ] {
                ui.selectable_value(&mut self.pointer.gizmo_tool, tool, name);
            }
        });
        ui.horizontal(|ui| {
            ui.label("Axes");
            for (axes, name) in [
                (Axes::Global, "Model"),
                (Axes::Local, "Handle"),
                (Axes::View, "View"),
            ] {
                ui.selectable_value(&mut self.pointer.axes, axes, name);
            }
        });
        let props = self
            .scene()
            .map(|scene| std::sync::Arc::clone(&scene.props));
        let mut is_mirrored = props.as_ref().is_some_and(|p| p.mirror.is_some());
        let mirror = ui.checkbox(&mut is_mirrored, "Mirror (M)");
        self.mark("mirror", mirror.rect);
        if mirror.changed() {
            self.switch_mirror();
        }
        if props.is_some_and(|p| p.pivot.is_some()) && ui.button("Pivot in the middle").clicked() {
            self.run(Command::SetPivot { vertex: None });
        }
        let is_open_mesh = self
            .workspace
            .model()
            .is_some_and(|m| !m.mesh().is_closed());
        if is_open_mesh {
            let handle = self.scene().and_then(|scene| scene.boundary_handle());
            let mut is_fixed = handle.is_some();
            if ui.checkbox(&mut is_fixed, "Open boundary fixed").changed() {
                self.run(match is_fixed {
                    true => Command::FixBoundary,
                    false => Command::FreeBoundary,
                });
            }
        }
    }

    fn handle_list(&mut self, ui: &mut egui::Ui) {
        let props = match self.scene() {
            Some(scene) if !scene.handles().is_empty() => std::sync::Arc::clone(&scene.props),
            _ => {
                ui.weak(
                    "Click a vertex and press X to fix it, another and H to make a handle, \
                     then drag its round mark.",
                );
                return;
            }
        };
        for (handle, group) in props.handles.iter().enumerate() {
            let is_active = props.is_active(handle);
            ui.horizontal(|ui| {
                let kind = match group.role {
                    Role::Fixed => "■",
                    // The only round symbol of this kind in the font.
                    Role::Movable => "⏺",
                };
                let text = format!("{kind} {} ({})", group.name, group.vertices.len());
                let line = ui.selectable_label(is_active, text);
                self.mark(&format!("handle-{handle}"), line.rect);
                if line.clicked() {
                    self.pages.name = None;
                    self.run(match ui.input(|i| i.modifiers.shift) {
                        true => Command::ActivateToo { handle },
                        false => Command::Activate {
                            handle: Some(handle),
                        },
                    });
                }
                let mut is_soft = group.hold != Hold::Hard;
                if ui.checkbox(&mut is_soft, "soft").changed() {
                    let hold = match is_soft {
                        true => Hold::Soft(self.pages.soft_weight),
                        false => Hold::Hard,
                    };
                    self.run(Command::SetHold { handle, hold });
                }
                if ui.small_button("✖").on_hover_text("let go").clicked() {
                    self.run(Command::RemoveHandle { handle });
                }
            });
            if props.active == Some(handle) {
                self.active_handle(ui, handle, group);
            }
        }
    }

    /// The name and the weight of the active handle.
    fn active_handle(&mut self, ui: &mut egui::Ui, handle: usize, group: &HandleGroup) {
        let mut name = self.pages.name.take().unwrap_or_else(|| group.name.clone());
        let field = ui.add(egui::TextEdit::singleline(&mut name).hint_text("name"));
        if field.lost_focus() && name != group.name && !name.is_empty() {
            self.run(Command::RenameHandle { handle, name });
        } else if field.has_focus() {
            self.pages.name = Some(name);
        }
        let is_selected = self.is_selected();
        ui.horizontal(|ui| {
            for (name, command) in [
                ("Add the selection", Command::AddToHandle { handle }),
                ("Take it away", Command::TakeFromHandle { handle }),
            ] {
                if ui
                    .add_enabled(is_selected, egui::Button::new(name))
                    .clicked()
                {
                    self.run(command);
                }
            }
        });
        if let Hold::Soft(mut weight) = group.hold {
            let slider = Slider::new(&mut weight, 0.01..=1e4)
                .logarithmic(true)
                .text("weight");
            let response = ui.add(slider);
            if response.drag_stopped() || (response.changed() && !response.dragged()) {
                self.pages.soft_weight = weight;
                let hold = Hold::Soft(weight);
                self.run(Command::SetHold { handle, hold });
            }
        }
    }

    fn deform_settings(&mut self, ui: &mut egui::Ui) {
        let Some(scene) = self.scene() else {
            return;
        };
        let before = scene.settings().follow;
        let mut follow = before;
        influence(ui, &mut follow);
        let mut do_follow = follow.others == Others::Follow;
        ui.checkbox(&mut do_follow, "parts without handles follow");
        follow.others = match do_follow {
            true => Others::Follow,
            false => Others::Stay,
        };
        ui.collapsing("How it follows", |ui| {
            let (kind, all) = (&mut follow.orientation, OrientationKind::ALL);
            choice(ui, "Orientation", kind, all, |k| k.name());
            choice(ui, "Weights", &mut follow.scheme, SchemeKind::ALL, |k| {
                k.name()
            });
            let mut is_growing = follow.details == Details::Grow;
            ui.checkbox(&mut is_growing, "details grow with the area");
            follow.details = match is_growing {
                true => Details::Grow,
                false => Details::Keep,
            };
            let mut is_paper = follow.way == Way::Paper;
            ui.checkbox(&mut is_paper, "the paper's schedule (slower)");
            follow.way = match is_paper {
                true => Way::Paper,
                false => Way::Accelerated,
            };
        });
        if follow != before {
            self.run(Command::SetFollow { follow });
        }
        ui.horizontal(|ui| {
            if ui.button("Settle / stop (Space)").clicked() {
                self.settle_or_stop();
            }
            if ui.button("Rest shape").clicked() {
                self.run(Command::ResetShape);
            }
        });
    }
}

/// The region of influence of the handles.
fn influence(ui: &mut egui::Ui, follow: &mut Follow) {
    let mut is_local = follow.influence.is_some();
    ui.checkbox(&mut is_local, "only around the handles");
    let mut reach = follow.influence.unwrap_or_default();
    if is_local {
        // A new system is factorized for every region: not while the slider is held.
        let mut slider = |value: &mut f64, from: f64, text: &str| {
            let before = *value;
            let response = ui.add(
                Slider::new(value, from..=1.0)
                    .text(text)
                    .update_while_editing(false),
            );
            if response.dragged() {
                *value = before;
            }
        };
        slider(&mut reach.radius, 0.01, "reach");
        slider(&mut reach.falloff, 0.0, "falloff");
    }
    follow.influence = is_local.then_some(reach);
}

/// A combo box of named values.
pub(super) fn choice<K: Copy + PartialEq + 'static>(
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
