//! Dialogs: questions and messages.

use std::path::PathBuf;

use cotan_io::printable;
use eframe::egui;
use egui_file_dialog::FileDialog;

use super::Editor;
use super::actions::Repairs;
use crate::files::{Expect, LeftBehind};

/// The open dialogs.
pub(super) struct Dialogs {
    /// The messages, shown one after the other.
    messages: Vec<Message>,
    question: Option<Question>,
    files: FileDialog,
    purpose: Purpose,
    pub(super) has_help: bool,
    /// A line in the status bar, such as the reason why a method was chosen.
    pub(super) note: Option<String>,
}

/// A message to the user.
pub(super) struct Message {
    title: &'static str,
    text: String,
}

impl Message {
    pub(super) fn error(text: String) -> Self {
        Self::of("That did not work", &text)
    }

    pub(super) fn note(text: String) -> Self {
        Self::of("Please note", &text)
    }

    /// Makes a message whose text may contain parts of a file. Each line is made printable.
    fn of(title: &'static str, text: &str) -> Self {
        let lines: Vec<_> = text.lines().map(printable).collect();
        let text = lines.join("\n");
        Self { title, text }
    }
}

/// A question to the user.
pub(super) enum Question {
    /// There are unsaved changes; holds the action that raised the question.
    Unsaved(Then),
    /// Saving would replace a file: the reason and the path.
    Replace(String, PathBuf),
    /// A mesh can only be opened with repairs: the reason and the path.
    Repair(String, PathBuf),
    /// A crash left work behind.
    Recover(Vec<LeftBehind>),
}

/// The action that follows once the unsaved changes are dealt with.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Then {
    Close,
    ChooseFile,
    Open(PathBuf),
    OpenSample,
}

/// The purpose of the file dialog.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Purpose {
    OpenMesh,
    SaveMesh,
    OpenHandles,
    SaveHandles,
    SavePicture,
}

impl Dialogs {
    pub(super) fn new() -> Self {
        Self {
            messages: Vec::new(),
            question: None,
            files: FileDialog::new(),
            purpose: Purpose::OpenMesh,
            has_help: false,
            note: None,
        }
    }

    /// Returns `true` if a dialog is waiting for an answer.
    pub(super) fn is_open(&self) -> bool {
        !self.messages.is_empty() || self.question.is_some() || self.is_choosing() || self.has_help
    }

    fn is_choosing(&self) -> bool {
        matches!(self.files.state(), egui_file_dialog::DialogState::Open)
    }

    /// The name of the open dialog, for the trace.
    pub(super) fn name(&self) -> &str {
        match (&self.question, self.messages.first()) {
            _ if self.is_choosing() => "files",
            (_, Some(message)) => &message.text,
            (Some(Question::Unsaved(_)), _) => "unsaved",
            (Some(Question::Replace(text, _)), _) => text,
            (Some(Question::Repair(text, _)), _) => text,
            (Some(Question::Recover(_)), _) => "recover",
            _ if self.has_help => "help",
            _ => "",
        }
    }
}

impl Editor {
    pub(super) fn tell(&mut self, message: Message) {
        self.dialogs.messages.push(message);
    }

    pub(super) fn ask(&mut self, question: Question) {
        self.dialogs.question = Some(question);
    }

    /// Opens the file dialog.
    pub(super) fn choose(&mut self, purpose: Purpose) {
        let open = self.open.as_ref();
        let path = open.map(|open| open.mesh.path.clone()).unwrap_or_default();
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let mut dialog = FileDialog::new();
        if let Some(folder) = path.parent().filter(|f| f.is_dir() && self.has_file()) {
            dialog = dialog.initial_directory(folder.to_owned());
        }
        let meshes = vec!["obj", "ply", "off", "stl", "gltf", "glb", "gz"];
        dialog = match purpose {
            Purpose::OpenMesh => dialog
                .title("Open a mesh")
                .add_file_filter_extensions("Meshes", meshes)
                .default_file_filter("Meshes"),
            Purpose::SaveMesh => {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                dialog
                    .title("Save the mesh (.obj .ply .off .stl .gltf .glb)")
                    .default_file_name(&name)
            }
            Purpose::OpenHandles => dialog
                .title("Load handles")
                .add_file_filter_extensions("Handles", vec!["json", "txt", "sel"]),
            Purpose::SaveHandles => dialog
                .title("Save the handles, for cotan deform")
                .default_file_name(&format!("{stem}-handles.json")),
            Purpose::SavePicture => dialog
                .title("Save the picture")
                .default_file_name(&format!("{stem}.png")),
        };
        // The code that writes the file asks before it replaces one.
        dialog.config_mut().allow_file_overwrite = true;
        match purpose {
            Purpose::OpenMesh | Purpose::OpenHandles => dialog.pick_file(),
            _ => dialog.save_file(),
        }
        self.dialogs.files = dialog;
        self.dialogs.purpose = purpose;
    }

