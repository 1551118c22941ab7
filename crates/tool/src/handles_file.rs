//! Handles files: the vertices that are held, and their target positions.
//!
//! Three kinds are supported: JSON, text with one `vertex x y z` per line, and the pair `.sel` +
//! `.def` of the bend benchmark. All of them are converted to a list of [`Constraint`]s, one per
//! vertex, checked against the mesh and each other; or to [`Group`]s, which retain the transform
//! that moves them. Groups are written as JSON by [`to_json`].

mod constraint;
mod error;
mod file_vertices;
mod group;
mod json;
mod loose;
mod part_settings;
mod sel;
mod selection;
mod text;
mod transform;
mod vertices;
mod write;

use std::path::{Path, PathBuf};

use cotan_io::{Document, ProcessingMesh, read_regular};
use nalgebra::Matrix4;

pub use constraint::{Constraint, Goal, to_handles};
pub use error::{HandlePlace, HandlesError};
pub use file_vertices::FileVertices;
pub use group::{Group, GroupMotion, constraints};
pub use json::from_json;
pub use loose::Loose;
pub use part_settings::{Follow, FollowWord, PartSettings, PartWord};
pub use write::{groups_in_file, to_json};

use crate::error::ToolError;
use vertices::Vertices;

/// The files that define the handles.
#[derive(Clone, Copy, Debug)]
pub struct HandlesFile<'a> {
    /// JSON, text, or a `.sel` file.
    pub path: &'a Path,
    /// The matrix of a `.sel` file, if it is not next to it.
    pub def: Option<&'a Path>,
    /// Maximum file size in bytes; larger files are rejected.
    pub max_bytes: u64,
}

impl HandlesFile<'_> {
    /// Returns the matrix file that is implied by a `.sel` file, if none is given.
    pub fn default_matrix(&self) -> Option<PathBuf> {
        let is_sel = self.def.is_none() && self.kind("") == Kind::Sel;
        is_sel.then(|| self.path.with_extension("def"))
    }

    /// Reads the handles of a document.
    ///
    /// Indices in the handles file refer to the mesh file, those in the result to the document. A
    /// handle on a vertex that a repair split holds all its copies.
    ///
    /// # Errors
    /// [`ToolError::Handles`] with the file, the handle or line, and what to do.
    pub fn read(
        &self,
        document: &Document,
        processing: &ProcessingMesh,
        file_vertices: Option<&FileVertices>,
    ) -> Result<Vec<Constraint>, ToolError> {
        let mesh = Vertices {
            document,
            processing,
            file_vertices,
        };
        let contents = self.contents(&mesh)?;
        Ok(mesh.on_surface(&contents.constraints, contents.kind))
    }

    /// Like [`HandlesFile::read`], but keeps vertices that move alike together: the handles of a
    /// JSON file, the lines of a text file, the fixed and the moved vertices of a `.sel` file.
    ///
    /// [`constraints`] converts the result to that of [`HandlesFile::read`], except for the
    /// locations in the file and, for a `.sel` file, the order.
    ///
    /// # Errors
    /// As for [`HandlesFile::read`].
    pub fn read_groups(
        &self,
        document: &Document,
        processing: &ProcessingMesh,
        file_vertices: Option<&FileVertices>,
    ) -> Result<Vec<Group>, ToolError> {
        let mesh = Vertices {
            document,
            processing,
            file_vertices,
        };
        let contents = self.contents(&mesh)?;
        let held = mesh.on_surface(&contents.constraints, contents.kind);
        Ok(contents.groups(held, document.positions()))
    }

    /// Reads which parts follow; the defaults for a file that does not say.
    ///
    /// # Errors
    /// [`ToolError::Handles`] for a file that cannot be read.
    pub fn read_parts(&self) -> Result<PartSettings, ToolError> {
        let text = self.read_text(self.path)?;
        match self.kind(&text) {
            Kind::Json => json::read_parts(&text).map_err(in_file(self.path)),
            Kind::Text | Kind::Sel => Ok(PartSettings::default()),
        }
    }

    /// The checked contents of the file.
    fn contents(&self, mesh: &Vertices<'_>) -> Result<Contents, ToolError> {
        let here = in_file(self.path);
        let text = self.read_text(self.path)?;
        let kind = self.kind(&text);
        let mut matrices = Vec::new();
        let constraints = match kind {
            Kind::Json => json::read(&text, mesh, &mut matrices),
            Kind::Text => text::read(&text, mesh),
            Kind::Sel => {
                let statuses = sel::read_statuses(&text, mesh).map_err(&here)?;
                let matrix = match statuses.need_matrix() {
                    true => Some(self.read_matrix()?),
                    false => None,
                };
                matrices.extend(matrix.map(|matrix| (HandlePlace::Handle(0), matrix)));
                statuses.constraints(matrix, mesh)
            }
        };
        let constraints = constraints.map_err(&here)?;
        if constraints.is_empty() {
            return Err(here(HandlesError::NoHandles));
        }
        constraint::check(&constraints, mesh).map_err(here)?;
        Ok(Contents {
            kind,
            constraints,
            matrices,
        })
    }

    fn kind(&self, contents: &str) -> Kind {
        let extension = self.path.extension().map(|e| e.to_ascii_lowercase());
        match extension.as_deref().and_then(|e| e.to_str()) {
            Some("sel") => Kind::Sel,
            _ if self.def.is_some() => Kind::Sel,
            Some("json") => Kind::Json,
            _ if contents.trim_start().starts_with(['{', '[']) => Kind::Json,
            _ => Kind::Text,
        }
    }

    fn read_matrix(&self) -> Result<Matrix4<f64>, ToolError> {
        let path = match self.def {
            Some(path) => path.to_owned(),
            None => {
                let expected = self.path.with_extension("def");
                if !expected.is_file() {
                    return Err(in_file(self.path)(HandlesError::NoDef { expected }));
                }
                expected
            }
        };
        sel::read_matrix(&self.read_text(&path)?).map_err(in_file(&path))
    }

    fn read_text(&self, path: &Path) -> Result<String, ToolError> {
        let refused = |error| in_file(path)(HandlesError::Read(error));
        let bytes = read_regular(path, self.max_bytes).map_err(refused)?;
        check_room(&bytes).map_err(refused)?;
        let text = String::from_utf8(bytes).map_err(|_| in_file(path)(HandlesError::NotText))?;
        Ok(match text.strip_prefix('\u{feff}') {
            Some(text) => text.to_owned(),
            None => text,
        })
    }
}

/// The contents of a file per vertex, with the indices of the mesh file.
struct Contents {
    kind: Kind,
    constraints: Vec<Constraint>,
    /// The transforms of handles, in order; at most one in a `.sel` file.
    matrices: Vec<(HandlePlace, Matrix4<f64>)>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Json,
    Text,
    Sel,
}

fn in_file(path: &Path) -> impl Fn(HandlesError) -> ToolError {
    let path: PathBuf = path.to_owned();
    move |source| ToolError::Handles {
        path: path.clone(),
        source,
    }
}

/// Checks that the system can provide memory for parsing these bytes: a number takes at least two
/// bytes of text, and its parsed form at most this many times as many.
fn check_room(bytes: &[u8]) -> std::io::Result<()> {
    const BYTES_PER_BYTE: usize = 16;
    let parsed = bytes.len().saturating_mul(BYTES_PER_BYTE);
    Vec::<u8>::new()
        .try_reserve_exact(parsed)
        .map_err(|_| std::io::ErrorKind::OutOfMemory.into())
}

#[cfg(test)]
mod tests;
