//! Commands that read and write files.

use std::path::{Path, PathBuf};

use cotan::geometry::TriangleTree;
use cotan_io::{Document, Limits};
use cotan_tool::handles_file::{HandlesFile, groups_in_file, to_json};
use cotan_tool::paths::Paths;

use super::Workspace;
use super::jobs::Outcome;
use crate::command::{Command, Over};
use crate::effect::{Effect, Notice};
use crate::files::{self, Expect, SaveError, is_project, open_project};
use crate::handle_groups::{groups_of, handles_of};
use crate::model::Model;
use crate::refused::Refused;
use crate::scene::Scene;

/// A model that was read and prepared for picking, or the reason why it was not.
pub(super) enum Opened {
    Model(Box<(Model, TriangleTree)>),
    /// The reason, and the file if repairs would help.
    Not(String, Option<PathBuf>),
}

impl Workspace {
    pub(super) fn carry_out_file(
        &mut self,
        command: Command,
        effects: &mut Vec<Effect>,
    ) -> Result<(), Refused> {
        match command {
            Command::Open { path } => {
                self.start_task("Opening", effects, move |_| {
                    Ok(Outcome::Opened(read(&path, files::open)))
                });
            }
            Command::OpenRepaired { path } => {
                self.start_task("Opening", effects, move |_| {
                    Ok(Outcome::Opened(read(&path, files::open_repaired)))
                });
            }
            Command::OpenSample => match self.sample() {
                Ok(model) => self.show_model(model, effects),
                Err(problem) => effects.push(Effect::Told(Notice::Error(problem))),
            },
            Command::ImportHandles { path } => return self.import_handles(&path, effects),
            Command::ExportHandles { path } => {
                let written = self.export_handles(&path)?;
                effects.extend(told(written, path));
            }
            Command::Save => return self.save(effects),
            Command::SaveAs { path, over } => return self.save_as(path, over, effects),
            Command::ExportMesh { path, over } => return self.export_mesh(path, over, effects),
            Command::Discard => {
                if let Some(model) = &mut self.model {
                    model.mark_saved();
                }
                self.stop_journal(effects);
            }
            // All others are carried out elsewhere.
            _ => {}
        }
        Ok(())
    }

    pub(super) fn take_opened(&mut self, opened: Opened, effects: &mut Vec<Effect>) {
        match opened {
            Opened::Not(reason, Some(path)) => effects.push(Effect::Asked {
                reason,
                command: Command::OpenRepaired { path },
            }),
            Opened::Not(reason, None) => effects.push(Effect::Told(Notice::Error(reason))),
            Opened::Model(opened) => {
                let (model, tree) = *opened;
                let file = model.file();
                let mut told: Vec<String> = file.warnings.iter().take(MOST_TOLD).cloned().collect();
                let changes = file.changes.iter().map(ToString::to_string);
                told.extend(changes.take(MOST_TOLD));
                if !told.is_empty() {
                    effects.push(Effect::Told(Notice::Note(told.join("\n"))));
                }
                self.note_recent(&model.file().path, effects);
                self.set_model(model);
                effects.push(Effect::Opened(Box::new(tree)));
            }
        }
    }

    fn note_recent(&mut self, path: &Path, effects: &mut Vec<Effect>) {
        if let Err(error) = self.recent.note(path) {
            let text = format!("cannot write the list of recent files: {error}");
            effects.push(Effect::Mentioned(text));
        }
    }

    /// Shows another model.
    pub(super) fn show_model(&mut self, model: Model, effects: &mut Vec<Effect>) {
        let tree = tree_of(&model);
        self.set_model(model);
        effects.push(Effect::Opened(Box::new(tree)));
    }

    fn set_model(&mut self, model: Model) {
        self.cancel_job();
        // A model is left only after what was unsaved in it was saved or discarded.
        let _ = self.journal.stop();
        self.drag = None;
        self.morph = None;
        self.arrival = None;
        self.num_left_behind = 0;
        self.model = Some(model);
        self.show();
    }

