//! Finding the autosaves that ended processes have left.

use std::fs::{File, TryLockError};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::error::AutosaveError;
use super::format::{self, Recovered};
use super::{DATA, LOCK, MOST_BYTES, PART, create_private, remove_if_there};
use crate::files::Fingerprint;

/// The autosave of a process that has ended.
///
/// While this value is held, no other process is offered the autosave. When it is dropped, the
/// file stays for the next time.
#[derive(Debug)]
pub struct LeftBehind {
    /// The file of the mesh.
    pub mesh: PathBuf,
    /// The fingerprint of the file when it was opened.
    pub fingerprint: Fingerprint,
    /// The time of the autosave.
    pub saved: SystemTime,
    /// `true` if the file of the mesh is the user's, not the sample.
    pub has_file: bool,
    path: PathBuf,
    lock_path: PathBuf,
    _lock: File,
}

/// The autosaves found in a folder.
#[derive(Debug, Default)]
pub struct Listing {
    /// The autosaves that can be restored, the newest first.
    pub left: Vec<LeftBehind>,
    /// Errors of the autosaves that cannot be used. Their files are left in place.
    pub problems: Vec<AutosaveError>,
}

/// Finds the autosaves in `folder` (see [`folder`](super::folder)) left by processes that have
/// ended.
///
/// Of each file only the beginning is read. A missing folder
/// gives an empty listing.
pub fn list(folder: &Path) -> Listing {
    let mut listing = Listing::default();
    let mut paths = match paths(folder) {
        Ok(paths) => paths,
        Err(error) => {
            listing.problems.push(error);
            return listing;
        }
    };
    paths.sort();
    let with = |wanted: &'static str| {
        let has = move |path: &&PathBuf| path.extension().is_some_and(|found| found == wanted);
        paths.iter().filter(has)
    };
    // Clean up before the locks are taken and kept.
    with(PART).for_each(|path| remove_part(path));
    with(LOCK).for_each(|path| remove_lone_lock(path));
    for path in with(DATA) {
        match LeftBehind::open(path) {
            Ok(left) => listing.left.extend(left),
            Err(error) => listing.problems.push(error),
        }
    }
    listing
        .left
        .sort_by_key(|left| std::cmp::Reverse(left.saved));
    listing
}

impl LeftBehind {
    /// Opens an autosave. Returns `None` if its process still runs or another one holds it.
    fn open(path: &Path) -> Result<Option<Self>, AutosaveError> {
        let lock_path = path.with_extension(LOCK);
        let Some(lock) = take_lock(&lock_path).map_err(|e| AutosaveError::read(path, e))? else {
            return Ok(None);
        };
        let Some(file) = open_bounded(path)? else {
            return Ok(None);
        };
        let summary = format::summary(file).map_err(|error| AutosaveError::format(path, error))?;
        Ok(Some(Self {
            mesh: summary.mesh,
            fingerprint: summary.fingerprint,
            saved: summary.saved,
            has_file: summary.has_file,
            path: path.to_owned(),
            lock_path,
            _lock: lock,
        }))
    }

    /// Returns `true` if the file of the mesh is still the one that was edited.
    pub fn is_current(&self) -> bool {
        Fingerprint::of(&self.mesh).is_ok_and(|now| now == self.fingerprint)
    }

    /// Reads the whole autosave.
    ///
    /// # Errors
    /// [`AutosaveError`] if the file is gone or damaged.
    pub fn read(&self) -> Result<Recovered, AutosaveError> {
        let Some(file) = open_bounded(&self.path)? else {
            return Err(AutosaveError::read(&self.path, ErrorKind::NotFound.into()));
        };
        format::decode(file).map_err(|error| AutosaveError::format(&self.path, error))
    }

    /// Removes the autosave, after it was restored and saved anew or when it is not wanted.
    ///
    /// # Errors
    /// [`AutosaveError::Write`] if the system refuses.
    pub fn remove(self) -> Result<(), AutosaveError> {
        remove_if_there(&self.path).map_err(|source| AutosaveError::write(&self.path, source))?;
        let _ = std::fs::remove_file(&self.lock_path);
        Ok(())
    }

    /// The path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

fn paths(folder: &Path) -> Result<Vec<PathBuf>, AutosaveError> {
    let failed = |error| AutosaveError::read(folder, error);
    let entries = match std::fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(failed(error)),
    };
    let paths = entries.map(|entry| entry.map(|entry| entry.path()));
    paths.collect::<Result<_, _>>().map_err(failed)
}

/// Takes the lock of a process that has ended.
///
/// Returns `None` if it still runs. A missing lock file is recreated, so that two processes do
/// not restore the same autosave.
fn take_lock(path: &Path) -> std::io::Result<Option<File>> {
    if std::fs::symlink_metadata(path).is_ok_and(|metadata| !metadata.is_file()) {
        return Err(std::io::Error::other("its lock is not a regular file"));
    }
    let lock = match File::options().read(true).write(true).open(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => create_private(path)?,
        opened => opened?,
    };
    match lock.try_lock() {
        Ok(()) => Ok(Some(lock)),
        Err(TryLockError::WouldBlock) => Ok(None),
        Err(TryLockError::Error(error)) => Err(error),
    }
}

/// Opens a regular file within the size limit, or returns `None` if it is gone.
fn open_bounded(path: &Path) -> Result<Option<File>, AutosaveError> {
    let failed = |error| AutosaveError::read(path, error);
    let corrupt = |problem: &str| AutosaveError::Corrupt {
        path: path.to_owned(),
        problem: problem.to_owned(),
    };
    // Check the type before opening: a pipe would block, and a link may lead anywhere.
    let metadata = match std::fs::symlink_metadata(path) {
        Ok(metadata) => metadata,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(failed(error)),
    };
    if !metadata.is_file() {
        return Err(corrupt("it is not a regular file"));
    }
    let file = File::open(path).map_err(failed)?;
    let length = file.metadata().map_err(failed)?.len();
    match length > MOST_BYTES {
        true => Err(corrupt("it is larger than 2 GiB")),
        false => Ok(Some(file)),
    }
}

/// Removes the lock of a process that crashed without writing an autosave.
fn remove_lone_lock(path: &Path) {
    if path.with_extension(DATA).exists() {
        return;
    }
    // The file is locked while it is removed, so a process about to lock it notices.
    if let Ok(Some(_lock)) = take_lock(path) {
        let _ = std::fs::remove_file(path);
    }
}

/// Removes the file `NAME.….part` of a process that ended while writing it.
fn remove_part(path: &Path) {
    let name = path.file_name().and_then(|name| name.to_str());
    let Some((name, _)) = name.and_then(|name| name.split_once('.')) else {
        return;
    };
    let lock_path = path.with_file_name(format!("{name}.{LOCK}"));
    let is_over = match lock_path.exists() {
        true => matches!(take_lock(&lock_path), Ok(Some(_))),
        false => true,
    };
    if is_over {
        let _ = std::fs::remove_file(path);
    }
}
