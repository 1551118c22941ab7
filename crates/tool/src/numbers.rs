//! Conversion of errors to the indices of the user's file.

use cotan::Error;
use cotan::flow::FlowError;
use cotan::geometry::SurfaceError;
use cotan::halfedge::VertexId;
use cotan::laplacian::SchemeError;
use cotan::linear::LinearError;
use cotan_io::{IoError, ProcessingMesh, Repaired};

use crate::handles_file::FileVertices;

/// Converts the vertex indices of an error to those of the file.
pub fn in_file_numbers(
    error: Error,
    processing: &ProcessingMesh,
    file_vertices: Option<&FileVertices>,
) -> Error {
    let file = |v: VertexId| {
        if v.index() < processing.mesh().num_vertices() {
            let vertex = processing.document_vertex(v);
            VertexId::new(file_vertices.map_or(vertex, |file| file.vertex(vertex)))
        } else {
            v
        }
    };
    let linear = |error| match error {
        LinearError::ComponentWithoutHandle {
            vertex,
            num_vertices,
        } => LinearError::ComponentWithoutHandle {
            vertex: file(vertex),
            num_vertices,
        },
        LinearError::DuplicateHandle { vertex } => LinearError::DuplicateHandle {
            vertex: file(vertex),
        },
        LinearError::HandleWeight { vertex, weight } => LinearError::HandleWeight {
            vertex: file(vertex),
            weight,
        },
        other => other,
    };
    let surface = |error| match error {
        SurfaceError::NonFinite { vertex } => SurfaceError::NonFinite {
            vertex: file(vertex),
        },
        other => other,
    };
    let scheme = |error| match error {
        SchemeError::NonFiniteWeight { scheme, vertices } => SchemeError::NonFiniteWeight {
            scheme,
            vertices: vertices.map(file),
        },
        other => other,
    };
    match error {
        Error::Contradiction { groups, vertex } => Error::Contradiction {
            groups,
            vertex: file(vertex),
        },
        Error::Surface(error) => Error::Surface(surface(error)),
        Error::Scheme(error) => Error::Scheme(scheme(error)),
        Error::Flow(FlowError::Scheme(error)) => Error::Flow(FlowError::Scheme(scheme(error))),
        Error::Flow(FlowError::Surface(error)) => Error::Flow(FlowError::Surface(surface(error))),
        Error::Flow(FlowError::Linear(error)) => Error::Flow(FlowError::Linear(linear(error))),
        Error::Flow(FlowError::NonFiniteTarget { vertex }) => {
            Error::Flow(FlowError::NonFiniteTarget {
                vertex: file(vertex),
            })
        }
        other => other,
    }
}

/// Converts the vertex and face indices of an error to those before a repair.
pub fn before_repair(error: IoError, repaired: &Repaired) -> IoError {
    let vertex = |v: VertexId| {
        let source = repaired.vertex_sources.get(v.index());
        source.map_or(v, |&source| VertexId::new(source))
    };
    let face = |f: usize| {
        let source = repaired.face_sources.get(f).copied().flatten();
        source.unwrap_or(f)
    };
    let IoError::NotManifold(error) = error else {
        return error;
    };
    IoError::NotManifold(error.renumbered(vertex, face))
}