    fn import_handles(&mut self, path: &Path, effects: &mut Vec<Effect>) -> Result<(), Refused> {
        let model = self.model.as_ref().ok_or(Refused::NoModel)?;
        let opened = model.file();
        let file = HandlesFile {
            path,
            def: None,
            max_bytes: Limits::default().max_bytes,
        };
        let read = file.read_groups(
            &opened.document,
            &opened.processing,
            opened.file_vertices.as_ref(),
        );
        match read {
            Ok(groups) => {
                let rest = model.scene().rest.positions();
                let handles = handles_of(&groups, &opened.processing, rest);
                self.record(&Command::SetHandles { handles }, effects)
            }
            Err(error) => {
                effects.push(Effect::Told(Notice::Error(error.to_string())));
                Ok(())
            }
        }
    }

    /// Writes the handles. Returns what there is to know about them, or why they were not written.
    fn export_handles(&self, path: &Path) -> Result<Result<Option<String>, String>, Refused> {
        let model = self.model.as_ref().ok_or(Refused::NoModel)?;
        let opened = model.file();
        let mut groups = groups_of(model.scene().handles(), &opened.processing);
        if let Some(file) = &opened.file_vertices {
            match groups_in_file(&groups, &opened.document, &opened.processing, file) {
                Ok(in_file) => groups = in_file,
                Err(error) => return Ok(Err(format!("{}: {error}", path.display()))),
            }
        }
        if let Err(problem) = self.write_beside("the handles", path, to_json(&groups).as_bytes()) {
            return Ok(Err(problem));
        }
        Ok(Ok((model.scene().rest != *model.original()).then(|| {
            "The mesh was smoothed or morphed since it was opened. These handles go with the \
             shape that it was made into, not with the file that was opened."
                .to_owned()
        })))
    }

    /// Writes a file, refusing to overwrite the open one.
    ///
    /// # Errors
    /// One sentence that names the file.
    pub fn write_beside(&self, name: &str, path: &Path, bytes: &[u8]) -> Result<(), String> {
        let mut paths = Paths::default();
        if let Some(model) = self.model.as_ref().filter(|model| model.has_file()) {
            paths.read("the model", &model.file().path);
        }
        paths.write(name, path);
        paths.check().map_err(|e| e.to_string())?;
        cotan_tool::files::write(path, bytes).map_err(|e| e.to_string())
    }

    fn save(&mut self, effects: &mut Vec<Effect>) -> Result<(), Refused> {
        let model = self.model.as_ref().ok_or(Refused::NoModel)?;
        if !model.has_file() {
            effects.push(Effect::AskedForFile);
            return Ok(());
        }
        let path = model.file().path.clone();
        self.save_as(path, Over::Own, effects)
    }

    fn save_as(
        &mut self,
        path: PathBuf,
        over: Over,
        effects: &mut Vec<Effect>,
    ) -> Result<(), Refused> {
        let model = self.model.as_mut().ok_or(Refused::NoModel)?;
        let expect = expected(model, &path, over);
        let saved = match is_project(&path) {
            true => files::save_project(model, &path, expect).map(|of| (of, Vec::new())),
            false => write_mesh(model, &path, expect),
        };
        match saved {
            Ok((fingerprint, losses)) => {
                let is_mesh = !is_project(&path);
                model.set_file(path.clone(), fingerprint);
                model.mark_saved();
                let props = &model.scene().props;
                let has_more = !(props.handles.is_empty() && props.masks.is_empty());
                self.note_recent(&path, effects);
                effects.push(Effect::Written(path));
                if is_mesh && has_more {
                    let text =
                        "a mesh file has no handles and masks: a project (.cotan) keeps them";
                    effects.push(Effect::Mentioned(text.to_owned()));
                }
                if !losses.is_empty() {
                    effects.push(Effect::Told(Notice::Note(losses.join("\n"))));
                }
                self.stop_journal(effects);
            }
            Err(error) => {
                let over = Over::Any;
                effects.push(not_saved(&error, Command::SaveAs { path, over }));
            }
        }
        Ok(())
    }

