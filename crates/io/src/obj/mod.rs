//! Wavefront OBJ: positions and faces are read, everything else is kept as it stands and decoded
//! when it is asked for.
//!
//! Vertices keep the numbers of the file, also those that no face uses. Accepted are `v x y z`
//! with anything behind (a weight, a colour), `f` with corners `v`, `v/vt`, `v//vn`, `v/vt/vn`,
//! negative indices counted from the latest vertex, references to vertices further down,
//! lines continued by a backslash, comments, and every line end. Names may be UTF-8 or Latin-1.
//! No library that the file names (`mtllib`) is opened. Source: Wavefront, "Object Files (.obj)",
//! Advanced Visualizer manual, appendix B1.

mod counts;
mod decode;
mod fast;
mod parse;
mod patch;
mod rebuild;
mod statement;
mod write;

use std::sync::Arc;

use crate::attributes::Attributes;
use crate::document::{Document, Parsed};
use crate::error::IoError;
use crate::format::Format;
use crate::limits::Limits;
use crate::obj::counts::Counts;
use crate::remap::Remap;
use crate::source::{Mesh, Moves, SourceFile};
use crate::writer::Contents;

/// Reads an OBJ file.
pub(crate) fn read(bytes: Vec<u8>, limits: &Limits) -> Result<Document, IoError> {
    let parse::Mesh {
        positions,
        faces,
        counts,
        ..
    } = parse::parse(&bytes, limits)?;
    let parsed = Parsed {
        positions,
        faces,
        warnings: counts.warnings(),
        ..Parsed::default()
    };
    Document::from_source(parsed, ObjFile { bytes, counts })
}

/// An OBJ file as it was read. Where its vertices stand is found again when it is needed, since
/// that takes less time than the memory is worth.
#[derive(Debug)]
struct ObjFile {
    bytes: Vec<u8>,
    counts: Counts,
}

impl SourceFile for ObjFile {
    fn format(&self) -> Format {
        Format::Obj
    }

    fn num_bytes(&self) -> usize {
        self.bytes.len()
    }

    fn attributes(&self, mesh: Mesh<'_>) -> Result<Attributes, IoError> {
        decode::attributes(self, mesh)
    }

    fn has_normals(&self) -> bool {
        self.counts.normals() > 0
    }

    fn extras(&self) -> Vec<String> {
        self.counts.extras()
    }

    fn write(&self, _format: Format, moves: &Moves<'_>) -> Result<Vec<u8>, IoError> {
        Ok(patch::rewrite(self, moves))
    }

    fn rebuild(&self, remap: &Remap, mesh: Mesh<'_>) -> Result<Arc<dyn SourceFile>, IoError> {
        let bytes = rebuild::rebuild(self, remap, mesh)?;
        // What was read once can be read again, so no limit applies.
        let again = parse::parse(&bytes, &Limits::NONE)?;
        // A wrong file must never be written in silence.
        if again.positions.len() != remap.vertices.len() || again.faces != remap.faces {
            return Err(IoError::Unsupported {
                feature: "this repair of an OBJ".to_owned(),
                remedy: "convert the file to another format and repair that",
            });
        }
        Ok(Arc::new(Self {
            bytes,
            counts: again.counts,
        }))
    }
}

/// What a new OBJ file cannot hold, in words.
pub(crate) fn losses(attributes: &Attributes) -> Vec<String> {
    write::losses(attributes)
}

/// A new OBJ file.
pub(crate) fn write_new(contents: &Contents<'_>) -> Result<Vec<u8>, IoError> {
    Ok(write::write(contents).into_bytes())
}

#[cfg(test)]
mod round_trips;
#[cfg(test)]
mod tests;
