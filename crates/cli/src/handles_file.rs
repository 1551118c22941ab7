//! Handles files: which vertices are held, and where they go.
//!
//! Three kinds are read: JSON ([`json`]), text with `vertex x y z` a line ([`text`]), and the pair
//! `.sel` + `.def` of the bend benchmark ([`sel`]). All of them end as a list of [`Constraint`]s, one
//! a vertex, in the numbers of the mesh file and checked against the mesh and each other.

mod constraint;
mod error;
mod json;
mod sel;
mod selection;
mod text;
mod transform;

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use cotan_io::{Document, ProcessingMesh};

pub(crate) use constraint::{Constraint, Goal, to_handles};
pub(crate) use error::{HandlesError, Place};

use crate::error::CliError;

/// The files that name the handles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HandlesFile<'a> {
    pub(crate) path: &'a Path,
    /// The matrix of a `.sel` file, where it is not beside it.
    pub(crate) def: Option<&'a Path>,
}

impl HandlesFile<'_> {
    /// Reads the handles of a document, in the numbers of its file; they come back in those of the
    /// document. A handle on a vertex that a repair split holds all its copies.
    ///
    /// # Errors
    /// [`CliError::Handles`] with the file, the handle or line, and what to do.
    pub(crate) fn read(
        &self,
        document: &Document,
        processing: &ProcessingMesh,
        file_vertices: Option<&FileVertices>,
    ) -> Result<Vec<Constraint>, CliError> {
        let here = in_file(self.path);
        let contents = read_text(self.path)?;
        let mesh = Vertices {
            document,
            processing,
            file_vertices,
        };
        let kind = self.kind(&contents);
        let constraints = match kind {
            Kind::Json => json::read(&contents, &mesh),
            Kind::Text => text::read(&contents, &mesh),
            Kind::Sel => {
                let statuses = sel::read_statuses(&contents, &mesh).map_err(&here)?;
                let matrix = match statuses.need_matrix() {
                    true => Some(self.read_matrix()?),
                    false => None,
                };
                statuses.constraints(matrix, &mesh)
            }
        };
        let constraints = constraints.map_err(&here)?;
        if constraints.is_empty() {
            return Err(here(HandlesError::NoHandles));
        }
        constraint::check(&constraints, &mesh).map_err(here)?;
        Ok(mesh.on_surface(&constraints, kind))
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

    fn read_matrix(&self) -> Result<nalgebra::Matrix4<f64>, CliError> {
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
        sel::read_matrix(&read_text(&path)?).map_err(in_file(&path))
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Json,
    Text,
    Sel,
}

/// Where the vertices of a file are in the document that was repaired from it.
#[derive(Clone, Debug)]
pub(crate) struct FileVertices {
    num_vertices: usize,
    /// The vertex of the file for each vertex of the document.
    sources: Vec<usize>,
    /// Vertices of the file with those of the document that come from them, in order.
    copies: Vec<(usize, usize)>,
}

impl FileVertices {
    /// `sources` gives the file's vertex for each vertex of the document.
    pub(crate) fn new(num_vertices: usize, sources: Vec<usize>) -> Self {
        let mut copies: Vec<_> = sources
            .iter()
            .enumerate()
            .map(|(v, &file)| (file, v))
            .collect();
        copies.sort_unstable();
        Self {
            num_vertices,
            sources,
            copies,
        }
    }

    /// The vertex of the file that a vertex of the document comes from.
    pub(crate) fn vertex(&self, vertex: usize) -> usize {
        self.sources.get(vertex).copied().unwrap_or(vertex)
    }

    /// Number of vertices of the file.
    pub(crate) fn num_vertices(&self) -> usize {
        self.num_vertices
    }

    /// The vertices of the document that come from a vertex of the file.
    pub(crate) fn in_document(&self, vertex: usize) -> impl Iterator<Item = usize> {
        self.copies(vertex).iter().map(|&(_, v)| v)
    }

    fn copies(&self, vertex: usize) -> &[(usize, usize)] {
        let start = self.copies.partition_point(|&(file, _)| file < vertex);
        let end = self.copies.partition_point(|&(file, _)| file <= vertex);
        &self.copies[start..end]
    }
}

/// The vertices that handles refer to.
pub(crate) struct Vertices<'a> {
    document: &'a Document,
    processing: &'a ProcessingMesh,
    file_vertices: Option<&'a FileVertices>,
}

