//! The user's file in memory: what is worked on, and everything else, kept.

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::HalfedgeMesh;
use nalgebra::Point3;

use crate::error::IoError;
use crate::faces::FaceList;
use crate::format::Format;
use crate::processing::ProcessingMesh;
use crate::source::Source;
use crate::{obj, off, ply};

/// A mesh file: positions, polygons, and the bytes that they were read from.
///
/// Vertices and faces have the numbers of the file, counted from 0; polygons keep their degree;
/// vertices that no face uses are there. Work happens on a [`ProcessingMesh`], and
/// [`Document::set_positions`] brings the moved vertices back.
///
/// Written in the format that it was read from, a document differs from the file only in the
/// coordinates of the vertices that were moved: comments, texture coordinates, colours, groups,
/// materials, further PLY elements, spaces and line ends are kept byte by byte. Normals are kept
/// too and are stale where vertices moved. [`Document::losses`] says what a write would drop or
/// leave stale.
#[derive(Clone, Debug)]
pub struct Document {
    positions: Vec<Point3<f64>>,
    faces: FaceList,
    source: Option<Source>,
    /// Whether each vertex was moved since the file was read; empty as long as none was.
    moved: Vec<bool>,
}

impl Document {
    /// A document made in memory.
    ///
    /// # Errors
    /// [`IoError`] if there is no vertex, a coordinate is not finite, a face has fewer than three
    /// corners, or a corner refers to a vertex that is not there.
    pub fn new(positions: Vec<Point3<f64>>, faces: FaceList) -> Result<Self, IoError> {
        let num_vertices = positions.len();
        if num_vertices == 0 {
            return Err(IoError::Empty);
        }
        if let Some(vertex) = positions.iter().position(|p| !is_finite(p)) {
            return Err(IoError::NonFinitePosition { vertex });
        }
        for (face, polygon) in faces.iter().enumerate() {
            if polygon.len() < 3 {
                return Err(IoError::FaceCorners {
                    face,
                    degree: polygon.len(),
                });
            }
            if let Some(&vertex) = polygon.iter().find(|&&v| v as usize >= num_vertices) {
                return Err(IoError::FaceVertex {
                    face,
                    vertex: vertex as usize,
                    num_vertices,
                });
            }
        }
        Ok(Self {
            positions,
            faces,
            source: None,
            moved: Vec::new(),
        })
    }

    /// A document of a half-edge mesh and its positions.
    ///
    /// # Errors
    /// As [`Document::new`], and if there is not one position a vertex.
    pub fn from_mesh<T: Scalar>(
        mesh: &HalfedgeMesh,
        positions: &Positions<T>,
    ) -> Result<Self, IoError> {
        let faces = mesh
            .faces()
            .map(|f| {
                mesh.face_vertices(f)
                    .map(|v| v.index() as u32)
                    .collect::<Vec<_>>()
            })
            .collect();
        if positions.len() != mesh.num_vertices() {
            return Err(IoError::PositionCount {
                expected: mesh.num_vertices(),
                found: positions.len(),
            });
        }
        Self::new(
            positions.values().map(|p| p.map(Scalar::as_f64)).collect(),
            faces,
        )
    }

    /// What a reader found; its checks are those of [`Document::new`].
    pub(crate) fn from_source(
        positions: Vec<Point3<f64>>,
        faces: FaceList,
        source: Source,
    ) -> Result<Self, IoError> {
        if positions.is_empty() {
            return Err(IoError::NoVertices {
                format: source.format(),
            });
        }
        Ok(Self {
            positions,
            faces,
            source: Some(source),
            moved: Vec::new(),
        })
    }

    /// The format of the file, or `None` if the document was made in memory.
    pub fn format(&self) -> Option<Format> {
        self.source.as_ref().map(Source::format)
    }

    /// All positions, in the order of the file.
    pub fn positions(&self) -> &[Point3<f64>] {
        &self.positions
    }

    /// All faces, in the order of the file.
    pub fn faces(&self) -> &FaceList {
        &self.faces
    }

    /// The triangulated half-edge mesh of this document, with maps both ways.
    ///
    /// Vertices that no face uses are left out; larger polygons are cut into triangles inside
    /// their outline, also where it is concave.
    ///
    /// # Errors
    /// [`IoError::NoFaces`] if there is nothing to build from, [`IoError::NotManifold`] if the
    /// faces do not form an oriented manifold.
    pub fn processing_mesh(&self) -> Result<ProcessingMesh, IoError> {
        ProcessingMesh::build(&self.positions, &self.faces)
    }

