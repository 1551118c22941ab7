//! glTF 2.0, as JSON and in one binary file.
//!
//! The vertices of the document are the elements of the POSITION accessors of all triangles, in
//! the order of meshes and primitives. Each accessor occurs once, plus once for each use that
//! must not be joined to the others (see `sharing`). Vertices are placed by the first node that
//! shows the mesh; the other nodes that show it are its instances. Writing preserves the JSON
//! text and the buffers byte by byte, except for what a moved vertex changes. External buffers
//! and images stay external as long as they do not change; saving copies them next to the file,
//! or embeds them.
//!
//! Source: Khronos, "glTF 2.0 Specification", 2021.
//!
//! The files of this folder are one concept and use each other freely; outside of it, only
//! [`formats`](crate::formats) and [`detect`](crate::detect) use them.

mod accessor;
mod attributes;
mod buffers;
mod container;
mod embed;
mod external;
mod geometry;
mod json;
mod materials;
mod model;
mod new;
mod new_materials;
mod origin;
mod plan;
mod private;
mod rebuild;
mod scene;
mod sharing;
#[cfg(test)]
mod tests;
mod tokens;
mod unique;
mod write;

use std::sync::Arc;

use nalgebra::Point3;

use self::buffers::{Buffer, Kind};
use self::container::Container;
use self::external::External;
use self::geometry::Geometry;
use self::model::{Accessor, Mesh as JsonMesh, Root, View};
use self::sharing::Sharing;
use crate::attributes::{Attributes, LabelKind};
use crate::companions::References;
use crate::error::{IoError, Place, quote};
use crate::format::Format;
use crate::limits::Limits;
use crate::material::Materials;
use crate::parsed::{Node, Parsed};
use crate::placement::Instance;
use crate::precision::single;
use crate::remap::Remap;
use crate::resolve::Resolve;
use crate::source::{Mesh, Moves, Reading, SourceFile};

pub(crate) use self::new::{losses, write_new};

/// Returns `true` if the content starts with the GLB signature.
pub(crate) fn is_glb(bytes: &[u8]) -> bool {
    bytes.starts_with(container::MAGIC)
}

/// Reads a glTF or GLB file.
pub(crate) fn read(
    bytes: Vec<u8>,
    limits: &Limits,
    resolver: &dyn Resolve,
) -> Result<Reading, IoError> {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
    if !is_glb(&bytes) && !text.trim_ascii_start().starts_with(b"{") {
        return Err(IoError::Malformed {
            place: Place::Byte(0),
            problem: "this is not a glTF file: a GLB starts with `glTF`, a .gltf is JSON"
                .to_owned(),
        });
    }
    let files = External::new(resolver.shared());
    let (file, parsed) = GltfFile::read(bytes, limits, files)?;
    Ok(Reading::new(parsed, file))
}

/// The bytes of a file and of its buffers.
#[derive(Debug)]
struct Buffers {
    file: Vec<u8>,
    list: Vec<Buffer>,
    /// The total size of the files that buffers refer to, each counted once.
    external: usize,
}

impl Buffers {
    fn len(&self) -> usize {
        self.list.len()
    }

    /// The bytes of a buffer, up to the length stated in the JSON.
    fn bytes(&self, buffer: usize) -> &[u8] {
        self.list
            .get(buffer)
            .map_or(&[], |buffer| buffer.bytes(&self.file))
    }

    /// Returns `true` if a buffer has any data.
    fn is_there(&self, buffer: usize) -> bool {
        self.list
            .get(buffer)
            .is_some_and(|buffer| buffer.kind != Kind::Absent)
    }

    /// The total size of the file and its external buffers, which bounds all counts.
    fn num_bytes(&self) -> usize {
        self.file.len().saturating_add(self.external)
    }
}

/// A glTF file as it was read.
#[derive(Debug)]
struct GltfFile {
    buffers: Buffers,
    /// The files that it refers to.
    files: External,
    container: Container,
    accessors: Vec<Accessor>,
    views: Vec<View>,
    meshes: Vec<JsonMesh>,
    /// The names of the materials, for labels.
    materials: Vec<String>,
    geometry: Geometry,
    /// Accessors used by something other than a primitive: skins and animations.
    other_uses: Vec<u64>,
    /// Views that contain images.
    images: Vec<u64>,
    extras: Vec<String>,
    limits: Limits,
}

impl GltfFile {
    fn read(bytes: Vec<u8>, limits: &Limits, files: External) -> Result<(Self, Parsed), IoError> {
        Self::read_shared(bytes, limits, files, Sharing::default())
    }

