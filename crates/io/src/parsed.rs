//! The geometry of a file, as a reader returns it.

use std::ops::Range;

use nalgebra::Point3;

use crate::error::Warning;
use crate::faces::FaceList;

/// A part of a document with its own vertices and faces, such as a mesh of a glTF.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Part {
    /// The name in the file; may be empty.
    pub name: String,
    /// The vertices of the part.
    pub vertices: Range<usize>,
    /// The faces of the part.
    pub faces: Range<usize>,
}

/// A node of a glTF.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Node {
    /// The name in the file; may be empty.
    pub name: String,
    /// The index of the node that it is a child of.
    pub parent: Option<usize>,
    /// The index of the [`Part`] that is its mesh.
    pub part: Option<usize>,
}

/// The result of a reader.
#[derive(Debug, Default)]
pub(crate) struct Parsed {
    pub(crate) positions: Vec<Point3<f64>>,
    pub(crate) faces: FaceList,
    /// Empty if the document is one part.
    pub(crate) parts: Vec<Part>,
    /// Vertex ranges of layers (the same faces again, which must not be joined to the others) with
    /// the index of the layer, in ascending order.
    pub(crate) layers: Vec<(Range<usize>, u32)>,
    /// `true` if vertices at the same position within a part are one vertex of the surface.
    pub(crate) is_split: bool,
    pub(crate) warnings: Vec<Warning>,
}
