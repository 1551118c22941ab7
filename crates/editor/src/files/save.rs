//! From an edited mesh back to a file, in one step or not at all.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use cotan::geometry::Positions;
use cotan_io::{Change, Document, Format, IoError, ProcessingMesh, link_target, num_names};
use cotan_tool::files::folder_of;
use thiserror::Error;

use super::Fingerprint;

/// What is to be in the place where a mesh is saved.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Expect {
    /// The file that was opened, as it was then; or none, if it was deleted since.
    Unchanged(Fingerprint),
    /// No file.
    Absent,
    /// Whatever there is: a person has said that it may be replaced.
    Anything,
}

/// What a save left.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Saved {
    /// The file as it is now; to be expected by the next save.
    pub fingerprint: Fingerprint,
    /// What the file does not say though the mesh has it, one sentence each.
    pub losses: Vec<String>,
}

/// Why a mesh was not saved: one sentence that names the file. An older file is as it was.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SaveError {
    /// The extension is none of a mesh.
    #[error("{}: the name tells no format; end it in {known}, also with .gz behind", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// The extensions that are known.
        known: String,
    },
    /// The folder is not there.
    #[error("{}: the folder {} does not exist; make it first, or save elsewhere", path.display(), folder.display())]
    NoFolder {
        /// The file.
        path: PathBuf,
        /// The folder.
        folder: PathBuf,
    },
    /// There is a folder, a pipe or a device of that name.
    #[error("{}: this is no file that could be replaced; save under another name", path.display())]
    NotAFile {
        /// The file.
        path: PathBuf,
    },
    /// The file may not be written.
    #[error("{}: the file is read-only; save under another name, or allow writing it", path.display())]
    ReadOnlyFile {
        /// The file.
        path: PathBuf,
    },
    /// The folder may not be written.
    #[error("{}: nothing can be written to the folder {}; save elsewhere", path.display(), folder.display())]
    ReadOnlyFolder {
        /// The file.
        path: PathBuf,
        /// The folder.
        folder: PathBuf,
    },
    /// The disk, or what one may have of it, is full.
    #[error("{}: the disk is full; the file is as it was. Make room, or save elsewhere", path.display())]
    Full {
        /// The file.
        path: PathBuf,
    },
    /// Another program wrote the file.
    #[error("{}: the file was changed by another program since it was opened; save under another name, or replace it", path.display())]
    Changed {
        /// The file.
        path: PathBuf,
    },
    /// There is a file already.
    #[error("{}: there is a file of that name already; save under another name, or replace it", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The mesh cannot be written in that format, or its positions are no numbers.
    #[error("{}: {source}", path.display())]
    Document {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        #[source]
        source: IoError,
    },
    /// What else the system says.
    #[error("{}: cannot write the file: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What it says.
        #[source]
        source: io::Error,
    },
}

impl SaveError {
    /// Whether [`Expect::Anything`] would save nevertheless.
    pub fn is_overridable(&self) -> bool {
        matches!(self, Self::Changed { .. } | Self::Exists { .. })
    }
}

/// Saves `document` with the vertices of its surface at `positions`, in the format of the
/// extension.
///
/// The document itself stays at rest. The file is written beside the old one and takes its place in
/// one step; a file that may not be written is refused, though it could be replaced.
///
/// # Errors
/// [`SaveError`]; an older file is whole then.
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

/// What a file in `format` cannot tell of what a repair did, one sentence each.
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
        "{format} stores positions, not which vertices are one; what the repair parted at the same \
         position meets again when the file is opened"
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

/// Refuses what a change of names alone would not notice.
fn check_place(path: &Path, expect: Expect) -> Result<(), SaveError> {
    let owned = || path.to_owned();
    // Of a link, the folder that it leads to.
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
            // The bits count for the superuser, too, whom the system would let write.
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

/// Whether the system refuses to open a file for writing; nothing is written.
fn is_denied(path: &Path) -> bool {
    let opened = std::fs::OpenOptions::new().write(true).open(path);
    opened.is_err_and(|error| {
        matches!(
            error.kind(),
            ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem
        )
    })
}

/// Of a folder. On Windows the mark says nothing about the files in it.
fn is_marked_read_only(folder: &std::fs::Metadata) -> bool {
    cfg!(unix) && folder.permissions().readonly()
}

fn write_error(path: &Path, source: io::Error) -> SaveError {
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

/// The error without the path that it names, where one is said around it.
fn without_path(error: IoError) -> IoError {
    match error {
        IoError::InFile { source, .. } => *source,
        error => error,
    }
}

#[cfg(test)]
mod tests;
