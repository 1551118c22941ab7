//! What can be wrong with a handles file.

use std::fmt;
use std::path::PathBuf;

use thiserror::Error;

/// Where in the file a handle stands.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub(crate) enum Place {
    /// A member of the list `handles`, counted from 0.
    Handle(usize),
    /// A line, counted from 1.
    Line(usize),
    /// Nowhere: it holds still what no handle holds.
    Loose,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Handle(number) => write!(f, "handle {number}"),
            Self::Line(number) => write!(f, "line {number}"),
            Self::Loose => f.write_str("a component without a handle"),
        }
    }
}

/// Why a handles file was refused. Vertices have the numbers of the mesh file, from 0; so have
/// handles in JSON.
#[derive(Debug, Error)]
pub(crate) enum HandlesError {
    #[error("cannot read the file: {0}")]
    Read(#[source] std::io::Error),
    #[error("this is not a text file; handles are JSON, lines of `vertex x y z`, or a .sel file")]
    NotText,
    #[error("the JSON is not a handles file: {0} (see `cotan deform --help`)")]
    Json(#[source] serde_json::Error),
    #[error("there is no handle; hold at least one vertex")]
    NoHandles,
    #[error(
        "{place}: there is no vertex {vertex}; the mesh has {num_vertices} vertices, numbered from 0"
    )]
    OutOfRange {
        place: Place,
        vertex: usize,
        num_vertices: usize,
    },
    #[error(
        "{place}: vertex {vertex} belongs to no face, so nothing would follow it; leave it out"
    )]
    Unreferenced { place: Place, vertex: usize },
    #[error("{place} holds no vertex: {why}")]
    Empty { place: Place, why: &'static str },
    #[error("{place} {problem}")]
    Invalid { place: Place, problem: String },
    #[error("{place} has {vertices} vertices but {targets} positions in \"to\"; give one a vertex")]
    TargetCount {
        place: Place,
        vertices: usize,
        targets: usize,
    },
    #[error("{place}: the new position of vertex {vertex} is not a finite number")]
    NonFinite { place: Place, vertex: usize },
    #[error("{} and {} contradict each other: they want vertex {vertex} at two places", places[0], places[1])]
    Contradiction { places: [Place; 2], vertex: usize },
    #[error("line {line}: {problem}")]
    Line { line: usize, problem: String },
    #[error(
        "{statuses} lines of status, but the mesh has {num_vertices} vertices; give one line a vertex"
    )]
    StatusCount {
        statuses: usize,
        num_vertices: usize,
    },
    #[error("status 2 needs a matrix: put it into {} or name its file with --def", beside.display())]
    NoDef { beside: PathBuf },
    #[error("the matrix {0}")]
    Matrix(String),
}
