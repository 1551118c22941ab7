//! Why a file of a program could not be read or written.

use std::io;
use std::path::PathBuf;

use cotan_io::IoError;
use thiserror::Error;

use crate::handles_file::HandlesError;

/// Why a file could not be read or written, with its path.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ToolError {
    /// A mesh file.
    #[error(transparent)]
    Io(#[from] IoError),
    /// A handles file.
    #[error("{}: {source}", path.display())]
    Handles {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        #[source]
        source: HandlesError,
    },
    /// A file or a folder that cannot be written.
    #[error("{}: cannot write: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system says.
        #[source]
        source: io::Error,
    },
    /// An output whose folder is not there.
    #[error("{}: the folder {} does not exist; make it first", path.display(), folder.display())]
    NoFolder {
        /// The file that was to be written.
        path: PathBuf,
        /// The folder that is missing.
        folder: PathBuf,
    },
}
