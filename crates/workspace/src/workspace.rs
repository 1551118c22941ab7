//! The workspace: the open model, the threads that work on it, and the commands.

mod drag;
mod files;
mod jobs;
#[cfg(test)]
mod tests;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use cotan::halfedge::VertexMap;
use nalgebra::{Point3, Vector3};

use crate::command::{Command, Record};
use crate::effect::{Effect, Notice};
use crate::files::{Journal, LeftBehind, Listing, Recent, recovered};
use crate::jobs::Morph;
use crate::model::Model;
use crate::refused::{After, Refused};
use crate::scene::Scene;
use crate::shape::Shape;
use crate::solver::{Pace, Solver, State};
use crate::task::Task;

use drag::Grip;
use jobs::Outcome;

/// A function that is called from other threads when there is something new.
type Notify = std::sync::Arc<dyn Fn() + Send + Sync>;

/// The open model, the threads that work on it, and the commands.
///
/// [`Self::apply`] carries out a command and returns what the window has to do. Long jobs run on
/// threads: [`Self::poll`] collects their results, which are commands too.
pub struct Workspace {
    model: Option<Model>,
    solver: Solver,
    task: Option<Task<Outcome>>,
    drag: Option<Grip>,
    morph: Option<Morph>,
    journal: Journal,
    /// The folder of the journal.
    folder: Option<PathBuf>,
    recent: Recent,
    /// The number of parts left behind that was last warned of.
    num_left_behind: usize,
    /// The data of the last update of the solver.
    arrival: Option<Arrival>,
    notify: Notify,
}

/// The data of an update of the solver.
#[derive(Clone, Debug)]
pub struct Arrival {
    /// The shape.
    pub shape: Shape,
    /// The normals of the shape at its vertices.
    pub normals: std::sync::Arc<VertexMap<Vector3<f64>>>,
    /// The tag of the goal; see [`Solver::tag`].
    pub tag: u64,
    /// The times when the goal was posted, when the solver took it up, and when the step was
    /// done.
    pub times: [Instant; 3],
}

impl std::fmt::Debug for Workspace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let model = self.model.as_ref().map(|m| &m.file().path);
        f.debug_struct("Workspace")
            .field("model", &model)
            .finish_non_exhaustive()
    }
}

impl Workspace {
    /// Starts an empty workspace. `notify` is called from its threads when there is something to
    /// [poll](Self::poll).
    ///
    /// # Errors
    /// Fails if the system cannot start a thread.
    pub fn start(notify: impl Fn() + Send + Sync + 'static) -> std::io::Result<Self> {
        let notify: Notify = std::sync::Arc::new(notify);
        let own = std::sync::Arc::clone(&notify);
        Ok(Self {
            model: None,
            solver: Solver::start(move || own())?,
            task: None,
            drag: None,
            morph: None,
            journal: Journal::off(),
            folder: None,
            recent: Recent::default(),
            num_left_behind: 0,
            arrival: None,
            notify,
        })
    }

    /// The open model.
    pub fn model(&self) -> Option<&Model> {
        self.model.as_ref()
    }

    /// The scene that is shown.
    pub fn scene(&self) -> Option<&Scene> {
        self.model().map(Model::scene)
    }

    /// The shape on the screen: that of the scene, or the one between it and its map.
    pub fn shown(&self) -> Option<&Shape> {
        match &self.morph {
            Some(morph) => Some(morph.shape()),
            None => self.scene().map(|scene| &scene.shape),
        }
    }

    /// The map to the sphere that is shown.
    pub fn morph(&self) -> Option<&Morph> {
        self.morph.as_ref()
    }

    /// The solver.
    pub fn solver(&self) -> &Solver {
        &self.solver
    }

    /// The handle that is held.
    pub fn grabbed(&self) -> Option<usize> {
        self.drag.as_ref().map(Grip::handle)
    }

