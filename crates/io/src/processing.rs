//! The triangulated half-edge mesh that is worked on, and the way back to the document.

use cotan_geometry::Positions;
use cotan_halfedge::{BuildError, FaceId, FaceMap, HalfedgeMesh, VertexId, VertexMap};
use nalgebra::Point3;

use crate::error::IoError;
use crate::faces::FaceList;
use crate::triangulate::Triangulator;

/// A mesh of triangles built from a [`Document`](crate::Document), with maps both ways.
///
/// Vertices come in the order of the document without those that no face uses, triangles in the
/// order of the document's faces.
#[derive(Clone, Debug)]
pub struct ProcessingMesh {
    mesh: HalfedgeMesh,
    positions: Positions<f64>,
    document_vertices: VertexMap<u32>,
    vertices: Vec<Option<VertexId>>,
    document_faces: FaceMap<u32>,
}

impl ProcessingMesh {
    /// `places` gives for each vertex the first vertex at its place; empty if none are welded.
    pub(crate) fn build(
        positions: &[Point3<f64>],
        faces: &FaceList,
        places: &[u32],
    ) -> Result<Self, IoError> {
        if faces.is_empty() {
            return Err(IoError::NoFaces {
                num_vertices: positions.len(),
            });
        }
        let place = |v: u32| places.get(v as usize).map_or(v, |&place| place);
        let mut polygons = Uncollapsed::new(faces, places);
        let (mut is_corner, mut is_used) = (vec![false; positions.len()], Vec::new());
        faces
            .corners()
            .iter()
            .for_each(|&v| is_corner[v as usize] = true);
        if !places.is_empty() {
            is_used.resize(positions.len(), false);
            polygons.each(|_, polygon| {
                polygon
                    .iter()
                    .for_each(|&v| is_used[place(v) as usize] = true);
            });
        }
        let mut document_vertices = VertexMap::default();
        let mut vertices: Vec<Option<VertexId>> = vec![None; positions.len()];
        // The vertex of each place, given to the first vertex there that a face uses.
        let mut at_place = vec![None; places.len()];
        for v in (0..positions.len()).filter(|&v| is_corner[v]) {
            let mut fresh = || document_vertices.push(v as u32);
            vertices[v] = match places.get(v) {
                None => Some(fresh()),
                Some(&place) if is_used[place as usize] => {
                    Some(*at_place[place as usize].get_or_insert_with(fresh))
                }
                Some(_) => None,
            };
        }
        let mut triangles = Vec::with_capacity(faces.num_triangles());
        let mut document_faces = Vec::with_capacity(faces.num_triangles());
        let mut triangulator = Triangulator::new(positions, faces.num_corners());
        // Every corner of a polygon that is cut is used, so it has a number.
        let number = |v: u32| vertices[v as usize].map_or(0, |id: VertexId| id.index() as u32);
        polygons.each(|face, polygon| {
            triangulator.cut(polygon, |triangle| {
                triangles.push(triangle.map(number));
                document_faces.push(face as u32);
            });
        });
        if triangles.is_empty() {
            return Err(IoError::AllCollapsed {
                num_faces: faces.len(),
            });
        }
        let document_faces = FaceMap::from_vec(document_faces);
        let mesh = HalfedgeMesh::from_faces(document_vertices.len(), &triangles)
            .map_err(|error| in_document(error, &document_vertices, &document_faces))?;
        let positions = document_vertices.map(|&v| positions[v as usize]);
        Ok(Self {
            mesh,
            positions,
            document_vertices,
            vertices,
            document_faces,
        })
    }

    /// The connectivity: triangles only.
    pub fn mesh(&self) -> &HalfedgeMesh {
        &self.mesh
    }

    /// The positions at the time of building.
    pub fn positions(&self) -> &Positions<f64> {
        &self.positions
    }

    /// The document's vertex, counted from 0, that a vertex stands for; the first of them if
    /// several were welded.
    ///
    /// # Panics
    /// If the mesh has no such vertex.
    pub fn document_vertex(&self, vertex: VertexId) -> usize {
        self.document_vertices[vertex] as usize
    }

    /// The vertex that stands for a vertex of the document, counted from 0, or `None` if no face
    /// uses it or there is no such vertex.
    pub fn vertex(&self, document_vertex: usize) -> Option<VertexId> {
        *self.vertices.get(document_vertex)?
    }

    /// The document's face, counted from 0, that a triangle was cut from.
    ///
    /// # Panics
    /// If the mesh has no such face.
    pub fn document_face(&self, face: FaceId) -> usize {
        self.document_faces[face] as usize
    }

    /// Number of vertices of the document, with those that no face uses.
    pub fn num_document_vertices(&self) -> usize {
        self.vertices.len()
    }
}

/// The polygons without the corners that are welded to the corner before them, and without those
/// of which fewer than three corners are left.
struct Uncollapsed<'a> {
    faces: &'a FaceList,
    places: &'a [u32],
    kept: Vec<u32>,
}

impl<'a> Uncollapsed<'a> {
    fn new(faces: &'a FaceList, places: &'a [u32]) -> Self {
        Self {
            faces,
            places,
            kept: Vec::new(),
        }
    }

    fn each(&mut self, mut visit: impl FnMut(usize, &[u32])) {
        for (face, polygon) in self.faces.iter().enumerate() {
            if self.places.is_empty() {
                visit(face, polygon);
                continue;
            }
            self.kept.clear();
            let place = |v: u32| self.places[v as usize];
            let mut last = polygon.last().map(|&v| place(v));
            for &v in polygon {
                if last.replace(place(v)) != Some(place(v)) {
                    self.kept.push(v);
                }
            }
            if self.kept.len() >= 3 {
                visit(face, &self.kept);
            }
        }
    }
}

/// The same error with the document's numbers of vertices and faces.
fn in_document(error: BuildError, vertices: &VertexMap<u32>, faces: &FaceMap<u32>) -> IoError {
    let vertex = |v: VertexId| vertices.get(v).map_or(v, |&n| VertexId::new(n as usize));
    let face = |f: usize| faces.as_slice().get(f).map_or(f, |&n| n as usize);
    IoError::NotManifold(error.renumbered(vertex, face))
}
