//! The triangulated half-edge mesh used for processing, and its mapping back to the document.

use std::borrow::Cow;

use cotan_geometry::{Positions, SpatialOrder, Surface};
use cotan_halfedge::{BuildError, FaceId, FaceMap, HalfedgeMesh, VertexId, VertexMap};
use nalgebra::Point3;

use crate::error::IoError;
use crate::faces::FaceList;
use crate::recut::{Cutter, Polygons, Recuts};

/// A triangle mesh built from a [`Document`](crate::Document), with index maps in both
/// directions.
///
/// Vertices follow the order of the document, without those that no face uses, and triangles
/// follow the order of the document's faces. If that order is so scattered that processing would
/// be slow, both are sorted spatially instead: see [`Numbering`]. The maps are valid in either
/// case.
///
/// If the faces do not form an oriented manifold and this was allowed
/// ([`Document::surface_in_pieces`](crate::Document::surface_in_pieces)), the mesh is cut into
/// pieces that do. Copies of vertices then follow the others; each represents the same document
/// vertex as its row ([`HalfedgeMesh::row_of`]). Nothing of the document changes.
#[derive(Clone, Debug)]
pub struct ProcessingMesh {
    mesh: HalfedgeMesh,
    positions: Positions<f64>,
    document_vertices: VertexMap<u32>,
    vertices: Vec<Option<VertexId>>,
    document_faces: FaceMap<u32>,
    is_renumbered: bool,
}

/// The order of the vertices and triangles of a [`ProcessingMesh`].
///
/// If neighbours have distant indices, each pass over a large mesh waits for memory and takes
/// several times as long.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Numbering {
    /// The order of the document, unless it is scattered ([`SpatialOrder::is_scattered`]).
    #[default]
    Auto,
    /// The order of the document.
    Document,
    /// The order along a space-filling curve ([`SpatialOrder`]).
    Spatial,
}

/// The surfaces that a [`ProcessingMesh`] may have.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Allowed {
    /// Oriented manifolds; everything else is refused.
    Manifold,
    /// Any, cut into pieces where necessary.
    Any,
}

impl ProcessingMesh {
    /// Builds the mesh.
    ///
    /// `places` gives for each vertex the first vertex at its place; it is empty if none are
    /// welded.
    pub(crate) fn build(
        positions: &[Point3<f64>],
        faces: &FaceList,
        places: &[u32],
        numbering: Numbering,
        allowed: Allowed,
    ) -> Result<Self, IoError> {
        let build = |allowed, recuts: &Recuts| {
            Self::build_cut(positions, faces, places, numbering, allowed, recuts)
        };
        let alone = build(Allowed::Manifold, &Recuts::default());
        // Polygons whose diagonals conflict are not manifold, so the search for conflicts is
        // needed only if building fails.
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
        let manifold = match recuts.is_empty() {
            true => alone,
            false => build(Allowed::Manifold, &recuts),
        };
        match (manifold, allowed) {
            (Err(IoError::NotManifold(_)), Allowed::Any) => build(allowed, &recuts),
            (result, _) => result,
        }
    }

