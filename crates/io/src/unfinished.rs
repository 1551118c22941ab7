//! Files that are being written: temporary, and known to whoever has to remove them.
//!
//! A file is written under a temporary name and then renamed. An error or a panic removes it; a
//! signal ends the process without either, and a handler calls [`remove_unfinished`] first.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::Duration;

/// A file under a temporary name. Dropped before it is finished, it is removed.
#[derive(Debug)]
pub struct Unfinished {
    // Removed before it is taken from the list: fields are dropped in this order.
    file: tempfile::NamedTempFile,
    listed: Listed,
}

/// The rights of a new file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Access {
    /// For its owner alone.
    Private,
    /// As any new file: what the process's mask leaves of reading and writing for all.
    Usual,
}

impl Unfinished {
    /// A new file in `folder`, whose name begins with `prefix` and ends with `suffix`.
    ///
    /// # Errors
    /// What the system says.
    pub fn create(
        folder: &Path,
        prefix: &OsStr,
        suffix: &OsStr,
        access: Access,
    ) -> std::io::Result<Self> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(prefix).suffix(suffix);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = match access {
                Access::Private => 0o600,
                Access::Usual => 0o666,
            };
            builder.permissions(std::fs::Permissions::from_mode(mode));
        }
        #[cfg(not(unix))]
        let _ = access;
        // Held until the name is listed, so that no signal comes between.
        let mut list = lock();
        let file = builder.tempfile_in(folder)?;
        list.insert(file.path().to_owned());
        let listed = Listed(file.path().to_owned());
        Ok(Self { file, listed })
    }

    /// The file.
    pub fn file(&self) -> &File {
        self.file.as_file()
    }

    /// The file, for writing.
    pub fn file_mut(&mut self) -> &mut File {
        self.file.as_file_mut()
    }

    /// Where it is, for now.
    pub fn path(&self) -> &Path {
        self.file.path()
    }

    /// Stores what was written, and gives the file its name in the place of an older file.
    ///
    /// # Errors
    /// What the system says; the older file is whole then.
    pub fn finish(self, target: &Path) -> std::io::Result<()> {
        let Self { file, listed } = self;
        file.as_file().sync_all()?;
        // No signal comes between the removal of what is unfinished and the end of the process.
        let list = lock();
        let renamed = file.persist(target);
        drop(list);
        drop(listed);
        // If there is an error it holds the file, which is removed here.
        renamed.map(drop).map_err(|error| error.error)
    }
}

/// Removes all files that are being written; for a process that is about to end.
///
/// From here on no file is begun or finished: threads that try to wait for ever. Waits a second at
/// most for a file that is just being created or renamed.
pub fn remove_unfinished() {
    for _ in 0..ATTEMPTS {
        let list = match UNFINISHED.try_lock() {
            Ok(list) => list,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => {
                std::thread::sleep(Duration::from_millis(10));
                continue;
            }
        };
        for path in list.iter() {
            let _ = std::fs::remove_file(path);
        }
        // Never unlocked.
        std::mem::forget(list);
        return;
    }
}

const ATTEMPTS: usize = 100;

static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn lock() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    // Of paths alone: there is nothing that a panic could have left half done.
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// An entry of the list.
#[derive(Debug)]
struct Listed(PathBuf);

impl Drop for Listed {
    fn drop(&mut self) {
        lock().remove(&self.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn create(folder: &Path) -> Unfinished {
        let (prefix, suffix) = (OsStr::new(".test-"), OsStr::new(".part"));
        Unfinished::create(folder, prefix, suffix, Access::Private).unwrap()
    }

    #[test]
    fn a_file_is_listed_until_it_is_finished_or_dropped() {
        let folder = tempfile::tempdir().unwrap();
        let dropped = create(folder.path());
        let path = dropped.path().to_owned();
        assert!(lock().contains(&path) && path.exists());
        drop(dropped);
        assert!(!lock().contains(&path) && !path.exists());

        let mut finished = create(folder.path());
        let path = finished.path().to_owned();
        finished.file_mut().write_all(b"done").unwrap();
        let target = folder.path().join("target");
        finished.finish(&target).unwrap();
        assert!(!lock().contains(&path) && !path.exists());
        assert_eq!(std::fs::read(&target).unwrap(), b"done");
    }

    #[test]
    fn a_file_that_cannot_be_finished_is_removed() {
        let folder = tempfile::tempdir().unwrap();
        let file = create(folder.path());
        let path = file.path().to_owned();
        file.finish(&folder.path().join("missing").join("target"))
            .unwrap_err();
        assert!(!lock().contains(&path) && !path.exists());
    }
}