    /// The name and progress of the running job, or that it is being stopped.
    pub fn job(&self) -> Option<(&str, Option<f32>)> {
        let task = self.task.as_ref()?;
        Some(match task.is_cancelled() {
            true => ("Stopping", None),
            false => (&task.name, task.progress()),
        })
    }

    /// Returns `true` if a job or the solver is at work, or a result was not polled yet.
    pub fn is_working(&self) -> bool {
        self.task.is_some() || self.solver.is_busy()
    }

    /// Returns `true` if closing the model would lose something.
    pub fn is_changed(&self) -> bool {
        self.model().is_some_and(Model::is_changed)
    }

    /// The last update of the solver, if it was not taken yet.
    pub fn take_arrival(&mut self) -> Option<Arrival> {
        self.arrival.take()
    }

    /// Carries out a command.
    pub fn apply(&mut self, command: Command) -> Vec<Effect> {
        let mut effects = Vec::new();
        if let Err(refused) = self.carry_out(command, &mut effects) {
            effects.push(Effect::Mentioned(refused.to_string()));
        }
        effects
    }

    fn carry_out(&mut self, command: Command, effects: &mut Vec<Effect>) -> Result<(), Refused> {
        match command.record() {
            Record::Nothing => {}
            Record::Travel => {
                self.cancel_drag(effects);
                self.cancel_job();
                self.morph = None;
                return self.record(&command, effects);
            }
            _ => return self.record(&command, effects),
        }
        match command {
            Command::Settle => self.settle(),
            Command::Stop => self.show(),
            Command::Grab { handle } => self.grab(handle, effects)?,
            Command::Drag { motion } => self.drag(motion),
            Command::DragBy { transform, pivot } => {
                self.drag_in_numbers(&transform, pivot.map(Point3::from));
            }
            Command::Transform { transform, pivot } => {
                self.transform(&transform, pivot.map(Point3::from), effects)?;
            }
            Command::FindMirror => self.start_mirroring(effects)?,
            Command::Drop => self.release(effects)?,
            Command::CancelDrag => self.cancel_drag(effects),
            Command::Smooth | Command::AdjustSmooth { .. } | Command::ScaleDetails { .. } => {
                self.start_reshaping(command, effects)?;
            }
            Command::Paint { stroke } => self.start_painting(&stroke, effects)?,
            Command::MapToSphere => self.start_mapping(effects)?,
            Command::Morph { share } => {
                if let Some(morph) = &mut self.morph {
                    morph.set_share(share.clamp(0.0, 1.0));
                }
            }
            Command::KeepMorph => self.keep_morph(effects)?,
            Command::LeaveMorph => self.morph = None,
            Command::CancelJob => self.cancel_job(),
            file => self.carry_out_file(file, effects)?,
        }
        Ok(())
    }

    /// Carries out a command that is recorded, and tells the solver.
    fn record(&mut self, command: &Command, effects: &mut Vec<Effect>) -> Result<(), Refused> {
        match self.write(command, effects)? {
            After::Nothing => {}
            After::Hold => {
                if let Some(model) = &self.model {
                    self.solver.follow(model, model.scene(), Pace::Still);
                }
            }
            After::Settle => self.settle(),
            After::Show => self.show(),
        }
        Ok(())
    }

    /// Carries out a command that is recorded, and writes it to the journal. Returns what the
    /// solver is to do.
    fn write(&mut self, command: &Command, effects: &mut Vec<Effect>) -> Result<After, Refused> {
        let model = self.model.as_mut().ok_or(Refused::NoModel)?;
        let caught_up = self.journal.catch_up(model);
        let index = model.history().index();
        let Some(after) = model.record(command)? else {
            return Ok(After::Nothing);
        };
        let written = self.journal.note(model, command, index);
        if let Err(error) = caught_up.and(written) {
            effects.push(Effect::Mentioned(error.to_string()));
        }
        effects.push(Effect::Marked);
        Ok(after)
    }

