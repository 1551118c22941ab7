//! Errors and warnings about files, with their locations.

use std::fmt;
use std::path::PathBuf;

use cotan_geometry::Readable;
use cotan_halfedge::BuildError;
use thiserror::Error;

use crate::cure::Cure;
use crate::format::Format;
use crate::printable::printable;

/// A location in a file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Place {
    /// A 1-based line number in a text file.
    Line(usize),
    /// A 0-based byte offset in a binary file.
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

/// An irregularity in a file that could still be read.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Warning {
    /// The location, if there is one.
    pub place: Option<Place>,
    /// The irregularity, and how it was interpreted.
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

/// An error while reading, building or writing a mesh file.
///
/// Vertex and face indices are 0-based, as everywhere in cotan, unless stated otherwise.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum IoError {
    /// Another error, together with the file that it concerns.
    #[error("{}: {source}", path.display())]
    InFile {
        /// The file.
        path: PathBuf,
        /// The error.
        source: Box<IoError>,
    },
    /// The file could not be opened or read.
    #[error("cannot read the file: {0}")]
    Read(#[source] std::io::Error),
    /// The file could not be written. An existing file of that name is left untouched.
    #[error("cannot write the file: {0}")]
    Write(#[source] std::io::Error),
    /// The format can be determined neither from the content nor from the name.
    #[error(
        "the format is not known; cotan reads and writes .obj, .ply, .off, .stl, .gltf and .glb, optionally followed by .gz"
    )]
    UnknownFormat,
    /// The file exceeds one of the [`Limits`](crate::Limits).
    #[error("more than {limit} {what}; raise the limit if you trust the file")]
    OverLimit {
        /// The quantity that is limited.
        what: &'static str,
        /// The limit.
        limit: u64,
    },
    /// The system could not provide the memory that the file requires.
    #[error(
        "out of memory: this file needs {bytes} bytes at once, which the system cannot provide"
    )]
    OutOfMemory {
        /// Size of the failed allocation, in bytes.
        bytes: u64,
    },
    /// The file contains no vertices: it is an empty mesh, or not a mesh file.
    #[error("no vertices: this is an empty mesh or not {format} at all")]
    NoVertices {
        /// The format in which it was read.
        format: Format,
    },
    /// The file has zero bytes.
    #[error("the file is empty")]
    EmptyFile,
    /// A document created in memory has no vertices.
    #[error("there are no vertices")]
    Empty,
    /// A header that violates the rules of its format.
    #[error("line {line}: {problem}")]
    Header {
        /// The 1-based line number.
        line: usize,
        /// The problem, and what was expected.
        problem: String,
    },
    /// A file that violates the rules of its format.
    #[error("{place}: {problem}")]
    Malformed {
        /// The location.
        place: Place,
        /// The problem, and what was expected.
        problem: String,
    },
    /// Part of a glTF file that violates the specification.
    #[error("{path}: {problem}")]
    Gltf {
        /// The location in the JSON, such as `accessors[3].count`.
        path: String,
        /// The problem, and what was expected.
        problem: String,
    },
    /// A feature of the format that is not supported.
    #[error("{feature} is not supported; {remedy}")]
    Unsupported {
        /// The feature.
        feature: String,
        /// The suggested remedy.
        remedy: &'static str,
    },
    /// A referenced file could not be read.
    #[error("the file refers to `{uri}`, which cannot be read: {problem}")]
    External {
        /// The reference (shortened).
        uri: String,
        /// The reason.
        problem: String,
    },
    /// A file that the document refers to cannot be placed next to the output file.
    #[error("the file {} cannot be placed next to the mesh that refers to it: {problem}; nothing was written", path.display())]
    Companion {
        /// The path at which the file is needed.
        path: PathBuf,
        /// Why it cannot be placed there, and what to do.
        problem: String,
    },
    /// Text that is not a number where one is required.
    #[error("{place}: {element} has `{text}` where {expected} is expected")]
    BadNumber {
        /// The location.
        place: Place,
        /// The element, such as `vertex 12`.
        element: Element,
        /// The text that was found (shortened).
        text: String,
        /// A description of the expected value.
        expected: &'static str,
    },
    /// A coordinate that is NaN, infinite, or too large for `f64`.
    #[error("{place}: vertex {vertex} has the coordinate {value}, which is not a finite number")]
    NonFinite {
        /// The location.
        place: Place,
        /// The vertex index.
        vertex: usize,
        /// The value (or its text).
        value: String,
    },
    /// A row with too few numbers.
    #[error("{place}: {element} has {found} numbers; it needs {needed}")]
    TooFewNumbers {
        /// The location.
        place: Place,
        /// The element.
        element: Element,
        /// The number of values found.
        found: usize,
        /// The number of values needed.
        needed: usize,
    },
    /// The file ends before all promised elements were read.
    #[error("{place}: the file ends at {element}, but {promised} were promised; it was cut short")]
    CutShort {
        /// The location of the end.
        place: Place,
        /// The first missing element.
        element: Element,
        /// The count in the header.
        promised: u64,
    },
    /// Extra rows after the last face that the header promises.
    #[error("{place}: more rows follow the {promised} faces that the header promises")]
    MoreThanPromised {
        /// The location.
        place: Place,
        /// The face count in the header.
        promised: u64,
    },
    /// A face that refers to a vertex that does not exist.
    #[error("{place}: face {face} refers to vertex {index}, but {}", vertices_there(*first, *num_vertices))]
    IndexOutOfRange {
        /// The location.
        place: Place,
        /// The face index.
        face: usize,
        /// The index as written in the file.
        index: i64,
        /// The index of the first vertex in this format: 1 for OBJ, otherwise 0.
        first: u32,
        /// The number of vertices.
        num_vertices: usize,
    },
    /// A face with fewer than three corners.
    #[error("{place}: face {face} has {degree} corners; a face needs three or more")]
    TooFewCorners {
        /// The location.
        place: Place,
        /// The face index.
        face: usize,
        /// The number of its corners.
        degree: usize,
    },
    /// A face given in memory has fewer than three corners.
    #[error("face {face} has {degree} corners; a face needs three or more")]
    FaceCorners {
        /// The face index.
        face: usize,
        /// The number of its corners.
        degree: usize,
    },
    /// A face given in memory refers to a vertex that does not exist.
    #[error(
        "face {face} refers to vertex {vertex}, but there are only {num_vertices} vertices (numbered from 0)"
    )]
    FaceVertex {
        /// The face index.
        face: usize,
        /// The vertex index.
        vertex: usize,
        /// The number of vertices.
        num_vertices: usize,
    },
    /// A vertex index that is out of range for the document.
    #[error("there is no vertex {vertex}; there are {num_vertices} vertices, numbered from 0")]
    NoSuchVertex {
        /// The vertex index.
        vertex: usize,
        /// The number of vertices.
        num_vertices: usize,
    },
    /// The document has vertices but no faces, so there is no surface to work on.
    #[error("there are {num_vertices} vertices and no faces; a surface needs faces")]
    NoFaces {
        /// The number of vertices.
        num_vertices: usize,
    },
    /// The faces do not form an oriented manifold. Indices are those of the file, 0-based.
    #[error(
        "the faces do not form a manifold surface: {} (vertices and faces are numbered from 0, as in the file){}",
        _0,
        cure_text(_0)
    )]
    NotManifold(#[source] BuildError),
    /// After welding, no face has three distinct corners left.
    #[error(
        "all {num_faces} faces collapse when vertices are welded; weld within a smaller distance"
    )]
    AllCollapsed {
        /// The number of faces.
        num_faces: usize,
    },
    /// Every part is too small to be kept.
    #[error(
        "every part has fewer than {least_faces} faces (the largest has {num_faces}), so nothing \
         would be left; lower the number"
    )]
    NoPartLeft {
        /// The minimum number of faces per part.
        least_faces: usize,
        /// The number of faces of the largest part.
        num_faces: usize,
    },
    /// A welding tolerance that is not a valid distance.
    #[error("{} is not a valid welding distance; it must be finite and not negative", Readable(*tolerance))]
    WeldTolerance {
        /// The tolerance.
        tolerance: f64,
    },
    /// Attributes that do not fit the document.
    #[error("{problem}; the document was not changed")]
    Attributes {
        /// The mismatch.
        problem: String,
    },
    /// The number of positions does not match the document.
    #[error("{found} positions were given where {expected} are needed")]
    PositionCount {
        /// The number of positions needed.
        expected: usize,
        /// The number of positions given.
        found: usize,
    },
    /// A new position is NaN or infinite.
    #[error("the new position of vertex {vertex} is not finite; the document was not changed")]
    NonFinitePosition {
        /// The vertex index in the document.
        vertex: usize,
    },
    /// A coordinate that cannot be represented in the number type of the file.
    #[error(
        "vertex {vertex}: {} does not fit the file's type `{number_type}`; save in another format",
        Readable(*value)
    )]
    DoesNotFit {
        /// The vertex index.
        vertex: usize,
        /// The coordinate.
        value: f64,
        /// The type declared in the PLY header.
        number_type: &'static str,
    },
}

impl IoError {
    /// Returns the step of [`Repair`](crate::Repair) that fixes whatever keeps the surface from
    /// being built, or `None` for every other error.
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
        Some(Cure::DropDegenerate) => "; Repair::drop_degenerate fixes it",
        Some(Cure::SplitEdges) => "; Repair::split_edges fixes it",
        Some(Cure::Orient) => "; Repair::orient fixes it, unless the surface is one-sided",
        Some(Cure::SplitVertices) => "; Repair::split_vertices fixes it",
        _ => "",
    }
}

/// An element of a file, for error messages: its kind and its 0-based index.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Element {
    /// `vertex`, `face`, or the element name from a PLY header.
    pub kind: String,
    /// The 0-based index.
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

/// Quotes rejected text, shortened for a message and stripped of terminal control characters.
pub(crate) fn quote(text: &[u8]) -> String {
    const LONGEST: usize = 40;
    let cut = &text[..text.len().min(LONGEST)];
    let mut quoted = printable(&String::from_utf8_lossy(cut)).into_owned();
    if text.len() > LONGEST {
        quoted.push('…');
    }
    quoted
}