    fn build_cut(
        positions: &[Point3<f64>],
        faces: &FaceList,
        places: &[u32],
        numbering: Numbering,
        allowed: Allowed,
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
        // The vertex of each place, assigned at the first vertex there that a face uses.
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
        // An unused vertex that is welded to a used one is the same vertex.
        if !places.is_empty() {
            for (vertex, &place) in vertices.iter_mut().zip(places) {
                *vertex = vertex.or(at_place[place as usize]);
            }
        }
        let mut triangles = Vec::with_capacity(faces.num_triangles());
        let mut document_faces = Vec::with_capacity(faces.num_triangles());
        let mut cutter = Cutter::new(positions, faces.num_corners(), recuts);
        // Every corner of a triangulated polygon is used, so it has an index.
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
            allowed,
        };
        if is_renumbered {
            numbered = match numbered.in_space() {
                Ok(built) => return Ok(built),
                // Report the first defect in document order.
                Err(numbered) => *numbered,
            };
        }
        numbered.build()
    }

    /// The connectivity, which consists of triangles only.
    pub fn mesh(&self) -> &HalfedgeMesh {
        &self.mesh
    }

    /// The mesh with its positions, for measurements and jobs.
    pub fn surface(&self) -> Surface<'_, f64> {
        Surface::assume_checked(&self.mesh, &self.positions)
    }

    /// The positions when the mesh was built.
    pub fn positions(&self) -> &Positions<f64> {
        &self.positions
    }

    /// The 0-based document vertex that `vertex` represents; the first of them if several were
    /// welded. Copies of a vertex all represent the same one.
    ///
    /// # Panics
    /// If `vertex` is out of range.
    pub fn document_vertex(&self, vertex: VertexId) -> usize {
        self.document_vertices[vertex] as usize
    }

    /// The vertex that represents a 0-based document vertex (never a copy), or `None` if neither
    /// that vertex nor one welded to it is used by a face, or if the index is out of range.
    pub fn vertex(&self, document_vertex: usize) -> Option<VertexId> {
        *self.vertices.get(document_vertex)?
    }

    /// The 0-based document face that a triangle was cut from.
    ///
    /// # Panics
    /// If `face` is out of range.
    pub fn document_face(&self, face: FaceId) -> usize {
        self.document_faces[face] as usize
    }

    /// Returns `true` if the order of vertices and triangles differs from that of the document.
    pub fn is_renumbered(&self) -> bool {
        self.is_renumbered
    }

    /// Number of vertices in the document, including those that no face uses.
    pub fn num_document_vertices(&self) -> usize {
        self.vertices.len()
    }
}

/// The input from which a mesh is built.
struct Numbered {
    triangles: Vec<[u32; 3]>,
    positions: Positions<f64>,
    document_vertices: VertexMap<u32>,
    vertices: Vec<Option<VertexId>>,
    document_faces: FaceMap<u32>,
    allowed: Allowed,
}

impl Numbered {
    fn connect(&self, triangles: &[[u32; 3]]) -> Result<HalfedgeMesh, BuildError> {
        let num_vertices = self.positions.len();
        match self.allowed {
            Allowed::Manifold => HalfedgeMesh::from_faces(num_vertices, triangles),
            Allowed::Any => HalfedgeMesh::from_faces_in_pieces(num_vertices, triangles),
        }
    }

    fn build(self) -> Result<ProcessingMesh, IoError> {
        match self.connect(&self.triangles) {
            Ok(mesh) => Ok(self.with(mesh)),
            Err(error) => Err(in_document(
                error,
                &self.document_vertices,
                &self.document_faces,
            )),
        }
    }

    /// Builds the mesh in spatial order, or returns `self` on failure.
    fn in_space(self) -> Result<ProcessingMesh, Box<Self>> {
        let order = SpatialOrder::of(&self.positions);
        let (triangles, old_faces) = order.faces(&self.triangles);
        let Ok(mesh) = self.connect(&triangles) else {
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
            allowed: self.allowed,
        };
        let mut built = renumbered.with(mesh);
        built.is_renumbered = true;
        Ok(built)
    }

    fn with(self, mesh: HalfedgeMesh) -> ProcessingMesh {
        ProcessingMesh {
            positions: mesh.to_vertices(self.positions),
            document_vertices: mesh.to_vertices(self.document_vertices),
            mesh,
            vertices: self.vertices,
            document_faces: self.document_faces,
            is_renumbered: false,
        }
    }
}

/// The polygons after welding: corners welded to the preceding corner are removed, and so are
/// polygons left with fewer than three corners.
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

/// Returns the corners that [`Uncollapsed`] keeps of every face; empty for a removed face.
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

/// Translates the vertex and face indices of an error to those of the document.
fn in_document(error: BuildError, vertices: &VertexMap<u32>, faces: &FaceMap<u32>) -> IoError {
    let vertex = |v: VertexId| vertices.get(v).map_or(v, |&n| VertexId::new(n as usize));
    let face = |f: usize| faces.as_slice().get(f).map_or(f, |&n| n as usize);
    IoError::NotManifold(error.renumbered(vertex, face))
}
