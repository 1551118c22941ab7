//! The window: the workspace and its picture.

mod actions;
mod dialogs;
mod drag;
mod files;
mod job_pages;
mod keys;
mod measuring;
mod menu;
mod numbers;
mod pages;
mod palette;
mod panels;
mod picture;
mod pointer;
mod shown;
mod start;
mod tints;
mod trace;
mod typing;
mod viewport;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use cotan_workspace::{Command, Effect, Notice, Scene, Workspace, files::folder};
use eframe::egui;

pub use trace::Trace;

use dialogs::{Dialogs, Message, Question};
use measuring::Measuring;
use pages::Pages;
use pointer::Pointer;
use shown::Shown;

/// The arguments that the program was started with.
#[derive(Debug, Default)]
pub struct Startup {
    /// The mesh or project to open, or the sample if there is none.
    pub mesh: Option<PathBuf>,
    /// A file of handles to put on the mesh.
    pub handles: Option<PathBuf>,
    /// The trace that records every frame, for tests and measurements.
    pub trace: Option<Trace>,
    /// Enables keys that crash the program on purpose, for tests of crash recovery.
    pub breakable: bool,
}

/// The editor.
pub struct Editor {
    workspace: Workspace,
    /// Measurements of the shape on the screen.
    measuring: Measuring,
    /// The picture of the model.
    shown: Shown,
    /// The tools of the pointer, and what it holds.
    pointer: Pointer,
    /// The side panel.
    pages: Pages,
    dialogs: Dialogs,
    startup: Startup,
    /// `true` once the window may close.
    is_closing: bool,
    /// The current window title.
    ///
    /// It is set only when it changes, because setting it requests a redraw.
    title: String,
}

impl Editor {
    /// Makes the editor in eframe's window.
    ///
    /// # Errors
    /// One sentence: OpenGL is missing, or a thread cannot be started.
    pub fn new(cc: &eframe::CreationContext<'_>, startup: Startup) -> Result<Self, String> {
        let gl = cc.gl.as_ref().ok_or("the window has no OpenGL")?;
        let no_thread = |e: std::io::Error| format!("cannot start a thread: {e}");
        let repaint = |ctx: &egui::Context| {
            let ctx = ctx.clone();
            move || ctx.request_repaint()
        };
        let mut editor = Self {
            workspace: Workspace::start(repaint(&cc.egui_ctx)).map_err(no_thread)?,
            measuring: Measuring::start(repaint(&cc.egui_ctx)).map_err(no_thread)?,
            shown: Shown::new(gl)?,
            pointer: Pointer::default(),
            pages: Pages::default(),
            dialogs: Dialogs::new(),
            startup,
            is_closing: false,
            title: String::new(),
        };
        editor.start_journal();
        editor.run(match editor.startup.mesh.clone() {
            Some(path) => Command::Open { path },
            None => Command::OpenSample,
        });
        Ok(editor)
    }

    /// Starts the journal, and offers what ended processes have left.
    fn start_journal(&mut self) {
        let listing = folder().and_then(|folder| self.workspace.keep_journal(&folder));
        match listing {
            Ok(listing) => {
                let problems = listing.problems.iter().take(MOST_TOLD);
                problems.for_each(|p| self.tell(Message::note(p.to_string())));
                if !listing.left.is_empty() {
                    self.ask(Question::Recover(listing.left));
                }
            }
            Err(error) => self.tell(Message::note(format!(
                "{error}. Unsaved work will be lost if the editor crashes."
            ))),
        }
    }

    /// Carries out a command and shows its effects.
    fn run(&mut self, command: Command) {
        let effects = self.workspace.apply(command);
        self.show_effects(effects);
    }

    fn show_effects(&mut self, effects: Vec<Effect>) {
        for effect in effects {
            match effect {
                Effect::Opened(tree) => self.show_model(*tree),
                Effect::Marked => self.tint(),
                Effect::Told(Notice::Error(text)) => self.tell(Message::error(text)),
                Effect::Told(Notice::Note(text)) => self.tell(Message::note(text)),
                Effect::Mentioned(text) => self.dialogs.note = Some(text),
                Effect::Asked { reason, command } => {
                    self.ask(Question::Proceed { reason, command });
                }
                Effect::Offered { text, ways } => self.dialogs.offer = Some((text, ways)),
                Effect::AskedForFile => self.choose(dialogs::Purpose::SaveModel),
                Effect::Written(path) => {
                    self.dialogs.note = Some(format!("saved {}", path.display()));
                }
                _ => {}
            }
        }
    }

    /// Shows a model that was opened.
    fn show_model(&mut self, tree: cotan::geometry::TriangleTree) {
        let Some(model) = self.workspace.model() else {
            return;
        };
        self.shown.open(model, tree);
        self.measuring.forget();
        self.pointer.forget();
        self.pages.forget();
        self.dialogs.offer = None;
        self.tint();
        if let Some(path) = self.startup.handles.take() {
            self.run(Command::ImportHandles { path });
        }
    }

    fn scene(&self) -> Option<&Scene> {
        self.workspace.scene()
    }

    /// Collects the results of the threads and brings the picture up to date.
    fn collect(&mut self, ctx: &egui::Context) {
        let effects = self.workspace.poll();
        if let Some(arrival) = self.workspace.take_arrival() {
            if self.workspace.morph().is_none() && !self.shown.looks.is_before {
                self.shown.draw(&arrival.shape, &arrival.normals);
            }
            if let Some(trace) = &mut self.startup.trace {
                trace.taken(arrival.tag, arrival.times);
            }
        }
        self.show_effects(effects);
        if let Some(reading) = self.measuring.take() {
            self.shown.set_colors(reading);
        }
        if let (Some(shape), Some(model)) = (self.workspace.shown(), self.workspace.model()) {
            let shape = match self.shown.looks.is_before {
                true => model.original(),
                false => shape,
            };
            self.shown.bring_up_to_date(model, shape);
            let is_moving =
                self.workspace.solver().state().0 == cotan_workspace::solver::State::Running;
            if let Some(wait) = self.measuring.ask(model, shape, is_moving) {
                ctx.request_repaint_after(wait);
            }
        }
    }

    fn title(&self) -> String {
        let Some(model) = self.workspace.model() else {
            return "cotan".to_owned();
        };
        let name = model.file().path.file_name().unwrap_or_default();
        let mark = if model.is_changed() { "*" } else { "" };
        format!("{}{mark} – cotan", name.to_string_lossy())
    }

    fn show_title(&mut self, ctx: &egui::Context) {
        let title = self.title();
        if title != self.title {
            let shown = cotan_io::printable(&title).into_owned();
            ctx.send_viewport_cmd(egui::ViewportCommand::Title(shown));
            self.title = title;
        }
    }
}

impl eframe::App for Editor {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        let begin = Instant::now();
        let ctx = ui.ctx().clone();
        self.collect(&ctx);
        self.keys(&ctx);
        self.menu(ui);
        self.status(ui);
        self.panels(ui);
        self.viewport(ui);
        self.show_dialogs(&ctx);
        self.close_if_asked(&ctx);
        self.show_title(&ctx);
        if self.workspace.job().is_some() {
            ctx.request_repaint_after(Duration::from_millis(100));
        }
        self.write_trace(&ctx, begin);
    }

    fn on_exit(&mut self, _gl: Option<&eframe::glow::Context>) {
        // A regular exit: changes that were not saved were discarded deliberately.
        let _ = self.workspace.apply(Command::Discard);
    }
}

/// The largest number of problems shown at the start.
const MOST_TOLD: usize = 10;
