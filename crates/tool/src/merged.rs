//! The file of a merged mesh, with the data of both inputs.

use std::collections::VecDeque;

use cotan::geometry::Scalar;
use cotan::halfedge::{FaceId, FaceMap, VertexId, VertexMap};
use cotan::merge::{FaceOrigin, Merged, VertexOrigin};
use cotan_io::{Assembled, Assembly, DataSource, Document, FaceList, IoError, ProcessingMesh};

/// A document and its surface.
#[derive(Clone, Copy, Debug)]
pub struct MergeSource<'a> {
    /// The file.
    pub document: &'a Document,
    /// The surface that was merged.
    pub processing: &'a ProcessingMesh,
}

/// The document of a merged mesh: polygons, texture coordinates, materials, images and other
/// properties of both files. Faces of the seam get the material of the nearest face, and the
/// texture coordinates of the nearest corners of the same file.
///
/// A polygon of which only some triangles are left becomes these triangles.
///
/// # Errors
/// [`IoError`] as for [`Assembly::build`].
pub fn merged_document<T: Scalar>(
    inputs: [MergeSource<'_>; 2],
    merged: &Merged<T>,
) -> Result<Assembled, IoError> {
    let mesh = merged.mesh.connectivity();
    let mut sources = Sources::new(inputs, merged);
    sources.spread();
    let vertex_sources = sources.of_vertices();
    let mut assembly = Assembly {
        positions: merged
            .mesh
            .positions()
            .values()
            .map(|p| p.map(T::as_f64))
            .collect(),
        vertices: vertex_sources,
        ..Assembly::default()
    };
    let mut faces: Vec<Vec<u32>> = Vec::new();
    // The polygons that are kept whole, by document and face; each is written once.
    let mut kept = [0, 1].map(|k| sources.kept_triangles(k));
    for f in mesh.faces() {
        let Some((k, triangle)) = sources.of_face[f] else {
            continue;
        };
        let input = inputs[k];
        let document_face = input.processing.document_face(triangle);
        let is_seam = merged.faces[f] == FaceOrigin::Seam;
        let polygon = match is_seam {
            true => None,
            false => sources.whole_polygon(k, document_face, &mut kept[k]),
        };
        match polygon {
            Some(Polygon::Written) => continue,
            Some(Polygon::Whole(vertices)) => {
                let corners = input.document.faces().corner_range(document_face);
                let sources = corners.map(|element| {
                    Some(DataSource {
                        document: k,
                        element,
                    })
                });
                assembly.corners.extend(sources);
                faces.push(vertices);
            }
            None => {
                let corners = mesh.triangle(f);
                let sources = corners.map(|v| Some(sources.corner(k, triangle, v)));
                assembly.corners.extend(sources);
                faces.push(corners.iter().map(|v| v.index() as u32).collect());
            }
        }
        assembly.face_sources.push(Some(DataSource {
            document: k,
            element: document_face,
        }));
    }
    assembly.faces = faces.into_iter().collect::<FaceList>();
    assembly.build(&inputs.map(|input| input.document))
}

/// The fate of a polygon of the file.
enum Polygon {
    /// All of its triangles are kept: its corners in the merged mesh.
    Whole(Vec<u32>),
    /// It was written with another of its triangles.
    Written,
}

/// The sources of the data of the merged mesh.
struct Sources<'a, T: Scalar> {
    inputs: [MergeSource<'a>; 2],
    merged: &'a Merged<T>,
    /// For each vertex of the two surfaces its vertex in the merged mesh.
    new: [Vec<Option<VertexId>>; 2],
    /// For each face of the merged mesh the input and the triangle there.
    of_face: FaceMap<Option<(usize, FaceId)>>,
    /// For each vertex a kept triangle at it, if it comes from an input.
    triangle_at: VertexMap<Option<(usize, FaceId)>>,
}

impl<'a, T: Scalar> Sources<'a, T> {
    fn new(inputs: [MergeSource<'a>; 2], merged: &'a Merged<T>) -> Self {
        let mut new = inputs.map(|input| vec![None; input.processing.mesh().num_vertices()]);
        for (v, origin) in merged.vertices.iter() {
            if let Some((k, old)) = of_vertex(*origin) {
                new[k][old.index()] = Some(v);
            }
        }
        let of_face = merged.faces.map(|origin| match *origin {
            FaceOrigin::A(f) => Some((0, f)),
            FaceOrigin::B(f) => Some((1, f)),
            FaceOrigin::Seam => None,
        });
        let mesh = merged.mesh.connectivity();
        let mut triangle_at = VertexMap::filled(mesh.num_vertices(), None);
        for (f, source) in of_face.iter() {
            if source.is_some() {
                for v in mesh.triangle(f) {
                    triangle_at[v] = triangle_at[v].or(*source);
                }
            }
        }
        Self {
            inputs,
            merged,
            new,
            of_face,
            triangle_at,
        }
    }

    /// Gives the faces of the seam the source of the nearest face, counted in faces.
    fn spread(&mut self) {
        let mesh = self.merged.mesh.connectivity();
        let has_source = |f: &FaceId| self.of_face[*f].is_some();
        let mut open: VecDeque<FaceId> = mesh.faces().filter(has_source).collect();
        while let Some(f) = open.pop_front() {
            for h in mesh.face_halfedges(f) {
                if let Some(other) = mesh.face(h.twin())
                    && self.of_face[other].is_none()
                {
                    self.of_face[other] = self.of_face[f];
                    open.push_back(other);
                }
            }
        }
    }

    /// The vertex of a document for each vertex; for those of the seam, of the nearest vertex,
    /// counted in edges.
    fn of_vertices(&self) -> Vec<Option<DataSource>> {
        let mesh = self.merged.mesh.connectivity();
        let mut sources = self.merged.vertices.map(|origin| {
            let (document, old) = of_vertex(*origin)?;
            let element = self.inputs[document].processing.document_vertex(old);
            Some(DataSource { document, element })
        });
        let mut open: VecDeque<VertexId> =
            mesh.vertices().filter(|v| sources[*v].is_some()).collect();
        while let Some(v) = open.pop_front() {
            for j in mesh.one_ring(v) {
                if sources[j].is_none() {
                    sources[j] = sources[v];
                    open.push_back(j);
                }
            }
        }
        sources.into_vec()
    }

    /// For each face of a document, how many of its triangles are kept, less all that it has: zero
    /// for a whole one.
    fn kept_triangles(&self, k: usize) -> Vec<i64> {
        let processing = self.inputs[k].processing;
        let mut balance = vec![0; self.inputs[k].document.faces().len()];
        for f in processing.mesh().faces() {
            balance[processing.document_face(f)] -= 1;
        }
        for origin in self.merged.faces.values() {
            match (k, *origin) {
                (0, FaceOrigin::A(f)) | (1, FaceOrigin::B(f)) => {
                    balance[processing.document_face(f)] += 1;
                }
                _ => {}
            }
        }
        balance
    }

    /// The polygon of the file if it is kept whole. Notes in `balance` that it was written.
    fn whole_polygon(&self, k: usize, face: usize, balance: &mut [i64]) -> Option<Polygon> {
        match balance[face] {
            WRITTEN => return Some(Polygon::Written),
            0 => {}
            _ => return None,
        }
        let input = self.inputs[k];
        let corners = input.document.faces().get(face)?;
        let vertices: Option<Vec<u32>> = corners
            .iter()
            .map(|&corner| {
                let old = input.processing.vertex(corner as usize)?;
                Some(self.new[k][old.index()]?.index() as u32)
            })
            .collect();
        let vertices = vertices?;
        let mut sorted = vertices.clone();
        sorted.sort_unstable();
        if sorted.windows(2).any(|pair| pair[0] == pair[1]) {
            return None;
        }
        balance[face] = WRITTEN;
        Some(Polygon::Whole(vertices))
    }

    /// The corner of a document whose data a corner of the merged mesh gets, in a face whose
    /// source is `triangle`: its own, that of a neighbour at the same vertex, or the nearest one
    /// of the triangle.
    fn corner(&self, k: usize, triangle: FaceId, v: VertexId) -> DataSource {
        let processing = self.inputs[k].processing;
        let own = of_vertex(self.merged.vertices[v]).filter(|&(of, _)| of == k);
        let corners = processing.mesh().triangle(triangle);
        let (face, vertex) = match own {
            Some((_, old)) if corners.contains(&old) => (triangle, old),
            Some((_, old)) => match self.triangle_at[v] {
                Some((of, neighbour)) if of == k => (neighbour, old),
                _ => (triangle, corners[0]),
            },
            None => {
                let place = self.merged.mesh.positions()[v].map(T::as_f64);
                let distance = |old: &VertexId| match self.new[k][old.index()] {
                    Some(new) => {
                        let corner = self.merged.mesh.positions()[new].map(T::as_f64);
                        (corner - place).norm_squared()
                    }
                    None => f64::INFINITY,
                };
                let nearest = corners
                    .into_iter()
                    .min_by(|a, b| distance(a).total_cmp(&distance(b)));
                (triangle, nearest.unwrap_or(corners[0]))
            }
        };
        let document_face = processing.document_face(face);
        let faces = self.inputs[k].document.faces();
        let polygon = faces.get(document_face).unwrap_or(&[]);
        let within = polygon
            .iter()
            .position(|&corner| processing.vertex(corner as usize) == Some(vertex));
        DataSource {
            document: k,
            element: faces.corner_range(document_face).start + within.unwrap_or(0),
        }
    }
}

fn of_vertex(origin: VertexOrigin) -> Option<(usize, VertexId)> {
    match origin {
        VertexOrigin::A(v) => Some((0, v)),
        VertexOrigin::B(v) => Some((1, v)),
        VertexOrigin::Seam => None,
    }
}

/// The balance of a polygon that was written.
const WRITTEN: i64 = i64::MAX;
