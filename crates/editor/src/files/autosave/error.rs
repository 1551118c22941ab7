//! Why something could not be put aside, or not be found again.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::format::FormatError;

/// Why an autosave could not be written or read: one sentence that names the file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum AutosaveError {
    /// The system has no folder for the user's data.
    #[error(
        "there is no folder for autosaves: no home folder is known; name one by COTAN_EDITOR_DATA"
    )]
    NoFolder,
    /// The disk, or what one may have of it, is full.
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
        /// What the system says.
        #[source]
        source: io::Error,
    },
    /// The file or the folder cannot be read.
    #[error("{}: cannot read the autosave: {source}", path.display())]
    Read {
        /// The file or the folder.
        path: PathBuf,
        /// What the system says.
        #[source]
        source: io::Error,
    },
    /// A file that is no autosave, or no longer.
    #[error("{}: this autosave cannot be used: {problem}", path.display())]
    Corrupt {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// A record of another mesh than the one at hand.
    #[error("the autosave does not belong to this mesh: {problem}")]
    Misfit {
        /// What does not fit.
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
