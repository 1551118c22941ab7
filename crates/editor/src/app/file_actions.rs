//! Files: meshes, handles, pictures and autosaves.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use cotan::geometry::{Positions, Surface};
use cotan_io::{Document, Limits};
use cotan_tool::handles_file::{Group, HandlesFile, groups_in_file, to_json};
use cotan_tool::paths::Paths;
use eframe::egui;
use serde_json::json;

use super::actions::{Repairs, TaskResult};
use super::dialogs::{Message, Purpose, Question, Then};
use super::{Editor, Open};
use crate::files::{
    self, Autosave, Expect, LeftBehind, OpenedMesh, Record, Recovered, SaveError, folder, list,
};
use crate::handle_groups::{groups_of, handles_of};
use crate::rescue;
use crate::scene::{History, Scene};
use crate::view::{Camera, Picker};

impl Editor {
    pub(super) fn has_file(&self) -> bool {
        self.open.as_ref().is_some_and(|open| open.has_file)
    }

    /// Runs an action, after asking about unsaved changes if there are any.
    pub(super) fn after_saving(&mut self, ctx: &egui::Context, then: Then) {
        match self.is_changed() {
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
            Then::ChooseFile => self.choose(Purpose::OpenMesh),
            Then::Open(path) => self.open_path(ctx, path, Repairs::No),
            Then::OpenSample => self.open_sample(),
        }
    }

    /// Asks about unsaved changes before the window closes, and opens a dropped file.
    pub(super) fn close_if_asked(&mut self, ctx: &egui::Context) {
        let is_asked = ctx.input(|i| i.viewport().close_requested());
        if is_asked && !self.is_closing && self.is_changed() {
            ctx.send_viewport_cmd(egui::ViewportCommand::CancelClose);
            self.ask(Question::Unsaved(Then::Close));
        }
        let dropped = ctx.input(|i| i.raw.dropped_files.iter().find_map(|f| f.path.clone()));
        if let Some(path) = dropped {
            self.after_saving(ctx, Then::Open(path));
        }
    }

    /// Opens a mesh in a background task.
    pub(super) fn open_path(&mut self, ctx: &egui::Context, path: PathBuf, repairs: Repairs) {
        self.start_task(ctx, "Opening", move |_| {
            let opened = match repairs {
                Repairs::No => files::open(&path),
                Repairs::Safe => files::open_repaired(&path),
            };
            Ok(match opened {
                Ok(mesh) => {
                    let surface = &mesh.processing;
                    let picker = Picker::new(surface.mesh(), surface.positions());
                    TaskResult::Opened(Box::new(mesh), Box::new(picker))
                }
                Err(error) => {
                    let repairable = error.is_repairable().then(|| path.clone());
                    TaskResult::NotOpened(error.to_string(), repairable)
                }
            })
        });
    }

    pub(super) fn not_opened(&mut self, problem: String, repairable: Option<PathBuf>) {
        match repairable {
            Some(path) => self.ask(Question::Repair(problem, path)),
            None => self.tell(Message::error(problem)),
        }
    }

    /// Opens the sample.
    ///
    /// It is stored in the user's data folder so that the autosave works for it too; saving asks
    /// for another path.
    pub(super) fn open_sample(&mut self) {
        let sample = || -> Result<OpenedMesh, String> {
            let shape = cotan::shapes::creature::<f64>(64);
            let document = Document::from_mesh(shape.connectivity(), shape.positions())
                .map_err(|e| e.to_string())?;
            let folder = folder().map_err(|e| e.to_string())?;
            let path = folder.with_file_name("sample.obj");
            if let Some(folder) = path.parent() {
                std::fs::create_dir_all(folder).map_err(|e| e.to_string())?;
            }
            cotan_io::save(&document, &path).map_err(|e| e.to_string())?;
            files::open(&path).map_err(|e| e.to_string())
        };
        match sample() {
            Ok(mesh) => {
                self.show_mesh(mesh);
                if let Some(open) = &mut self.open {
                    open.has_file = false;
                }
            }
            Err(problem) => self.tell(Message::error(problem)),
        }
    }

    pub(super) fn opened(&mut self, mesh: OpenedMesh, picker: Picker) {
        let mut told: Vec<String> = mesh.warnings.iter().take(MOST_TOLD).cloned().collect();
        let changes = mesh.changes.iter().map(ToString::to_string);
        told.extend(changes.take(MOST_TOLD));
        if !told.is_empty() {
            self.tell(Message::note(told.join("\n")));
        }
        self.show_mesh(mesh);
        if let Some(shape) = self.displayed() {
            self.pick.know(shape, picker);
        }
        if let Some(handles) = self.startup.handles.take() {
            self.load_handles(&handles);
        }
    }

