//! The triangulated half-edge mesh that is worked on, and the way back to the document.

use std::borrow::Cow;

use cotan_geometry::{Positions, SpatialOrder, Surface};
use cotan_halfedge::{BuildError, FaceId, FaceMap, HalfedgeMesh, VertexId, VertexMap};
use nalgebra::Point3;

use crate::error::IoError;
use crate::faces::FaceList;
use crate::recut::{Cutter, Polygons, Recuts};

/// A mesh of triangles built from a [`Document`](crate::Document), with maps both ways.
///
/// Vertices come in the order of the document without those that no face uses, triangles in the
/// order of the document's faces; or both in the order of their places, if the document's is so
/// bad that the mesh would be slow: see [`Numbering`]. The maps hold in any case.
#[derive(Clone, Debug)]
pub struct ProcessingMesh {
    mesh: HalfedgeMesh,
    positions: Positions<f64>,
    document_vertices: VertexMap<u32>,
    vertices: Vec<Option<VertexId>>,
    document_faces: FaceMap<u32>,
    is_renumbered: bool,
}

/// How the vertices and triangles of a [`ProcessingMesh`] are numbered.
///
/// Where neighbours have far numbers, each pass over a large mesh waits for memory: several times
/// as long as where they have near ones.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Numbering {
    /// As the document has them, unless its numbers are scattered ([`SpatialOrder::is_scattered`]).
    #[default]
    Auto,
    /// As the document has them.
    Document,
    /// Along a curve through space ([`SpatialOrder`]).
    Spatial,
}

impl ProcessingMesh {
    /// `places` gives for each vertex the first vertex at its place; empty if none are welded.
    pub(crate) fn build(
        positions: &[Point3<f64>],
        faces: &FaceList,
        places: &[u32],
        numbering: Numbering,
    ) -> Result<Self, IoError> {
        let alone = Self::build_cut(positions, faces, places, numbering, &Recuts::default());
        // Where polygons are in each other's way there is no manifold, so that no time is lost on
        // looking for that where there is one.
        let Err(IoError::NotManifold(_)) = alone else {
            return alone;
        };
        let uncollapsed = match places.is_empty() {
            true => Cow::Borrowed(faces),
            false => Cow::Owned(uncollapsed(faces, places)),
        };
        let recuts = Recuts::new(Polygons {
            faces: &uncollapsed,
            places,
            positions,
        });
        match recuts.is_empty() {
            true => alone,
            false => Self::build_cut(positions, faces, places, numbering, &recuts),
        }
    }

    fn build_cut(
        positions: &[Point3<f64>],
        faces: &FaceList,
        places: &[u32],
        numbering: Numbering,
        recuts: &Recuts,
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
        // A vertex in no face that is welded to one in a face is that one.
        if !places.is_empty() {
            for (vertex, &place) in vertices.iter_mut().zip(places) {
                *vertex = vertex.or(at_place[place as usize]);
            }
        }
        let mut triangles = Vec::with_capacity(faces.num_triangles());
        let mut document_faces = Vec::with_capacity(faces.num_triangles());
        let mut cutter = Cutter::new(positions, faces.num_corners(), recuts);
        // Every corner of a polygon that is cut is used, so it has a number.
        let number = |v: u32| vertices[v as usize].map_or(0, |id: VertexId| id.index() as u32);
        polygons.each(|face, polygon| {
            cutter.cut(face as u32, polygon, |triangle| {
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
        let positions = document_vertices.map(|&v| positions[v as usize]);
        let is_renumbered = match numbering {
            Numbering::Document => false,
            Numbering::Spatial => true,
            Numbering::Auto => SpatialOrder::is_scattered(positions.len(), &triangles),
        };
        let mut numbered = Numbered {
            triangles,
            positions,
            document_vertices,
            vertices,
            document_faces,
        };
        if is_renumbered {
            numbered = match numbered.in_space() {
                Ok(built) => return Ok(built),
                // The first defect is to be that of the document.
                Err(numbered) => *numbered,
            };
        }
        numbered.build()
    }

    /// The connectivity: triangles only.
    pub fn mesh(&self) -> &HalfedgeMesh {
        &self.mesh
    }

    /// The mesh with its positions, to be measured and passed to jobs.
    pub fn surface(&self) -> Surface<'_, f64> {
        Surface::assume_checked(&self.mesh, &self.positions)
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
    /// uses it or one that it is welded to, or there is no such vertex.
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

    /// Whether vertices and triangles have other numbers than the order of the document gives them.
    pub fn is_renumbered(&self) -> bool {
        self.is_renumbered
    }

    /// Number of vertices of the document, with those that no face uses.
    pub fn num_document_vertices(&self) -> usize {
        self.vertices.len()
    }
}

/// Everything that a mesh is built from.
struct Numbered {
    triangles: Vec<[u32; 3]>,
    positions: Positions<f64>,
    document_vertices: VertexMap<u32>,
    vertices: Vec<Option<VertexId>>,
    document_faces: FaceMap<u32>,
}

impl Numbered {
    fn build(self) -> Result<ProcessingMesh, IoError> {
        let mesh = HalfedgeMesh::from_faces(self.positions.len(), &self.triangles);
        match mesh {
            Ok(mesh) => Ok(self.with(mesh)),
            Err(error) => Err(in_document(
                error,
                &self.document_vertices,
                &self.document_faces,
            )),
        }
    }

    /// Builds with other numbers, or gives itself back.
    fn in_space(self) -> Result<ProcessingMesh, Box<Self>> {
        let order = SpatialOrder::of(&self.positions);
        let (triangles, old_faces) = order.faces(&self.triangles);
        let Ok(mesh) = HalfedgeMesh::from_faces(self.positions.len(), &triangles) else {
            return Err(Box::new(self));
        };
        let document_faces = old_faces.iter().map(|&f| self.document_faces[f]).collect();
        let mut vertices = self.vertices;
        for vertex in vertices.iter_mut().flatten() {
            *vertex = order.new_id(*vertex);
        }
        let renumbered = Self {
            triangles,
            positions: order.gather(&self.positions),
            document_vertices: order.gather(&self.document_vertices),
            vertices,
            document_faces,
        };
        let mut built = renumbered.with(mesh);
        built.is_renumbered = true;
        Ok(built)
    }

    fn with(self, mesh: HalfedgeMesh) -> ProcessingMesh {
        ProcessingMesh {
            mesh,
            positions: self.positions,
            document_vertices: self.document_vertices,
            vertices: self.vertices,
            document_faces: self.document_faces,
            is_renumbered: false,
        }
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

/// The corners that [`Uncollapsed`] gives of every face; none of a face that it leaves out.
pub(crate) fn uncollapsed(faces: &FaceList, places: &[u32]) -> FaceList {
    let mut list = FaceList::new();
    Uncollapsed::new(faces, places).each(|face, polygon| {
        while list.len() < face {
            list.end_face();
        }
        polygon.iter().for_each(|&v| list.push_corner(v));
        list.end_face();
    });
    while list.len() < faces.len() {
        list.end_face();
    }
    list
}

/// The same error with the document's numbers of vertices and faces.
fn in_document(error: BuildError, vertices: &VertexMap<u32>, faces: &FaceMap<u32>) -> IoError {
    let vertex = |v: VertexId| vertices.get(v).map_or(v, |&n| VertexId::new(n as usize));
    let face = |f: usize| faces.as_slice().get(f).map_or(f, |&n| n as usize);
    IoError::NotManifold(error.renumbered(vertex, face))
}
