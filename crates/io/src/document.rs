//! The user's mesh file in memory: the mesh to work on, and everything else, preserved.

mod derive;
mod positions;
mod stretches;
mod surface;
mod write;

pub use derive::{Derivation, Derived};

use std::borrow::Cow;
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
use crate::parsed::{Node, Parsed, Part};
use crate::remap::Remap;
use crate::source::{Mesh, Reading, SourceFile};
use crate::weld::Weld;

/// A mesh file: positions, polygons, and all its other contents.
///
/// Vertices and faces keep the order of the file and are indexed from 0. Polygons keep their
/// degree, and vertices that no face uses are included. Editing happens on a
/// [`ProcessingMesh`](crate::ProcessingMesh), and [`Document::set_positions`] writes the moved
/// vertices back.
///
/// A document written in the format it was read from differs from the original file only in
/// the coordinates of moved vertices and in the surface normals there, which rotate with the
/// surface. Comments, texture coordinates, colours, groups, materials, additional PLY elements,
/// the nodes and images of a glTF, whitespace and line endings are preserved byte for byte. Any
/// other format receives the [`Attributes`] that it can represent. [`Document::losses`] lists
/// what a write would drop or leave stale.
///
/// The vertices of a glTF are those of its meshes. Each is stored once, no matter how many nodes
/// show it, and placed by the first node that does: an edit of a mesh shows at all its instances,
/// as in the file, and formats without nodes receive one copy per instance. Meshes that share an
/// accessor get separate vertices if they are placed differently or have a face in common, and so
/// do primitives of one mesh that have a face in common.
#[derive(Clone, Debug)]
pub struct Document {
    positions: Vec<Point3<f64>>,
    faces: FaceList,
    parts: Vec<Part>,
    stretches: Stretches,
    places: Places,
    warnings: Vec<Warning>,
    /// Attributes of a document made in memory; those of a file are decoded on request.
    attributes: Attributes,
    source: Option<Arc<dyn SourceFile>>,
    /// Materials that replace those of the file, if any were set.
    materials: Option<Arc<Materials>>,
    /// The file that a detached document comes from. It still supplies the instances of its
    /// meshes and its materials; everything else in it is lost.
    origin: Option<Arc<dyn SourceFile>>,
    /// The positions in the file; empty as long as no vertex has moved.
    original: Vec<Point3<f64>>,
    /// The folder of the file, in which its companion files are found; `None` without a path.
    home: Option<PathBuf>,
}

/// The vertices that count as one when the document is welded as its format implies.
#[derive(Clone, Debug)]
enum Places {
    /// No vertices are merged.
    Own,
    /// Vertices at exactly the same position within a part are merged, because the format splits
    /// vertices.
    Exact,
    /// For each vertex, the first vertex that it is merged with, as left by a repair.
    Given(Vec<u32>),
}

impl Document {
    /// Creates a document in memory.
    ///
    /// # Errors
    /// [`IoError`] if there is no vertex, a coordinate is not finite, a face has fewer than three
    /// corners, or a corner refers to a vertex that does not exist.
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

    /// Replaces the attributes. The resulting document is detached from its file.
    ///
    /// # Errors
    /// [`IoError::Attributes`] if they do not match the vertices, faces and corners.
    pub fn with_attributes(self, attributes: Attributes) -> Result<Self, IoError> {
        let (vertices, faces) = (self.positions.len(), &self.faces);
        if let Some(problem) = attributes.misfit(vertices, faces.len(), faces.num_corners()) {
            return Err(IoError::Attributes { problem });
        }
        // Attributes are replaced, but materials and instances stay.
        let origin = self.origin().cloned();
        Ok(Self {
            attributes,
            source: None,
            origin,
            original: Vec::new(),
            ..self
        })
    }

    /// Replaces the materials. The resulting document is detached from its file.
    ///
    /// # Errors
    /// [`IoError::Attributes`] if a number or an image is invalid, or if the labels of kind
    /// [`Material`](crate::LabelKind::Material) have more names than there are materials;
    /// [`IoError`] as for [`Document::attributes`].
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

    /// Creates a document from a half-edge mesh and its positions.
    ///
    /// # Errors
    /// As for [`Document::new`], and if there is not exactly one position per vertex.
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

