//! What can be wrong with a file, and where.

use std::fmt;
use std::path::PathBuf;

use cotan_geometry::Readable;
use cotan_halfedge::BuildError;
use thiserror::Error;

use crate::format::Format;
use crate::printable::printable;
use crate::repair::Cure;

/// A place in a file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Place {
    /// A line of a text file, counted from 1.
    Line(usize),
    /// A byte of a binary file, counted from 0.
    Byte(usize),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Byte(byte) => write!(f, "byte {byte}"),
        }
    }
}

/// Something odd in a file that was read nevertheless.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Warning {
    /// Where, if it has a place.
    pub place: Option<Place>,
    /// What is odd, and how it was read.
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.place {
            Some(place) => write!(f, "{place}: {}", self.message),
            None => f.write_str(&self.message),
        }
    }
}

/// Why a mesh file could not be read, built or written.
///
/// Vertices and faces are counted from 0, as everywhere in cotan, unless the text says otherwise.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum IoError {
    /// Another error, with the file that it concerns.
    #[error("{}: {source}", path.display())]
    InFile {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: Box<IoError>,
    },
    /// The file could not be opened or read.
    #[error("cannot read the file: {0}")]
    Read(#[source] std::io::Error),
    /// The file could not be written; an older file of that name is untouched.
    #[error("cannot write the file: {0}")]
    Write(#[source] std::io::Error),
    /// Neither the content nor the name tells the format.
    #[error(
        "the format is not known; cotan reads and writes .obj, .ply, .off, .stl, .gltf and .glb, also with .gz behind"
    )]
    UnknownFormat,
    /// More than [`Limits`](crate::Limits) allow.
    #[error("more than {limit} {what}; raise the limit if you trust the file")]
    OverLimit {
        /// What there is too much of.
        what: &'static str,
        /// How many are allowed.
        limit: u64,
    },
    /// The system does not give the memory that the file asks for.
    #[error("not enough memory: {bytes} bytes at once are needed for this file and cannot be had")]
    OutOfMemory {
        /// How many were asked for at once.
        bytes: u64,
    },
    /// The file holds no vertex at all: an empty mesh, or not a mesh file.
    #[error("no vertices: this is an empty mesh or not {format} at all")]
    NoVertices {
        /// The format that it was read as.
        format: Format,
    },
    /// A file without a byte.
    #[error("the file is empty")]
    EmptyFile,
    /// A document was to be made in memory without a vertex.
    #[error("there are no vertices")]
    Empty,
    /// A header that breaks the rules of its format.
    #[error("line {line}: {problem}")]
    Header {
        /// The line, counted from 1.
        line: usize,
        /// What is wrong, and what is expected.
        problem: String,
    },
    /// A file that breaks the rules of its format.
    #[error("{place}: {problem}")]
    Malformed {
        /// Where.
        place: Place,
        /// What is wrong, and what is expected.
        problem: String,
    },
    /// Something in a glTF that breaks its rules.
    #[error("{path}: {problem}")]
    Gltf {
        /// Where in the JSON, as `accessors[3].count`.
        path: String,
        /// What is wrong, and what is expected.
        problem: String,
    },
    /// A feature of the format that is not read.
    #[error("{feature} is not supported; {remedy}")]
    Unsupported {
        /// The feature.
        feature: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A file that this file refers to and that could not be had.
    #[error("the file refers to `{uri}`, which cannot be read: {problem}")]
    External {
        /// The reference (shortened).
        uri: String,
        /// Why not.
        problem: String,
    },
    /// A file that the document refers to and that cannot lie beside the file to be written.
    #[error("the mesh needs the file {} beside it: {problem}; nothing was written", path.display())]
    Companion {
        /// Where the file belongs.
        path: PathBuf,
        /// Why it cannot be there, and what to do.
        problem: String,
    },
    /// Something that is not a number where one is needed.
    #[error("{place}: {element} has `{text}` where {expected} is expected")]
    BadNumber {
        /// Where.
        place: Place,
        /// The element, such as `vertex 12`.
        element: Element,
        /// What stands there (shortened).
        text: String,
        /// What should stand there.
        expected: &'static str,
    },
    /// A coordinate that is NaN, infinite, or too large for 64 bits.
    #[error("{place}: vertex {vertex} has the coordinate {value}, which is not a finite number")]
    NonFinite {
        /// Where.
        place: Place,
        /// The vertex.
        vertex: usize,
        /// The value (or its text).
        value: String,
    },
    /// A row with fewer numbers than it needs.
    #[error("{place}: {element} has {found} numbers; it needs {needed}")]
    TooFewNumbers {
        /// Where.
        place: Place,
        /// The element.
        element: Element,
        /// How many numbers stand there.
        found: usize,
        /// How many are needed.
        needed: usize,
    },
    /// The file ends before all promised elements were read.
    #[error("{place}: the file ends at {element}, but {promised} were promised; it was cut short")]
    CutShort {
        /// Where it ends.
        place: Place,
        /// The first element that is missing.
        element: Element,
        /// How many the header promises.
        promised: u64,
    },
    /// Rows behind the last face that the header promises.
    #[error("{place}: more rows follow the {promised} faces that the header promises")]
    MoreThanPromised {
        /// Where.
        place: Place,
        /// How many faces the header promises.
        promised: u64,
    },
    /// A face that refers to a vertex that is not there.
    #[error("{place}: face {face} refers to vertex {index}, but {}", vertices_there(*first, *num_vertices))]
    IndexOutOfRange {
        /// Where.
        place: Place,
        /// The face.
        face: usize,
        /// The index as the file writes it.
        index: i64,
        /// The number of the first vertex in this format: 1 for OBJ, otherwise 0.
        first: u32,
        /// How many vertices there are.
        num_vertices: usize,
    },
    /// A face with fewer than three corners.
    #[error("{place}: face {face} has {degree} corners; a face needs three or more")]
    TooFewCorners {
        /// Where.
        place: Place,
        /// The face.
        face: usize,
        /// Its number of corners.
        degree: usize,
    },
    /// A face that was given in memory has fewer than three corners.
    #[error("face {face} has {degree} corners; a face needs three or more")]
    FaceCorners {
        /// The face.
        face: usize,
        /// Its number of corners.
        degree: usize,
    },
    /// A face that was given in memory refers to a vertex that is not there.
    #[error(
        "face {face} refers to vertex {vertex}, but there are only {num_vertices} vertices (numbered from 0)"
    )]
    FaceVertex {
        /// The face.
        face: usize,
        /// The vertex.
        vertex: usize,
        /// How many vertices there are.
        num_vertices: usize,
    },
    /// A vertex that the document does not have.
    #[error("there is no vertex {vertex}; there are {num_vertices} vertices, numbered from 0")]
    NoSuchVertex {
        /// The vertex.
        vertex: usize,
        /// How many vertices there are.
        num_vertices: usize,
    },
    /// The document has vertices and no faces, so there is no surface to work on.
    #[error("there are {num_vertices} vertices and no faces; a surface needs faces")]
    NoFaces {
        /// How many vertices there are.
        num_vertices: usize,
    },
    /// The faces do not form an oriented manifold. Numbers are those of the file, from 0.
    #[error(
        "the faces do not form a manifold surface: {} (vertices and faces are numbered from 0, as in the file){}",
        _0,
        cure_text(_0)
    )]
    NotManifold(#[source] BuildError),
    /// Welding left no face with three corners.
    #[error("all {num_faces} faces collapse when vertices are welded; weld less")]
    AllCollapsed {
        /// How many faces there are.
        num_faces: usize,
    },
    /// All parts are too small to be kept.
    #[error(
        "every part has fewer than {least_faces} faces, the largest {num_faces}; nothing would be \
         left, so ask for fewer"
    )]
    NoPartLeft {
        /// How many faces a part was to have.
        least_faces: usize,
        /// How many the largest one has.
        num_faces: usize,
    },
    /// A tolerance for welding that is not a distance.
    #[error("{} is not a distance to weld within; it must be finite and not negative", Readable(*tolerance))]
    WeldTolerance {
        /// The tolerance.
        tolerance: f64,
    },
    /// Attributes that do not belong to this document.
    #[error("{problem}; the document was not changed")]
    Attributes {
        /// What does not fit.
        problem: String,
    },
    /// Positions that do not belong to this document.
    #[error("{found} positions were given where {expected} are needed")]
    PositionCount {
        /// How many are needed.
        expected: usize,
        /// How many were given.
        found: usize,
    },
    /// A position that is NaN or infinite was to be stored.
    #[error("the new position of vertex {vertex} is not finite; the document was not changed")]
    NonFinitePosition {
        /// The vertex of the document.
        vertex: usize,
    },
    /// A coordinate that the file's own number type cannot hold.
    #[error(
        "vertex {vertex}: {} does not fit the file's type `{number_type}`; save in another format",
        Readable(*value)
    )]
    DoesNotFit {
        /// The vertex.
        vertex: usize,
        /// The coordinate.
        value: f64,
        /// The type that the PLY header declares for it.
        number_type: &'static str,
    },
}

