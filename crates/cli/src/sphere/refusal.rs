//! Why a mesh has no sphere map, in the numbers of its file.

use cotan::halfedge::{FaceId, VertexId};
use cotan::sphere::SphereError;
use cotan_tool::numbers::in_file_numbers;

use crate::error::CliError;
use crate::prepare::{Holes, Prepared, Source};

/// Turns the library's errors into those of a command.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Refusal<'a> {
    source: &'a Source<'a>,
    prepared: &'a Prepared,
}

impl<'a> Refusal<'a> {
    pub(crate) fn new(source: &'a Source<'a>, prepared: &'a Prepared) -> Self {
        Self { source, prepared }
    }

    /// The error with the file's name and numbers, and what is left to do.
    pub(crate) fn error(&self, error: SphereError) -> CliError {
        let remedy = match (&error, self.source.holes) {
            (SphereError::NotClosed { .. }, Holes::Fill) => {
                " (what --fill-holes left open needs a larger =N, or has to be closed by hand)"
            }
            _ => "",
        };
        CliError::Sphere {
            path: self.source.path.to_path_buf(),
            source: self.in_file_numbers(error),
            remedy,
        }
    }

    fn in_file_numbers(&self, error: SphereError) -> SphereError {
        match error {
            SphereError::NotClosed { loops, vertex } => SphereError::NotClosed {
                loops,
                vertex: self.vertex(vertex),
            },
            SphereError::Components { components } => SphereError::Components {
                components: components
                    .into_iter()
                    .map(|(v, count)| (self.vertex(v), count))
                    .collect(),
            },
            SphereError::OffSphere { vertex, distance } => SphereError::OffSphere {
                vertex: self.vertex(vertex),
                distance,
            },
            SphereError::Flipped { count, first } => SphereError::Flipped {
                count,
                first: self.face(first),
            },
            SphereError::Surface(error) => self.shared(error.into()),
            SphereError::Scheme(error) => self.shared(error.into()),
            SphereError::Flow(error) => self.shared(error.into()),
            other => other,
        }
    }

    /// Errors that deformations have, too.
    fn shared(&self, error: cotan::Error) -> SphereError {
        let file_vertices = self.prepared.file_vertices.as_ref();
        match in_file_numbers(error, &self.prepared.processing, file_vertices) {
            cotan::Error::Surface(error) => error.into(),
            cotan::Error::Scheme(error) => error.into(),
            cotan::Error::Flow(error) => error.into(),
            other => SphereError::Mismatch(other.to_string()),
        }
    }

    fn vertex(&self, vertex: VertexId) -> VertexId {
        let vertex = self.prepared.processing.document_vertex(vertex);
        let file = self.prepared.file_vertices.as_ref();
        VertexId::new(file.map_or(vertex, |file| file.vertex(vertex)))
    }

    /// A face that fills a hole has no number in the file, and keeps that of the repaired one.
    fn face(&self, face: FaceId) -> FaceId {
        let face = self.prepared.processing.document_face(face);
        let sources = self.prepared.file_faces.as_deref();
        let source = sources.and_then(|sources| sources.get(face).copied().flatten());
        FaceId::new(source.unwrap_or(face))
    }
}
