//! Stanford PLY, text and binary in both byte orders.
//!
//! The header is scanned and bounded here and then parsed by the `ply-rs` crate. The rows are
//! walked here, for three reasons. Coordinates have to be replaced in place, which preserves
//! every other property, element and comment of the file. A table of hash maps takes 1.7 s where
//! the walk takes milliseconds. And exporters write blank lines, `nan` qualities and `.5`, which
//! that crate rejects.
//!
//! The bytes of the file are kept. Data that is decoded on request ([`decode`]), replaced
//! ([`rewrite`]) or carried over to another mesh ([`rebuild`]) is located again by one walk over
//! the cells of each row ([`rows`]), which is the same for text and for both byte orders. Source:
//! G. Turk, "The PLY Polygon File Format", 1994.
//!
//! The files of this folder are one concept and use each other freely; outside of it, only
//! [`formats`](crate::formats) uses them.

#[cfg(test)]
mod attribute_tests;
mod binary;
mod decode;
mod fast;
mod groups;
mod header;
mod layout;
mod names;
mod read;
mod rebuild;
#[cfg(test)]
mod rebuild_tests;
mod rewrite;
#[cfg(test)]
mod roundtrip_tests;
mod rows;
mod strips;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod trap_tests;
mod write;

use std::sync::Arc;

use nalgebra::Point3;
use ply_rs::ply::Encoding;

use crate::attributes::Attributes;
use crate::error::{IoError, quote};
use crate::format::Format;
use crate::limits::Limits;
use crate::parsed::Parsed;
use crate::remap::Remap;
use crate::room;
use crate::source::{Mesh, Moves, Reading, SourceFile};

pub(crate) use write::{losses, write_new};

use header::Header;
use layout::{ElementKind, Layout};
use read::{Body, read_rows};
use rows::with_encoding;

/// Reads a PLY file.
pub(crate) fn read(bytes: Vec<u8>, limits: &Limits) -> Result<Reading, IoError> {
    let (parsed, file) = parse(bytes, limits)?;
    Ok(Reading::new(parsed, file))
}

/// Reads a document.
#[cfg(test)]
fn open(bytes: Vec<u8>, limits: &Limits) -> Result<crate::Document, IoError> {
    crate::Document::from_reading(read(bytes, limits)?)
}

fn parse(bytes: Vec<u8>, limits: &Limits) -> Result<(Parsed, PlyFile), IoError> {
    let header = Header::read(&bytes, limits)?;
    let layout = Layout::new(header, bytes.len())?;
    limits.check_vertices(layout.num_vertices)?;
    limits.check_faces(layout.num_faces)?;
    limits.check_memory(bytes.len(), layout.num_vertices, 0)?;
    let mut body = Body::new(&layout, bytes.len(), limits);
    // The layout is bounded by the size of the file.
    room::reserve_exact(&mut body.positions, layout.num_vertices)?;
    with_encoding!(layout.encoding, read_rows(&bytes, &layout, &mut body))?;
    let Body {
        positions,
        faces,
        starts,
        elements,
        ..
    } = body;
    let parsed = Parsed {
        positions,
        faces,
        ..Parsed::default()
    };
    let vertex = layout.find(ElementKind::Vertex);
    let size = vertex.and_then(|vertex| layout.elements[vertex].stride());
    let starts = match (vertex, size) {
        (Some(vertex), Some(size)) if layout.encoding != Encoding::Ascii => Starts::Every {
            first: elements[vertex],
            size,
        },
        _ => Starts::Each(starts),
    };
    let file = PlyFile {
        bytes,
        layout,
        elements,
        starts,
    };
    Ok((parsed, file))
}

/// A PLY file as it was read.
#[derive(Debug)]
struct PlyFile {
    bytes: Vec<u8>,
    layout: Layout,
    /// The start of the rows of each element, and the end of the last one.
    elements: Vec<usize>,
    starts: Starts,
}

/// The offset of each vertex row.
#[derive(Debug)]
enum Starts {
    /// Rows of a fixed size, which need no table.
    Every {
        first: usize,
        size: usize,
    },
    Each(Vec<usize>),
}

impl Starts {
    fn get(&self, vertex: usize) -> Option<usize> {
        match self {
            Self::Every { first, size } => Some(first + vertex * size),
            Self::Each(starts) => starts.get(vertex).copied(),
        }
    }
}

impl SourceFile for PlyFile {
    fn format(&self) -> Format {
        Format::Ply
    }

    fn num_bytes(&self) -> usize {
        self.bytes.len()
    }

    fn attributes(&self, mesh: Mesh<'_>) -> Result<Attributes, IoError> {
        decode::attributes(self, mesh.faces)
    }

    fn has_normals(&self) -> bool {
        self.layout.has_normals()
    }

    fn extras(&self) -> Vec<String> {
        self.layout.extras()
    }

    fn stale(&self) -> Vec<String> {
        let mut stale = Vec::new();
        if self.layout.has_odd_normals() {
            stale.push("normals that are not of one type".to_owned());
        }
        stale
    }

    fn stored(&self, _vertex: usize, position: Point3<f64>) -> Point3<f64> {
        rewrite::stored(self, position)
    }

    fn write(&self, _format: Format, moves: &Moves<'_>) -> Result<Vec<u8>, IoError> {
        rewrite::rewrite(self, moves)
    }

    fn rebuild(&self, remap: &Remap, mesh: Mesh<'_>) -> Result<Arc<dyn SourceFile>, IoError> {
        let bytes = rebuild::rebuild(self, remap, mesh)?;
        // A repair may exceed the limits that the original file met.
        read(bytes, &Limits::NONE)?.matching(remap, mesh)
    }
}

fn problem(line: usize, text: impl Into<String>) -> IoError {
    IoError::Header {
        line,
        problem: text.into(),
    }
}
