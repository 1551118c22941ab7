//! What ends a command with exit code 1, or 2 where it was used wrongly.

use std::io;
use std::path::{Path, PathBuf};

use cotan::halfedge::BuildError;
use cotan::sphere::SphereError;
use cotan_io::{IoError, Weld};
use cotan_tool::paths::Conflict;
use cotan_tool::{MemoryError, ToolError};
use thiserror::Error;

use crate::files;
use crate::inspect::weld_option;
use crate::sphere::LandmarksError;

/// Why a command could not do its work.
#[derive(Debug, Error)]
pub(crate) enum CliError {
    /// A mesh file that cannot be read, built from, or written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// An output that is an input or another output.
    #[error(transparent)]
    Conflict(Box<Conflict>),
    /// A handles file, or an output that cannot be written.
    #[error(transparent)]
    Tool(#[from] ToolError),
    /// A mesh from which no surface can be built, and what to do about it.
    #[error("{}: {source}; {remedy}", path.display())]
    Unsound {
        path: PathBuf,
        source: Box<BuildError>,
        remedy: String,
    },
    /// A mesh that cannot be edited or measured.
    #[error("{}: {source}", path.display())]
    Mesh {
        path: PathBuf,
        #[source]
        source: cotan::Error,
    },
    /// A mesh that cannot be mapped to the sphere.
    #[error("{}: {source}{remedy}", path.display())]
    Sphere {
        path: PathBuf,
        #[source]
        source: SphereError,
        /// What else is to be said; may be empty.
        remedy: String,
    },
    /// Work that would take too much memory.
    #[error("{}: {source}", path.display())]
    Memory {
        path: PathBuf,
        #[source]
        source: MemoryError,
    },
    /// A file of landmarks.
    #[error("{}: {source}", path.display())]
    Landmarks {
        path: PathBuf,
        #[source]
        source: LandmarksError,
    },
    /// Two files that cannot be compared.
    #[error("{} and {} cannot be compared: {problem}", paths[0].display(), paths[1].display())]
    Compare {
        paths: [PathBuf; 2],
        problem: String,
    },
    /// A field that the file does not hold.
    #[error("{}: the vertices have no finite number \"{name}\"; their numbers are: {known}", path.display())]
    NoField {
        path: PathBuf,
        name: String,
        known: String,
    },
    /// A report, a picture or a folder that cannot be written.
    #[error("{}: cannot write: {source}", path.display())]
    Write {
        path: PathBuf,
        #[source]
        source: io::Error,
    },
    /// Standard output.
    #[error("cannot write to standard output: {0}")]
    Output(#[source] io::Error),
    /// The editor is another package, which may not be there.
    #[error(
        "the program `cotan-editor` is neither beside this one nor on the PATH; install it with \
         `cargo install cotan-editor`, or build it in a checkout with `cargo build -p cotan-editor`"
    )]
    NoEditor,
    /// A program that is there and does not start.
    #[error("{}: cannot start: {source}", program.display())]
    Start {
        program: PathBuf,
        #[source]
        source: io::Error,
    },
    /// The thread pool.
    #[error("cannot start {threads} threads: {problem}; ask for fewer with --threads")]
    Threads { threads: usize, problem: String },
}

/// What can be said about repairs where a surface cannot be built.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Cure {
    /// There is a command for it.
    Command,
    /// The command at hand has `--repair`, too.
    Offered,
    /// `--repair` was given and is not enough.
    Beyond,
}

impl CliError {
    /// The exit code of a command that ends with this error.
    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            Self::Conflict(_) => 2,
            _ => 1,
        }
    }

    /// Why no surface can be built, with the repair that helps.
    pub(crate) fn surface(path: &Path, error: IoError, cure: Cure, weld: Weld) -> Self {
        let (source, needed) = match (error.cure(), error) {
            (Some(needed), IoError::NotManifold(source)) => (Box::new(source), needed),
            (_, error) => return Self::Io(files::in_file(path, error)),
        };
        let is_safe = needed != cotan_io::Cure::SplitEdges;
        let needed = match cure {
            // What the safe repairs left over is left by all but one.
            Cure::Beyond => cotan_io::Cure::SplitEdges,
            _ => needed,
        };
        let mut option = cotan_tool::repair::option(needed).to_owned();
        // What was welded and parted must not be welded again.
        let mut then = "";
        if let Some(weld) = weld_option(weld) {
            option = format!("{weld} {option}");
            then = " and leave --weld out then";
        }
        let remedy = match cure {
            Cure::Command => format!("repair with `cotan repair {option}`"),
            Cure::Offered if is_safe => {
                format!("repair with `cotan repair {option}`{then}, or pass --repair")
            }
            Cure::Offered => format!("repair with `cotan repair {option}` first{then}"),
            Cure::Beyond => {
                format!(
                    "--repair does not go so far: repair with `cotan repair {option}` first{then}"
                )
            }
        };
        Self::Unsound {
            path: path.to_owned(),
            source,
            remedy,
        }
    }
}
