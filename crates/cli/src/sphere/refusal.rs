//! Errors of sphere maps with the indices of the file.

use cotan::halfedge::{FaceId, VertexId};
use cotan::sphere::SphereError;
use cotan_io::Filling;
use cotan_tool::numbers::in_file_numbers;

use crate::error::CliError;
use crate::prepare::Prepared;

/// The error with the file's name and indices, and a remedy.
pub(crate) fn refuse(mesh: &Prepared, error: SphereError) -> CliError {
    let mut remedy = String::new();
    if let SphereError::NotClosed { .. } | SphereError::Components { .. } = &error
        && let Some(weldable) = mesh.weldable()
    {
        remedy = format!("; {weldable}");
    }
    remedy.push_str(match (&error, mesh.source.filling) {
        (SphereError::NotClosed { .. }, Filling::Plain { .. }) => {
            " (what --fill-holes left open needs a larger =N, or --fill-holes smooth)"
        }
        (SphereError::NotClosed { .. }, Filling::Smooth { .. }) => {
            " (what --fill-holes left open needs a larger N, or has to be closed by hand)"
        }
        _ => "",
    });
    CliError::Sphere {
        path: mesh.path().to_owned(),
        source: Refusal(mesh).in_file_numbers(error),
        remedy,
    }
}

/// Converts the elements that an error names.
struct Refusal<'a>(&'a Prepared);

impl Refusal<'_> {
    fn in_file_numbers(&self, error: SphereError) -> SphereError {
        match error {
            SphereError::NotClosed { loops, vertex } => SphereError::NotClosed {
                loops,
                vertex: self.lowest_at_a_hole().unwrap_or(vertex),
            },
            SphereError::Components { .. } => SphereError::Components {
                components: self.components(),
            },
            SphereError::OffSphere { vertex, distance } => SphereError::OffSphere {
                vertex: self.vertex(vertex),
                distance,
            },
            SphereError::Overflow { vertex } => SphereError::Overflow {
                vertex: self.vertex(vertex),
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

    /// Converts errors that deformations share.
    fn shared(&self, error: cotan::Error) -> SphereError {
        let file_vertices = self.0.file_vertices.as_ref();
        match in_file_numbers(error, &self.0.processing, file_vertices) {
            cotan::Error::Surface(error) => error.into(),
            cotan::Error::Scheme(error) => error.into(),
            cotan::Error::Flow(error) => error.into(),
            other => SphereError::Mismatch(other.to_string()),
        }
    }

    /// The lowest vertex of the file at a hole, which identifies that hole in all messages.
    fn lowest_at_a_hole(&self) -> Option<VertexId> {
        let mesh = self.0.processing.mesh();
        let at_holes = mesh.vertices().filter(|&v| mesh.is_boundary_vertex(v));
        at_holes.map(|v| self.vertex(v)).min()
    }

    /// The lowest vertex of the file and the number of vertices of each component, in file order.
    fn components(&self) -> Vec<(VertexId, usize)> {
        let mesh = self.0.processing.mesh();
        let components = mesh.components();
        let mut lowest: Vec<Option<VertexId>> = vec![None; components.count()];
        for v in mesh.vertices() {
            let file = self.vertex(v);
            let lowest = lowest[components.of(v)].get_or_insert(file);
            *lowest = file.min(*lowest);
        }
        let sizes = components.sizes().iter().copied();
        let found = lowest.into_iter().zip(sizes);
        let mut found: Vec<_> = found.filter_map(|(v, size)| Some((v?, size))).collect();
        found.sort_unstable();
        found
    }

    fn vertex(&self, vertex: VertexId) -> VertexId {
        let vertex = self.0.processing.document_vertex(vertex);
        let file = self.0.file_vertices.as_ref();
        VertexId::new(file.map_or(vertex, |file| file.vertex(vertex)))
    }

    /// The face of the file.
    ///
    /// A face that fills a hole has none and keeps its index in the repaired mesh.
    fn face(&self, face: FaceId) -> FaceId {
        let face = self.0.processing.document_face(face);
        let sources = self.0.file_faces.as_deref();
        let source = sources.and_then(|sources| sources.get(face).copied().flatten());
        FaceId::new(source.unwrap_or(face))
    }
}
