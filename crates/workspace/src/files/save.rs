//! Saving an edited mesh to a file, in one step or not at all.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use cotan::geometry::Positions;
use cotan_io::{Change, Document, Format, IoError, ProcessingMesh, link_target, num_names};
use cotan_tool::files::folder_of;
use thiserror::Error;

use super::Fingerprint;

/// The file expected at the path of a save.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Expect {
    /// The file that was opened, unchanged since then. It may also have been deleted.
    Unchanged(Fingerprint),
    /// No file.
    Absent,
    /// Any file: the user agreed to replace it.
    Anything,
}

/// The result of a save.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Saved {
    /// The fingerprint of the new file, to be expected by the next save.
    pub fingerprint: Fingerprint,
    /// Information that the mesh has but the file lacks, one sentence each.
    pub losses: Vec<String>,
}

/// The reason why a mesh was not saved, as one sentence that names the file.
///
/// An existing file is left unchanged.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SaveError {
    /// The extension is not that of a mesh format.
    #[error("{}: unknown file extension; use {known}, optionally followed by .gz", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// The known extensions.
        known: String,
    },
    /// The folder does not exist.
    #[error("{}: the folder {} does not exist; make it first, or save elsewhere", path.display(), folder.display())]
    NoFolder {
        /// The file.
        path: PathBuf,
        /// The folder.
        folder: PathBuf,
    },
    /// The path is a folder, a pipe or a device.
    #[error("{}: this is no file that could be replaced; save under another name", path.display())]
    NotAFile {
        /// The file.
        path: PathBuf,
    },
    /// The file is not writable.
    #[error("{}: the file is read-only; save under another name, or allow writing it", path.display())]
    ReadOnlyFile {
        /// The file.
        path: PathBuf,
    },
    /// The folder is not writable.
    #[error("{}: nothing can be written to the folder {}; save elsewhere", path.display(), folder.display())]
    ReadOnlyFolder {
        /// The file.
        path: PathBuf,
        /// The folder.
        folder: PathBuf,
    },
    /// The disk is full, or the user's quota on it is used up.
    #[error("{}: the disk is full; the file is as it was. Make room, or save elsewhere", path.display())]
    Full {
        /// The file.
        path: PathBuf,
    },
    /// Another program has changed the file.
    #[error("{}: the file was changed by another program since it was opened; save under another name, or replace it", path.display())]
    Changed {
        /// The file.
        path: PathBuf,
    },
    /// The file already exists.
    #[error("{}: there is a file of that name already; save under another name, or replace it", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The mesh cannot be written in this format, or its positions are not finite.
    #[error("{}: {source}", path.display())]
    Document {
        /// The file.
        path: PathBuf,
        /// The error of the writer.
        #[source]
        source: IoError,
    },
    /// Any other error of the system.
    #[error("{}: cannot write the file: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        #[source]
        source: io::Error,
    },
}

impl SaveError {
    /// Returns `true` if saving with [`Expect::Anything`] would succeed.
    pub fn is_overridable(&self) -> bool {
        matches!(self, Self::Changed { .. } | Self::Exists { .. })
    }
}

/// Saves `document` with its surface vertices at `positions`, in the format of the extension.
///
/// The document itself keeps its rest shape. The file is written next to the old one and replaces
/// it in one step. A read-only file is refused even though it could be replaced.
///
/// # Errors
/// [`SaveError`]. An existing file stays intact.
pub fn save(
    document: &Document,
    processing: &ProcessingMesh,
    positions: &Positions<f64>,
    path: &Path,
    expect: Expect,
) -> Result<Saved, SaveError> {
    let format = format(path)?;
    check_place(path, expect)?;
    let other_names = std::fs::metadata(path).map_or(0, |old| num_names(&old) - 1);
    let of_document = |source| SaveError::Document {
        path: path.to_owned(),
        source: without_path(source),
    };
    let mut moved = document.clone();
    moved
        .set_positions(processing, positions)
        .map_err(of_document)?;
    let saved = cotan_io::save(&moved, path).map_err(|error| match without_path(error) {
        IoError::Write(source) => write_error(path, source),
        source => of_document(source),
    })?;
    let fingerprint = Fingerprint::of(path).map_err(|source| write_error(path, source))?;
    let mut losses = saved.left;
    losses.extend(moved.losses(format));
    if other_names > 0 {
        losses.push(format!(
            "the file had {other_names} more names (hard links), which keep the old content"
        ));
    }
    Ok(Saved {
        fingerprint,
        losses,
    })
}

