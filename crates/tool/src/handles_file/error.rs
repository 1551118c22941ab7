//! Errors in handles files.

use std::fmt;
use std::path::PathBuf;

use thiserror::Error;

/// The location of a handle in a file.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum HandlePlace {
    /// A 0-based index in the list `handles`.
    Handle(usize),
    /// A 1-based line number.
    Line(usize),
    /// No location: the constraint holds a component that no handle holds.
    Loose,
}

impl fmt::Display for HandlePlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Handle(number) => write!(f, "handle {number}"),
            Self::Line(number) => write!(f, "line {number}"),
            Self::Loose => f.write_str("a component without a handle"),
        }
    }
}

/// An error in a handles file.
///
/// Vertex indices are those of the mesh file, 0-based; so are the indices of handles in JSON.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum HandlesError {
    /// The file cannot be read.
    #[error("cannot read the file: {0}")]
    Read(#[source] std::io::Error),
    /// The file is not UTF-8.
    #[error("this is not a text file; handles are JSON, lines of `vertex x y z`, or a .sel file")]
    NotText,
    /// The JSON has invalid syntax or keys.
    #[error("the JSON is not a handles file: {0} (see `cotan deform --help`)")]
    Json(#[source] serde_json::Error),
    /// The file holds no vertex.
    #[error(
        "the file has no handle; add at least one: vertices by number, region or name (`cotan info` \
         lists the parts), and where they go (`cotan deform --help` shows how)"
    )]
    NoHandles,
    /// A vertex index is out of range.
    #[error(
        "{place}: there is no vertex {vertex}; the mesh has {num_vertices} vertices, numbered from 0"
    )]
    OutOfRange {
        /// The location of the handle.
        place: HandlePlace,
        /// The vertex index.
        vertex: usize,
        /// The number of vertices.
        num_vertices: usize,
    },
    /// A vertex that no face uses.
    #[error(
        "{place}: vertex {vertex} belongs to no face, so nothing would follow it; leave it out"
    )]
    Unreferenced {
        /// The location of the handle.
        place: HandlePlace,
        /// The vertex index.
        vertex: usize,
    },
    /// A handle without vertices.
    #[error("{place} selects no vertex: {why}")]
    Empty {
        /// The location of the handle.
        place: HandlePlace,
        /// The reason why its selection is empty.
        why: &'static str,
    },
    /// An invalid handle.
    #[error("{place} {problem}")]
    Invalid {
        /// The location of the handle.
        place: HandlePlace,
        /// The problem, and what to do.
        problem: String,
    },
    /// The number of targets differs from the number of vertices.
    #[error(
        "{place} has {vertices} vertices but {targets} positions in \"to\"; give one per vertex"
    )]
    TargetCount {
        /// The location of the handle.
        place: HandlePlace,
        /// The number of vertices.
        vertices: usize,
        /// The number of targets.
        targets: usize,
    },
    /// A target that is not finite.
    #[error("{place}: the new position of vertex {vertex} is not a finite number")]
    NonFinite {
        /// The location of the handle.
        place: HandlePlace,
        /// The vertex index.
        vertex: usize,
    },
    /// Two handles move a vertex differently.
    #[error("{} and {} contradict each other: they move vertex {vertex} to different positions", places[0], places[1])]
    Contradiction {
        /// The locations of the two handles.
        places: [HandlePlace; 2],
        /// The vertex index.
        vertex: usize,
    },
    /// A line that cannot be read.
    #[error("line {line}: {problem}")]
    Line {
        /// The 1-based line number.
        line: usize,
        /// The problem.
        problem: String,
    },
    /// A `.sel` file that belongs to another mesh.
    #[error(
        "{statuses} lines of status, but the mesh has {num_vertices} vertices; give one line per vertex"
    )]
    StatusCount {
        /// The number of lines.
        statuses: usize,
        /// The number of vertices.
        num_vertices: usize,
    },
    /// A `.sel` file moves vertices, but there is no matrix.
    #[error("status 2 needs a matrix: put it into {} or name its file with --def", expected.display())]
    NoDef {
        /// The path at which it was expected.
        expected: PathBuf,
    },
    /// A matrix that is not affine.
    #[error("the matrix {0}")]
    Matrix(String),
    /// Handles that differ between the copies of one file vertex; occurs only when writing.
    #[error(
        "a repair split vertex {vertex} of the file, and its copies have different constraints, which \
         a handles file cannot express; save the repaired mesh, and then its handles"
    )]
    Copies {
        /// The vertex index in the file.
        vertex: usize,
    },
}
