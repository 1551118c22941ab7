//! Opening a file as a mesh that can be edited.

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

/// A mesh and the information about its file.
#[derive(Clone, Debug)]
pub struct OpenedMesh {
    /// The path of the file.
    pub path: PathBuf,
    /// The name of the mesh file; it differs from that of `path` if that is a project.
    pub name: String,
    /// The document in its rest shape, repaired if that was requested.
    pub document: Document,
    /// The surface of the document.
    pub processing: Arc<ProcessingMesh>,
    /// Warnings about the file for the user.
    pub warnings: Vec<String>,
    /// The fingerprint when the file was read, to be passed to [`save`](super::save).
    pub fingerprint: Fingerprint,
    /// Maps vertices to those of the file; `None` if they are those of the document.
    pub file_vertices: Option<FileVertices>,
    /// The changes made by the repair; empty if nothing was repaired.
    pub changes: Vec<Change>,
    /// The document before the repair, if something was repaired: a project keeps it.
    pub before_repair: Option<Arc<Document>>,
}

/// The reason why a mesh was not opened, as one sentence that names the file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OpenError {
    /// The file cannot be read, or it has no surface that a repair could save.
    #[error(transparent)]
    Io(#[from] IoError),
    /// The path is a folder, a pipe or a device, which could block the editor forever.
    #[error("{}: this is {what}, not a mesh file", path.display())]
    NotAFile {
        /// The path.
        path: PathBuf,
        /// The kind of entry at the path.
        what: &'static str,
    },
    /// The mesh is too large for this machine.
    #[error("{}: {source}", path.display())]
    Memory {
        /// The file.
        path: PathBuf,
        /// The memory it would take.
        #[source]
        source: MemoryError,
    },
    /// The faces do not form a surface.
    #[error("{}: {source}; {remedy}", path.display())]
    Unsound {
        /// The file.
        path: PathBuf,
        /// The first defect, with the indices of the file.
        #[source]
        source: Box<BuildError>,
        /// The way to fix it.
        remedy: Remedy,
    },
}

/// The way to fix faces that do not form a surface.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Remedy {
    /// [`open_repaired`] opens the mesh. The step of `cotan repair` does no more than that.
    OpenRepaired(Cure),
    /// The safe repairs are not enough, but the step of `cotan repair` is.
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

/// A file, and the name of the mesh in it.
pub(super) struct Place {
    pub(super) path: PathBuf,
    pub(super) name: String,
    pub(super) fingerprint: Fingerprint,
}

impl OpenedMesh {
    /// The mesh of a document, without repairs.
    pub(super) fn as_it_is(place: Place, document: Document) -> Result<Self, IoError> {
        let (processing, note) = surface_of(&document)?;
        let mut warnings = warnings(&document);
        warnings.extend(note);
        Ok(Self {
            path: place.path,
            name: place.name,
            processing: Arc::new(processing),
            warnings,
            document,
            fingerprint: place.fingerprint,
            file_vertices: None,
            changes: Vec::new(),
            before_repair: None,
        })
    }

    /// The mesh of a document with the lossless repairs.
    pub(super) fn repaired(place: Place, document: Document) -> Result<Self, IoError> {
        // Weld before the repair: welding afterwards would join what the repair has split.
        let repair = Repair::default().weld_in_place(Weld::AsFormat);
        let mut done = repair.apply(&document)?;
        // Welding concerns only the surface; the file keeps its vertices.
        done.changes
            .retain(|change| !matches!(change, Change::MergedVertex { .. }));
        if done.changes.is_empty() {
            return Self::as_it_is(place, document);
        }
        let (processing, note) =
            surface_of(&done.document).map_err(|error| before_repair(error, &done))?;
        let mut warnings = warnings(&document);
        warnings.extend(note);
        let num_vertices = document.positions().len();
        Ok(Self {
            path: place.path,
            name: place.name,
            processing: Arc::new(processing),
            warnings,
            document: done.document,
            fingerprint: place.fingerprint,
            file_vertices: Some(FileVertices::new(num_vertices, done.vertex_sources)),
            changes: done.changes,
            before_repair: Some(Arc::new(document)),
        })
    }
}

/// The surface of a document, and a note if it had to be cut into pieces.
fn surface_of(document: &Document) -> Result<(ProcessingMesh, Option<String>), IoError> {
    match document.surface() {
        Err(IoError::NotManifold(defect)) => {
            let processing = document.surface_in_pieces(Weld::AsFormat)?;
            let note = format!(
                "The faces are not one oriented surface: {defect}. They were opened in {} pieces, \
                 which move as one where they meet. Maps to the sphere need a repaired file.",
                processing.mesh().pieces().count()
            );
            Ok((processing, Some(note)))
        }
        surface => Ok((surface?, None)),
    }
}

fn name_of(path: &Path) -> String {
    path.file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

impl OpenError {
    /// Returns `true` if [`open_repaired`] may open a mesh that [`open`] could not.
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

/// Opens a mesh as it is, within the limits of the command line.
///
/// Faces that are not one oriented manifold surface are opened in pieces, which move as one where
/// they meet. The buffers of a glTF must be in the folder of the file.
///
/// # Errors
/// [`OpenError`], also for a face that passes twice through a vertex.
pub fn open(path: &Path) -> Result<OpenedMesh, OpenError> {
    let (document, place) = load(path)?;
    OpenedMesh::as_it_is(place, document).map_err(|error| unsound(path, error, Tried::Nothing))
}

/// Opens a mesh with the lossless repairs of `--repair`.
///
/// Degenerate and duplicate faces are dropped, faces are oriented, and vertices with several fans
/// are split. The file stays unchanged.
///
/// # Errors
/// The same as [`open`], if the repairs were not enough.
pub fn open_repaired(path: &Path) -> Result<OpenedMesh, OpenError> {
    let (document, place) = load(path)?;
    OpenedMesh::repaired(place, document).map_err(|error| unsound(path, error, Tried::Repair))
}

/// The step that was tried before a surface could not be built.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Tried {
    Nothing,
    Repair,
}

/// Loads a file and its fingerprint from before it was read, so that a save notices any change
/// made in the meantime.
fn load(path: &Path) -> Result<(Document, Place), OpenError> {
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
    // Check the memory for a deformation, since the mesh will be edited.
    let checked = memory.check(Work::Deform, &document);
    checked.map_err(|source| OpenError::Memory {
        path: path.to_owned(),
        source,
    })?;
    let place = Place {
        path: path.to_owned(),
        name: name_of(path),
        fingerprint,
    };
    Ok((document, place))
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

/// The largest number of warnings reported for a file.
const MOST_WARNINGS: usize = 10;

fn unsound(path: &Path, error: IoError, tried: Tried) -> OpenError {
    let remedy = match (tried, error.cure().unwrap_or(Cure::SplitEdges)) {
        // Splitting edges is the only cure for defects that the safe repairs leave.
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
