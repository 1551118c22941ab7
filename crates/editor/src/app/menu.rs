//! The menu bar and the status line.

use cotan_io::printable;
use eframe::egui;

use cotan_workspace::solver::State;
use cotan_workspace::{Combine, Command, Role};

use super::Editor;
use super::dialogs::Purpose;
use super::files::Then;
use crate::view::{Shading, StandardView, UpAxis};

impl Editor {
    pub(super) fn menu(&mut self, ui: &mut egui::Ui) {
        let ctx = ui.ctx().clone();
        egui::Panel::top("menu").show_inside(ui, |ui| {
            egui::MenuBar::new().ui(ui, |ui| {
                ui.menu_button("File", |ui| self.file_menu(ui, &ctx));
                ui.menu_button("Edit", |ui| self.edit_menu(ui));
                ui.menu_button("Select", |ui| self.select_menu(ui));
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
            self.run(Command::Save);
        }
        if ui.button("Save as…   Ctrl Shift S").clicked() {
            self.choose(Purpose::SaveModel);
        }
        if ui.button("Export the mesh…").clicked() {
            self.choose(Purpose::ExportMesh);
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
        let history = self.workspace.model().map(cotan_workspace::Model::history);
        let undo = history.and_then(|h| h.undo_label()).map(str::to_owned);
        let redo = history.and_then(|h| h.redo_label()).map(str::to_owned);
        let text = |verb: &str, label: &Option<String>, keys: &str| {
            format!("{verb} {}   {keys}", label.as_deref().unwrap_or_default())
        };
        let button = egui::Button::new(text("Undo", &undo, "Ctrl Z"));
        if ui.add_enabled(undo.is_some(), button).clicked() {
            self.travel(Command::Undo);
        }
        let button = egui::Button::new(text("Redo", &redo, "Ctrl Shift Z"));
        if ui.add_enabled(redo.is_some(), button).clicked() {
            self.travel(Command::Redo);
        }
        ui.menu_button("History", |ui| self.history_menu(ui));
        ui.separator();
        let is_selected = self.is_selected();
        let button = egui::Button::new("Handle of the selection   H");
        if ui.add_enabled(is_selected, button).clicked() {
            self.make_handle(Role::Movable);
        }
        let button = egui::Button::new("Fix the selection   X");
        if ui.add_enabled(is_selected, button).clicked() {
            self.make_handle(Role::Fixed);
        }
        for (name, command) in [
            ("Fix the other parts", Command::FixTheRest),
            ("Let go of all handles", Command::RemoveAllHandles),
            ("Back to the rest shape", Command::ResetShape),
        ] {
            if ui.button(name).clicked() {
                self.run(command);
            }
        }
    }

    /// All steps, to go to any of them.
    fn history_menu(&mut self, ui: &mut egui::Ui) {
        let Some(model) = self.workspace.model() else {
            return;
        };
        let (history, now) = (model.history(), model.history().index());
        let labels: Vec<String> = history.labels().map(str::to_owned).collect();
        egui::ScrollArea::vertical()
            .max_height(400.0)
            .show(ui, |ui| {
                for (step, label) in labels.iter().enumerate() {
                    if ui.selectable_label(step == now, label).clicked() {
                        self.travel(Command::GoTo { step });
                    }
                }
            });
    }

    pub(super) fn is_selected(&self) -> bool {
        self.scene()
            .is_some_and(|scene| !scene.selection().is_empty())
    }

    fn select_menu(&mut self, ui: &mut egui::Ui) {
        let nothing = Command::Select {
            vertices: Vec::new(),
            how: Combine::Replace,
        };
        let mut commands = vec![
            ("All   Ctrl A".to_owned(), Command::SelectAll),
            ("Nothing   Esc".to_owned(), nothing),
            ("Invert   Ctrl I".to_owned(), Command::InvertSelection),
            ("Grow   +".to_owned(), Command::GrowSelection),
            ("Shrink   −".to_owned(), Command::ShrinkSelection),
            (
                "All that is linked   Ctrl L".to_owned(),
                Command::SelectLinked,
            ),
        ];
        if let Some(scene) = self.scene() {
            let handles = scene.handles().iter().enumerate();
            commands.extend(handles.map(|(handle, group)| {
                let name = format!("Those of {}", group.name);
                (name, Command::SelectHandle { handle })
            }));
        }
        for (name, command) in commands {
            if ui.button(name).clicked() {
                self.run(command);
            }
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
                self.shown.camera.look_from(view);
            }
        }
        for (name, axis) in [("Y is up", UpAxis::Y), ("Z is up", UpAxis::Z)] {
            if ui.button(name).clicked() {
                self.shown.camera.set_up(axis);
            }
        }
        ui.separator();
        ui.checkbox(&mut self.shown.looks.has_wireframe, "Wireframe   Z");
        let mut is_flat = self.shown.looks.shading == Shading::Flat;
        if ui.checkbox(&mut is_flat, "Flat shading   S").changed() {
            self.shown.looks.shading = if is_flat {
                Shading::Flat
            } else {
                Shading::Smooth
            };
        }
        ui.checkbox(&mut self.shown.looks.has_normals, "Normals   N");
        ui.separator();
        egui::widgets::global_theme_preference_buttons(ui);
    }

    pub(super) fn status(&mut self, ui: &mut egui::Ui) {
        egui::Panel::bottom("status").show_inside(ui, |ui| {
            ui.horizontal(|ui| {
                self.progress(ui);
                let state = self.workspace.solver().state().0;
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
                if let Some(model) = self.workspace.model() {
                    let mesh = model.mesh();
                    ui.label(format!(
                        "{} vertices, {} faces",
                        mesh.num_vertices(),
                        mesh.num_faces()
                    ));
                    ui.separator();
                }
                let selection = self.scene().map(|scene| scene.selection());
                ui.label(match selection.unwrap_or_default() {
                    [] => "nothing selected".to_owned(),
                    [one] => format!("vertex {} selected", self.file_vertex(*one)),
                    all => format!("{} vertices selected", all.len()),
                });
                if let Some(note) = &self.dialogs.note {
                    ui.separator();
                    ui.add(egui::Label::new(printable(note)).truncate());
                }
            });
        });
    }

    /// The index of a vertex in the file.
    fn file_vertex(&self, vertex: cotan::halfedge::VertexId) -> usize {
        let Some(model) = self.workspace.model() else {
            return vertex.index();
        };
        let file = model.file();
        let in_document = file.processing.document_vertex(vertex);
        match &file.file_vertices {
            Some(numbers) => numbers.vertex(in_document),
            None => in_document,
        }
    }

    fn progress(&mut self, ui: &mut egui::Ui) {
        let Some((name, share)) = self.workspace.job() else {
            return;
        };
        let bar = match share {
            Some(share) => egui::ProgressBar::new(share).show_percentage(),
            None => egui::ProgressBar::new(0.5).animate(true),
        };
        ui.add(bar.desired_width(120.0).text(name));
        let cancel = ui.button("Cancel");
        let (rect, is_cancelled) = (cancel.rect, cancel.clicked());
        if is_cancelled {
            self.run(Command::CancelJob);
        }
        self.mark("cancel", rect);
        ui.separator();
    }
}
