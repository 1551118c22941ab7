//! The mesh that is changed, with the corner of the file for each of its corners.

use cotan::geometry::{Mesh, Positions, SurfacePoint};
use cotan::halfedge::{EdgeId, FaceId, FaceMap, HalfedgeMesh, VertexId};
use cotan::nalgebra::Vector3;
use cotan_io::{Derivation, Derived, Document, IoError, LabelKind, Values};

use crate::error::CliError;
use crate::prepare::Prepared;

/// A mesh with its sources in the document.
pub(crate) struct Base {
    pub(crate) mesh: HalfedgeMesh,
    pub(crate) positions: Positions<f64>,
    /// Per face: its face in the document.
    faces: Vec<usize>,
    /// Per corner, in the order of the faces and of their halfedges: its corner in the document.
    corners: Vec<usize>,
    /// Per face: the index of its first corner.
    starts: Vec<usize>,
}

impl Base {
    /// The triangles that a mesh is processed by.
    pub(crate) fn triangles(prepared: &Prepared) -> Self {
        let processing = &prepared.processing;
        let mesh = processing.mesh().clone();
        let sources = mesh.faces().map(|f| processing.document_face(f)).collect();
        Self::new(prepared, mesh, processing.positions().clone(), sources)
    }

    /// The polygons of the file. Faces with fewer than three corners after welding are omitted.
    pub(crate) fn polygons(prepared: &Prepared) -> Result<Self, CliError> {
        let processing = &prepared.processing;
        let (mut polygons, mut sources) = (Vec::new(), Vec::new());
        for (face, corners) in prepared.document.faces().iter().enumerate() {
            let mut polygon: Vec<u32> = Vec::new();
            for &v in corners {
                if let Some(v) = processing.vertex(v as usize) {
                    let v = v.index() as u32;
                    if polygon.last() != Some(&v) {
                        polygon.push(v);
                    }
                }
            }
            while polygon.len() > 1 && polygon.first() == polygon.last() {
                polygon.pop();
            }
            if polygon.len() >= 3 {
                polygons.push(polygon);
                sources.push(face);
            }
        }
        let mesh = HalfedgeMesh::from_faces(processing.mesh().num_vertices(), &polygons)
            .map_err(|source| super::refuse(prepared.path(), source.into()))?;
        Ok(Self::new(
            prepared,
            mesh,
            processing.positions().clone(),
            sources,
        ))
    }

    fn new(
        prepared: &Prepared,
        mesh: HalfedgeMesh,
        positions: Positions<f64>,
        faces: Vec<usize>,
    ) -> Self {
        let (document, processing) = (&prepared.document, &prepared.processing);
        let (mut corners, mut starts) = (Vec::new(), Vec::new());
        for f in mesh.faces() {
            starts.push(corners.len());
            let range = document.faces().corner_range(faces[f.index()]);
            let old = &document.faces().corners()[range.clone()];
            for v in mesh.face_vertices(f) {
                let is_it = |&w: &u32| processing.vertex(w as usize) == Some(v);
                let k = old.iter().position(is_it).unwrap_or(0);
                corners.push(range.start + k);
            }
        }
        Self {
            mesh,
            positions,
            faces,
            corners,
            starts,
        }
    }

    /// The corners of the document of corner `k` of `face`, with the weight `w`.
    fn corner(&self, face: usize, k: usize, w: f64) -> (usize, f64) {
        (self.corners[self.starts[face] + k], w)
    }

    /// Edges whose two sides have other texture coordinates, colours, materials or groups.
    pub(crate) fn seams(&self, document: &Document) -> Result<Vec<EdgeId>, IoError> {
        let attributes = document.attributes()?;
        let labels = attributes
            .labels
            .iter()
            .filter(|l| l.kind != LabelKind::Smoothing);
        let labels: Vec<_> = labels.collect();
        let tables = attributes
            .corners
            .iter()
            .filter(|p| p.name != cotan_io::NORMAL);
        let tables: Vec<_> = tables.collect();
        let vertices = attributes
            .vertices
            .iter()
            .filter(|p| p.name != cotan_io::NORMAL && !matches!(p.values, Values::Lists { .. }));
        let vertices: Vec<_> = vertices.collect();
        let vertex_of = document.faces().corners();
        let same = |values: &Values, components: usize, a: usize, b: usize| {
            a == b
                || (0..components)
                    .all(|k| values.get(a * components + k) == values.get(b * components + k))
        };
        let mut corner_of = vec![0; self.mesh.num_halfedges()];
        for f in self.mesh.faces() {
            for (k, h) in self.mesh.face_halfedges(f).enumerate() {
                corner_of[h.index()] = self.corners[self.starts[f.index()] + k];
            }
        }
        let is_seam = |e: &EdgeId| {
            let [a, b] = e.halfedges();
            let (Some(f), Some(g)) = (self.mesh.face(a), self.mesh.face(b)) else {
                return false;
            };
            let sources = [f, g].map(|f| self.faces[f.index()]);
            let other = |l: &&cotan_io::Labels| l.faces.get(sources[0]) != l.faces.get(sources[1]);
            // Each end of the edge, as a corner of either face.
            let ends = [(a, self.mesh.next(b)), (self.mesh.next(a), b)];
            labels.iter().any(other)
                || ends.iter().any(|&(h, g)| {
                    let (c, d) = (corner_of[h.index()], corner_of[g.index()]);
                    tables.iter().any(|p| {
                        let [i, j] =
                            [c, d].map(|c| p.indices.get(c).map_or(usize::MAX, |&i| i as usize));
                        !same(&p.values, p.components, i, j)
                    }) || vertices.iter().any(|p| {
                        let [i, j] = [c, d].map(|c| vertex_of[c] as usize);
                        !same(&p.values, p.components, i, j)
                    })
                })
        };
        Ok(self.mesh.edges().filter(is_seam).collect())
    }

