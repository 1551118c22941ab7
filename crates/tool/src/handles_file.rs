//! Handles files: which vertices are held, and where they go.
//!
//! Three kinds are read: JSON, text with `vertex x y z` a line, and the pair `.sel` + `.def` of the
//! bend benchmark. All of them end as a list of [`Constraint`]s, one a vertex, checked against the
//! mesh and each other; or as [`Group`]s, which still know the map that moves them. Groups are
//! written as JSON by [`to_json`].

mod constraint;
mod error;
mod file_vertices;
mod group;
mod json;
mod loose;
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
pub use error::{HandlesError, Place};
pub use file_vertices::FileVertices;
pub use group::{Group, GroupMotion, constraints};
pub use json::from_json;
pub use loose::Loose;
pub use write::{groups_in_file, to_json};

use crate::error::ToolError;
use vertices::Vertices;

/// The files that name the handles.
#[derive(Clone, Copy, Debug)]
pub struct HandlesFile<'a> {
    /// JSON, text, or a `.sel` file.
    pub path: &'a Path,
    /// The matrix of a `.sel` file, where it is not beside it.
    pub def: Option<&'a Path>,
    /// Larger files are refused.
    pub max_bytes: u64,
}

impl HandlesFile<'_> {
    /// The file of the matrix, where it is not named but found beside a `.sel` file.
    pub fn matrix_beside(&self) -> Option<PathBuf> {
        let is_sel = self.def.is_none() && self.kind("") == Kind::Sel;
        is_sel.then(|| self.path.with_extension("def"))
    }

    /// Reads the handles of a document, in the numbers of its file; they come back in those of the
    /// document. A handle on a vertex that a repair split holds all its copies.
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

    /// As [`HandlesFile::read`], with the vertices that move alike kept together: the handles of a
    /// JSON file, the lines of a text file, what a `.sel` file fixes and what it moves.
    ///
    /// [`constraints`] makes of them what [`HandlesFile::read`] gives, but for the places in the
    /// file and, of a `.sel` file, the order.
    ///
    /// # Errors
    /// As [`HandlesFile::read`].
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

    /// What the file says, checked.
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
                matrices.extend(matrix.map(|matrix| (Place::Handle(0), matrix)));
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
                let beside = self.path.with_extension("def");
                if !beside.is_file() {
                    return Err(in_file(self.path)(HandlesError::NoDef { beside }));
                }
                beside
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

/// What a file says, vertex by vertex, in the numbers of the mesh file.
struct Contents {
    kind: Kind,
    constraints: Vec<Constraint>,
    /// The maps that move handles, in order; one at most in a `.sel` file.
    matrices: Vec<(Place, Matrix4<f64>)>,
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

/// Room for what is parsed from these bytes: a number takes two bytes of a text, and what it
/// becomes no more than this many times as many.
fn check_room(bytes: &[u8]) -> std::io::Result<()> {
    const BYTES_PER_BYTE: usize = 16;
    let parsed = bytes.len().saturating_mul(BYTES_PER_BYTE);
    Vec::<u8>::new()
        .try_reserve_exact(parsed)
        .map_err(|_| std::io::ErrorKind::OutOfMemory.into())
}

#[cfg(test)]
mod tests;
