//! The summary of a command that reports nothing but the mesh that it wrote.

use std::path::{Path, PathBuf};

use cotan_io::Document;
use serde::Serialize;

use super::{Report, Seconds};
use crate::text::Text;

/// The counts of a written mesh.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub(crate) struct MeshCounts {
    file: PathBuf,
    vertices: usize,
    faces: usize,
}

impl MeshCounts {
    /// The counts of `document`, to be written to `file`.
    pub(crate) fn new(file: &Path, document: &Document) -> Self {
        Self {
            file: file.to_owned(),
            vertices: document.positions().len(),
            faces: document.faces().len(),
        }
    }
}

impl Report for MeshCounts {
    fn set_seconds(&mut self, _: Seconds) {}

    fn table(&self) -> Text {
        Text::of(format_args!(
            "{}: {} vertices, {} faces",
            self.file.display(),
            self.vertices,
            self.faces
        ))
    }
}