    /// Creates the document of a file.
    ///
    /// # Errors
    /// [`IoError::NoVertices`] if the file has none.
    pub(crate) fn from_reading(reading: Reading) -> Result<Self, IoError> {
        let Reading { parsed, source } = reading;
        if parsed.positions.is_empty() {
            return Err(IoError::NoVertices {
                format: source.format(),
            });
        }
        Ok(Self::from_parsed(parsed, Some(source)))
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

    /// Sets the folder that the document was read from.
    pub(crate) fn at_home(self, home: Option<PathBuf>) -> Self {
        Self { home, ..self }
    }

    /// The folder of the file.
    pub(crate) fn home(&self) -> Option<&Path> {
        self.home.as_deref()
    }

    /// The format of the file, or `None` for a document made in memory.
    pub fn format(&self) -> Option<Format> {
        self.source.as_ref().map(|source| source.format())
    }

    /// Size of the retained file in bytes, uncompressed; 0 for a document made in memory.
    pub fn num_bytes(&self) -> usize {
        self.source.as_ref().map_or(0, |source| source.num_bytes())
    }

    /// Irregularities of the file that did not prevent reading it.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// The parts, in file order; at least one.
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// The nodes of a glTF, in file order; empty for other formats.
    pub fn nodes(&self) -> &[Node] {
        self.origin().map_or(&[], |origin| origin.nodes())
    }

    /// The number of times that the nodes of a glTF show a part; 1 for other formats.
    pub fn num_instances(&self, part: usize) -> usize {
        self.origin().map_or(1, |origin| origin.num_instances(part))
    }

    /// Gives every node of a glTF that shows a mesh a mesh of its own, so that an edit moves one
    /// instance and not all of them.
    ///
    /// Vertices and faces keep their indices; those of the copies follow, placed by their nodes.
    /// Instances that only another scene shows, and those of one node by
    /// `EXT_mesh_gpu_instancing`, stay shared. Other documents are returned as they are.
    ///
    /// # Errors
    /// [`IoError`] if the copies exceed the limits with which the file was read.
    pub fn with_unique_meshes(self) -> Result<Self, IoError> {
        let Some(source) = &self.source else {
            return Ok(self);
        };
        match self.with_moves(&**source, |moves| source.with_unique_meshes(moves))? {
            Some(reading) => Ok(Self::from_reading(reading)?.at_home(self.home)),
            None => Ok(self),
        }
    }

    /// All positions, in file order.
    pub fn positions(&self) -> &[Point3<f64>] {
        &self.positions
    }

    /// Returns `true` if a vertex is not where the file has it.
    pub fn has_moved(&self, vertex: usize) -> bool {
        self.file_positions().get(vertex) != self.positions.get(vertex)
    }

    /// All faces, in file order.
    pub fn faces(&self) -> &FaceList {
        &self.faces
    }

    fn mesh(&self) -> Mesh<'_> {
        Mesh {
            positions: &self.positions,
            faces: &self.faces,
        }
    }

    /// Decodes the texture coordinates, normals, colours, groups, materials and all other
    /// attributes that more than one format can represent.
    ///
    /// Normals are rotated with the surface where vertices have moved.
    ///
    /// # Errors
    /// [`IoError`] with the line or byte at which the file is invalid: data that is only retained
    /// is not checked when the file is read.
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

    /// Reads the materials, and the images of their textures, in the order of the labels of kind
    /// [`Material`](crate::LabelKind::Material).
    ///
    /// They are decoded, and images are read, on every call; the material libraries of an OBJ are
    /// read only once. Unreadable content is not an error; it is listed in [`Materials::others`].
    ///
    /// # Errors
    /// As for [`Document::attributes`].
    pub fn materials(&self) -> Result<Materials, IoError> {
        Ok(self.materials_of(&*self.attributes()?))
    }

    /// Like [`Document::materials`], for given attributes.
    pub(crate) fn materials_of(&self, attributes: &Attributes) -> Materials {
        match (&self.materials, self.origin()) {
            (Some(materials), _) => Materials::clone(materials),
            (None, Some(origin)) => origin.materials(attributes),
            (None, None) => Materials::default(),
        }
    }

    /// The file that the document comes from, even if the document is detached from it.
    pub(crate) fn origin(&self) -> Option<&Arc<dyn SourceFile>> {
        self.source.as_ref().or(self.origin.as_ref())
    }

    /// Returns `true` if an OBJ written from the document keeps the material libraries of the OBJ
    /// it comes from.
    pub(crate) fn keeps_libraries(&self) -> bool {
        let is_obj = |origin: &Arc<dyn SourceFile>| origin.writes(Format::Obj);
        self.materials.is_none() && self.origin().is_some_and(is_obj)
    }

    /// The mesh with all its instances, welded as the format implies.
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

    /// The same document, as if from a format that splits vertices, with these parts.
    #[cfg(test)]
    pub(crate) fn split_into(mut self, parts: Vec<Part>) -> Self {
        self.places = Places::Exact;
        self.stretches = Stretches::new(&parts, &[]);
        self.parts = parts;
        self
    }

    /// Creates the document of another mesh made of this one's vertices and faces, with all data
    /// that the file has for them.
    ///
    /// `places` is that of the new mesh (see [`Document::places`]).
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
        // Vertices and faces of a part stay contiguous, so counting is enough.
        let mut parts = self.parts.clone();
        let (mut vertex, mut face) = (0, 0);
        for (part, old) in parts.iter_mut().zip(&self.parts) {
            let vertices = remap.vertices[vertex..].iter();
            let vertices = vertices.take_while(|&&v| (v as usize) < old.vertices.end);
            part.vertices = vertex..vertex + vertices.count();
            vertex = part.vertices.end;
            // A face that closes a hole comes after the faces of its part.
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
}

fn is_finite(point: &Point3<f64>) -> bool {
    point.iter().all(|x| x.is_finite())
}

#[cfg(test)]
mod tests;