    /// Reads a file, optionally with the sharing of vertices between its primitives given.
    fn read_shared(
        bytes: Vec<u8>,
        limits: &Limits,
        mut files: External,
        sharing: Sharing,
    ) -> Result<(Self, Parsed), IoError> {
        limits.check_bytes(bytes.len() as u64)?;
        let mut warnings = Vec::new();
        let container = Container::read(&bytes, &mut warnings)?;
        let start = container.json.start;
        let text = std::str::from_utf8(&bytes[container.json.clone()]).map_err(|error| {
            IoError::Malformed {
                place: crate::error::Place::Byte(start + error.valid_up_to()),
                problem: "the JSON is not UTF-8".to_owned(),
            }
        })?;
        let root = Root::read(text, start, limits)?;
        check_extensions(&root)?;
        let list = buffers::load(&root, &container, bytes.len(), limits, &mut files)?;
        let extras = extras(&root, &container);
        // The URIs borrow from the bytes, which are about to be moved.
        let root = Root {
            buffers: Vec::new(),
            ..root
        };
        let root: Root<'static> = root;
        let external = usize::try_from(files.num_bytes()).unwrap_or(usize::MAX);
        let buffers = Buffers {
            file: bytes,
            list,
            external,
        };
        let (geometry, mut parsed) =
            Geometry::read(&root, &buffers, limits, sharing, &mut warnings)?;
        parsed.warnings = warnings;
        let materials = root.materials.into_iter().enumerate();
        let name = |(number, material): (usize, model::Named)| {
            material
                .name
                .unwrap_or_else(|| format!("material {number}"))
        };
        let skins = root.skins.iter().filter_map(|skin| skin.matrices);
        let samplers = root
            .animations
            .iter()
            .flat_map(|animation| &animation.samplers);
        let animated = samplers.flat_map(|sampler| [sampler.input, sampler.output]);
        let file = Self {
            buffers,
            files,
            container,
            materials: materials.map(name).collect(),
            geometry,
            other_uses: skins.chain(animated).collect(),
            images: root.images.iter().filter_map(|image| image.view).collect(),
            accessors: root.accessors,
            views: root.views,
            meshes: root.meshes,
            extras,
            limits: *limits,
        };
        Ok((file, parsed))
    }

    /// The JSON text.
    fn text(&self) -> &str {
        let bytes = self.buffers.file.get(self.container.json.clone());
        // It was validated when the file was read.
        std::str::from_utf8(bytes.unwrap_or(&[])).unwrap_or_default()
    }

    /// The chunks of a GLB that are neither JSON nor data, and the bytes after its end.
    fn chunks(&self) -> (impl Iterator<Item = &[u8]> + Clone, &[u8]) {
        self.container.further(&self.buffers.file)
    }

    /// The primitive that a piece was read from.
    fn primitive(&self, piece: &geometry::Piece) -> Option<&model::Primitive> {
        self.meshes.get(piece.mesh)?.primitives.get(piece.primitive)
    }

    /// The primitives that faces were read from.
    fn primitives(&self) -> impl Iterator<Item = &model::Primitive> {
        let pieces = self.geometry.pieces.iter();
        pieces.filter_map(|piece| self.primitive(piece))
    }

    /// Returns `true` if primitives with the same positions have different normals, of which only
    /// the first are rotated.
    fn has_several_normals(&self) -> bool {
        self.geometry.blocks.iter().any(|block| {
            let pieces = block
                .pieces
                .iter()
                .filter_map(|&p| self.geometry.pieces.get(p));
            let mut normals =
                pieces.filter_map(|piece| self.primitive(piece)?.attributes.get("NORMAL"));
            let first = normals.next();
            normals.any(|normal| Some(normal) != first)
        })
    }

    /// Returns `true` if a primitive with faces has the attribute.
    fn has_attribute(&self, semantic: &str) -> bool {
        let has = |primitive: &model::Primitive| primitive.attributes.contains_key(semantic);
        self.primitives().any(has)
    }
}

impl SourceFile for GltfFile {
    fn format(&self) -> Format {
        if self.container.is_binary {
            Format::Glb
        } else {
            Format::Gltf
        }
    }

    fn writes(&self, format: Format) -> bool {
        matches!(format, Format::Gltf | Format::Glb)
    }

    fn num_bytes(&self) -> usize {
        self.buffers.num_bytes()
    }

    fn attributes(&self, mesh: Mesh<'_>) -> Result<Attributes, IoError> {
        attributes::decode(self, mesh)
    }

    fn has_normals(&self) -> bool {
        self.has_attribute("NORMAL")
    }

    fn extras(&self) -> Vec<String> {
        let others = &self.geometry.placements.others;
        let elsewhere = others.iter().map(|others| others.elsewhere);
        // The visitor never fails.
        let singular = self.geometry.instances(&self.buffers, &mut |_| Ok(()));
        let counted = [
            (elsewhere.sum(), "that another scene shows"),
            (singular.unwrap_or(0), "whose transform is not invertible"),
        ];
        let counted = counted.into_iter().filter(|&(count, _)| count > 0);
        let counted = counted.map(|(count, which)| {
            let instances = if count == 1 { "instance" } else { "instances" };
            format!("{count} {instances} of meshes {which}")
        });
        self.extras.iter().cloned().chain(counted).collect()
    }

