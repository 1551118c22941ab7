//! Opening, saving and autosaving, without a window.
//!
//! A mesh is opened within the limits of the command line ([`open`]), repaired if that is asked for
//! ([`open_repaired`]), and saved in one step ([`save`]), unless the file is another one by now
//! ([`Fingerprint`]). What a crash must not take is put aside by [`Autosave`] and found again by
//! [`list`].

mod autosave;
mod fingerprint;
mod open;
mod save;
#[cfg(test)]
#[cfg(target_os = "linux")]
mod small_disk;

pub use autosave::{Autosave, AutosaveError, LeftBehind, Listing, Record, Recovered, folder, list};
pub use fingerprint::Fingerprint;
pub use open::{OpenError, OpenedMesh, Remedy, open, open_repaired};
pub use save::{Expect, SaveError, Saved, forgotten, save};
