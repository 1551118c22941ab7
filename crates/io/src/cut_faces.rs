//! Replacement of document polygons by the triangles into which they were cut.

use cotan_halfedge::FaceId;

use crate::document::Document;
use crate::error::IoError;
use crate::processing::ProcessingMesh;
use crate::remap::Remap;
use crate::weld::Weld;

/// A document in which some polygons have been replaced by triangles.
#[derive(Clone, Debug)]
pub struct CutDocument {
    /// The document.
    pub document: Document,
    /// For each of its faces, the 0-based index of the face in the original document.
    pub face_sources: Vec<usize>,
}

impl Document {
    /// Returns the document with the given faces (0-based) replaced by the triangles into which
    /// `processing` cut them.
    ///
    /// Vertices are unchanged. Texture coordinates, normals, groups and all other data of a face
    /// or corner are passed on to its triangles.
    ///
    /// Faces that `processing` omitted are kept, and indices out of range are ignored.
    ///
    /// # Errors
    /// [`IoError::PositionCount`] if `processing` does not belong to this document, and any error
    /// in the parts of the file that have to be decoded.
    pub fn with_faces_cut(
        &self,
        processing: &ProcessingMesh,
        faces: &[usize],
    ) -> Result<CutDocument, IoError> {
        let (expected, found) = (self.positions().len(), processing.num_document_vertices());
        if expected != found {
            return Err(IoError::PositionCount { expected, found });
        }
        let mut is_cut = vec![false; self.faces().len()];
        for &face in faces {
            if let Some(is_cut) = is_cut.get_mut(face) {
                *is_cut = true;
            }
        }
        let remap = remap(self, processing, &is_cut);
        let face_sources = remap.face_sources.iter().map(|&f| f as usize).collect();
        let places = self.places(Weld::AsFormat)?.into_owned();
        let document = self.remapped(&remap, places)?;
        Ok(CutDocument {
            document,
            face_sources,
        })
    }
}

fn remap(document: &Document, processing: &ProcessingMesh, is_cut: &[bool]) -> Remap {
    let mesh = processing.mesh();
    let is_cut = |face: usize| is_cut.get(face) == Some(&true);
    // The triangles of each face, contiguous and in face order.
    let mut triangles: Vec<(usize, FaceId)> = mesh
        .faces()
        .map(|f| (processing.document_face(f), f))
        .filter(|&(face, _)| is_cut(face))
        .collect();
    triangles.sort_by_key(|&(face, _)| face);
    let mut triangles = triangles.as_slice();
    let faces = document.faces();
    let mut remap = Remap {
        vertices: (0..document.positions().len() as u32).collect(),
        ..Remap::default()
    };
    for (face, polygon) in faces.iter().enumerate() {
        let first_corner = faces.corner_range(face).start;
        let mut add = |corners: &[usize]| {
            for &k in corners {
                remap.faces.push_corner(polygon[k]);
                remap.corner_sources.push((first_corner + k) as u32);
            }
            remap.faces.end_face();
            remap.face_sources.push(face as u32);
        };
        let count = triangles.iter().take_while(|t| t.0 == face).count();
        let (own, rest) = triangles.split_at(count);
        triangles = rest;
        if own.is_empty() {
            add(&(0..polygon.len()).collect::<Vec<_>>());
        }
        for &(_, t) in own {
            let corner = |v| {
                let is_corner = |&w: &u32| processing.vertex(w as usize) == Some(v);
                polygon.iter().position(is_corner).unwrap_or(0)
            };
            add(&mesh.triangle(t).map(corner));
        }
    }
    remap
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::Format;
    use crate::limits::Limits;

    fn text(bytes: Vec<u8>) -> String {
        String::from_utf8(bytes).expect("text")
    }

    #[test]
    fn triangles_of_a_quad_keep_texture_group_and_the_other_faces_bytes() {
        let obj = "# by hand\nmtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\n\
                   vt 0 0\nvt 0.5 0\nvt 0.5 1\nvt 0 1\nvt 1 0\nvt 1 1\n\
                   g left\nusemtl red\nf 1/1 2/2 3/3 4/4\ng right\nusemtl blue\nf 2/2 5/5 6/6 3/3\n";
        let document = crate::read(obj, None, &Limits::default()).expect("a document");
        let processing = document.surface().expect("a surface");
        let cut = document.with_faces_cut(&processing, &[1]).expect("a cut");
        assert_eq!(cut.face_sources, [0, 1, 1]);
        let written = text(cut.document.write(Format::Obj).expect("a file"));
        assert!(
            written.contains("g left\nusemtl red\nf 1/1 2/2 3/3 4/4\n"),
            "{written}"
        );
        let right = written.split("usemtl blue\n").nth(1).expect("the group");
        let triangles: Vec<&str> = right.lines().filter(|l| l.starts_with("f ")).collect();
        assert_eq!(triangles.len(), 2, "{written}");
        for triangle in triangles {
            for corner in triangle.split_whitespace().skip(1) {
                let (v, vt) = corner.split_once('/').expect("a texture coordinate");
                assert!(matches!(
                    (v, vt),
                    ("2", "2") | ("5", "5") | ("6", "6") | ("3", "3")
                ));
            }
        }
        assert!(written.contains("# by hand") && written.contains("mtllib a.mtl"));
    }

    #[test]
    fn triangles_of_a_ply_polygon_keep_its_properties() {
        let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
                   property float z\nelement face 1\nproperty list uchar int vertex_indices\n\
                   property int label\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3 7\n";
        let document = crate::read(ply, None, &Limits::default()).expect("a document");
        let processing = document.surface().expect("a surface");
        let cut = document.with_faces_cut(&processing, &[0]).expect("a cut");
        let written = text(cut.document.write(Format::Ply).expect("a file"));
        let rows: Vec<&str> = written.lines().rev().take(2).collect();
        assert!(
            rows.iter()
                .all(|r| r.starts_with("3 ") && r.ends_with(" 7")),
            "{written}"
        );
    }

    #[test]
    fn a_mesh_of_another_document_is_refused() {
        let read = |text: &str| crate::read(text, None, &Limits::default()).expect("a document");
        let small = read("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
        let large = read("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\nf 1 2 3\n");
        let processing = small.surface().expect("a surface");
        let refused = large.with_faces_cut(&processing, &[0]);
        assert!(matches!(refused, Err(IoError::PositionCount { .. })));
    }
}
