//! The file that a document was read from, kept in full so that it can be rewritten with moved
//! vertices.

use std::fmt::Debug;
use std::sync::Arc;

use nalgebra::Point3;

use crate::attributes::Attributes;
use crate::companions::References;
use crate::error::IoError;
use crate::faces::FaceList;
use crate::format::Format;
use crate::material::Materials;
use crate::normals::Normals;
use crate::parsed::{Node, Parsed};
use crate::placement::Instance;
use crate::remap::Remap;

/// The result of a reader, from which [`Document`](crate::Document) is built.
#[derive(Debug)]
pub(crate) struct Reading {
    pub(crate) parsed: Parsed,
    pub(crate) source: Arc<dyn SourceFile>,
}

impl Reading {
    pub(crate) fn new(parsed: Parsed, source: impl SourceFile + 'static) -> Self {
        Self {
            parsed,
            source: Arc::new(source),
        }
    }

    /// The file, if its mesh is that of the remap; `mesh` is the old one.
    ///
    /// A format that rebuilds its text has to read it again anyway, to locate its elements. An
    /// incorrect file must never be written silently.
    pub(crate) fn matching(
        self,
        remap: &Remap,
        mesh: Mesh<'_>,
    ) -> Result<Arc<dyn SourceFile>, IoError> {
        let Self { parsed, source } = self;
        let positions = remap.vertices.iter();
        let positions = positions.map(|&v| mesh.positions.get(v as usize));
        if parsed.faces == remap.faces && parsed.positions.iter().map(Some).eq(positions) {
            return Ok(source);
        }
        Err(IoError::Unsupported {
            feature: format!(
                "this change of vertices and faces in this {}",
                source.format()
            ),
            remedy: "write the mesh in another format and change that file",
        })
    }
}

/// A file as it was read. Each format has its own implementation.
pub(crate) trait SourceFile: Debug + Send + Sync {
    fn format(&self) -> Format;

    /// Returns `true` if the file can be written as `format` without loss.
    fn writes(&self, format: Format) -> bool {
        format == self.format()
    }

    /// Size of the file's retained bytes.
    fn num_bytes(&self) -> usize;

