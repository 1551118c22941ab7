//! Decoding of vertex attributes and face names, on request.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;

use super::GltfFile;
use super::accessor::{Component, Layout, problem};
use super::geometry::Piece;
use super::model::Primitive;
use crate::attributes::{Attributes, COLOR, LabelKind, Labels, NONE, NORMAL, Property, UV, Values};
use crate::error::IoError;
use crate::source::Mesh;

/// Maximum number of attribute values per byte of the file.
const VALUES_PER_BYTE: usize = 64;

/// Decodes all contents of a file that [`Attributes`] can represent.
pub(super) fn decode(file: &GltfFile, mesh: Mesh<'_>) -> Result<Attributes, IoError> {
    let num_vertices = mesh.positions.len();
    let columns = columns(file)?;
    let mut vertices = Vec::new();
    let mut num_bytes = file.buffers.num_bytes();
    // An accessor may have elements but no bytes, and several accessors may share their bytes.
    let per_vertex = columns.values().map(|column| column.components).sum();
    let num_values = num_vertices.saturating_mul(per_vertex);
    if num_values > num_bytes.saturating_mul(VALUES_PER_BYTE) {
        return Err(problem(
            "meshes".to_owned(),
            format!("{num_values} numbers of attributes in all in a file of {num_bytes} bytes"),
        ));
    }
    for (semantic, column) in &columns {
        num_bytes = num_bytes.saturating_add(
            num_vertices
                .saturating_mul(column.components)
                .saturating_mul(4),
        );
        file.limits
            .check_memory(num_bytes, num_vertices, mesh.faces.num_corners())?;
        vertices.push(column.property(file, semantic, num_vertices)?);
    }
    Ok(Attributes {
        vertices,
        labels: labels(file, mesh.faces.len()),
        ..Attributes::default()
    })
}

/// One semantic, over all blocks that have it.
#[derive(Debug)]
struct Column {
    components: usize,
    /// The integer type, if it is the same everywhere and needs no conversion.
    integer: Option<Component>,
    /// The layout per block.
    layouts: Vec<(usize, Layout)>,
}

/// The property name for a semantic.
fn name(semantic: &str) -> String {
    match semantic {
        "NORMAL" => NORMAL.to_owned(),
        "TEXCOORD_0" => UV.to_owned(),
        "COLOR_0" => COLOR.to_owned(),
        other => other.to_lowercase(),
    }
}

/// The accessor of a semantic for a block: that of the first primitive that has it.
pub(super) fn layout_of(
    file: &GltfFile,
    block: usize,
    semantic: &str,
) -> Result<Option<Layout>, IoError> {
    let mut found = primitives(file, block)
        .filter_map(|(piece, primitive)| Some((piece, *primitive.attributes.get(semantic)?)));
    let found = found.next();
    found
        .map(|(piece, accessor)| checked(file, block, semantic, piece, accessor))
        .transpose()
}

/// The primitives that use a block.
fn primitives(file: &GltfFile, block: usize) -> impl Iterator<Item = (&Piece, &Primitive)> {
    let pieces = file.geometry.blocks.get(block);
    let pieces = pieces.map_or(&[][..], |block| &block.pieces);
    pieces.iter().filter_map(|&piece| {
        let piece = file.geometry.pieces.get(piece)?;
        Some((piece, file.primitive(piece)?))
    })
}

/// The layout of an attribute, checked against its vertices and its meaning.
fn checked(
    file: &GltfFile,
    block: usize,
    semantic: &str,
    piece: &Piece,
    accessor: u64,
) -> Result<Layout, IoError> {
    let layout = Layout::new(accessor, &file.accessors, &file.views, &file.buffers)?;
    let count = file.geometry.blocks[block].vertices.len();
    if layout.count != count {
        return Err(problem(
            format!(
                "meshes[{}].primitives[{}].attributes.{semantic}",
                piece.mesh, piece.primitive
            ),
            format!(
                "accessor {accessor} has {} elements and POSITION has {count}",
                layout.count
            ),
        ));
    }
    let is_fitting = match semantic {
        "NORMAL" => layout.components == 3 && layout.component != Component::U32,
        "TEXCOORD_0" => layout.components == 2,
        "COLOR_0" => {
            matches!(layout.components, 3 | 4)
                && matches!(
                    layout.component,
                    Component::U8 | Component::U16 | Component::F32
                )
        }
        _ => true,
    };
    if !is_fitting {
        return Err(problem(
            format!("accessors[{accessor}]"),
            format!(
                "{} and component type {} do not fit {semantic}",
                file.accessors[layout.accessor].shape, file.accessors[layout.accessor].component
            ),
        ));
    }
    Ok(layout)
}

fn columns(file: &GltfFile) -> Result<BTreeMap<String, Column>, IoError> {
    let mut columns: BTreeMap<String, Column> = BTreeMap::new();
    for number in 0..file.geometry.blocks.len() {
        let mut first: BTreeMap<&str, (&Piece, u64)> = BTreeMap::new();
        for (piece, primitive) in primitives(file, number) {
            for (semantic, &accessor) in &primitive.attributes {
                first.entry(semantic).or_insert((piece, accessor));
            }
        }
        first.remove("POSITION");
        for (semantic, (piece, accessor)) in first {
            let layout = checked(file, number, semantic, piece, accessor)?;
            let is_color = semantic == "COLOR_0";
            // The second texture coordinate is flipped, which would take it out of the unsigned
            // integers.
            let is_real = matches!(semantic, "NORMAL" | "TEXCOORD_0");
            let is_plain = (!layout.normalized || is_color) && !is_real;
            let integer =
                (is_plain && layout.component != Component::F32).then_some(layout.component);
            let column = columns
                .entry(semantic.to_owned())
                .or_insert_with(|| Column {
                    components: layout.components,
                    integer,
                    layouts: Vec::new(),
                });
            column.components = column.components.max(layout.components);
            if column.integer != integer {
                column.integer = None;
            }
            column.layouts.push((number, layout));
        }
    }
    Ok(columns)
}