    fn stale(&self) -> Vec<String> {
        let mut stale = Vec::new();
        if self.primitives().any(|p| !p.targets.is_empty()) {
            stale.push("morph targets".to_owned());
        }
        if self.has_attribute("TANGENT") {
            stale.push("tangents".to_owned());
        }
        if self.has_several_normals() {
            stale.push("further normals of vertices that primitives share".to_owned());
        }
        stale
    }

    fn has_materials(&self) -> bool {
        !self.materials.is_empty()
    }

    fn materials(&self, attributes: &Attributes) -> Materials {
        let labels = attributes.label(LabelKind::Material);
        materials::materials(self, labels)
    }

    fn stored(&self, vertex: usize, position: Point3<f64>) -> Point3<f64> {
        let blocks = &self.geometry.blocks;
        let block = blocks.partition_point(|block| block.vertices.end <= vertex);
        let Some(block) = blocks.get(block) else {
            return position;
        };
        let placement = &block.placement;
        placement.to_scene(single(placement.to_mesh(position)))
    }

    fn write(&self, format: Format, moves: &Moves<'_>) -> Result<Vec<u8>, IoError> {
        write::write(self, format, moves)
    }

    fn instances(
        &self,
        visit: &mut dyn FnMut(Instance<'_>) -> Result<(), IoError>,
    ) -> Result<(), IoError> {
        self.geometry.check_instances(&self.buffers, &self.limits)?;
        self.geometry.instances(&self.buffers, visit).map(|_| ())
    }

    fn nodes(&self) -> &[Node] {
        &self.geometry.placements.nodes
    }

    fn num_instances(&self, part: usize) -> usize {
        let others = self.geometry.placements.others.get(part);
        others.map_or(1, |others| others.count)
    }

    fn with_unique_meshes(&self, moves: &Moves<'_>) -> Result<Option<Reading>, IoError> {
        unique::with_unique_meshes(self, moves)
    }

    fn references(&self, written: &[u8]) -> Result<References, IoError> {
        self.files.references(written, self.limits.max_bytes)
    }

    fn own_references(&self) -> Result<References, IoError> {
        self.references(&self.buffers.file)
    }

    fn embedded(&self, written: Vec<u8>) -> Result<Vec<u8>, IoError> {
        embed::embed(written, &self.files, &self.limits)
    }

    fn rebuild(&self, remap: &Remap, mesh: Mesh<'_>) -> Result<Arc<dyn SourceFile>, IoError> {
        Ok(Arc::new(rebuild::rebuild(self, remap, mesh)?))
    }
}

/// Rejects files that require unsupported extensions.
fn check_extensions(root: &Root<'_>) -> Result<(), IoError> {
    // These describe materials, lighting or the storage of numbers; all of it is preserved.
    const KNOWN: [&str; 5] = [
        "EXT_mesh_gpu_instancing",
        "KHR_mesh_quantization",
        "KHR_texture_basisu",
        "KHR_texture_transform",
        "KHR_lights_punctual",
    ];
    const KNOWN_PREFIXES: [&str; 4] = [
        "KHR_materials_",
        "EXT_materials_",
        "EXT_texture_",
        "EXT_lights_",
    ];
    for name in &root.extensions_required {
        if KNOWN.contains(&name.as_str()) || KNOWN_PREFIXES.iter().any(|p| name.starts_with(p)) {
            continue;
        }
        if name == "KHR_draco_mesh_compression" {
            return Err(geometry::draco());
        }
        return Err(IoError::Unsupported {
            feature: format!("the extension {}", quote(name.as_bytes())),
            remedy: if name.contains("meshopt") {
                "write the file without compression, for example with `gltf-transform copy`"
            } else {
                "the file requires it; write it without"
            },
        });
    }
    Ok(())
}

/// Lists the contents that only a glTF can represent.
fn extras(root: &Root<'_>, container: &Container) -> Vec<String> {
    let primitives = || root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let num_unshown = primitives().filter(|p| p.mode < 4).count();
    let has_targets = primitives().any(|p| !p.targets.is_empty());
    let counts = [
        (root.nodes.len(), "node", "nodes"),
        (root.skins.len(), "skin", "skins"),
        (root.animations.len(), "animation", "animations"),
        (root.cameras.len(), "camera", "cameras"),
        (
            num_unshown,
            "primitive of points or lines",
            "primitives of points or lines",
        ),
        (container.others.len(), "further chunk", "further chunks"),
    ];
    let mut extras: Vec<String> = counts
        .into_iter()
        .filter(|&(count, ..)| count > 0)
        .map(|(count, one, more)| format!("{count} {}", if count == 1 { one } else { more }))
        .collect();
    if has_targets {
        extras.push("morph targets".to_owned());
    }
    if root.extras.is_some() {
        extras.push("application data (`extras`)".to_owned());
    }
    if root.extensions.is_some() {
        extras.push("data of extensions".to_owned());
    }
    extras
}