    /// Shows a newly opened mesh in the window.
    fn show_mesh(&mut self, mesh: OpenedMesh) {
        self.cancel_task();
        let positions = Arc::new(mesh.processing.positions().clone());
        let surface = Surface::assume_checked(mesh.processing.mesh(), &positions);
        self.camera = Camera::new(&surface.bounding_box());
        crate::newest::lock(&self.renderer).set_mesh(mesh.processing.mesh());
        self.drawn = None;
        self.solver_shape = None;
        self.reading = None;
        self.measured = None;
        self.selection.clear();
        self.active = None;
        self.drag = None;
        self.jobs.map = None;
        self.jobs.base = None;
        self.pick.forget();
        self.open = Some(Open {
            original: Arc::clone(&positions),
            saved: (0, Arc::clone(&positions)),
            history: History::new(Scene::new(positions)),
            mesh,
            has_file: true,
        });
        self.tint();
        self.show_as_is();
    }

    // Saving.

    /// Saves to the open file, or asks for a path.
    pub(super) fn save(&mut self) {
        match &self.open {
            Some(open) if open.has_file => {
                let path = open.mesh.path.clone();
                let expect = Expect::Unchanged(open.mesh.fingerprint);
                self.save_mesh(path, Some(expect));
            }
            Some(_) => self.choose(Purpose::SaveMesh),
            None => {}
        }
    }

    pub(super) fn save_mesh(&mut self, path: PathBuf, expect: Option<Expect>) {
        let Some(open) = &mut self.open else {
            return;
        };
        // The shape itself, even while the picture shows a morph to the sphere.
        let shape = Arc::clone(&open.history.present().shape);
        let expect = expect.unwrap_or(match path == open.mesh.path && open.has_file {
            true => Expect::Unchanged(open.mesh.fingerprint),
            false => Expect::Absent,
        });
        let mesh = &open.mesh;
        match files::save(&mesh.document, &mesh.processing, &shape, &path, expect) {
            Ok(saved) => {
                let mut told = saved.losses;
                if let Some(format) = cotan_io::Format::from_path(&path) {
                    told.extend(files::forgotten(format, &mesh.changes));
                }
                open.mesh.path = path;
                open.mesh.fingerprint = saved.fingerprint;
                open.has_file = true;
                open.saved = (open.history.position(), shape);
                if let Some(autosave) = &self.autosave {
                    // The autosave is now older than the file. If it cannot be removed, it is
                    // merely offered once more.
                    let _ = autosave.remove();
                    self.autosaved.1 = None;
                }
                if !told.is_empty() {
                    self.tell(Message::note(told.join("\n")));
                }
            }
            Err(error) => self.not_saved(&error, path),
        }
    }

    fn not_saved(&mut self, error: &SaveError, path: PathBuf) {
        match error.is_overridable() {
            true => self.ask(Question::Replace(error.to_string(), path)),
            false => self.tell(Message::error(error.to_string())),
        }
    }

    /// Marks the unsaved changes as discarded.
    pub(super) fn discard(&mut self) {
        if let Some(open) = &mut self.open {
            let shape = Arc::clone(&open.history.present().shape);
            open.saved = (open.history.position(), shape);
        }
        if let Some(autosave) = &self.autosave {
            let _ = autosave.remove();
            self.autosaved.1 = None;
        }
    }

    // Handles.

    pub(super) fn save_handles(&mut self, path: &Path) {
        let Some(open) = &self.open else {
            return;
        };
        let scene = open.history.present();
        let mesh = &open.mesh;
        let mut groups = groups_of(&scene.handles, &mesh.processing);
        if let Some(file) = &mesh.file_vertices {
            match groups_in_file(&groups, &mesh.document, &mesh.processing, file) {
                Ok(in_file) => groups = in_file,
                Err(error) => {
                    return self.tell(Message::error(format!("{}: {error}", path.display())));
                }
            }
        }
        if let Err(problem) = self.write_beside("the handles", path, to_json(&groups).as_bytes()) {
            return self.tell(Message::error(problem));
        }
        if *scene.rest != *mesh.processing.positions() {
            self.tell(Message::note(
                "The mesh was smoothed or morphed since it was opened. These handles go with the \
                 shape that it was made into, not with the file that was opened."
                    .to_owned(),
            ));
        }
    }

