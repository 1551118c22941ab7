//! The journal of a workspace: every command is on disk as soon as it was carried out.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, TryLockError};

use super::autosave::{Autosave, AutosaveError, Record};
use crate::command::{Command, Record as Kind};
use crate::model::Model;
use crate::newest::lock;
use crate::record::SceneRecord;
use crate::shape::Shape;

/// The journal of a workspace: every command is on disk as soon as it was carried out.
///
/// It begins with the scene after the first command that leaves something unsaved, and ends when
/// nothing is unsaved any more.
#[derive(Debug)]
pub struct Journal {
    file: Option<Arc<Autosave>>,
    begun: Option<Begun>,
}

/// The part of the history that the file holds.
#[derive(Debug)]
struct Begun {
    /// The number of steps that can be undone without leaving the journal, and repeated.
    behind: usize,
    ahead: usize,
    bytes: u64,
    /// The shape to which the commands lead, and whether it is at rest.
    shape: Shape,
    is_settled: bool,
}

impl Journal {
    /// A journal that writes nothing.
    pub(crate) fn off() -> Self {
        Self {
            file: None,
            begun: None,
        }
    }

    /// Starts a journal in a folder.
    ///
    /// # Errors
    /// As for [`Autosave::start`].
    pub(crate) fn start(folder: &Path) -> Result<Self, AutosaveError> {
        Ok(Self {
            file: Some(Arc::new(Autosave::start(folder)?)),
            begun: None,
        })
    }

    /// Writes the shape that the solver has come to, which belongs to the present step. To be
    /// called before a command is carried out.
    pub(crate) fn catch_up(&mut self, model: &Model) -> Result<(), AutosaveError> {
        let scene = model.scene();
        let (Some(file), Some(begun)) = (&self.file, &mut self.begun) else {
            return Ok(());
        };
        if begun.shape.is(&scene.shape) && begun.is_settled == scene.is_settled {
            return Ok(());
        }
        let shape = scene.shape.clone();
        let arrive = Command::Arrive {
            shape: shape.clone(),
            is_settled: scene.is_settled,
        };
        match file.append(&arrive) {
            Ok(bytes) => {
                begun.bytes += bytes;
                begun.shape = shape;
                begun.is_settled = scene.is_settled;
                keep(None);
                Ok(())
            }
            Err(error) => {
                // Behind a broken line nothing is read: the next command begins anew.
                self.begun = None;
                Err(error)
            }
        }
    }

    /// Writes a command that was carried out on a model when `index` steps could be undone.
    pub(crate) fn note(
        &mut self,
        model: &Model,
        command: &Command,
        index: usize,
    ) -> Result<(), AutosaveError> {
        let Some(file) = &self.file else {
            return Ok(());
        };
        if !model.is_changed() {
            return self.stop();
        }
        let begun = self
            .begun
            .take()
            .and_then(|begun| begun.after(model, command, index));
        let Some(mut begun) = begun.filter(|begun| begun.bytes < MOST_BYTES) else {
            return self.restart(model);
        };
        let now = model.history().index();
        match command {
            // Steps are counted from another beginning when the journal is read.
            Command::GoTo { .. } => {
                for _ in now..index {
                    begun.bytes += file.append(&Command::Undo)?;
                }
                for _ in index..now {
                    begun.bytes += file.append(&Command::Redo)?;
                }
            }
            command => begun.bytes += file.append(command)?,
        }
        begun.shape = model.scene().shape.clone();
        begun.is_settled = model.scene().is_settled;
        self.begun = Some(begun);
        Ok(())
    }

    /// Begins anew with the present scene.
    pub(crate) fn restart(&mut self, model: &Model) -> Result<(), AutosaveError> {
        self.begun = None;
        let Some(file) = &self.file else {
            return Ok(());
        };
        let opened = model.file();
        let bytes = file.begin(&Record {
            mesh: &opened.path,
            fingerprint: opened.fingerprint,
            has_file: model.has_file(),
            is_repaired: opened.before_repair.is_some(),
            scene: &SceneRecord::of(model),
        })?;
        self.begun = Some(Begun {
            behind: 0,
            ahead: 0,
            bytes,
            shape: model.scene().shape.clone(),
            is_settled: model.scene().is_settled,
        });
        Ok(())
    }

    /// Removes the file: nothing is unsaved.
    pub(crate) fn stop(&mut self) -> Result<(), AutosaveError> {
        keep(None);
        self.begun = None;
        match &self.file {
            Some(file) => file.remove(),
            None => Ok(()),
        }
    }

    /// Hands over the present shape, to be written if the program crashes before it is at rest.
    pub(crate) fn keep_for_a_crash(&self, model: &Model) {
        if let (Some(file), Some(_)) = (&self.file, &self.begun) {
            keep(Some((Arc::clone(file), model.scene().shape.clone())));
        }
    }
}

impl Begun {
    /// The part of the history that the file holds after a command; `None` if the command left it.
    fn after(mut self, model: &Model, command: &Command, index: usize) -> Option<Self> {
        let now = model.history().index();
        match command.record() {
            Kind::Travel => {
                let (back, on) = (index.saturating_sub(now), now.saturating_sub(index));
                self.behind = (self.behind + on).checked_sub(back)?;
                self.ahead = (self.ahead + back).checked_sub(on)?;
            }
            Kind::InPlace => {}
            _ => {
                self.behind += now.saturating_sub(index);
                self.ahead = 0;
            }
        }
        Some(self)
    }
}

/// The length from which a journal begins anew: 256 MiB.
const MOST_BYTES: u64 = 256 << 20;

/// The shape that is not in the journal yet.
static UNWRITTEN: Mutex<Option<(Arc<Autosave>, Shape)>> = Mutex::new(None);

fn keep(unwritten: Option<(Arc<Autosave>, Shape)>) {
    *lock(&UNWRITTEN) = unwritten;
}

/// Writes to the journal what is not in it yet, from a panic hook of any thread. Returns the path
/// of the journal if there is anything unsaved in it.
///
/// # Errors
/// The error of [`Autosave::append`].
pub fn put_aside() -> Option<Result<PathBuf, AutosaveError>> {
    // A panic while this lock is held would deadlock.
    let unwritten = match UNWRITTEN.try_lock() {
        Ok(guard) => guard,
        Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
        Err(TryLockError::WouldBlock) => return None,
    };
    let (file, shape) = unwritten.as_ref()?;
    let is_settled = false;
    let shape = shape.clone();
    let written = file.append(&Command::Arrive { shape, is_settled });
    Some(written.map(|_| file.path().to_owned()))
}