    /// Brings positions of the processing mesh back: every vertex whose position differs from the
    /// document's is moved; all others, and vertices that no face uses, stay as they are, to the
    /// last digit of the file.
    ///
    /// # Errors
    /// [`IoError::PositionCount`] if the positions do not belong to `processing` or that not to
    /// this document, [`IoError::NonFinitePosition`] if one is not finite; the document is then
    /// unchanged.
    pub fn set_positions<T: Scalar>(
        &mut self,
        processing: &ProcessingMesh,
        positions: &Positions<T>,
    ) -> Result<(), IoError> {
        let expected = processing.mesh().num_vertices();
        if positions.len() != expected {
            return Err(IoError::PositionCount {
                expected,
                found: positions.len(),
            });
        }
        let expected = self.positions.len();
        if processing.num_document_vertices() != expected {
            return Err(IoError::PositionCount {
                expected,
                found: processing.num_document_vertices(),
            });
        }
        let moves: Vec<(usize, Point3<f64>)> = positions
            .iter()
            .map(|(v, p)| (processing.document_vertex(v), p))
            // Compared in the caller's type: what f32 cannot tell apart was not moved.
            .filter(|&(vertex, p)| *p != self.positions[vertex].map(T::of_f64))
            .map(|(vertex, p)| (vertex, p.map(Scalar::as_f64)))
            .collect();
        if let Some(&(vertex, _)) = moves.iter().find(|(_, p)| !is_finite(p)) {
            return Err(IoError::NonFinitePosition { vertex });
        }
        for (vertex, position) in moves {
            self.place(vertex, position);
        }
        Ok(())
    }

    /// Moves one vertex of the document, counted from 0.
    ///
    /// # Errors
    /// [`IoError::NonFinitePosition`] if the position is not finite, [`IoError::NoSuchVertex`]
    /// if there is no such vertex.
    pub fn set_position(&mut self, vertex: usize, position: Point3<f64>) -> Result<(), IoError> {
        if vertex >= self.positions.len() {
            return Err(IoError::NoSuchVertex {
                vertex,
                num_vertices: self.positions.len(),
            });
        }
        if !is_finite(&position) {
            return Err(IoError::NonFinitePosition { vertex });
        }
        self.place(vertex, position);
        Ok(())
    }

    fn place(&mut self, vertex: usize, position: Point3<f64>) {
        if self.positions[vertex] != position {
            self.moved.resize(self.positions.len(), false);
            self.moved[vertex] = true;
            self.positions[vertex] = position;
        }
    }

    /// What a write in `format` would drop or leave stale, one sentence each, for a warning.
    ///
    /// Empty if the file written has everything that the file read has.
    pub fn losses(&self, format: Format) -> Vec<String> {
        let Some(source) = &self.source else {
            return Vec::new();
        };
        if source.format() != format {
            let lost = |what: &String| format!("{what} will be lost in {format}");
            return source.extras().iter().map(lost).collect();
        }
        if self.moved.is_empty() {
            return Vec::new();
        }
        let stale = |what: &String| format!("{what} are kept as they were; vertices have moved");
        source.stale().iter().map(stale).collect()
    }

    /// The document as a file in `format`.
    ///
    /// In the format that it was read from, only the coordinates of moved vertices are replaced,
    /// in the number type that the file has (a PLY with `float` coordinates keeps them `float`);
    /// otherwise a new file is written with positions as 64-bit numbers and the faces. Text
    /// formats get the shortest number that reads back to the same bits.
    ///
    /// # Errors
    /// [`IoError::DoesNotFit`] if the file's number type cannot hold a new coordinate.
    pub fn write(&self, format: Format) -> Result<Vec<u8>, IoError> {
        match &self.source {
            Some(source) if source.format() == format => {
                let moved = self.moved.iter().enumerate().filter(|&(_, &moved)| moved);
                source.rewrite(moved.map(|(vertex, _)| (vertex, self.positions[vertex])))
            }
            _ => match format {
                Format::Obj => Ok(obj::write(&self.positions, &self.faces)),
                Format::Off => Ok(off::write(&self.positions, &self.faces)),
                Format::Ply => ply::write(&self.positions, &self.faces),
            },
        }
    }
}