    /// Decodes the part of the file that [`Attributes`] can represent.
    ///
    /// Errors name the line or byte: data that is only retained is not checked when the file is
    /// read.
    fn attributes(&self, mesh: Mesh<'_>) -> Result<Attributes, IoError>;

    /// Returns `true` if [`SourceFile::attributes`] contains normals, which must rotate where
    /// vertices move.
    fn has_normals(&self) -> bool;

    /// Descriptions of the contents that [`Attributes`] cannot represent and that other formats
    /// drop.
    fn extras(&self) -> Vec<String>;

    /// Returns `true` if [`SourceFile::materials`] may be non-empty.
    fn has_materials(&self) -> bool {
        false
    }

    /// Returns the materials for the labels of these attributes, in label order, followed by all
    /// others.
    ///
    /// Problems with materials are not errors; they are listed among the materials' `others`.
    fn materials(&self, _attributes: &Attributes) -> Materials {
        Materials::default()
    }

    /// Descriptions of contents that become stale when vertices move and are not updated.
    fn stale(&self) -> Vec<String> {
        Vec::new()
    }

    /// Returns the position that [`SourceFile::write`] stores for a vertex moved to `position`.
    fn stored(&self, _vertex: usize, position: Point3<f64>) -> Point3<f64> {
        position
    }

    /// Writes the file in `format` (one that it [writes](SourceFile::writes)), replacing moved
    /// vertices and rotated normals in place.
    ///
    /// Without any changes, returns the bytes that were read.
    fn write(&self, format: Format, moves: &Moves<'_>) -> Result<Vec<u8>, IoError>;

    /// Visits the instances of the meshes in addition to those where the document places them.
    fn instances(
        &self,
        _visit: &mut dyn FnMut(Instance<'_>) -> Result<(), IoError>,
    ) -> Result<(), IoError> {
        Ok(())
    }

    /// The nodes that show the meshes, in file order.
    fn nodes(&self) -> &[Node] {
        &[]
    }

    /// The number of times that the file shows a part of the document.
    fn num_instances(&self, _part: usize) -> usize {
        1
    }

    /// The same file with a mesh of its own for every node that shows one, or `None` if this file
    /// has these already.
    fn with_unique_meshes(&self, _moves: &Moves<'_>) -> Result<Option<Reading>, IoError> {
        Ok(None)
    }

    /// Lists the companion files that the output of [`SourceFile::write`] refers to.
    fn references(&self, _written: &[u8]) -> Result<References, IoError> {
        Ok(References::default())
    }

    /// Lists the companion files that the file refers to as it was read.
    fn own_references(&self) -> Result<References, IoError> {
        self.references(&[])
    }

    /// Embeds the companion files in the output of [`SourceFile::write`], as far as the format
    /// allows.
    fn embedded(&self, written: Vec<u8>) -> Result<Vec<u8>, IoError> {
        Ok(written)
    }

    /// Builds the file of another mesh made of this one's vertices and faces, without moving
    /// anything. `mesh` holds the old positions and faces.
    fn rebuild(&self, remap: &Remap, mesh: Mesh<'_>) -> Result<Arc<dyn SourceFile>, IoError>;
}

/// The mesh of a document, as passed to its source.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mesh<'a> {
    pub(crate) positions: &'a [Point3<f64>],
    pub(crate) faces: &'a FaceList,
}

/// The replacements to make in a file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moves<'a> {
    pub(crate) mesh: Mesh<'a>,
    /// For each vertex, `true` if it moved; empty if none did.
    pub(crate) moved: &'a [bool],
    /// The normals rotated with the surface.
    pub(crate) normals: &'a Normals,
}

impl Moves<'_> {
    /// The moved vertices in ascending order, with their positions.
    pub(crate) fn vertices(&self) -> impl Iterator<Item = (usize, Point3<f64>)> {
        let moved = self.moved.iter().enumerate().filter(|&(_, &moved)| moved);
        moved.map(|(vertex, _)| (vertex, self.mesh.positions[vertex]))
    }
}

/// A copy of a text with some words replaced, built from front to back.
pub(crate) struct TextPatch<'a> {
    bytes: &'a [u8],
    copied: usize,
    out: Vec<u8>,
    number: String,
}

impl<'a> TextPatch<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        // New numbers are often longer than old ones, so reserve an extra eighth.
        let out = Vec::with_capacity(bytes.len() + bytes.len() / 8);
        Self {
            bytes,
            copied: 0,
            out,
            number: String::new(),
        }
    }

    /// Replaces `length` bytes at `start`, which must lie after all previous replacements.
    pub(crate) fn replace(&mut self, start: usize, length: usize, write: impl FnOnce(&mut String)) {
        self.number.clear();
        write(&mut self.number);
        self.out.extend_from_slice(&self.bytes[self.copied..start]);
        self.out.extend_from_slice(self.number.as_bytes());
        self.copied = start + length;
    }

    /// Replaces `length` bytes at `start`, which must lie after all previous replacements.
    pub(crate) fn replace_bytes(&mut self, start: usize, length: usize, new: &[u8]) {
        self.out.extend_from_slice(&self.bytes[self.copied..start]);
        self.out.extend_from_slice(new);
        self.copied = start + length;
    }

    /// Inserts bytes at `start`, which must not lie before any previous replacement.
    pub(crate) fn insert(&mut self, start: usize, new: &[u8]) {
        self.replace_bytes(start, 0, new);
    }

    pub(crate) fn finish(mut self) -> Vec<u8> {
        self.out.extend_from_slice(&self.bytes[self.copied..]);
        self.out
    }
}