    /// The components of a property of the document at the corners of the triangles, colours from
    /// 0 to 1; `None` without such a property. A corner without a value has zeros.
    pub(crate) fn corner_values(
        &self,
        document: &Document,
        name: &str,
    ) -> Result<Option<Vec<FaceMap<[f64; 3]>>>, IoError> {
        let attributes = document.attributes()?;
        let vertex_of = document.faces().corners();
        let (values, components, index): (_, _, &[u32]) =
            match (attributes.corner(name), attributes.vertex(name)) {
                (Some(p), _) => (&p.values, p.components, &p.indices),
                (None, Some(p)) => (&p.values, p.components, vertex_of),
                (None, None) => return Ok(None),
            };
        let unit = if name == cotan_io::COLOR {
            values.unit()
        } else {
            1.0
        };
        let value = |corner: usize, k: usize| {
            let row = index.get(corner).map(|&i| i as usize);
            let number =
                row.and_then(|row| values.get(row.saturating_mul(components).saturating_add(k)));
            number.unwrap_or(0.0) / unit
        };
        let channel = |k: usize| {
            let of_face = |f: &usize| [0, 1, 2].map(|i| value(self.corners[f + i], k));
            FaceMap::from_vec(self.starts.iter().map(of_face).collect())
        };
        Ok(Some((0..components).map(channel).collect()))
    }

    /// Edges whose faces differ by at least `angle`, in radians.
    pub(crate) fn creases(&self, angle: f64) -> Vec<EdgeId> {
        let normal = |f: FaceId| {
            let corners: Vec<_> = self
                .mesh
                .face_vertices(f)
                .map(|v| self.positions[v])
                .collect();
            let area = |k: usize| {
                let (p, q) = (
                    corners[k] - corners[0],
                    corners[(k + 1) % corners.len()] - corners[0],
                );
                p.cross(&q)
            };
            (0..corners.len()).map(area).sum::<Vector3<f64>>()
        };
        let is_crease = |e: &EdgeId| {
            let [a, b] = e.halfedges().map(|h| self.mesh.face(h).map(normal));
            a.zip(b).is_some_and(|(a, b)| a.angle(&b) >= angle)
        };
        self.mesh.edges().filter(is_crease).collect()
    }

    /// The document of a mesh whose corners are on triangles of this one.
    pub(crate) fn derive(
        &self,
        document: &Document,
        made: &Mesh<f64>,
        corners: &FaceMap<[SurfacePoint; 3]>,
    ) -> Result<Derived, IoError> {
        let mut derivation = Derivation {
            positions: made.positions().as_slice().to_vec(),
            faces: triangles(made.connectivity()).collect(),
            ..Derivation::default()
        };
        for places in corners.values() {
            // The middle of the face lies on the triangle that most of its corners lie on.
            let face = places.iter().map(|p| p.face.index()).max_by_key(|&f| {
                (
                    places.iter().filter(|p| p.face.index() == f).count(),
                    usize::MAX - f,
                )
            });
            derivation.face_sources.push(self.faces[face.unwrap_or(0)]);
            for place in places {
                let weights = place.barycentric.iter().enumerate();
                let weights = weights.filter(|(_, w)| **w > 0.0);
                let sources = weights.map(|(k, &w)| self.corner(place.face.index(), k, w));
                derivation.corner_sources.push(sources.collect());
            }
        }
        document.derive(derivation)
    }

    /// The document of a subdivided mesh.
    pub(crate) fn subdivided(
        &self,
        document: &Document,
        made: &cotan::surface::Subdivided<f64>,
    ) -> Result<Derived, IoError> {
        let mesh = &made.connectivity;
        let polygon = |f| {
            mesh.face_vertices(f)
                .map(|v: VertexId| v.index() as u32)
                .collect::<Vec<_>>()
        };
        let mut derivation = Derivation {
            positions: made.positions.as_slice().to_vec(),
            faces: mesh.faces().map(polygon).collect(),
            face_sources: made
                .parents
                .values()
                .map(|f| self.faces[f.index()])
                .collect(),
            corner_sources: Vec::with_capacity(made.corners.len()),
        };
        let mut corner = 0;
        for f in mesh.faces() {
            let parent = made.parents[f].index();
            for _ in 0..mesh.degree(f) {
                let terms = made.corners.terms(corner).iter();
                let sources = terms.map(|&(k, w)| self.corner(parent, k as usize, w));
                derivation.corner_sources.push(sources.collect());
                corner += 1;
            }
        }
        document.derive(derivation)
    }
}

fn triangles(mesh: &HalfedgeMesh) -> impl Iterator<Item = [u32; 3]> + '_ {
    mesh.faces()
        .map(|f| mesh.triangle(f).map(|v| v.index() as u32))
}