fn is_finite(point: &Point3<f64>) -> bool {
    point.iter().all(|x| x.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::file::read;
    use crate::limits::Limits;
    use nalgebra::Vector3;

    // Vertex 1 is used by no face.
    const FILE: &str = "v 0 0 0\nv 9 9 9\nv 1.10 0 0\nv 1 1 0\nv 0 1 0\nf 1 3 4 5\n";

    fn document() -> Document {
        read(FILE, None, &Limits::default()).unwrap()
    }

    #[test]
    fn the_maps_lead_there_and_back() {
        let processing = document().processing_mesh().unwrap();
        assert_eq!(
            (
                processing.mesh().num_vertices(),
                processing.mesh().num_faces()
            ),
            (4, 2)
        );
        assert_eq!(processing.vertex(1), None);
        assert_eq!(processing.vertex(5), None);
        for v in processing.mesh().vertices() {
            assert_eq!(processing.vertex(processing.document_vertex(v)), Some(v));
        }
        for f in processing.mesh().faces() {
            assert_eq!(processing.document_face(f), 0);
        }
    }

    #[test]
    fn only_moved_vertices_are_written() {
        let mut document = document();
        let processing = document.processing_mesh().unwrap();
        let mut positions = processing.positions().map(|p| p.map(|x| x as f32));
        document.set_positions(&processing, &positions).unwrap();
        assert_eq!(document.write(Format::Obj).unwrap(), FILE.as_bytes());

        positions[processing.vertex(4).unwrap()] += Vector3::new(0.0, 0.5, 0.0);
        document.set_positions(&processing, &positions).unwrap();
        let written = String::from_utf8(document.write(Format::Obj).unwrap()).unwrap();
        assert_eq!(written, FILE.replace("v 0 1 0", "v 0 1.5 0"));

        // What was moved can be moved back.
        document
            .set_positions(&processing, processing.positions())
            .unwrap();
        assert_eq!(document.write(Format::Obj).unwrap(), FILE.as_bytes());
    }

    #[test]
    fn positions_that_do_not_fit_change_nothing() {
        let mut document = document();
        let processing = document.processing_mesh().unwrap();
        let mut positions = processing.positions().map(|p| p * 2.0);
        positions[processing.vertex(4).unwrap()].y = f64::NAN;
        let error = document.set_positions(&processing, &positions).unwrap_err();
        assert!(
            matches!(error, IoError::NonFinitePosition { vertex: 4 }),
            "{error}"
        );
        let short = Positions::from_vec(vec![Point3::<f64>::origin(); 3]);
        assert!(document.set_positions(&processing, &short).is_err());
        assert!(document.set_position(5, Point3::origin()).is_err());
        assert_eq!(document.write(Format::Obj).unwrap(), FILE.as_bytes());
    }

    #[test]
    fn defects_are_named_in_the_numbers_of_the_file() {
        let file = "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 2 3 4 5\nf 3 4 5\n";
        let document = read(file, None, &Limits::default()).unwrap();
        let error = document.processing_mesh().unwrap_err().to_string();
        assert!(
            error.contains("faces 0 and 1") && error.contains("vertex 2"),
            "{error}"
        );
    }

    #[test]
    fn a_document_made_in_memory_is_checked() {
        let points = vec![
            Point3::origin(),
            Point3::new(1.0, 0.0, 0.0),
            Point3::new(0.0, 1.0, 0.0),
        ];
        let made = |faces: &[&[u32]]| Document::new(points.clone(), faces.iter().collect());
        assert!(made(&[&[0, 1, 2]]).is_ok());
        assert!(matches!(
            made(&[&[0, 1]]),
            Err(IoError::FaceCorners { face: 0, degree: 2 })
        ));
        assert!(matches!(
            made(&[&[0, 1, 3]]),
            Err(IoError::FaceVertex { vertex: 3, .. })
        ));
        assert!(matches!(
            Document::new(vec![Point3::new(0.0, f64::NAN, 0.0)], FaceList::new()),
            Err(IoError::NonFinitePosition { vertex: 0 })
        ));
        assert!(matches!(
            Document::new(Vec::new(), FaceList::new()),
            Err(IoError::Empty)
        ));
        let points_only = Document::new(points, FaceList::new()).unwrap();
        assert!(matches!(
            points_only.processing_mesh(),
            Err(IoError::NoFaces { num_vertices: 3 })
        ));
    }
}
