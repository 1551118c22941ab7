//! What processes that no longer run have left.

use std::fs::{File, TryLockError};
use std::io::{BufReader, ErrorKind};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::error::AutosaveError;
use super::format::{self, Recovered};
use super::{DATA, LOCK, MOST_BYTES, PART, create_private, remove_if_there};
use crate::files::{Fingerprint, OpenedMesh};

/// What a process that no longer runs had put aside.
///
/// No other process is offered it as long as this is held; dropped, it stays for the next time.
#[derive(Debug)]
pub struct LeftBehind {
    /// The file of the mesh.
    pub mesh: PathBuf,
    /// The file as it was when it was opened.
    pub fingerprint: Fingerprint,
    /// When it was put aside.
    pub saved: SystemTime,
    /// How many positions there are.
    pub num_positions: u64,
    path: PathBuf,
    lock_path: PathBuf,
    _lock: File,
}

/// Everything that was found.
#[derive(Debug, Default)]
pub struct Listing {
    /// What can be restored, the newest first.
    pub left: Vec<LeftBehind>,
    /// What was found and cannot be used; such files are left where they are.
    pub problems: Vec<AutosaveError>,
}

/// Finds what was left in `folder` (see [`folder`](super::folder)) by processes that no longer run.
///
/// Each file is read through once, to see that it is whole, and only its header kept. A folder that
/// is not there has nothing.
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
    // Before their locks are taken and kept.
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
    /// `None` if the process still runs, or another one has it.
    fn open(path: &Path) -> Result<Option<Self>, AutosaveError> {
        let lock_path = path.with_extension(LOCK);
        let Some(lock) = take_lock(&lock_path).map_err(|e| AutosaveError::read(path, e))? else {
            return Ok(None);
        };
        let Some((file, length)) = open_bounded(path)? else {
            return Ok(None);
        };
        let summary = format::summary(BufReader::new(file), length)
            .map_err(|error| AutosaveError::format(path, error))?;
        Ok(Some(Self {
            mesh: summary.mesh,
            fingerprint: summary.fingerprint,
            saved: summary.saved,
            num_positions: summary.num_positions,
            path: path.to_owned(),
            lock_path,
            _lock: lock,
        }))
    }

    /// Whether the file of the mesh is still the one that was edited.
    pub fn is_current(&self) -> bool {
        Fingerprint::of(&self.mesh).is_ok_and(|now| now == self.fingerprint)
    }

    /// Reads everything back.
    ///
    /// # Errors
    /// [`AutosaveError`] if the file is gone or damaged.
    pub fn read(&self) -> Result<Recovered, AutosaveError> {
        let Some((file, length)) = open_bounded(&self.path)? else {
            return Err(AutosaveError::read(&self.path, ErrorKind::NotFound.into()));
        };
        format::decode(BufReader::new(file), length)
            .map_err(|error| AutosaveError::format(&self.path, error))
    }

    /// Removes it: restored and put aside anew, or not wanted.
    ///
    /// # Errors
    /// [`AutosaveError::Write`] if the system refuses.
    pub fn remove(self) -> Result<(), AutosaveError> {
        remove_if_there(&self.path).map_err(|source| AutosaveError::write(&self.path, source))?;
        let _ = std::fs::remove_file(&self.lock_path);
        Ok(())
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Recovered {
    /// Whether this can be restored on a mesh: the file may be another one by now, and whoever can
    /// write the autosave can write anything into it.
    ///
    /// # Errors
    /// [`AutosaveError::Misfit`] with what does not fit.
    pub fn check(&self, mesh: &OpenedMesh) -> Result<(), AutosaveError> {
        let misfit = |problem: String| Err(AutosaveError::Misfit { problem });
        let (found, expected) = (self.positions.len(), mesh.processing.mesh().num_vertices());
        if found != expected {
            return misfit(format!(
                "it has {found} positions where the surface has {expected} vertices"
            ));
        }
        let is_finite = |p: &nalgebra::Point3<f64>| p.iter().all(|x| x.is_finite());
        if let Some(vertex) = self.positions.iter().position(|p| !is_finite(p)) {
            return misfit(format!("its position {vertex} is not finite"));
        }
        let mut vertices = self
            .groups
            .iter()
            .flat_map(|group| group.vertices.iter().copied());
        match vertices.find(|&vertex| mesh.processing.vertex(vertex).is_none()) {
            Some(vertex) => misfit(format!("a handle holds vertex {vertex}, which no face has")),
            None => Ok(()),
        }
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

/// The lock of a process that no longer runs; `None` if it runs. A lock file that is gone is made
/// anew, so that two processes do not restore the same.
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

/// A regular file of a length that is read, and that length; `None` if it is gone.
fn open_bounded(path: &Path) -> Result<Option<(File, u64)>, AutosaveError> {
    let failed = |error| AutosaveError::read(path, error);
    let corrupt = |problem: &str| AutosaveError::Corrupt {
        path: path.to_owned(),
        problem: problem.to_owned(),
    };
    // Asked before it is opened: a pipe would keep us waiting, and a link may lead anywhere.
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
        false => Ok(Some((file, length))),
    }
}

/// Of a process that put nothing aside and did not end well.
fn remove_lone_lock(path: &Path) {
    if path.with_extension(DATA).exists() {
        return;
    }
    // Locked while it is removed, which tells a process that was about to lock it.
    if let Ok(Some(_lock)) = take_lock(path) {
        let _ = std::fs::remove_file(path);
    }
}

/// Of a process that ended while it was writing; `NAME.….part`.
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