    pub(super) fn show_dialogs(&mut self, ctx: &egui::Context) {
        if self.dialogs.is_choosing() {
            self.dialogs.files.update(ctx);
        }
        if let Some(path) = self.dialogs.files.take_picked() {
            match self.dialogs.purpose {
                Purpose::OpenMesh => self.open_path(ctx, path, Repairs::No),
                Purpose::SaveMesh => self.save_mesh(path, None),
                Purpose::OpenHandles => self.load_handles(&path),
                Purpose::SaveHandles => self.save_handles(&path),
                Purpose::SavePicture => self.request_picture(ctx, path),
            }
        }
        if self.dialogs.has_help {
            self.help(ctx);
        }
        if self.show_message(ctx) {
            return;
        }
        if let Some(question) = self.dialogs.question.take() {
            self.show_question(ctx, question);
        }
    }

    /// Shows the oldest message, if there is one.
    fn show_message(&mut self, ctx: &egui::Context) -> bool {
        let Some(message) = self.dialogs.messages.first() else {
            return false;
        };
        let mut is_read = false;
        let mut ok = egui::Rect::NOTHING;
        let modal = egui::Modal::new(egui::Id::new("message")).show(ctx, |ui| {
            ui.set_max_width(420.0);
            ui.heading(message.title);
            ui.add_space(6.0);
            ui.label(&message.text);
            ui.add_space(10.0);
            let button = ui.button("OK");
            ok = button.rect;
            is_read = button.clicked() || ui.input(|i| i.key_pressed(egui::Key::Enter));
        });
        self.mark("ok", ok);
        if is_read || modal.should_close() {
            self.dialogs.messages.remove(0);
        }
        true
    }

    fn show_question(&mut self, ctx: &egui::Context, question: Question) {
        let (title, text, answers) = match &question {
            Question::Unsaved(_) => (
                "Save your changes?",
                "The mesh was changed since it was last saved.".to_owned(),
                ["Save", "Discard", "Cancel"],
            ),
            Question::Replace(text, _) => (
                "Replace the file?",
                text.clone(),
                ["Replace", "Save as…", "Cancel"],
            ),
            Question::Repair(text, _) => (
                "Open it repaired?",
                text.clone(),
                ["Open repaired", "", "Cancel"],
            ),
            Question::Recover(left) => {
                let one = left.first().map(|l| l.mesh.display().to_string());
                let more = match left.len() {
                    0 | 1 => String::new(),
                    n => format!(" ({} more after it)", n - 1),
                };
                let text = format!(
                    "The editor ended before your work on {}{more} was saved.",
                    one.unwrap_or_default()
                );
                (
                    "Go on where you were?",
                    text,
                    ["Recover", "Throw away", "Later"],
                )
            }
        };
        let mut answer = None;
        let mut marks = Vec::new();
        let modal = egui::Modal::new(egui::Id::new("question")).show(ctx, |ui| {
            ui.set_max_width(420.0);
            ui.heading(title);
            ui.add_space(6.0);
            ui.label(printable(&text));
            ui.add_space(10.0);
            ui.horizontal(|ui| {
                for (k, label) in answers.iter().enumerate().filter(|(_, l)| !l.is_empty()) {
                    let button = ui.button(*label);
                    marks.push((format!("answer-{k}"), button.rect));
                    if button.clicked() {
                        answer = Some(k);
                    }
                }
            });
        });
        for (name, rect) in marks {
            self.mark(&name, rect);
        }
        match answer {
            Some(answer) => self.answer(ctx, question, answer),
            // Escape, or a click outside of the dialog.
            None if modal.should_close() => self.answer(ctx, question, 2),
            None => self.dialogs.question = Some(question),
        }
    }

    fn answer(&mut self, ctx: &egui::Context, question: Question, answer: usize) {
        match (question, answer) {
            (Question::Unsaved(then), 0) => {
                self.save();
                // A save that failed or asks for a path has not saved the changes yet.
                if !self.is_changed() {
                    self.go_on(ctx, then);
                }
            }
            (Question::Unsaved(then), 1) => {
                self.discard();
                self.go_on(ctx, then);
            }
            (Question::Replace(_, path), 0) => self.save_mesh(path, Some(Expect::Anything)),
            (Question::Replace(..), 1) => self.choose(Purpose::SaveMesh),
            (Question::Repair(_, path), 0) => self.open_path(ctx, path, Repairs::Safe),
            (Question::Recover(left), 0) => self.recover(ctx, left),
            (Question::Recover(left), 1) => self.throw_away(left),
            _ => {}
        }
    }

    /// Shows the list of keys on top of everything else.
    fn help(&mut self, ctx: &egui::Context) {
        let modal = egui::Modal::new(egui::Id::new("help")).show(ctx, |ui| {
            ui.heading("Keys and pointer");
            ui.add_space(6.0);
            egui::Grid::new("keys")
                .num_columns(2)
                .striped(true)
                .show(ui, |ui| {
                    for (keys, what) in super::keys::HELP {
                        ui.label(egui::RichText::new(*keys).strong());
                        ui.label(*what);
                        ui.end_row();
                    }
                });
            ui.add_space(6.0);
            ui.label("A held handle pulls the shape along; let go of, the shape comes to rest.");
        });
        if modal.should_close() {
            self.dialogs.has_help = false;
        }
    }
}
