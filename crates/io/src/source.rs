//! The file that a document was read from: kept whole, written again with vertices moved.

use std::fmt::Debug;
use std::sync::Arc;

use nalgebra::Point3;

use crate::attributes::Attributes;
use crate::companions::References;
use crate::error::IoError;
use crate::faces::FaceList;
use crate::format::Format;
use crate::instances::Instance;
use crate::material::Materials;
use crate::normals::Normals;
use crate::remap::Remap;

/// A file as it was read; each format has its own.
pub(crate) trait SourceFile: Debug + Send + Sync {
    fn format(&self) -> Format;

    /// Whether the file can be written as `format` with everything that it has.
    fn writes(&self, format: Format) -> bool {
        format == self.format()
    }

    /// Bytes of the file that it keeps.
    fn num_bytes(&self) -> usize;

    /// What [`Attributes`] can hold of it, decoded, as the file has it.
    ///
    /// An error names the line or byte: what is only kept is not checked when the file is read.
    fn attributes(&self, mesh: Mesh<'_>) -> Result<Attributes, IoError>;

    /// Whether [`SourceFile::attributes`] has normals, to be turned where vertices move.
    fn has_normals(&self) -> bool;

    /// What the file has that [`Attributes`] cannot hold, in words: another format drops it.
    fn extras(&self) -> Vec<String>;

    /// Whether [`SourceFile::materials`] may have something.
    fn has_materials(&self) -> bool {
        false
    }

    /// The materials of the labels of these attributes, in their order, and then all others. What
    /// is wrong with them is no error but named among the others of the materials.
    fn materials(&self, _attributes: &Attributes) -> Materials {
        Materials::default()
    }

    /// What no longer fits once vertices move and is not brought along, in words.
    fn stale(&self) -> Vec<String> {
        Vec::new()
    }

    /// The position that a file from [`SourceFile::write`] has for a vertex that was moved there.
    fn stored(&self, _vertex: usize, position: Point3<f64>) -> Point3<f64> {
        position
    }

    /// The file in `format` (one that it [writes](SourceFile::writes)), with the moved vertices
    /// and the turned normals replaced where they stand; without any, the bytes that were read.
    fn write(&self, format: Format, moves: &Moves<'_>) -> Result<Vec<u8>, IoError>;

    /// Where its meshes are besides the places where the document has them.
    fn instances(
        &self,
        _visit: &mut dyn FnMut(Instance<'_>) -> Result<(), IoError>,
    ) -> Result<(), IoError> {
        Ok(())
    }

    /// The files beside it that a file from [`SourceFile::write`] refers to.
    fn references(&self, _written: &[u8]) -> Result<References, IoError> {
        Ok(References::default())
    }

    /// The files beside it that the file refers to as it was read.
    fn own_references(&self) -> Result<References, IoError> {
        self.references(&[])
    }

    /// A file from [`SourceFile::write`] with the files in it that it refers to, as far as its
    /// format can hold them.
    fn embedded(&self, written: Vec<u8>) -> Result<Vec<u8>, IoError> {
        Ok(written)
    }

    /// The file of another mesh made of this one's vertices and faces, nothing moved; positions
    /// and faces are those of the old mesh.
    fn rebuild(&self, remap: &Remap, mesh: Mesh<'_>) -> Result<Arc<dyn SourceFile>, IoError>;
}

/// The mesh of a document, for its source.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mesh<'a> {
    pub(crate) positions: &'a [Point3<f64>],
    pub(crate) faces: &'a FaceList,
}

/// What is to be replaced in a file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moves<'a> {
    pub(crate) mesh: Mesh<'a>,
    /// Whether each vertex was moved; empty if none was.
    pub(crate) moved: &'a [bool],
    /// The normals that turned with the surface.
    pub(crate) normals: &'a Normals,
}

impl Moves<'_> {
    /// The moved vertices in ascending order, with their positions.
    pub(crate) fn vertices(&self) -> impl Iterator<Item = (usize, Point3<f64>)> {
        let moved = self.moved.iter().enumerate().filter(|&(_, &moved)| moved);
        moved.map(|(vertex, _)| (vertex, self.mesh.positions[vertex]))
    }
}

/// A text that is copied with some words replaced, from front to back.
pub(crate) struct TextPatch<'a> {
    bytes: &'a [u8],
    copied: usize,
    out: Vec<u8>,
    number: String,
}

impl<'a> TextPatch<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        // New numbers are often longer than old ones: room for an eighth more.
        let out = Vec::with_capacity(bytes.len() + bytes.len() / 8);
        Self {
            bytes,
            copied: 0,
            out,
            number: String::new(),
        }
    }

    /// Replaces `length` bytes at `start`, which lies behind everything replaced so far.
    pub(crate) fn replace(&mut self, start: usize, length: usize, write: impl FnOnce(&mut String)) {
        self.number.clear();
        write(&mut self.number);
        self.out.extend_from_slice(&self.bytes[self.copied..start]);
        self.out.extend_from_slice(self.number.as_bytes());
        self.copied = start + length;
    }

    /// Replaces `length` bytes at `start`, which lies behind everything replaced so far.
    pub(crate) fn replace_bytes(&mut self, start: usize, length: usize, new: &[u8]) {
        self.out.extend_from_slice(&self.bytes[self.copied..start]);
        self.out.extend_from_slice(new);
        self.copied = start + length;
    }

    /// Inserts bytes at `start`, which does not lie before anything replaced so far.
    pub(crate) fn insert(&mut self, start: usize, new: &[u8]) {
        self.replace_bytes(start, 0, new);
    }

    pub(crate) fn finish(mut self) -> Vec<u8> {
        self.out.extend_from_slice(&self.bytes[self.copied..]);
        self.out
    }
}
