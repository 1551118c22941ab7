//! Longitude and latitude as the texture coordinates of a document.

use cotan::geometry::Scalar;
use cotan::halfedge::FaceId;
use cotan::sphere::CornerUvs;
use cotan_io::{CornerProperty, Document, IoError, NONE, ProcessingMesh, UV, Values};

use crate::sphere::Mapped;

/// Sets the texture coordinates of a document to the longitudes and latitudes of its vertices.
///
/// They replace existing ones. The document is then no longer tied to its file.
pub(crate) fn with_texture<T: Scalar>(
    document: Document,
    mapped: &Mapped<T>,
    processing: &ProcessingMesh,
) -> Result<Document, IoError> {
    let uvs = mapped.map.longitude_latitude();
    let mut attributes = document.attributes()?.into_owned();
    attributes.vertices.retain(|property| property.name != UV);
    attributes.corners.retain(|property| property.name != UV);
    attributes
        .corners
        .push(corners(&document, &uvs, mapped, processing));
    document.with_attributes(attributes)
}

/// The texture coordinates of the corners of the document's faces, which may be polygons.
fn corners<T: Scalar>(
    document: &Document,
    uvs: &CornerUvs<T>,
    mapped: &Mapped<T>,
    processing: &ProcessingMesh,
) -> CornerProperty {
    let mesh = processing.mesh();
    let (table, of_triangles) = uvs.indexed(&mapped.map);
    // The triangles of each face are contiguous and in the order of the faces.
    let mut triangles: Vec<FaceId> = mesh.faces().collect();
    triangles.sort_by_key(|&f| processing.document_face(f));
    let mut triangle = 0;
    let mut indices = Vec::with_capacity(document.faces().num_corners());
    for (face, polygon) in document.faces().iter().enumerate() {
        let start = triangle;
        let is_of_face = |&f: &FaceId| processing.document_face(f) == face;
        triangle += triangles[start..]
            .iter()
            .take_while(|f| is_of_face(f))
            .count();
        let corner = |&vertex: &u32| {
            let v = processing.vertex(vertex as usize)?;
            triangles[start..triangle].iter().find_map(|&t| {
                let place = mesh.triangle(t).iter().position(|&w| w == v)?;
                Some(of_triangles[t.index()][place])
            })
        };
        indices.extend(polygon.iter().map(|v| corner(v).unwrap_or(NONE)));
    }
    CornerProperty {
        name: UV.to_owned(),
        components: 2,
        values: Values::F64(table.iter().flatten().map(|x| x.as_f64()).collect()),
        indices,
    }
}