/// The changes of a repair that a file in `format` cannot express, one sentence each.
pub fn forgotten(format: Format, changes: &[Change]) -> Vec<String> {
    let is_parting = |change: &Change| {
        matches!(
            change,
            Change::SplitVertex { .. } | Change::PartedPlace { .. } | Change::DetachedFace { .. }
        )
    };
    let by_place = matches!(format, Format::Gltf | Format::Glb | Format::Stl);
    if !by_place || !changes.iter().any(is_parting) {
        return Vec::new();
    }
    vec![format!(
        "{format} cannot store several vertices at one position: vertices that the repair split are \
         merged again when the file is opened"
    )]
}

fn format(path: &Path) -> Result<Format, SaveError> {
    Format::from_path(path).ok_or_else(|| {
        let [first @ .., last] = Format::ALL.map(Format::extension);
        SaveError::UnknownFormat {
            path: path.to_owned(),
            known: format!(".{} or .{last}", first.join(", .")),
        }
    })
}

/// Checks conditions that a rename would not detect.
pub(super) fn check_place(path: &Path, expect: Expect) -> Result<(), SaveError> {
    let owned = || path.to_owned();
    // For a link, the folder of its target.
    let target = link_target(path).map_err(|source| write_error(path, source))?;
    let folder = folder_of(&target);
    let folder_metadata = match std::fs::metadata(folder) {
        Ok(metadata) if metadata.is_dir() => metadata,
        Err(source) if source.kind() == ErrorKind::PermissionDenied => {
            return Err(write_error(path, source));
        }
        _ => {
            return Err(SaveError::NoFolder {
                path: owned(),
                folder: folder.to_owned(),
            });
        }
    };
    match std::fs::metadata(path) {
        Ok(metadata) => {
            if !metadata.is_file() {
                return Err(SaveError::NotAFile { path: owned() });
            }
            let known = match expect {
                Expect::Unchanged(known) => Some(known),
                Expect::Absent => return Err(SaveError::Exists { path: owned() }),
                Expect::Anything => None,
            };
            if known.is_some_and(|known| known != Fingerprint::from_metadata(&metadata)) {
                return Err(SaveError::Changed { path: owned() });
            }
            // The permission bits also count for the superuser, whom the system would allow to
            // write.
            if metadata.permissions().readonly() || is_denied(path) {
                return Err(SaveError::ReadOnlyFile { path: owned() });
            }
        }
        Err(error) if error.kind() == ErrorKind::NotFound => {}
        Err(error) => return Err(write_error(path, error)),
    }
    if is_marked_read_only(&folder_metadata) {
        let folder = folder.to_owned();
        return Err(SaveError::ReadOnlyFolder {
            path: owned(),
            folder,
        });
    }
    Ok(())
}

/// Returns `true` if the system refuses to open a file for writing. Nothing is written.
fn is_denied(path: &Path) -> bool {
    let opened = std::fs::OpenOptions::new().write(true).open(path);
    opened.is_err_and(|error| {
        matches!(
            error.kind(),
            ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem
        )
    })
}

/// Returns `true` if a folder is marked read-only.
///
/// On Windows the mark does not affect the files in it.
fn is_marked_read_only(folder: &std::fs::Metadata) -> bool {
    cfg!(unix) && folder.permissions().readonly()
}

pub(super) fn write_error(path: &Path, source: io::Error) -> SaveError {
    let path = path.to_owned();
    match source.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => SaveError::Full { path },
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => SaveError::ReadOnlyFolder {
            folder: folder_of(&path).to_owned(),
            path,
        },
        ErrorKind::NotFound => SaveError::NoFolder {
            folder: folder_of(&path).to_owned(),
            path,
        },
        _ => SaveError::Write { path, source },
    }
}

/// Removes the path from an error whose message is embedded in one that names it.
fn without_path(error: IoError) -> IoError {
    match error {
        IoError::InFile { source, .. } => *source,
        error => error,
    }
}

#[cfg(test)]
mod tests;
