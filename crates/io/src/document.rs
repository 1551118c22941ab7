//! The user's file in memory: what is worked on, and everything else, kept.

mod stretches;
mod write;

use std::borrow::Cow;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::HalfedgeMesh;
use nalgebra::Point3;

use self::stretches::Stretches;
use crate::attributes::{Attributes, NONE};
use crate::error::{IoError, Warning};
use crate::faces::FaceList;
use crate::format::Format;
use crate::instances::Expanded;
use crate::material::Materials;
use crate::normals::Normals;
use crate::processing::{Numbering, ProcessingMesh};
use crate::remap::Remap;
use crate::source::{Mesh, SourceFile};
use crate::weld::{self, Weld};

/// A mesh file: positions, polygons, and everything else that it holds.
///
/// Vertices and faces have the numbers of the file, counted from 0; polygons keep their degree;
/// vertices that no face uses are there. Work happens on a [`ProcessingMesh`], and
/// [`Document::set_positions`] brings the moved vertices back.
///
/// Written in the format that it was read from, a document differs from the file only in the
/// coordinates of the vertices that were moved and in the normals of the surface there, which
/// turn with it: comments, texture coordinates, colours, groups, materials, further PLY elements,
/// the nodes and images of a glTF, spaces and line ends are kept byte by byte. Any other format
/// gets what it can hold of the [`Attributes`]. [`Document::losses`] says what a write would drop
/// or leave stale.
///
/// The vertices of a glTF are those of its meshes, each once however many nodes show it, placed by
/// the first node that does: an edit of a mesh shows at all of its places, as in the file, and
/// formats without nodes get the mesh at each. Meshes that share an accessor have vertices of
/// their own if they are placed differently or have a face in common, and so have primitives of
/// one mesh with a face in common.
#[derive(Clone, Debug)]
pub struct Document {
    positions: Vec<Point3<f64>>,
    faces: FaceList,
    parts: Vec<Part>,
    stretches: Stretches,
    places: Places,
    warnings: Vec<Warning>,
    /// Of a document made in memory; what a file has is decoded on request.
    attributes: Attributes,
    source: Option<Arc<dyn SourceFile>>,
    /// Those that were given, in place of those of the file.
    materials: Option<Arc<Materials>>,
    /// The file that a document comes from which is no longer tied to it: its meshes are where the
    /// file has them, its materials are those of the file, and everything else of it is lost.
    origin: Option<Arc<dyn SourceFile>>,
    /// The positions as the file has them; empty as long as no vertex was moved.
    original: Vec<Point3<f64>>,
    /// The folder of the file, in which the files lie that it refers to; `None` without a path.
    home: Option<PathBuf>,
}

/// Which vertices count as one where the document is welded as its format means it.
#[derive(Clone, Debug)]
enum Places {
    /// None do.
    Own,
    /// Those at exactly the same place of a part: the format splits vertices.
    Exact,
    /// For each vertex the first one that it is one with, as a repair left it.
    Given(Vec<u32>),
}

/// A part of a document with vertices and faces of its own: a mesh of a glTF.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Part {
    /// The name in the file; may be empty.
    pub name: String,
    /// Its vertices.
    pub vertices: Range<usize>,
    /// Its faces.
    pub faces: Range<usize>,
}

