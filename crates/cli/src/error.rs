//! Errors that end a command with exit code 1, or 2 for wrong usage.

use std::error::Error;
use std::io;
use std::path::{Path, PathBuf};

use cotan::halfedge::BuildError;
use cotan::sphere::SphereError;
use cotan_io::{IoError, Weld};
use cotan_tool::files::in_file;
use cotan_tool::part_names::UnknownPart;
use cotan_tool::paths::Conflict;
use cotan_tool::repair::weld_option;
use cotan_tool::{MemoryError, ToolError};

/// The reason why a command failed.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CliError {
    /// A mesh file cannot be read, built or written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// An output is also an input or another output.
    #[error(transparent)]
    Conflict(Box<Conflict>),
    /// A handles file is invalid, or an output cannot be written.
    #[error(transparent)]
    Tool(#[from] ToolError),
    /// No surface can be built from the mesh. Includes a remedy.
    #[error("{}: {source}; {remedy}", path.display())]
    Unsound {
        path: PathBuf,
        source: Box<BuildError>,
        remedy: String,
    },
    /// The mesh cannot be edited or measured.
    #[error("{}: {source}", path.display())]
    Mesh {
        path: PathBuf,
        #[source]
        source: cotan::Error,
    },
    /// The mesh cannot be remeshed, decimated or subdivided.
    #[error("{}: {source}", path.display())]
    Tessellation {
        path: PathBuf,
        #[source]
        source: cotan::surface::TessellationError,
    },
    /// The mesh cannot be mapped to the sphere.
    #[error("{}: {source}{remedy}", path.display())]
    Sphere {
        path: PathBuf,
        #[source]
        source: SphereError,
        /// Further advice; may be empty.
        remedy: String,
    },
    /// The work would take too much memory.
    #[error("{}: {source}", path.display())]
    Memory {
        path: PathBuf,
        #[source]
        source: MemoryError,
    },
    /// A file read in addition to the mesh is invalid, such as one of landmarks.
    #[error("{}: {source}", path.display())]
    File {
        path: PathBuf,
        #[source]
        source: Box<dyn Error + Send + Sync>,
    },
    /// The two files cannot be compared.
    #[error("{} and {} cannot be compared: {problem}", paths[0].display(), paths[1].display())]
    Compare {
        paths: [PathBuf; 2],
        problem: String,
    },
    /// Distances along a mesh cannot be measured.
    #[error("{}: {source}", path.display())]
    Distances {
        path: PathBuf,
        #[source]
        source: cotan::surface::DistanceError,
    },
    /// No face has the vertex that an option names.
    #[error("{}: vertex {vertex} is on no face; the vertices are 0 to {}", path.display(), num_vertices.saturating_sub(1))]
    NoVertex {
        path: PathBuf,
        vertex: usize,
        num_vertices: usize,
    },
    /// The file has no such field.
    #[error("{}: the vertices have no finite values of \"{name}\"; their scalar properties are: {known}", path.display())]
    NoField {
        path: PathBuf,
        name: String,
        known: String,
    },
    /// An option counts a property that the file does not have.
    #[error("{}: there is no \"{property}\" on its vertices or corners; omit {option}", path.display())]
    NoProperty {
        path: PathBuf,
        property: &'static str,
        option: &'static str,
    },
    /// The part that `--mask` or `--region` names has no vertex.
    #[error("{}: the part that is to move has no vertex; check the numbers of --mask or --region (cotan info shows the size of the mesh)", path.display())]
    EmptyPart { path: PathBuf },
    /// A report, a picture or a folder cannot be written.
    #[error("{}: cannot write: {source}", path.display())]
    Write {
        path: PathBuf,
        #[source]
        source: io::Error,
    },
    /// Standard output cannot be written.
    #[error("cannot write to standard output: {0}")]
    Output(#[source] io::Error),
    /// The editor, which is a separate package, is not installed.
    #[error(
        "the program `cotan-editor` is neither next to this one nor on the PATH; install it with \
         `cargo install cotan-editor`, or build it in a checkout with `cargo build -p cotan-editor`"
    )]
    NoEditor,
    /// A program exists but cannot be started.
    #[error("{}: cannot start: {source}", program.display())]
    Start {
        program: PathBuf,
        #[source]
        source: io::Error,
    },
    /// The words after --parts do not go together.
    #[error("--parts {0}: write `follow`, `still`, or `only` and the names or numbers of parts")]
    Parts(String),
    /// A part that the model does not have.
    #[error("{}: {source}", path.display())]
    Part {
        path: PathBuf,
        #[source]
        source: UnknownPart,
    },
    /// The thread pool cannot be started.
    #[error("cannot start {threads} threads: {problem}; ask for fewer with --threads")]
    Threads { threads: usize, problem: String },
}

/// The repair that an error message can suggest when no surface can be built.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Cure {
    /// The `repair` command.
    Command,
    /// The `--repair` option of the current command.
    Offered,
    /// None of the safe repairs: `--repair` was given and was not enough.
    Beyond,
}

impl CliError {
    /// The exit code of a command that ends with this error.
    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            Self::Conflict(_) | Self::Parts(_) => 2,
            _ => 1,
        }
    }

    /// Makes the error for a mesh without a surface, with the repair that helps.
    pub(crate) fn surface(path: &Path, error: IoError, cure: Cure, weld: Weld) -> Self {
        let (source, needed) = match (error.cure(), error) {
            (Some(needed), IoError::NotManifold(source)) => (Box::new(source), needed),
            (_, error) => return Self::Io(in_file(path, error)),
        };
        let is_safe = needed != cotan_io::Cure::SplitEdges;
        let needed = match cure {
            // Splitting edges is the only cure for defects that the safe repairs leave.
            Cure::Beyond => cotan_io::Cure::SplitEdges,
            _ => needed,
        };
        let mut option = cotan_tool::repair::option(needed).to_owned();
        // After welding and splitting, the mesh must not be welded again.
        let mut then = "";
        if let Some(weld) = weld_option(weld) {
            option = format!("{weld} {option}");
            then = " and then omit --weld";
        }
        let remedy = match cure {
            Cure::Command => format!("repair with `cotan repair {option}`"),
            Cure::Offered if is_safe => {
                format!("repair with `cotan repair {option}`{then}, or pass --repair")
            }
            Cure::Offered => format!("repair with `cotan repair {option}` first{then}"),
            Cure::Beyond => {
                format!("--repair is not enough: repair with `cotan repair {option}` first{then}")
            }
        };
        Self::Unsound {
            path: path.to_owned(),
            source,
            remedy,
        }
    }
}