    /// Writes a file, refusing to overwrite the open mesh.
    fn write_beside(&self, name: &str, path: &Path, bytes: &[u8]) -> Result<(), String> {
        let mut paths = Paths::default();
        if let Some(open) = self.open.as_ref().filter(|open| open.has_file) {
            paths.read("the mesh", &open.mesh.path);
        }
        paths.write(name, path);
        paths.check().map_err(|e| e.to_string())?;
        cotan_tool::files::write(path, bytes).map_err(|e| e.to_string())
    }

    pub(super) fn load_handles(&mut self, path: &Path) {
        let Some(open) = &self.open else {
            return;
        };
        let mesh = &open.mesh;
        let file = HandlesFile {
            path,
            def: None,
            max_bytes: Limits::default().max_bytes,
        };
        let read = file.read_groups(
            &mesh.document,
            &mesh.processing,
            mesh.file_vertices.as_ref(),
        );
        match read {
            Ok(groups) => {
                let rest = &open.history.present().rest;
                let handles = handles_of(&groups, &mesh.processing, rest);
                self.load_groups(handles);
            }
            Err(error) => self.tell(Message::error(error.to_string())),
        }
    }

    // Pictures.

    /// Requests a screenshot of the window, which arrives in a later frame.
    pub(super) fn request_picture(&mut self, ctx: &egui::Context, path: PathBuf) {
        let data = egui::UserData::new(path);
        ctx.send_viewport_cmd(egui::ViewportCommand::Screenshot(data));
    }

    /// Writes the part of the screenshot that shows the mesh.
    pub(super) fn take_picture(&mut self, ctx: &egui::Context, rect: egui::Rect) {
        let taken = ctx.input(|i| {
            i.events.iter().find_map(|event| match event {
                egui::Event::Screenshot {
                    image, user_data, ..
                } => {
                    let path = user_data.data.as_ref()?.downcast_ref::<PathBuf>()?;
                    Some((Arc::clone(image), path.clone()))
                }
                _ => None,
            })
        });
        let Some((image, path)) = taken else {
            return;
        };
        let part = image.region(&rect, Some(ctx.pixels_per_point()));
        let written = png_of(&part)
            .map_err(|e| e.to_string())
            .and_then(|bytes| self.write_beside("the picture", &path, &bytes));
        if let Err(problem) = written {
            self.tell(Message::error(problem));
        }
    }

    // Autosaves.

    pub(super) fn start_autosave(&mut self) {
        let started = folder().and_then(|folder| {
            let left = list(&folder);
            let own = Autosave::start(&folder)?;
            Ok((left, own))
        });
        match started {
            Ok((listing, own)) => {
                self.autosave = Some(Arc::new(own));
                let problems = listing.problems.iter().take(MOST_TOLD);
                problems.for_each(|p| self.tell(Message::note(p.to_string())));
                if !listing.left.is_empty() {
                    self.ask(Question::Recover(listing.left));
                }
            }
            Err(error) => self.tell(Message::note(format!(
                "{error}. Until that is mended, a crash takes what is not saved."
            ))),
        }
    }

    /// Autosaves changed work once the interval has passed, and returns the time left until then.
    ///
    /// Also hands the work to `rescue`, which saves it if the program crashes in the meantime.
    pub(super) fn autosave_if_due(&mut self) -> Option<Duration> {
        let is_changed = self.is_changed();
        let (Some(open), Some(autosave)) = (&self.open, &self.autosave) else {
            return None;
        };
        if !is_changed {
            rescue::forget();
            return None;
        }
        let scene = open.history.present();
        let work = rescue::Work {
            mesh: open.mesh.path.clone(),
            fingerprint: open.mesh.fingerprint,
            processing: Arc::clone(&open.mesh.processing),
            handles: Arc::clone(&scene.handles),
            rest: Arc::clone(&scene.rest),
            shape: Arc::clone(&scene.shape),
            has_file: open.has_file,
        };
        rescue::keep(autosave, work.clone());
        let (last, aside) = &self.autosaved;
        // Compares shape and handles, not the history position: the same edit may still converge,
        // and another edit may take its position.
        let is_aside = aside.as_ref().is_some_and(|(shape, handles)| {
            Arc::ptr_eq(shape, &work.shape) && Arc::ptr_eq(handles, &work.handles)
        });
        if self.drag.is_some() || is_aside {
            return None;
        }
        let wait = AUTOSAVE_EVERY.saturating_sub(last.elapsed());
        if !wait.is_zero() {
            return Some(wait);
        }
        if let Err(error) = work.write(autosave) {
            self.dialogs.note = Some(error.to_string());
        }
        self.autosaved = (Instant::now(), Some((work.shape, work.handles)));
        None
    }

