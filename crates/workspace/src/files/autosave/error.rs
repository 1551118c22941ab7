//! Errors of autosaving and of restoring.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::format::FormatError;

/// The reason why an autosave could not be written or read, as one sentence that names the file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum AutosaveError {
    /// The system has no folder for the user's data.
    #[error(
        "there is no folder for autosaves: no home folder is known; name one by COTAN_EDITOR_DATA"
    )]
    NoFolder,
    /// The disk is full, or the user's quota on it is used up.
    #[error("{}: the disk is full; the autosave before is kept", path.display())]
    Full {
        /// The file.
        path: PathBuf,
    },
    /// The file or the folder cannot be written.
    #[error("{}: cannot write the autosave: {source}", path.display())]
    Write {
        /// The file or the folder.
        path: PathBuf,
        /// The error of the system.
        #[source]
        source: io::Error,
    },
    /// The file or the folder cannot be read.
    #[error("{}: cannot read the autosave: {source}", path.display())]
    Read {
        /// The file or the folder.
        path: PathBuf,
        /// The error of the system.
        #[source]
        source: io::Error,
    },
    /// The file is not an autosave, or it is damaged.
    #[error("{}: this autosave cannot be used: {problem}", path.display())]
    Corrupt {
        /// The file.
        path: PathBuf,
        /// The defect.
        problem: String,
    },
    /// The record belongs to another mesh.
    #[error("the autosave does not belong to this mesh: {problem}")]
    Misfit {
        /// The mismatch.
        problem: String,
    },
}

impl AutosaveError {
    pub(super) fn write(path: &Path, source: io::Error) -> Self {
        let path = path.to_owned();
        match source.kind() {
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded => Self::Full { path },
            _ => Self::Write { path, source },
        }
    }

    pub(super) fn read(path: &Path, source: io::Error) -> Self {
        let path = path.to_owned();
        Self::Read { path, source }
    }

    pub(super) fn format(path: &Path, error: FormatError) -> Self {
        match error {
            FormatError::Read(source) => Self::read(path, source),
            FormatError::Corrupt(problem) => Self::Corrupt {
                path: path.to_owned(),
                problem,
            },
        }
    }
}
