//! Dialogs: questions and messages.

use cotan_io::printable;
use eframe::egui;
use egui_file_dialog::FileDialog;

use cotan_workspace::files::{LeftBehind, is_project};
use cotan_workspace::{Command, Over};

use super::Editor;
use super::files::Then;
use super::palette::Palette;

/// The open dialogs.
pub(super) struct Dialogs {
    /// The messages, shown one after the other.
    messages: Vec<Message>,
    question: Option<Question>,
    files: FileDialog,
    purpose: Purpose,
    pub(super) has_help: bool,
    /// The palette, if it is open.
    pub(super) palette: Option<Palette>,
    /// A warning with its ways out, which does not stop anything.
    pub(super) offer: Option<(String, Vec<(&'static str, Command)>)>,
    /// True once the hints for the first handle were followed, or closed.
    pub(super) is_hint_closed: bool,
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
    /// A command needs a confirmation.
    Proceed { reason: String, command: Command },
    /// A crash left work behind.
    Recover(Vec<LeftBehind>),
}

/// The purpose of the file dialog.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Purpose {
    Open,
    SaveModel,
    ExportMesh,
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
            purpose: Purpose::Open,
            has_help: false,
            palette: None,
            offer: None,
            is_hint_closed: false,
            note: None,
        }
    }

    /// Returns `true` if a dialog is waiting for an answer.
    pub(super) fn is_open(&self) -> bool {
        !self.messages.is_empty()
            || self.question.is_some()
            || self.is_choosing()
            || self.has_help
            || self.palette.is_some()
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
            (Some(Question::Proceed { reason, .. }), _) => reason,
            (Some(Question::Recover(_)), _) => "recover",
            _ if self.has_help => "help",
            _ if self.palette.is_some() => "palette",
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
        let model = self.workspace.model();
        let path = model
            .map(|model| model.file().path.clone())
            .unwrap_or_default();
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let mut dialog = FileDialog::new();
        let has_file = model.is_some_and(cotan_workspace::Model::has_file);
        if let Some(folder) = path.parent().filter(|f| f.is_dir() && has_file) {
            dialog = dialog.initial_directory(folder.to_owned());
        }
        let has_more = model.is_some_and(|model| {
            let props = &model.scene().props;
            !(props.handles.is_empty() && props.masks.is_empty())
        });
        let known = vec!["cotan", "obj", "ply", "off", "stl", "gltf", "glb", "gz"];
        dialog = match purpose {
            Purpose::Open => dialog
                .title("Open a mesh or a project")
                .add_file_filter_extensions("Meshes and projects", known)
                .default_file_filter("Meshes and projects"),
            // Only a project keeps handles and masks.
            Purpose::SaveModel if has_more && !is_project(&path) => dialog
                .title("Save as a project (.cotan) or a mesh")
                .default_file_name(&format!("{stem}.cotan")),
            Purpose::SaveModel => dialog
                .title("Save as a project (.cotan) or a mesh")
                .default_file_name(&name),
            Purpose::ExportMesh => dialog
                .title("Export the mesh (.obj .ply .off .stl .gltf .glb)")
                .default_file_name(&format!("{stem}-edited.obj")),
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
            Purpose::Open | Purpose::OpenHandles => dialog.pick_file(),
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
            let over = Over::Own;
            match self.dialogs.purpose {
                Purpose::Open => self.run(Command::Open { path }),
                Purpose::SaveModel => self.run(Command::SaveAs { path, over }),
                Purpose::ExportMesh => self.run(Command::ExportMesh { path, over }),
                Purpose::OpenHandles => self.run(Command::ImportHandles { path }),
                Purpose::SaveHandles => self.run(Command::ExportHandles { path }),
                Purpose::SavePicture => self.request_picture(ctx, path),
            }
        }
        if self.dialogs.has_help {
            self.help(ctx);
        }
        self.show_palette(ctx);
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
                self.losses(),
                ["Save", "Discard", "Cancel"],
            ),
            Question::Proceed {
                reason,
                command: Command::OpenRepaired { .. },
            } => (
                "Open it repaired?",
                reason.clone(),
                ["Open repaired", "", "Cancel"],
            ),
            Question::Proceed { reason, .. } => (
                "Replace the file?",
                reason.clone(),
                ["Replace", "Save as…", "Cancel"],
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
                    "Recover unsaved work?",
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
                self.run(Command::Save);
                // A save that failed or asks for a path has not saved the changes yet.
                if !self.workspace.is_changed() {
                    self.go_on(ctx, then);
                }
            }
            (Question::Unsaved(then), 1) => {
                self.run(Command::Discard);
                self.go_on(ctx, then);
            }
            (Question::Proceed { command, .. }, 0) => self.run(command),
            (Question::Proceed { command, .. }, 1) => self.choose(match command {
                Command::ExportMesh { .. } => Purpose::ExportMesh,
                _ => Purpose::SaveModel,
            }),
            (Question::Recover(left), 0) => self.recover(ctx, left),
            (Question::Recover(left), 1) => self.throw_away(left),
            _ => {}
        }
    }

    /// Restores work that was left behind, the newest first.
    fn recover(&mut self, ctx: &egui::Context, mut left: Vec<LeftBehind>) {
        if left.is_empty() {
            return;
        }
        match self.workspace.recover(left.remove(0)) {
            Ok(effects) => self.show_effects(effects),
            Err(problem) => self.tell(Message::error(problem)),
        }
        if !left.is_empty() {
            self.ask(Question::Recover(left));
        }
        ctx.request_repaint();
    }

    fn throw_away(&mut self, left: Vec<LeftBehind>) {
        for one in left {
            if let Err(error) = one.remove() {
                self.tell(Message::note(error.to_string()));
            }
        }
    }

    /// Shows the list of keys on top of everything else.
    fn help(&mut self, ctx: &egui::Context) {
        let modal = egui::Modal::new(egui::Id::new("help")).show(ctx, |ui| {
            ui.heading("Keys and pointer");
            ui.add_space(6.0);
            let height = (ctx.content_rect().height() - 140.0).max(120.0);
            egui::ScrollArea::vertical()
                .max_height(height)
                .show(ui, |ui| {
                    let grid = egui::Grid::new("keys").num_columns(2).striped(true);
                    grid.show(ui, |ui| {
                        for (keys, what) in super::keys::HELP {
                            ui.label(egui::RichText::new(*keys).strong());
                            ui.label(*what);
                            ui.end_row();
                        }
                    });
                });
            ui.add_space(6.0);
            ui.label("While you drag a handle, the shape follows. When you release it, the shape is solved to convergence.");
        });
        if modal.should_close() {
            self.dialogs.has_help = false;
        }
    }
}