impl Column {
    fn property(
        &self,
        file: &GltfFile,
        semantic: &str,
        num_vertices: usize,
    ) -> Result<Property, IoError> {
        let zeros = num_vertices.saturating_mul(self.components);
        // Vertices without a colour are white, as rendered.
        let is_color = semantic == "COLOR_0";
        let mut values = match self.integer {
            Some(Component::I8) => Values::I8(vec![0; zeros]),
            Some(Component::U8) => Values::U8(vec![if is_color { u8::MAX } else { 0 }; zeros]),
            Some(Component::I16) => Values::I16(vec![0; zeros]),
            Some(Component::U16) => Values::U16(vec![if is_color { u16::MAX } else { 0 }; zeros]),
            Some(Component::U32) => Values::U32(vec![0; zeros]),
            Some(Component::F32) | None => {
                Values::F32(vec![if is_color { 1.0 } else { 0.0 }; zeros])
            }
        };
        for (block, layout) in &self.layouts {
            let block = &file.geometry.blocks[*block];
            let start = block.vertices.start;
            layout.for_each(&file.buffers, |element, bytes| {
                let at = (start + element) * self.components;
                let mut value = [0.0; 16];
                for (k, value) in value.iter_mut().enumerate().take(layout.components) {
                    *value = match self.integer {
                        Some(component) => {
                            component.read(bytes.get(k * component.size()..).unwrap_or(&[]))
                        }
                        None if semantic == "COLOR_0" && layout.component != Component::F32 => {
                            let raw = bytes.get(k * layout.component.size()..).unwrap_or(&[]);
                            let raw = layout.component.read(raw);
                            f64::from(raw as f32 / layout.component.unit())
                        }
                        None => layout.value(bytes, k),
                    };
                }
                match semantic {
                    "NORMAL" => {
                        let normal = Vector3::new(value[0], value[1], value[2]);
                        let normal = block.placement.normal_to_scene(normal);
                        value[..3].copy_from_slice(normal.as_slice());
                    }
                    // Pointing up, as in OBJ and PLY.
                    "TEXCOORD_0" => value[1] = 1.0 - value[1],
                    // Opaque if only other primitives have alpha.
                    "COLOR_0" if layout.components < self.components => {
                        value[3] = self.integer.map_or(1.0, |c| f64::from(c.unit()));
                    }
                    _ => {}
                }
                for (k, &value) in value.iter().enumerate().take(self.components) {
                    values.set(at + k, value);
                }
                Ok(())
            })?;
        }
        Ok(Property {
            name: name(semantic),
            components: self.components,
            values,
        })
    }
}

/// The materials used by faces, in the order of their labels.
pub(super) fn material_order(file: &GltfFile) -> Vec<usize> {
    let mut seen = BTreeSet::new();
    let materials = file.geometry.pieces.iter().filter_map(|piece| {
        let material = usize::try_from(file.primitive(piece)?.material?).ok()?;
        file.materials.get(material).map(|_| material)
    });
    materials
        .filter(|&material| seen.insert(material))
        .collect()
}

/// The names of materials and meshes.
fn labels(file: &GltfFile, num_faces: usize) -> Vec<Labels> {
    let mut materials = Numbered::new(LabelKind::Material, num_faces);
    let mut objects = Numbered::new(LabelKind::Object, num_faces);
    for piece in &file.geometry.pieces {
        let material = file
            .primitive(piece)
            .and_then(|primitive| primitive.material);
        let material = material.and_then(|m| usize::try_from(m).ok());
        if let Some((number, name)) = material.and_then(|m| Some((m, file.materials.get(m)?))) {
            materials.put(number, name, piece.faces.clone());
        }
        let name = file.meshes.get(piece.mesh).map_or("", |mesh| &mesh.name);
        if !name.is_empty() {
            objects.put(piece.mesh, name, piece.faces.clone());
        }
    }
    [materials.labels, objects.labels]
        .into_iter()
        .filter(|labels| !labels.names.is_empty())
        .collect()
}

/// Labels keyed by object index, so that two objects with the same name stay separate.
struct Numbered {
    labels: Labels,
    numbers: BTreeMap<usize, u32>,
}

impl Numbered {
    fn new(kind: LabelKind, num_faces: usize) -> Self {
        Self {
            labels: Labels {
                kind,
                names: Vec::new(),
                faces: vec![NONE; num_faces],
            },
            numbers: BTreeMap::new(),
        }
    }

    fn put(&mut self, number: usize, name: &str, faces: std::ops::Range<usize>) {
        let names = &mut self.labels.names;
        let label = *self.numbers.entry(number).or_insert_with(|| {
            names.push(name.to_owned());
            // There are fewer than 2^32 primitives.
            (names.len() - 1) as u32
        });
        if let Some(faces) = self.labels.faces.get_mut(faces) {
            faces.fill(label);
        }
    }
}
