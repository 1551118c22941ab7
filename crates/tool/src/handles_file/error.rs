//! What can be wrong with a handles file.

use std::fmt;
use std::path::PathBuf;

use thiserror::Error;

/// Where in the file a handle stands.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum Place {
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
#[non_exhaustive]
pub enum HandlesError {
    /// The file cannot be had.
    #[error("cannot read the file: {0}")]
    Read(#[source] std::io::Error),
    /// The file is not UTF-8.
    #[error("this is not a text file; handles are JSON, lines of `vertex x y z`, or a .sel file")]
    NotText,
    /// JSON with a wrong syntax or wrong keys.
    #[error("the JSON is not a handles file: {0} (see `cotan deform --help`)")]
    Json(#[source] serde_json::Error),
    /// A file that holds no vertex.
    #[error("there is no handle; hold at least one vertex")]
    NoHandles,
    /// A vertex that is not there.
    #[error(
        "{place}: there is no vertex {vertex}; the mesh has {num_vertices} vertices, numbered from 0"
    )]
    OutOfRange {
        /// Where the handle stands.
        place: Place,
        /// The vertex.
        vertex: usize,
        /// How many there are.
        num_vertices: usize,
    },
    /// A vertex that no face uses.
    #[error(
        "{place}: vertex {vertex} belongs to no face, so nothing would follow it; leave it out"
    )]
    Unreferenced {
        /// Where the handle stands.
        place: Place,
        /// The vertex.
        vertex: usize,
    },
    /// A handle without a vertex.
    #[error("{place} holds no vertex: {why}")]
    Empty {
        /// Where the handle stands.
        place: Place,
        /// What its selection lacks.
        why: &'static str,
    },
    /// A handle that makes no sense.
    #[error("{place} {problem}")]
    Invalid {
        /// Where the handle stands.
        place: Place,
        /// What is wrong, and what to do.
        problem: String,
    },
    /// Not one target a vertex.
    #[error("{place} has {vertices} vertices but {targets} positions in \"to\"; give one a vertex")]
    TargetCount {
        /// Where the handle stands.
        place: Place,
        /// How many vertices it has.
        vertices: usize,
        /// How many targets it has.
        targets: usize,
    },
    /// A target that is not finite.
    #[error("{place}: the new position of vertex {vertex} is not a finite number")]
    NonFinite {
        /// Where the handle stands.
        place: Place,
        /// The vertex.
        vertex: usize,
    },
    /// A vertex that two handles move differently.
    #[error("{} and {} contradict each other: they want vertex {vertex} at two places", places[0], places[1])]
    Contradiction {
        /// Where the two handles stand.
        places: [Place; 2],
        /// The vertex.
        vertex: usize,
    },
    /// A line that cannot be read.
    #[error("line {line}: {problem}")]
    Line {
        /// The line, counted from 1.
        line: usize,
        /// What is wrong with it.
        problem: String,
    },
    /// A `.sel` file of another mesh.
    #[error(
        "{statuses} lines of status, but the mesh has {num_vertices} vertices; give one line a vertex"
    )]
    StatusCount {
        /// How many lines there are.
        statuses: usize,
        /// How many vertices there are.
        num_vertices: usize,
    },
    /// A `.sel` file that moves vertices, without the matrix.
    #[error("status 2 needs a matrix: put it into {} or name its file with --def", beside.display())]
    NoDef {
        /// Where it was looked for.
        beside: PathBuf,
    },
    /// A matrix that is not affine.
    #[error("the matrix {0}")]
    Matrix(String),
    /// Handles that the numbers of the file cannot tell apart: only for writing.
    #[error(
        "a repair split vertex {vertex} of the file, and its copies are not held alike, which a \
         handles file cannot say; save the repaired mesh, and the handles for that"
    )]
    Copies {
        /// The vertex of the file.
        vertex: usize,
    },
}
