//! From a file to a mesh that can be edited.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use cotan::halfedge::BuildError;
use cotan_io::{
    Change, Cure, Document, Folder, IoError, Limits, ProcessingMesh, Repair, Weld, load_with,
};
use cotan_tool::files::in_file;
use cotan_tool::handles_file::FileVertices;
use cotan_tool::numbers::before_repair;
use cotan_tool::repair::option;
use cotan_tool::{MemoryError, MemoryLimit, Work};
use thiserror::Error;

use super::Fingerprint;

/// A mesh with all that is known of its file.
#[derive(Clone, Debug)]
pub struct OpenedMesh {
    /// The file.
    pub path: PathBuf,
    /// What it holds, at rest; repaired, if that was asked for.
    pub document: Document,
    /// Its surface.
    pub processing: Arc<ProcessingMesh>,
    /// What is odd about the file, for a person.
    pub warnings: Vec<String>,
    /// The file as it was read; to be handed to [`save`](super::save).
    pub fingerprint: Fingerprint,
    /// How the vertices of the file are found; `None` if they are those of the document.
    pub file_vertices: Option<FileVertices>,
    /// What the repair did; empty if there was nothing to repair.
    pub changes: Vec<Change>,
}

/// Why a mesh was not opened: one sentence that names the file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OpenError {
    /// A file that cannot be read, or has no surface that a repair could save.
    #[error(transparent)]
    Io(#[from] IoError),
    /// A folder, a pipe or a device, which could keep the editor waiting for ever.
    #[error("{}: this is {what}, not a mesh file", path.display())]
    NotAFile {
        /// What was to be opened.
        path: PathBuf,
        /// What it is.
        what: &'static str,
    },
    /// A mesh that is too large for this machine.
    #[error("{}: {source}", path.display())]
    Memory {
        /// The file.
        path: PathBuf,
        /// How much memory it would take.
        #[source]
        source: MemoryError,
    },
    /// Faces that are no surface.
    #[error("{}: {source}; {remedy}", path.display())]
    Unsound {
        /// The file.
        path: PathBuf,
        /// The first defect, in the numbers of the file.
        #[source]
        source: Box<BuildError>,
        /// What helps.
        remedy: Remedy,
    },
}

/// What can be done about faces that are no surface.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Remedy {
    /// [`open_repaired`] does; the step of `cotan repair` does no more than this.
    OpenRepaired(Cure),
    /// The safe repairs do not go so far; the step of `cotan repair` does.
    Command(Cure),
}

impl std::fmt::Display for Remedy {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::OpenRepaired(cure) => write!(
                f,
                "open it repaired, or repair the file with `cotan repair {}`",
                option(*cure)
            ),
            Self::Command(cure) => write!(
                f,
                "opening it repaired does not go so far: repair the file with `cotan repair \
                 {}` first",
                option(*cure)
            ),
        }
    }
}

impl OpenError {
    /// Whether [`open_repaired`] may open what [`open`] could not.
    pub fn is_repairable(&self) -> bool {
        matches!(
            self,
            Self::Unsound {
                remedy: Remedy::OpenRepaired(_),
                ..
            }
        )
    }
}

/// Opens a mesh as it is, within the limits of the command line; the buffers of a glTF may lie in
/// the file's own folder and nowhere else.
///
/// # Errors
/// [`OpenError`], also if the faces are no surface.
pub fn open(path: &Path) -> Result<OpenedMesh, OpenError> {
    let (document, fingerprint) = load(path)?;
    as_it_is(path, document, fingerprint, Tried::Nothing)
}

/// Opens a mesh with the repairs that lose nothing, those of `--repair`: degenerate and duplicate
/// faces dropped, faces oriented, vertices with several fans split. The file stays as it is.
///
/// # Errors
/// As [`open`], if that was not enough.
pub fn open_repaired(path: &Path) -> Result<OpenedMesh, OpenError> {
    let (document, fingerprint) = load(path)?;
    // Welded before the repair and not after it: what was parted would be joined again.
    let repair = Repair::default().weld_in_place(Weld::AsFormat);
    let mut done = repair
        .apply(&document)
        .map_err(|error| in_file(path, error))?;
    // Welding is about the surface, and the file keeps its vertices.
    done.changes
        .retain(|change| !matches!(change, Change::MergedVertex { .. }));
    if done.changes.is_empty() {
        return as_it_is(path, document, fingerprint, Tried::Repair);
    }
    let surface = done.document.surface();
    let processing =
        surface.map_err(|error| unsound(path, before_repair(error, &done), Tried::Repair))?;
    let num_vertices = document.positions().len();
    Ok(OpenedMesh {
        path: path.to_owned(),
        processing: Arc::new(processing),
        warnings: warnings(&document),
        document: done.document,
        fingerprint,
        file_vertices: Some(FileVertices::new(num_vertices, done.vertex_sources)),
        changes: done.changes,
    })
}

/// A document in which nothing was repaired.
fn as_it_is(
    path: &Path,
    document: Document,
    fingerprint: Fingerprint,
    tried: Tried,
) -> Result<OpenedMesh, OpenError> {
    let processing = document
        .surface()
        .map_err(|error| unsound(path, error, tried))?;
    Ok(OpenedMesh {
        path: path.to_owned(),
        processing: Arc::new(processing),
        warnings: warnings(&document),
        document,
        fingerprint,
        file_vertices: None,
        changes: Vec::new(),
    })
}

/// What was done before a surface could not be built.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Tried {
    Nothing,
    Repair,
}

/// The file, and what it was like before it was read: what changes meanwhile is noticed at the
/// save.
fn load(path: &Path) -> Result<(Document, Fingerprint), OpenError> {
    let metadata = std::fs::metadata(path).map_err(|e| in_file(path, IoError::Read(e)))?;
    if !metadata.is_file() {
        let what = match metadata.is_dir() {
            true => "a folder",
            false => "a device or a pipe",
        };
        let path = path.to_owned();
        return Err(OpenError::NotAFile { path, what });
    }
    let fingerprint = Fingerprint::from_metadata(&metadata);
    let memory = MemoryLimit::of_machine();
    let limits = memory.reading(Limits::default());
    let document = load_with(path, &limits, &Folder::of(path))?;
    // What is opened will be edited.
    let checked = memory.check(Work::Deform, &document);
    checked.map_err(|source| OpenError::Memory {
        path: path.to_owned(),
        source,
    })?;
    Ok((document, fingerprint))
}

fn warnings(document: &Document) -> Vec<String> {
    let all = document.warnings();
    let told = all.iter().take(MOST_WARNINGS);
    let mut warnings: Vec<String> = told.map(ToString::to_string).collect();
    if all.len() > MOST_WARNINGS {
        warnings.push(format!("{} more warnings", all.len() - MOST_WARNINGS));
    }
    warnings
}

/// How many oddities of a file are told.
const MOST_WARNINGS: usize = 10;

fn unsound(path: &Path, error: IoError, tried: Tried) -> OpenError {
    let remedy = match (tried, error.cure().unwrap_or(Cure::SplitEdges)) {
        // What the safe repairs left over is left by all but one.
        (Tried::Repair, _) | (Tried::Nothing, Cure::SplitEdges) => {
            Remedy::Command(Cure::SplitEdges)
        }
        (Tried::Nothing, cure) => Remedy::OpenRepaired(cure),
    };
    match error {
        IoError::NotManifold(source) => OpenError::Unsound {
            path: path.to_owned(),
            source: Box::new(source),
            remedy,
        },
        error => OpenError::Io(in_file(path, error)),
    }
}

#[cfg(test)]
mod tests;