    /// Restores work that was left behind, the newest first.
    pub(super) fn recover(&mut self, ctx: &egui::Context, mut left: Vec<LeftBehind>) {
        if left.is_empty() {
            return;
        }
        let first = left.remove(0);
        match recovered(&first) {
            Ok((mesh, found)) => {
                let is_current = first.is_current();
                self.show_mesh(mesh);
                self.restore(&found);
                if !is_current {
                    self.tell(Message::note(format!(
                        "{}: the file was changed since; look before you save over it.",
                        first.mesh.display()
                    )));
                }
                // Autosave the work again before the old file is removed.
                let due = Instant::now().checked_sub(AUTOSAVE_EVERY);
                self.autosaved = (due.unwrap_or_else(Instant::now), None);
                self.autosave_if_due();
                if let Err(error) = first.remove() {
                    self.tell(Message::note(error.to_string()));
                }
            }
            Err(problem) => self.tell(Message::error(problem)),
        }
        if !left.is_empty() {
            self.ask(Question::Recover(left));
        }
        ctx.request_repaint();
    }

    fn restore(&mut self, found: &Recovered) {
        let Some(open) = &mut self.open else {
            return;
        };
        let shape: Positions<f64> = found.positions.iter().copied().collect();
        let shape = Arc::new(shape);
        // If the rest shape of a smoothed mesh is missing, the shape itself becomes the rest
        // shape.
        let is_reshaped = found
            .state
            .get("reshaped")
            .and_then(serde_json::Value::as_bool);
        let rest = match is_reshaped {
            Some(true) => Arc::clone(&shape),
            _ => Arc::clone(&open.history.present().rest),
        };
        let mut scene = open.history.present().clone();
        scene.handles = Arc::new(handles_of(&found.groups, &open.mesh.processing, &rest));
        scene.rest = rest;
        scene.shape = shape;
        scene.label = "Recovered".to_owned();
        open.history.push(scene);
        let has_file = found
            .state
            .get("has_file")
            .and_then(serde_json::Value::as_bool);
        open.has_file = has_file != Some(false);
        self.tint();
        self.show_as_is();
    }

    pub(super) fn throw_away(&mut self, left: Vec<LeftBehind>) {
        for one in left {
            if let Err(error) = one.remove() {
                self.tell(Message::note(error.to_string()));
            }
        }
    }
}

fn recovered(left: &LeftBehind) -> Result<(OpenedMesh, Recovered), String> {
    let found = left.read().map_err(|e| e.to_string())?;
    let mesh = match files::open(&left.mesh) {
        Err(error) if error.is_repairable() => files::open_repaired(&left.mesh),
        other => other,
    };
    let mesh = mesh.map_err(|e| e.to_string())?;
    found.check(&mesh).map_err(|e| e.to_string())?;
    Ok((mesh, found))
}

/// The state that the autosave keeps in addition to positions and handles.
pub(crate) fn state_of(has_file: bool, is_reshaped: bool) -> serde_json::Value {
    json!({ "has_file": has_file, "reshaped": is_reshaped })
}

/// Builds an autosave record of the work.
pub(crate) fn record<'a>(
    work: &'a rescue::Work,
    groups: &'a [Group],
    state: &'a serde_json::Value,
) -> Record<'a> {
    Record {
        mesh: &work.mesh,
        fingerprint: work.fingerprint,
        groups,
        state,
        positions: work.shape.as_slice(),
    }
}

fn png_of(image: &egui::ColorImage) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let [width, height] = image.size.map(|s| u32::try_from(s).unwrap_or(u32::MAX));
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header()?;
    let pixels: Vec<u8> = image
        .pixels
        .iter()
        .flat_map(|p| [p.r(), p.g(), p.b()])
        .collect();
    writer.write_image_data(&pixels)?;
    writer.finish()?;
    Ok(bytes)
}

/// The largest number of warnings shown for a file.
const MOST_TOLD: usize = 10;

/// The longest time for which work is kept in memory only.
const AUTOSAVE_EVERY: Duration = Duration::from_secs(5);