/// What a reader found.
#[derive(Debug, Default)]
pub(crate) struct Parsed {
    pub(crate) positions: Vec<Point3<f64>>,
    pub(crate) faces: FaceList,
    /// Empty if the document is one part.
    pub(crate) parts: Vec<Part>,
    /// Vertices of parts that are layers of these; see [`Stretches`].
    pub(crate) layers: Vec<(Range<usize>, u32)>,
    /// Whether vertices at the same place in a part are one vertex of the surface.
    pub(crate) is_split: bool,
    pub(crate) warnings: Vec<Warning>,
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
        let parsed = Parsed {
            positions,
            faces,
            ..Parsed::default()
        };
        Ok(Self::from_parsed(parsed, None))
    }

    /// The same document with these attributes; it is then no longer tied to a file.
    ///
    /// # Errors
    /// [`IoError::Attributes`] if they do not fit the vertices, faces and corners.
    pub fn with_attributes(self, attributes: Attributes) -> Result<Self, IoError> {
        let (vertices, faces) = (self.positions.len(), &self.faces);
        if let Some(problem) = attributes.misfit(vertices, faces.len(), faces.num_corners()) {
            return Err(IoError::Attributes { problem });
        }
        // Attributes come and go, materials and places stay.
        let origin = self.origin().cloned();
        Ok(Self {
            attributes,
            source: None,
            origin,
            original: Vec::new(),
            ..self
        })
    }

    /// The same document with these materials; it is then no longer tied to a file.
    ///
    /// # Errors
    /// [`IoError::Attributes`] if a number or an image does not fit, or if the labels of kind
    /// [`Material`](crate::LabelKind::Material) have more names than there are materials;
    /// [`IoError`] as [`Document::attributes`].
    pub fn with_materials(self, materials: Materials) -> Result<Self, IoError> {
        let attributes = self.attributes()?.into_owned();
        if let Some(problem) = materials.misfit(&attributes) {
            return Err(IoError::Attributes { problem });
        }
        Ok(Self {
            materials: Some(Arc::new(materials)),
            ..self.with_attributes(attributes)?
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
        parsed: Parsed,
        source: impl SourceFile + 'static,
    ) -> Result<Self, IoError> {
        if parsed.positions.is_empty() {
            return Err(IoError::NoVertices {
                format: source.format(),
            });
        }
        Ok(Self::from_parsed(parsed, Some(Arc::new(source))))
    }

    fn from_parsed(parsed: Parsed, source: Option<Arc<dyn SourceFile>>) -> Self {
        let Parsed {
            positions,
            faces,
            mut parts,
            layers,
            is_split,
            warnings,
        } = parsed;
        if parts.is_empty() {
            parts.push(Part {
                name: String::new(),
                vertices: 0..positions.len(),
                faces: 0..faces.len(),
            });
        }
        let places = if is_split { Places::Exact } else { Places::Own };
        Self {
            stretches: Stretches::new(&parts, &layers),
            positions,
            faces,
            parts,
            places,
            warnings,
            attributes: Attributes::default(),
            source,
            materials: None,
            origin: None,
            original: Vec::new(),
            home: None,
        }
    }

    /// The same document, read from a file in this folder.
    pub(crate) fn at_home(self, home: Option<PathBuf>) -> Self {
        Self { home, ..self }
    }

    /// The folder of the file.
    pub(crate) fn home(&self) -> Option<&Path> {
        self.home.as_deref()
    }

    /// The format of the file, or `None` if the document was made in memory.
    pub fn format(&self) -> Option<Format> {
        self.source.as_ref().map(|source| source.format())
    }

    /// Bytes of the file that are kept, unpacked; 0 if the document was made in memory.
    pub fn num_bytes(&self) -> usize {
        self.source.as_ref().map_or(0, |source| source.num_bytes())
    }

    /// What is odd about the file and was read nevertheless.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// The parts, in the order of the file; at least one.
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// All positions, in the order of the file.
    pub fn positions(&self) -> &[Point3<f64>] {
        &self.positions
    }

    /// All faces, in the order of the file.
    pub fn faces(&self) -> &FaceList {
        &self.faces
    }

    /// The positions as the file has them.
    fn file_positions(&self) -> &[Point3<f64>] {
        match self.original.as_slice() {
            [] => &self.positions,
            original => original,
        }
    }

    fn mesh(&self) -> Mesh<'_> {
        Mesh {
            positions: &self.positions,
            faces: &self.faces,
        }
    }

    /// Texture coordinates, normals, colours, groups, materials and all other attributes that
    /// more than one format can hold, decoded from the file; normals have turned with the surface
    /// where vertices were moved.
    ///
    /// # Errors
    /// [`IoError`] with the line or byte where the file is wrong: what is only kept is not checked
    /// when the file is read.
    pub fn attributes(&self) -> Result<Cow<'_, Attributes>, IoError> {
        let mut attributes = match &self.source {
            Some(source) => Cow::Owned(source.attributes(self.mesh())?),
            None => Cow::Borrowed(&self.attributes),
        };
        if !self.original.is_empty() {
            let normals =
                Normals::turned(&attributes, &self.faces, &self.original, &self.positions);
            normals.apply(attributes.to_mut());
        }
        Ok(attributes)
    }

    /// The materials, and the images of their textures, in the order of the labels of kind
    /// [`Material`](crate::LabelKind::Material).
    ///
    /// They are read from the file, and from the files that it refers to, every time that this is
    /// called. What cannot be read is no error: [`Materials::others`] names it.
    ///
    /// # Errors
    /// As [`Document::attributes`].
    pub fn materials(&self) -> Result<Materials, IoError> {
        Ok(self.materials_of(&*self.attributes()?))
    }

    /// [`Document::materials`], given the attributes.
    pub(crate) fn materials_of(&self, attributes: &Attributes) -> Materials {
        match (&self.materials, self.origin()) {
            (Some(materials), _) => Materials::clone(materials),
            (None, Some(origin)) => origin.materials(attributes),
            (None, None) => Materials::default(),
        }
    }

    /// The file that the document comes from, also where it is no longer tied to it.
    pub(crate) fn origin(&self) -> Option<&Arc<dyn SourceFile>> {
        self.source.as_ref().or(self.origin.as_ref())
    }

    /// Whether an OBJ of the document names the material libraries of the OBJ that it comes from.
    pub(crate) fn keeps_libraries(&self) -> bool {
        let is_obj = |origin: &Arc<dyn SourceFile>| origin.writes(Format::Obj);
        self.materials.is_none() && self.origin().is_some_and(is_obj)
    }

    /// The triangulated half-edge mesh of this document, with maps both ways, welded as the format
    /// means it; see [`Document::surface_with`].
    ///
    /// # Errors
    /// As [`Document::surface_with`].
    pub fn surface(&self) -> Result<ProcessingMesh, IoError> {
        self.surface_with(Weld::AsFormat)
    }

    /// The triangulated half-edge mesh of this document, with maps both ways.
    ///
    /// Vertices that no face uses are left out; larger polygons are cut into triangles inside
    /// their outline, also where it is concave. Faces of which welding leaves fewer than three
    /// corners are left out.
    ///
    /// # Errors
    /// [`IoError::NoFaces`] if there is nothing to build from, [`IoError::NotManifold`] if the
    /// faces do not form an oriented manifold.
    pub fn surface_with(&self, weld: Weld) -> Result<ProcessingMesh, IoError> {
        self.surface_numbered(weld, Numbering::Auto)
    }

    /// [`Document::surface_with`], its vertices and triangles numbered as asked for.
    ///
    /// # Errors
    /// As [`Document::surface_with`].
    pub fn surface_numbered(
        &self,
        weld: Weld,
        numbering: Numbering,
    ) -> Result<ProcessingMesh, IoError> {
        let places = self.places(weld)?;
        ProcessingMesh::build(&self.positions, &self.faces, &places, numbering)
    }

    /// For each vertex the first one that it is welded to; empty if there is nothing to weld.
    pub(crate) fn places(&self, weld: Weld) -> Result<Cow<'_, [u32]>, IoError> {
        let part = self.stretches.group_of();
        Ok(match weld {
            Weld::AsFormat => match &self.places {
                Places::Own => Cow::Borrowed(&[]),
                // Of the file: what is one vertex stays one when it is moved.
                Places::Exact => Cow::Owned(weld::exact(self.file_positions(), part)),
                Places::Given(places) => Cow::Borrowed(places),
            },
            Weld::Off => Cow::Borrowed(&[]),
            Weld::Exact => Cow::Owned(weld::exact(&self.positions, part)),
            Weld::Within(tolerance) if tolerance >= 0.0 && tolerance.is_finite() => {
                Cow::Owned(weld::within(&self.positions, part, tolerance))
            }
            Weld::Within(tolerance) => return Err(IoError::WeldTolerance { tolerance }),
        })
    }

    /// The mesh with every instance of it, welded as the format means it.
    pub(crate) fn expanded(&self) -> Result<Expanded<'_>, IoError> {
        let places = self.places(Weld::AsFormat)?;
        Expanded::new(
            self.origin().map(AsRef::as_ref),
            self.mesh(),
            &self.parts,
            self.attributes()?,
            places,
        )
    }

    /// The same document as one of a format that splits vertices, in these parts.
    #[cfg(test)]
    pub(crate) fn split_into(mut self, parts: Vec<Part>) -> Self {
        self.places = Places::Exact;
        self.stretches = Stretches::new(&parts, &[]);
        self.parts = parts;
        self
    }

    /// The number of the stretch of vertices that a vertex belongs to: ascending, and the same for
    /// vertices of a part that may be welded and stand together.
    pub(crate) fn stretch_of(&self) -> impl Fn(usize) -> usize + use<> {
        self.stretches.stretch_of()
    }

    /// The document of another mesh made of this one's vertices and faces, with everything that
    /// the file says about them; `places` is that of the new mesh (see [`Document::places`]).
    pub(crate) fn remapped(&self, remap: &Remap, places: Vec<u32>) -> Result<Self, IoError> {
        let gather = |positions: &[Point3<f64>]| -> Vec<Point3<f64>> {
            let old = remap.vertices.iter();
            old.map(|&v| positions.get(v as usize).copied().unwrap_or_default())
                .collect()
        };
        let file = Mesh {
            positions: self.file_positions(),
            faces: &self.faces,
        };
        let source = self.source.as_ref();
        let source = source
            .map(|source| source.rebuild(remap, file))
            .transpose()?;
        // Vertices and faces of a part stay together, so counting is enough.
        let mut parts = self.parts.clone();
        let (mut vertex, mut face) = (0, 0);
        for (part, old) in parts.iter_mut().zip(&self.parts) {
            let vertices = remap.vertices[vertex..].iter();
            let vertices = vertices.take_while(|&&v| (v as usize) < old.vertices.end);
            part.vertices = vertex..vertex + vertices.count();
            vertex = part.vertices.end;
            // A face that closes a hole stands behind the faces of its part.
            let faces = remap.face_sources[face..].iter();
            let faces = faces.take_while(|&&f| f == NONE || (f as usize) < old.faces.end);
            part.faces = face..face + faces.count();
            face = part.faces.end;
        }
        Ok(Self {
            positions: gather(&self.positions),
            faces: remap.faces.clone(),
            parts,
            stretches: self.stretches.remapped(&remap.vertices),
            places: match places.is_empty() {
                true => Places::Own,
                false => Places::Given(places),
            },
            warnings: self.warnings.clone(),
            attributes: self.attributes.remapped(remap),
            source,
            materials: self.materials.clone(),
            origin: self.origin.clone(),
            original: match self.original.as_slice() {
                [] => Vec::new(),
                original => gather(original),
            },
            home: self.home.clone(),
        })
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
        let mut moves: Vec<(usize, Point3<f64>)> = Vec::new();
        for vertex in 0..self.positions.len() {
            let Some(v) = processing.vertex(vertex) else {
                continue;
            };
            let (first, p) = (processing.document_vertex(v), positions[v]);
            let old = self.positions[first];
            // Compared in the caller's type: what f32 cannot tell apart was not moved.
            if p == old.map(T::of_f64) {
                continue;
            }
            let p = p.map(Scalar::as_f64);
            // Welded within a tolerance, a vertex keeps its distance to the first one.
            let [at, first] = [vertex, first].map(|v| self.file_positions()[v]);
            let p = match () {
                () if at == first => p,
                () if p == first => at,
                () => p + (at - first),
            };
            moves.push((vertex, p));
        }
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
            if self.original.is_empty() {
                self.original = self.positions.clone();
            }
            self.positions[vertex] = position;
        }
    }
}

fn is_finite(point: &Point3<f64>) -> bool {
    point.iter().all(|x| x.is_finite())
}

#[cfg(test)]
mod tests;
