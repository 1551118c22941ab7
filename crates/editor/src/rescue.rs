//! Saving the work when the program crashes.
//!
//! The window hands over its work in every frame (a few pointers). A panic in any thread writes
//! it to the autosave before anything else happens.

use std::panic::PanicHookInfo;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, TryLockError};

use cotan::geometry::Positions;
use cotan_io::{Printable, ProcessingMesh};

use crate::app::file_actions::{record, state_of};
use crate::files::{Autosave, AutosaveError, Fingerprint};
use crate::handle_groups::groups_of;
use crate::scene::HandleGroup;

/// The user's work as it is shown.
#[derive(Clone, Debug)]
pub(crate) struct Work {
    pub(crate) mesh: PathBuf,
    pub(crate) fingerprint: Fingerprint,
    pub(crate) processing: Arc<ProcessingMesh>,
    pub(crate) handles: Arc<Vec<HandleGroup>>,
    pub(crate) rest: Arc<Positions<f64>>,
    pub(crate) shape: Arc<Positions<f64>>,
    pub(crate) has_file: bool,
}

impl Work {
    /// Writes the work to the autosave.
    pub(crate) fn write(&self, autosave: &Autosave) -> Result<(), AutosaveError> {
        let groups = groups_of(&self.handles, &self.processing);
        let is_reshaped = *self.rest != *self.processing.positions();
        autosave.write(&record(
            self,
            &groups,
            &state_of(self.has_file, is_reshaped),
        ))
    }
}

/// The current work and its autosave.
static AT_HAND: Mutex<Option<(Arc<Autosave>, Work)>> = Mutex::new(None);

/// Stores the work to be saved on a panic.
pub(crate) fn keep(autosave: &Arc<Autosave>, work: Work) {
    *crate::newest::lock(&AT_HAND) = Some((Arc::clone(autosave), work));
}

/// Clears the stored work: there is nothing to lose.
pub(crate) fn forget() {
    *crate::newest::lock(&AT_HAND) = None;
}

/// Installs a panic hook that saves the work before the panic is reported, in any thread.
pub fn install() {
    let tell = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info: &PanicHookInfo<'_>| {
        // A panic while this lock is held would deadlock.
        let at_hand = match AT_HAND.try_lock() {
            Ok(guard) => guard,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => return tell(info),
        };
        if let Some((autosave, work)) = &*at_hand {
            match work.write(autosave) {
                Ok(()) => eprintln!(
                    "your work was put aside in {}",
                    Printable(autosave.path().display())
                ),
                Err(error) => eprintln!("your work could not be put aside: {}", Printable(error)),
            }
        }
        drop(at_hand);
        tell(info);
    }));
}