    /// Writes the mesh to another file, which does not become the open one.
    fn export_mesh(
        &mut self,
        path: PathBuf,
        over: Over,
        effects: &mut Vec<Effect>,
    ) -> Result<(), Refused> {
        let model = self.model.as_ref().ok_or(Refused::NoModel)?;
        let mut paths = Paths::default();
        if model.has_file() {
            paths.read("the model", &model.file().path);
        }
        paths.write("the mesh", &path);
        if let Err(problem) = paths.check() {
            effects.push(Effect::Told(Notice::Error(problem.to_string())));
            return Ok(());
        }
        let expect = match over {
            Over::Own => Expect::Absent,
            Over::Any => Expect::Anything,
        };
        match write_mesh(model, &path, expect) {
            Ok((_, losses)) => {
                let losses = (!losses.is_empty()).then(|| losses.join("\n"));
                effects.extend(told(Ok(losses), path));
            }
            Err(error) => {
                let over = Over::Any;
                effects.push(not_saved(&error, Command::ExportMesh { path, over }));
            }
        }
        Ok(())
    }

    /// The sample. It is stored in the user's data folder, so that the journal works for it too;
    /// saving asks for another path.
    fn sample(&self) -> Result<Model, String> {
        let shape = cotan::shapes::creature::<f64>(64);
        let document = Document::from_mesh(shape.connectivity(), shape.positions())
            .map_err(|e| e.to_string())?;
        let folder = match &self.folder {
            Some(folder) => folder.clone(),
            None => files::folder().map_err(|e| e.to_string())?,
        };
        let path = folder.with_file_name("sample.obj");
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|e| e.to_string())?;
        }
        cotan_io::save(&document, &path).map_err(|e| e.to_string())?;
        let mesh = files::open(&path).map_err(|e| e.to_string())?;
        Ok(Model::new(mesh).without_file())
    }

    /// Removes the journal: nothing is unsaved.
    fn stop_journal(&mut self, effects: &mut Vec<Effect>) {
        if let Err(error) = self.journal.stop() {
            effects.push(Effect::Mentioned(error.to_string()));
        }
    }
}

fn read(path: &Path, open: fn(&Path) -> Result<files::OpenedMesh, files::OpenError>) -> Opened {
    let model = match is_project(path) {
        true => open_project(path).map_err(|e| Opened::Not(e.to_string(), None)),
        false => open(path).map(Model::new).map_err(|error| {
            let repairable = error.is_repairable().then(|| path.to_owned());
            Opened::Not(error.to_string(), repairable)
        }),
    };
    match model {
        Ok(model) => {
            let tree = tree_of(&model);
            Opened::Model(Box::new((model, tree)))
        }
        Err(not) => not,
    }
}

fn tree_of(model: &Model) -> TriangleTree {
    let mesh = model.mesh();
    let triangle = |f| mesh.triangle(f).map(|v| v.index() as u32);
    let Scene { shape, .. } = model.scene();
    TriangleTree::build(mesh.faces().map(triangle).collect(), shape.positions())
}

fn expected(model: &Model, path: &Path, over: Over) -> Expect {
    match over {
        Over::Any => Expect::Anything,
        Over::Own if model.has_file() && model.file().path == path => {
            Expect::Unchanged(model.file().fingerprint)
        }
        Over::Own => Expect::Absent,
    }
}

/// Writes the mesh with the shape of the scene. Returns what the file lacks.
fn write_mesh(
    model: &Model,
    path: &Path,
    expect: Expect,
) -> Result<(files::Fingerprint, Vec<String>), SaveError> {
    let opened = model.file();
    let shape = model.scene().shape.positions();
    let saved = files::save(&opened.document, &opened.processing, shape, path, expect)?;
    let mut losses = saved.losses;
    if let Some(format) = cotan_io::Format::from_path(path) {
        losses.extend(files::forgotten(format, &opened.changes));
    }
    Ok((saved.fingerprint, losses))
}

fn not_saved(error: &SaveError, command: Command) -> Effect {
    let reason = error.to_string();
    match error.is_overridable() {
        true => Effect::Asked { reason, command },
        false => Effect::Told(Notice::Error(reason)),
    }
}

fn told(written: Result<Option<String>, String>, path: PathBuf) -> Vec<Effect> {
    match written {
        Err(problem) => vec![Effect::Told(Notice::Error(problem))],
        Ok(note) => {
            let note = note.map(|note| Effect::Told(Notice::Note(note)));
            note.into_iter().chain([Effect::Written(path)]).collect()
        }
    }
}

/// The largest number of warnings shown for a file.
const MOST_TOLD: usize = 10;
