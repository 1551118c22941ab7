//! Numbers of the vertices, read from a property of the file.

use cotan::halfedge::VertexMap;

use crate::error::CliError;
use crate::prepare::Prepared;

/// A field of the file with one number per vertex.
///
/// # Errors
/// [`CliError::NoField`] if there is no such field, or if a vertex of the surface has no finite
/// value.
pub(crate) fn vertex_field(mesh: &Prepared, name: &str) -> Result<VertexMap<f64>, CliError> {
    let attributes = mesh.document.attributes().map_err(|e| mesh.in_file(e))?;
    let missing = || {
        let names: Vec<&str> = attributes
            .vertices
            .iter()
            .filter(|p| p.components == 1)
            .map(|p| p.name.as_str())
            .collect();
        CliError::NoField {
            path: mesh.path().to_owned(),
            name: name.to_owned(),
            known: if names.is_empty() {
                "none".to_owned()
            } else {
                names.join(", ")
            },
        }
    };
    let property = attributes.vertex(name).ok_or_else(missing)?;
    if property.components != 1 {
        return Err(missing());
    }
    let processing = &mesh.processing;
    processing
        .mesh()
        .vertices()
        .map(|v| {
            let value = property.values.get(processing.document_vertex(v));
            value.filter(|x| x.is_finite()).ok_or_else(missing)
        })
        .collect()
}