impl IoError {
    /// The step of [`Repair`](crate::Repair) that cures what keeps a surface from being built;
    /// `None` for every other error.
    pub fn cure(&self) -> Option<Cure> {
        match self {
            Self::InFile { source, .. } => source.cure(),
            Self::NotManifold(error) => cure(error),
            _ => None,
        }
    }
}

fn cure(error: &BuildError) -> Option<Cure> {
    Some(match error {
        BuildError::RepeatedVertex { .. } => Cure::DropDegenerate,
        BuildError::NonManifoldEdge { .. } => Cure::SplitEdges,
        BuildError::InconsistentOrientation { .. } => Cure::Orient,
        BuildError::SeveralFans { .. } => Cure::SplitVertices,
        _ => return None,
    })
}

fn cure_text(error: &BuildError) -> &'static str {
    match cure(error) {
        Some(Cure::DropDegenerate) => "; Repair::drop_degenerate cures it",
        Some(Cure::SplitEdges) => "; Repair::split_edges cures it",
        Some(Cure::Orient) => "; Repair::orient cures it, unless the surface has one side only",
        Some(Cure::SplitVertices) => "; Repair::split_vertices cures it",
        _ => "",
    }
}

/// An element of a file, for error messages: its kind and number, counted from 0.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Element {
    /// `vertex`, `face`, or the name that a PLY header gives.
    pub kind: String,
    /// Its number, counted from 0.
    pub number: usize,
}

impl Element {
    pub(crate) fn new(kind: &str, number: usize) -> Self {
        Self {
            kind: kind.to_owned(),
            number,
        }
    }
}

impl fmt::Display for Element {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.kind, self.number)
    }
}

fn vertices_there(first: u32, num_vertices: usize) -> String {
    match num_vertices {
        0 => "there are no vertices".to_owned(),
        n => format!(
            "the vertices are numbered {first} to {}",
            n as u64 - 1 + u64::from(first)
        ),
    }
}

/// The text that was refused, short enough for a message and free of what a terminal acts on.
pub(crate) fn quote(text: &[u8]) -> String {
    const LONGEST: usize = 40;
    let cut = &text[..text.len().min(LONGEST)];
    let mut quoted = printable(&String::from_utf8_lossy(cut)).into_owned();
    if text.len() > LONGEST {
        quoted.push('…');
    }
    quoted
}
