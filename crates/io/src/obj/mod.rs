//! Wavefront OBJ. Positions and faces are read; everything else is preserved unchanged and
//! decoded on request.
//!
//! Vertices keep the order of the file, including those that no face uses. Accepted are `v x y z`
//! followed by anything (a weight, a colour), `f` with corners `v`, `v/vt`, `v//vn`, `v/vt/vn`,
//! negative indices counted back from the latest vertex, references to vertices further down,
//! lines continued by a backslash, comments, and all line endings. Names may be UTF-8 or Latin-1.
//! The libraries that the file names (`mtllib`) are looked up through the resolver of the
//! document when materials are requested. Source: Wavefront, "Object Files (.obj)", Advanced
//! Visualizer manual, appendix B1.
//!
//! The files of this folder are one concept and use each other freely; outside of it, only
//! [`formats`](crate::formats) uses them.

mod counts;
mod decode;
mod fast;
mod mtl;
mod new;
mod parse;
mod patch;
mod rebuild;
mod statement;
mod write;

use std::sync::{Arc, OnceLock};

use crate::attributes::{Attributes, LabelKind};
use crate::companions::References;
use crate::contents::Contents;
use crate::error::IoError;
use crate::format::Format;
use crate::limits::Limits;
use crate::material::Materials;
use crate::obj::counts::Counts;
use crate::obj::mtl::Libraries;
use crate::parsed::Parsed;
use crate::remap::Remap;
use crate::resolve::Resolve;
use crate::source::{Mesh, Moves, Reading, SourceFile};

pub(crate) use self::new::write_new;

/// Reads an OBJ file.
pub(crate) fn read(
    bytes: Vec<u8>,
    limits: &Limits,
    resolver: &dyn Resolve,
) -> Result<Reading, IoError> {
    let mesh = parse::parse(&bytes, limits)?;
    Ok(reading(bytes, mesh, resolver.shared(), *limits))
}

fn reading(bytes: Vec<u8>, mesh: parse::Mesh, files: Arc<dyn Resolve>, limits: Limits) -> Reading {
    let parse::Mesh {
        positions,
        faces,
        counts,
        ..
    } = mesh;
    let parsed = Parsed {
        positions,
        faces,
        warnings: counts.warnings(),
        ..Parsed::default()
    };
    Reading::new(parsed, ObjFile::new(bytes, counts, files, limits))
}

/// Reads an OBJ file without companion files.
#[cfg(test)]
fn open(bytes: Vec<u8>, limits: &Limits) -> Result<crate::Document, IoError> {
    crate::Document::from_reading(read(bytes, limits, &crate::resolve::NoFiles)?)
}

/// An OBJ file as it was read. The offsets of its vertices are recomputed on demand, since that
/// is cheaper than storing them.
#[derive(Debug)]
struct ObjFile {
    bytes: Vec<u8>,
    counts: Counts,
    /// Resolves the material libraries and their images.
    files: Arc<dyn Resolve>,
    limits: Limits,
    /// The material libraries, read on first use.
    libraries: OnceLock<Libraries>,
}

impl ObjFile {
    fn new(bytes: Vec<u8>, counts: Counts, files: Arc<dyn Resolve>, limits: Limits) -> Self {
        Self {
            bytes,
            counts,
            files,
            limits,
            libraries: OnceLock::new(),
        }
    }

    fn libraries(&self) -> &Libraries {
        self.libraries.get_or_init(|| {
            if self.counts.libraries() == 0 {
                return Libraries::default();
            }
            let names = decode::libraries(self);
            Libraries::read(&names, self.files.as_ref(), &self.limits)
        })
    }
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

    fn has_materials(&self) -> bool {
        self.counts.libraries() > 0
    }

    fn materials(&self, attributes: &Attributes) -> Materials {
        if !self.has_materials() {
            return Materials::default();
        }
        let labels = attributes.label(LabelKind::Material);
        mtl::materials(self.libraries(), labels, self.files.as_ref(), &self.limits)
    }

    fn references(&self, _written: &[u8]) -> Result<References, IoError> {
        let max = self.limits.max_bytes;
        Ok(self.libraries().references(&self.files, max))
    }

    fn write(&self, _format: Format, moves: &Moves<'_>) -> Result<Vec<u8>, IoError> {
        Ok(patch::rewrite(self, moves))
    }

    fn rebuild(&self, remap: &Remap, mesh: Mesh<'_>) -> Result<Arc<dyn SourceFile>, IoError> {
        let bytes = rebuild::rebuild(self, remap, mesh)?;
        // The original was read within the limits, so none apply here.
        let again = parse::parse(&bytes, &Limits::NONE)?;
        let files = Arc::clone(&self.files);
        reading(bytes, again, files, self.limits).matching(remap, mesh)
    }
}

/// Lists what a new OBJ file cannot represent.
pub(crate) fn losses(contents: &Contents<'_>) -> Vec<String> {
    let mut losses = write::losses(&contents.attributes);
    losses.extend(mtl::losses(&contents.materials));
    losses.extend(contents.materials.others.iter().cloned());
    losses
}

#[cfg(test)]
mod round_trip_tests;
#[cfg(test)]
mod tests;
