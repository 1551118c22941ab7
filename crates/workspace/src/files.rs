//! Opening, saving and autosaving, without a window.
//!
//! [`open`] reads a mesh within the limits of the command line, and [`open_repaired`] repairs it
//! as well. [`save`] writes it in one step, unless the file on disk has changed in the meantime
//! ([`Fingerprint`]). [`Autosave`] keeps the work for the case of a crash, and [`list`] finds it
//! again.

mod autosave;
mod fingerprint;
mod journal;
mod open;
mod project;
mod recent;
mod recover;
mod save;
#[cfg(test)]
#[cfg(target_os = "linux")]
mod small_disk;

pub use autosave::{Autosave, AutosaveError, LeftBehind, Listing, Record, Recovered, folder, list};
pub use fingerprint::Fingerprint;
pub use journal::{Journal, put_aside};
pub use open::{OpenError, OpenedMesh, Remedy, open, open_repaired};
pub use project::{
    ProjectError, is_project, open_project, project_bytes, read_project, save_project,
};
pub use recent::Recent;
pub(crate) use recover::recovered;
pub use save::{Expect, SaveError, Saved, forgotten, save};
