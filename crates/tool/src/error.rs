//! Errors while reading or writing a file of a program.
//!
//! The readers of handles files return this error, which adds the path to theirs.

use std::io;
use std::path::PathBuf;

use cotan_io::IoError;
use thiserror::Error;

use crate::handles_file::HandlesError;

/// An error while reading or writing a file, with its path.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ToolError {
    /// An error of a mesh file.
    #[error(transparent)]
    Io(#[from] IoError),
    /// An error of a handles file.
    #[error("{}: {source}", path.display())]
    Handles {
        /// The file.
        path: PathBuf,
        /// The error.
        #[source]
        source: HandlesError,
    },
    /// A file or a folder that cannot be written.
    #[error("{}: cannot write: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        #[source]
        source: io::Error,
    },
    /// The folder of an output does not exist.
    #[error("{}: the folder {} does not exist; make it first", path.display(), folder.display())]
    NoFolder {
        /// The output file.
        path: PathBuf,
        /// The missing folder.
        folder: PathBuf,
    },
}
