//! The menu bar and the status line.

use cotan_io::printable;
use eframe::egui;

use cotan_workspace::Command;
use cotan_workspace::solver::State;

use super::Editor;
use super::actions::{self, Action};
use super::palette::Palette;

impl Editor {
    pub(super) fn menu(&mut self, ui: &mut egui::Ui) {
        let ctx = ui.ctx().clone();
        egui::Panel::top("menu").show_inside(ui, |ui| {
            egui::MenuBar::new().ui(ui, |ui| {
                ui.menu_button("File", |ui| self.file_menu(ui, &ctx));
                ui.menu_button("Edit", |ui| self.edit_menu(ui, &ctx));
                ui.menu_button("Select", |ui| self.select_menu(ui, &ctx));
                ui.menu_button("View", |ui| self.view_menu(ui, &ctx));
                if ui.button("Search   Ctrl P").clicked() {
                    self.dialogs.palette = Some(Palette::default());
                }
                if ui.button("Help").clicked() {
                    self.dialogs.has_help = true;
                }
            });
        });
    }

    /// Lists actions, with their keys at the right.
    fn items(&mut self, ui: &mut egui::Ui, ctx: &egui::Context, actions: &[Action]) {
        for action in actions {
            let button = egui::Button::new(action.name).shortcut_text(action.keys);
            if ui.add(button).clicked() {
                action.run(self, ctx);
            }
        }
    }

    fn file_menu(&mut self, ui: &mut egui::Ui, ctx: &egui::Context) {
        ui.menu_button("Open recent", |ui| self.recent_menu(ui, ctx));
        self.items(ui, ctx, actions::FILE);
    }

    fn edit_menu(&mut self, ui: &mut egui::Ui, ctx: &egui::Context) {
        let history = self.workspace.model().map(cotan_workspace::Model::history);
        let undo = history.and_then(|h| h.undo_label()).map(str::to_owned);
        let redo = history.and_then(|h| h.redo_label()).map(str::to_owned);
        // The first two of the list, with the names of the steps.
        for (label, action) in [undo, redo].into_iter().zip(actions::EDIT) {
            let name = label.as_deref().unwrap_or_default();
            let button = egui::Button::new(format!("{} {name}", action.name));
            let button = button.shortcut_text(action.keys);
            if ui.add_enabled(label.is_some(), button).clicked() {
                action.run(self, ctx);
            }
        }
        ui.menu_button("History", |ui| self.history_menu(ui));
        ui.separator();
        self.items(ui, ctx, &actions::EDIT[2..]);
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

    fn select_menu(&mut self, ui: &mut egui::Ui, ctx: &egui::Context) {
        self.items(ui, ctx, actions::SELECT);
        ui.separator();
        self.items(ui, ctx, actions::HIDE);
        let names: Vec<String> = self.scene().map_or_else(Vec::new, |scene| {
            let handles = scene.handles().iter();
            handles.map(|g| format!("Vertices of {}", g.name)).collect()
        });
        if !names.is_empty() {
            ui.separator();
        }
        for (handle, name) in names.into_iter().enumerate() {
            if ui.button(name).clicked() {
                self.run(Command::SelectHandle { handle });
            }
        }
    }

    fn view_menu(&mut self, ui: &mut egui::Ui, ctx: &egui::Context) {
        self.items(ui, ctx, actions::VIEW);
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
                let num_hidden = self.scene().map_or(0, |scene| scene.hidden().len());
                if num_hidden > 0 {
                    ui.label(format!("{num_hidden} hidden"));
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
