//! The menu bar and the status line.

use cotan_io::printable;
use eframe::egui;

use super::Editor;
use super::dialogs::{Purpose, Then};
use crate::scene::Role;
use crate::solver::State;
use crate::view::{Shading, StandardView, UpAxis};

impl Editor {
    pub(super) fn menu(&mut self, ui: &mut egui::Ui) {
        let ctx = ui.ctx().clone();
        egui::Panel::top("menu").show_inside(ui, |ui| {
            egui::MenuBar::new().ui(ui, |ui| {
                ui.menu_button("File", |ui| self.file_menu(ui, &ctx));
                ui.menu_button("Edit", |ui| self.edit_menu(ui));
                ui.menu_button("View", |ui| self.view_menu(ui));
                if ui.button("Help").clicked() {
                    self.dialogs.has_help = true;
                }
            });
        });
    }

    fn file_menu(&mut self, ui: &mut egui::Ui, ctx: &egui::Context) {
        if ui.button("Open…   Ctrl O").clicked() {
            self.after_saving(ctx, Then::ChooseFile);
        }
        if ui.button("Open the sample").clicked() {
            self.after_saving(ctx, Then::OpenSample);
        }
        ui.separator();
        if ui.button("Save   Ctrl S").clicked() {
            self.save();
        }
        if ui.button("Save as…   Ctrl Shift S").clicked() {
            self.choose(Purpose::SaveMesh);
        }
        if ui.button("Save the picture…").clicked() {
            self.choose(Purpose::SavePicture);
        }
        ui.separator();
        if ui.button("Load handles…").clicked() {
            self.choose(Purpose::OpenHandles);
        }
        if ui.button("Save handles…").clicked() {
            self.choose(Purpose::SaveHandles);
        }
        ui.separator();
        if ui.button("Quit").clicked() {
            self.after_saving(ctx, Then::Close);
        }
    }

    fn edit_menu(&mut self, ui: &mut egui::Ui) {
        let history = self.open.as_ref().map(|open| &open.history);
        let undo = history.and_then(|h| h.undo_label()).map(str::to_owned);
        let redo = history.and_then(|h| h.redo_label()).map(str::to_owned);
        let text = |verb: &str, label: &Option<String>, keys: &str| {
            format!("{verb} {}   {keys}", label.as_deref().unwrap_or_default())
        };
        let button = egui::Button::new(text("Undo", &undo, "Ctrl Z"));
        if ui.add_enabled(undo.is_some(), button).clicked() {
            self.undo();
        }
        let button = egui::Button::new(text("Redo", &redo, "Ctrl Shift Z"));
        if ui.add_enabled(redo.is_some(), button).clicked() {
            self.redo();
        }
        ui.separator();
        let is_selected = !self.selection.is_empty();
        let button = egui::Button::new("Handle of the selection   H");
        if ui.add_enabled(is_selected, button).clicked() {
            self.make_handle(Role::Movable);
        }
        let button = egui::Button::new("Fix the selection   X");
        if ui.add_enabled(is_selected, button).clicked() {
            self.make_handle(Role::Fixed);
        }
        if ui.button("Let go of all handles").clicked() {
            self.remove_all_handles();
        }
        if ui.button("Back to the rest shape").clicked() {
            self.reset_shape();
        }
    }

    fn view_menu(&mut self, ui: &mut egui::Ui) {
        if ui.button("Fit   F").clicked() {
            self.fit();
        }
        for (name, view) in [
            ("Front   1", StandardView::Front),
            ("Right   3", StandardView::Right),
            ("Top   7", StandardView::Top),
            ("Oblique", StandardView::Oblique),
        ] {
            if ui.button(name).clicked() {
                self.camera.look_from(view);
            }
        }
        for (name, axis) in [("Y is up", UpAxis::Y), ("Z is up", UpAxis::Z)] {
            if ui.button(name).clicked() {
                self.camera.set_up(axis);
            }
        }
        ui.separator();
        ui.checkbox(&mut self.looks.has_wireframe, "Wireframe   Z");
        let mut is_flat = self.looks.shading == Shading::Flat;
        if ui.checkbox(&mut is_flat, "Flat shading   S").changed() {
            self.looks.shading = if is_flat {
                Shading::Flat
            } else {
                Shading::Smooth
            };
        }
        ui.checkbox(&mut self.looks.has_normals, "Normals   N");
        ui.separator();
        egui::widgets::global_theme_preference_buttons(ui);
    }

    pub(super) fn status(&mut self, ui: &mut egui::Ui) {
        egui::Panel::bottom("status").show_inside(ui, |ui| {
            ui.horizontal(|ui| {
                self.progress(ui);
                let (state, choice) = self.solver.state();
                match &state {
                    State::Idle => ui.label("ready"),
                    State::Preparing => {
                        ui.spinner();
                        ui.label("preparing the system")
                    }
                    State::Running => ui.label("following"),
                    State::Settled => ui.label("at rest"),
                    State::Failed(problem) => {
                        ui.colored_label(ui.visuals().error_fg_color, printable(problem))
                    }
                };
                ui.separator();
                if let Some(open) = &self.open {
                    let mesh = open.mesh.processing.mesh();
                    ui.label(format!(
                        "{} vertices, {} faces",
                        mesh.num_vertices(),
                        mesh.num_faces()
                    ));
                    ui.separator();
                }
                ui.label(match self.selection.len() {
                    0 => "nothing selected".to_owned(),
                    1 => {
                        let vertex = self.selection.first().map_or(0, |v| self.file_vertex(*v));
                        format!("vertex {vertex} selected")
                    }
                    n => format!("{n} vertices selected"),
                });
                if !choice.is_empty() {
                    ui.separator();
                    ui.label(choice);
                }
                if let Some(note) = &self.dialogs.note {
                    ui.separator();
                    ui.add(egui::Label::new(printable(note)).truncate());
                }
            });
        });
    }

    /// The index of a vertex in the file.
    fn file_vertex(&self, vertex: cotan::halfedge::VertexId) -> usize {
        let Some(open) = &self.open else {
            return vertex.index();
        };
        let in_document = open.mesh.processing.document_vertex(vertex);
        match &open.mesh.file_vertices {
            Some(file) => file.vertex(in_document),
            None => in_document,
        }
    }

    fn progress(&mut self, ui: &mut egui::Ui) {
        let Some(task) = &self.task else {
            return;
        };
        let bar = match task.progress() {
            Some(share) => egui::ProgressBar::new(share).show_percentage(),
            None => egui::ProgressBar::new(0.5).animate(true),
        };
        ui.add(bar.desired_width(120.0).text(task.name.clone()));
        let cancel = ui.button("Cancel");
        let (rect, is_cancelled) = (cancel.rect, cancel.clicked());
        if is_cancelled {
            self.cancel_task();
        }
        self.mark("cancel", rect);
        ui.separator();
    }
}
