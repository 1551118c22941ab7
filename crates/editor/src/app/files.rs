//! Opening, closing and dropped files: what has to be asked first.

use std::path::PathBuf;

use cotan_workspace::Command;
use eframe::egui;

use super::Editor;
use super::dialogs::{Purpose, Question};

/// The action that follows once the unsaved changes are dealt with.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Then {
    Close,
    ChooseFile,
    Open(PathBuf),
    OpenSample,
    /// Opens the file of the model again, repaired.
    OpenRepaired,
}

impl Editor {
    /// Runs an action, after asking about unsaved changes if there are any.
    pub(super) fn after_saving(&mut self, ctx: &egui::Context, then: Then) {
        match self.workspace.is_changed() {
            true => self.ask(Question::Unsaved(then)),
            false => self.go_on(ctx, then),
        }
    }

    pub(super) fn go_on(&mut self, ctx: &egui::Context, then: Then) {
        match then {
            Then::Close => {
                self.is_closing = true;
                ctx.send_viewport_cmd(egui::ViewportCommand::Close);
            }
            Then::ChooseFile => self.choose(Purpose::Open),
            Then::Open(path) => self.run(Command::Open { path }),
            Then::OpenSample => self.run(Command::OpenSample),
            Then::OpenRepaired => {
                let model = self.workspace.model();
                if let Some(path) = model.map(|model| model.file().path.clone()) {
                    self.run(Command::OpenRepaired { path });
                }
            }
        }
    }

    /// Asks about unsaved changes before the window closes, and opens a dropped file.
    pub(super) fn close_if_asked(&mut self, ctx: &egui::Context) {
        let is_asked = ctx.input(|i| i.viewport().close_requested());
        if is_asked && !self.is_closing && self.workspace.is_changed() {
            ctx.send_viewport_cmd(egui::ViewportCommand::CancelClose);
            self.ask(Question::Unsaved(Then::Close));
        }
        let dropped = ctx.input(|i| i.raw.dropped_files.iter().find_map(|f| f.path.clone()));
        if let Some(path) = dropped {
            self.after_saving(ctx, Then::Open(path));
        }
    }

    /// A sentence that names the losses of closing the model.
    pub(super) fn losses(&self) -> String {
        let losses = self.workspace.model().map(cotan_workspace::Model::losses);
        format!("Not saved: {}.", losses.unwrap_or_default().join("; "))
    }
}
