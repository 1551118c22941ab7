//! What ends a command with exit code 1.

use std::io;
use std::path::{Path, PathBuf};

use cotan::halfedge::{BuildError, VertexId};
use cotan::sphere::SphereError;
use cotan_io::{IoError, Repaired, Weld};
use thiserror::Error;

use crate::files;
use crate::handles_file::{FileVertices, HandlesError};
use crate::inspect::weld_option;
use crate::sphere::LandmarksError;

/// Why a command could not do its work.
#[derive(Debug, Error)]
pub(crate) enum CliError {
    /// A mesh file that cannot be read, built from, or written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// A mesh from which no surface can be built, and what to do about it.
    #[error("{}: {source}; {remedy}", path.display())]
    Unsound {
        path: PathBuf,
        source: Box<BuildError>,
        remedy: String,
    },
    /// A handles file.
    #[error("{}: {source}", path.display())]
    Handles {
        path: PathBuf,
        #[source]
        source: HandlesError,
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
        remedy: &'static str,
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
    /// An output whose folder is not there.
    #[error("{}: the folder {} does not exist; make it first", path.display(), folder.display())]
    NoFolder { path: PathBuf, folder: PathBuf },
    /// Standard output.
    #[error("cannot write to standard output: {0}")]
    Output(#[source] io::Error),
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
    /// Why no surface can be built, with the repair that helps.
    pub(crate) fn surface(path: &Path, error: IoError, cure: Cure, weld: Weld) -> Self {
        let (source, method) = match (error.cure(), error) {
            (Some(method), IoError::NotManifold(source)) => (Box::new(source), method),
            (_, error) => return Self::Io(files::in_file(path, error)),
        };
        let is_safe = method != "split_edges";
        let method = match cure {
            // What the safe repairs left over is left by all but one.
            Cure::Beyond => "split_edges",
            _ => method,
        };
        let mut option = format!("--{}", method.replace('_', "-"));
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

/// The same error with vertices as the file numbers them.
pub(crate) fn in_file_numbers(
    error: cotan::Error,
    processing: &cotan_io::ProcessingMesh,
    file_vertices: Option<&FileVertices>,
) -> cotan::Error {
    use cotan::Error;
    use cotan::flow::FlowError;
    use cotan::geometry::SurfaceError;
    use cotan::laplacian::SchemeError;
    use cotan::linear::LinearError;

    let file = |v: VertexId| {
        if v.index() < processing.mesh().num_vertices() {
            let vertex = processing.document_vertex(v);
            VertexId::new(file_vertices.map_or(vertex, |file| file.vertex(vertex)))
        } else {
            v
        }
    };
    let linear = |error| match error {
        LinearError::ComponentWithoutHandle {
            vertex,
            num_vertices,
        } => LinearError::ComponentWithoutHandle {
            vertex: file(vertex),
            num_vertices,
        },
        LinearError::DuplicateHandle { vertex } => LinearError::DuplicateHandle {
            vertex: file(vertex),
        },
        LinearError::HandleWeight { vertex, weight } => LinearError::HandleWeight {
            vertex: file(vertex),
            weight,
        },
        other => other,
    };
    let surface = |error| match error {
        SurfaceError::NonFinite { vertex } => SurfaceError::NonFinite {
            vertex: file(vertex),
        },
        other => other,
    };
    let scheme = |error| match error {
        SchemeError::NonFiniteWeight { scheme, vertices } => SchemeError::NonFiniteWeight {
            scheme,
            vertices: vertices.map(file),
        },
        other => other,
    };
    match error {
        Error::Contradiction { groups, vertex } => Error::Contradiction {
            groups,
            vertex: file(vertex),
        },
        Error::Surface(error) => Error::Surface(surface(error)),
        Error::Scheme(error) => Error::Scheme(scheme(error)),
        Error::Flow(FlowError::Scheme(error)) => Error::Flow(FlowError::Scheme(scheme(error))),
        Error::Flow(FlowError::Surface(error)) => Error::Flow(FlowError::Surface(surface(error))),
        Error::Flow(FlowError::Linear(error)) => Error::Flow(FlowError::Linear(linear(error))),
        Error::Flow(FlowError::NonFiniteTarget { vertex }) => {
            Error::Flow(FlowError::NonFiniteTarget {
                vertex: file(vertex),
            })
        }
        other => other,
    }
}

/// The same error with vertices and faces as the file had them before a repair.
pub(crate) fn before_repair(error: IoError, repaired: &Repaired) -> IoError {
    let vertex = |v: VertexId| {
        let source = repaired.vertex_sources.get(v.index());
        source.map_or(v, |&source| VertexId::new(source))
    };
    let face = |f: usize| {
        let source = repaired.face_sources.get(f).copied().flatten();
        source.unwrap_or(f)
    };
    let IoError::NotManifold(error) = error else {
        return error;
    };
    IoError::NotManifold(error.renumbered(vertex, face))
}
