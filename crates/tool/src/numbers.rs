//! Conversion of errors to the indices of the user's file.

use cotan::Error;
use cotan::halfedge::VertexId;
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
    error.with_vertices(file)
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
