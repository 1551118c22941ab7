//! Files being written: temporary, and registered for removal on a signal.
//!
//! A file is written under a temporary name and then renamed. On an error or a panic it is
//! removed automatically. A signal ends the process without unwinding, so its handler must call
//! [`remove_unfinished`] first.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::Duration;

use tempfile::{NamedTempFile, PersistError};

/// A file under a temporary name, removed if it is dropped before it is finished.
#[derive(Debug)]
pub struct Unfinished {
    // Fields are dropped in this order: the file is removed before its list entry.
    file: NamedTempFile,
    listed: Listed,
}

/// The permissions of a new file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Access {
    /// Accessible to its owner only.
    Private,
    /// The default: read and write for all, as restricted by the process umask.
    Usual,
}

impl Unfinished {
    /// Creates a file in `folder` whose name begins with `prefix` and ends with `suffix`.
    ///
    /// # Errors
    /// The error of the operating system.
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
        // Held until the name is listed, so that no signal handler runs in between.
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

    /// The current path.
    pub fn path(&self) -> &Path {
        self.file.path()
    }

    /// Flushes the data to disk and renames the file to `target`, replacing an existing file.
    ///
    /// # Errors
    /// The error of the operating system; the old file is intact in that case.
    pub fn finish(self, target: &Path) -> std::io::Result<()> {
        self.renamed(|file| file.persist(target))
    }

    /// Like [`Self::finish`], but never replaces an existing file.
    ///
    /// # Errors
    /// The error of the operating system, for example that the file exists.
    pub fn finish_new(self, target: &Path) -> std::io::Result<()> {
        self.renamed(|file| file.persist_noclobber(target))
    }

    fn renamed(
        self,
        rename: impl FnOnce(NamedTempFile) -> Result<File, PersistError>,
    ) -> std::io::Result<()> {
        let Self { file, listed } = self;
        file.as_file().sync_all()?;
        // Held so that no signal handler runs between the rename and the removal from the list.
        let list = lock();
        let renamed = rename(file);
        drop(list);
        drop(listed);
        // On failure the error holds the file, which is removed here.
        renamed.map(drop).map_err(|error| error.error)
    }
}

/// Removes all files that are being written. For a process that is about to exit.
///
/// Afterwards no file can be created or finished: threads that try block forever. Waits at most
/// one second for a file that is just being created or renamed.
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
    // The list holds only paths, so a panic cannot leave it inconsistent.
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// An entry in the list of unfinished files.
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