    /// Lets the shape come to rest with the present handles.
    fn settle(&mut self) {
        let Some(model) = &mut self.model else {
            return;
        };
        let is_free = model.scene().handles().is_empty();
        model.history_mut().scene_mut().is_settled = is_free;
        self.solver.clear_samples();
        let pace = match is_free {
            true => Pace::Still,
            false => Pace::Settle,
        };
        self.solver.follow(model, model.scene(), pace);
    }

    /// Shows a scene that does not continue the one before.
    fn show(&mut self) {
        if let Some(model) = &self.model {
            self.solver.show(model, model.scene());
        }
    }

    /// Collects the results of the threads.
    pub fn poll(&mut self) -> Vec<Effect> {
        let mut effects = Vec::new();
        if let Some(update) = self.solver.take() {
            let is_settled = update.state == State::Settled && update.tag == self.solver.tag();
            if let Some(model) = &mut self.model {
                let scene = model.history_mut().scene_mut();
                scene.shape = update.shape.clone();
                scene.is_settled = is_settled;
            }
            self.arrival = Some(Arrival {
                shape: update.shape,
                normals: update.normals,
                tag: update.tag,
                times: update.times,
            });
            if let Err(error) = self.journal_shape(is_settled) {
                effects.push(Effect::Mentioned(error));
            }
        }
        if let Some(result) = self.task.as_ref().and_then(Task::poll) {
            self.task = None;
            self.take_result(result, &mut effects);
        }
        effects
    }

    /// Writes the shape to the journal once it is at rest, and hands it over for the case of a
    /// crash. During a drag there is no step that it belongs to yet.
    fn journal_shape(&mut self, is_settled: bool) -> Result<(), String> {
        let Some(model) = self.model.as_ref().filter(|_| self.drag.is_none()) else {
            return Ok(());
        };
        match is_settled {
            true => self.journal.catch_up(model).map_err(|e| e.to_string()),
            false => {
                self.journal.keep_for_a_crash(model);
                Ok(())
            }
        }
    }

    /// Polls until no thread has anything to do, and returns all effects.
    ///
    /// For scripts and tests; a window polls once a frame.
    pub fn finish(&mut self) -> Vec<Effect> {
        let mut effects = self.poll();
        while self.is_working() {
            std::thread::sleep(Duration::from_millis(1));
            effects.extend(self.poll());
        }
        effects
    }

    /// The files that were opened or saved last.
    pub fn recent(&self) -> &Recent {
        &self.recent
    }

    /// Starts to keep a journal in a folder, for recovery after a crash, and next to it the list
    /// of recent files and the sample. Returns the journals that ended processes have left there.
    ///
    /// # Errors
    /// The error of [`crate::files::Autosave::start`]. Everything else works without a journal.
    pub fn keep_journal(
        &mut self,
        folder: &std::path::Path,
    ) -> Result<Listing, crate::files::AutosaveError> {
        // Before the own one is there.
        let listing = crate::files::list(folder);
        self.folder = Some(folder.to_owned());
        self.recent = Recent::load(folder);
        self.journal = Journal::start(folder)?;
        Ok(listing)
    }

    /// Restores the work of a journal that was left behind.
    ///
    /// # Errors
    /// One sentence: the journal or its mesh cannot be read, or the two do not fit together.
    pub fn recover(&mut self, left: LeftBehind) -> Result<Vec<Effect>, String> {
        let (model, mut effects) = recovered(&left)?;
        self.show_model(model, &mut effects);
        // Writes the work anew before the old journal is removed.
        if let Some(model) = &self.model
            && let Err(error) = self.journal.restart(model)
        {
            effects.push(Effect::Told(Notice::Note(error.to_string())));
        }
        if let Err(error) = left.remove() {
            effects.push(Effect::Told(Notice::Note(error.to_string())));
        }
        Ok(effects)
    }
}

impl Drop for Workspace {
    /// A regular end: changes that were not saved were discarded deliberately.
    fn drop(&mut self) {
        if !std::thread::panicking() {
            // If the journal cannot be removed, it is merely offered once more.
            let _ = self.journal.stop();
        }
    }
}