impl Vertices<'_> {
    /// Number of vertices of the file.
    fn len(&self) -> usize {
        match self.file_vertices {
            Some(file) => file.num_vertices,
            None => self.document.positions().len(),
        }
    }

    /// The document's vertices that a vertex of the file is.
    fn copies(&self, vertex: usize) -> impl Iterator<Item = usize> {
        let copies = self.file_vertices.map(|file| file.copies(vertex));
        let own = copies.is_none().then_some(vertex);
        own.into_iter()
            .chain(copies.into_iter().flatten().map(|&(_, v)| v))
    }

    /// The constraints in the numbers of the document, with what was welded held once: where several
    /// vertices of one handle are one of the surface, the first says where it goes.
    fn on_surface(&self, constraints: &[Constraint], kind: Kind) -> Vec<Constraint> {
        let positions = self.document.positions();
        let mut seen = HashSet::new();
        let mut held = Vec::with_capacity(constraints.len());
        for constraint in constraints {
            for copy in self.copies(constraint.vertex) {
                let Some(id) = self.processing.vertex(copy) else {
                    continue;
                };
                // All that a .sel file moves is one handle, and so is all that it fixes.
                let handle = match kind {
                    Kind::Sel => None,
                    Kind::Json | Kind::Text => Some(constraint.place),
                };
                let is_fixed = constraint.goal == Goal::Stay;
                if !seen.insert((handle, is_fixed, id)) {
                    continue;
                }
                let vertex = self.processing.document_vertex(id);
                let goal = match (constraint.goal, positions.get(copy), positions.get(vertex)) {
                    (Goal::To(target), Some(own), Some(first)) if target == *own => {
                        Goal::To(*first)
                    }
                    // A vertex keeps its distance to the one that it is welded to.
                    (Goal::To(target), Some(own), Some(first)) if own != first => {
                        Goal::To(target - (own - first))
                    }
                    (goal, ..) => goal,
                };
                held.push(Constraint {
                    vertex,
                    goal,
                    ..*constraint
                });
            }
        }
        held
    }

    /// The position of a vertex of the file that a face uses.
    fn position(&self, vertex: usize, place: Place) -> Result<nalgebra::Point3<f64>, HandlesError> {
        let first = self.copies(vertex).next();
        let Some(position) = first.and_then(|v| self.document.positions().get(v)) else {
            return Err(HandlesError::OutOfRange {
                place,
                vertex,
                num_vertices: self.len(),
            });
        };
        match self.is_used(vertex) {
            true => Ok(*position),
            false => Err(HandlesError::Unreferenced { place, vertex }),
        }
    }

    fn is_used(&self, vertex: usize) -> bool {
        self.copies(vertex)
            .any(|v| self.processing.vertex(v).is_some())
    }

    /// The vertices of the file that some face uses, in order.
    fn used(&self) -> impl Iterator<Item = (usize, nalgebra::Point3<f64>)> {
        (0..self.len())
            .filter(|&vertex| self.is_used(vertex))
            .filter_map(|vertex| {
                let first = self.copies(vertex).next()?;
                Some((vertex, *self.document.positions().get(first)?))
            })
    }
}

fn in_file(path: &Path) -> impl Fn(HandlesError) -> CliError {
    let path: PathBuf = path.to_owned();
    move |source| CliError::Handles {
        path: path.clone(),
        source,
    }
}

fn read_text(path: &Path) -> Result<String, CliError> {
    let bytes = std::fs::read(path).map_err(|e| in_file(path)(HandlesError::Read(e)))?;
    let text = String::from_utf8(bytes).map_err(|_| in_file(path)(HandlesError::NotText))?;
    Ok(match text.strip_prefix('\u{feff}') {
        Some(text) => text.to_owned(),
        None => text,
    })
}
