//! A new glTF for a document that was not read from one.
//!
//! It has one mesh with one set of vertices and one primitive per material. glTF has no corner
//! attributes, so a vertex whose corners differ in normal, texture coordinates or colour is
//! written once per combination. When the file is read, these are one vertex of the surface
//! again.

use std::borrow::Cow;
use std::collections::HashMap;

use nalgebra::{Point3, Vector3};

use super::buffers::encode;
use super::container::write_binary;
use super::new_materials;
use super::origin;
use super::write::{array, limits};
use crate::attributes::{Attributes, COLOR, LabelKind, Labels, NONE, NORMAL, Property, UV, Values};
use crate::contents::{Contents, named};
use crate::error::IoError;
use crate::faces::FaceList;
use crate::format::Format;
use crate::material::{Material, Materials};
use crate::precision::Rounding;
use crate::recut::{Cutter, Recuts};

/// Lists what a new glTF cannot represent.
pub(crate) fn losses(contents: &Contents<'_>) -> Vec<String> {
    let attributes = &contents.attributes;
    let is_held = |name: &str, components: usize| match name {
        NORMAL => components == 3,
        UV => matches!(components, 2 | 3),
        COLOR => matches!(components, 3 | 4),
        _ => false,
    };
    let vertices = attributes.vertices.iter();
    let vertices = vertices.filter(|p| !is_held(&p.name, p.components) || is_list(&p.values));
    let corners = attributes.corners.iter();
    let corners = corners.filter(|p| !is_held(&p.name, p.components));
    let mut losses: Vec<String> = [
        named("vertex", vertices.map(|p| p.name.as_str())),
        named("corner", corners.map(|p| p.name.as_str())),
        named("face", attributes.faces.iter().map(|p| p.name.as_str())),
    ]
    .into_iter()
    .flatten()
    .collect();
    if has_third(attributes) {
        losses.push("the third number of texture coordinates".to_owned());
    }
    let (positions, faces) = (&contents.positions, &contents.faces);
    let origin = origin::of(positions, faces);
    let stored = |v: usize| origin::stored(positions[v], &origin);
    losses.extend(Rounding::measure(positions, faces, stored).map(|rounding| rounding.loss()));
    let polygons = contents.faces.iter().filter(|f| f.len() > 3).count();
    let has = |kind: LabelKind| attributes.label(kind).is_some();
    let counted = |count: usize, one: &str, more: &str| match count {
        0 => None,
        1 => Some(format!("1 {one}")),
        count => Some(format!("{count} {more}")),
    };
    losses.extend(counted(
        polygons,
        "face of more than three corners (cut into triangles)",
        "faces of more than three corners (cut into triangles)",
    ));
    if has(LabelKind::Object) && object(attributes).is_none() {
        losses.push("the objects of the faces".to_owned());
    }
    if has(LabelKind::Group) {
        losses.push("groups".to_owned());
    }
    if has(LabelKind::Smoothing) {
        losses.push("smoothing groups".to_owned());
    }
    losses.extend(counted(attributes.comments.len(), "comment", "comments"));
    if contents.materials.is_empty() {
        losses.extend(counted(
            attributes.libraries.len(),
            "reference to a material library",
            "references to material libraries",
        ));
    }
    losses.extend(contents.materials.others.iter().cloned());
    losses
}

/// Returns `true` if texture coordinates have a non-trivial third component.
fn has_third(attributes: &Attributes) -> bool {
    let says = |values: &Values, components: usize| {
        components == 3
            && (2..values.len())
                .step_by(3)
                .any(|i| values.get(i).is_some_and(|x| x != 0.0))
    };
    attributes
        .corner(UV)
        .is_some_and(|p| says(&p.values, p.components))
        || attributes
            .vertex(UV)
            .is_some_and(|p| says(&p.values, p.components))
}

/// The single object that contains all faces; its name becomes that of the mesh.
fn object(attributes: &Attributes) -> Option<&str> {
    let labels = attributes.label(LabelKind::Object)?;
    match labels.names.as_slice() {
        [name] if labels.faces.iter().all(|&l| l == 0) => Some(name),
        _ => None,
    }
}

fn is_list(values: &Values) -> bool {
    matches!(values, Values::Lists { .. })
}

/// Writes a new glTF or GLB file.
pub(crate) fn write_new(contents: &Contents<'_>, format: Format) -> Result<Vec<u8>, IoError> {
    let (positions, faces) = (&*contents.positions, &*contents.faces);
    if faces.is_empty() {
        return Err(IoError::NoFaces {
            num_vertices: positions.len(),
        });
    }
    let split = Split::new(contents);
    let mut file = NewFile::default();
    let origin = origin::of(positions, faces);
    let attributes = file.attributes(&split, positions, &origin)?;
    let translation = match origin == Point3::origin() {
        true => String::new(),
        false => format!(",\"translation\":{}", array(origin.coords.as_slice())),
    };
    let labels = contents.attributes.label(LabelKind::Material);
    let recuts = contents.recuts();
    let primitives = file.primitives(&split, positions, labels, &attributes, &recuts);
    let materials = file.materials(labels, &contents.materials)?;
    let name = object(&contents.attributes).map(|name| format!("\"name\":{},", quoted(name)));
    let uri = match format {
        Format::Glb => String::new(),
        _ => format!(",\"uri\":\"{}\"", encode(&file.data)),
    };
    let json = format!(
        "{{\"asset\":{{\"generator\":\"cotan\",\"version\":\"2.0\"}},\"scene\":0,\
         \"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{{\"mesh\":0{translation}}}],\
         \"meshes\":[{{{}\"primitives\":[{}]}}]{materials},\
         \"accessors\":[{}],\"bufferViews\":[{}],\"buffers\":[{{\"byteLength\":{}{uri}}}]}}",
        name.unwrap_or_default(),
        primitives.join(","),
        file.accessors.join(","),
        file.views.join(","),
        file.data.len(),
    );
    match format {
        Format::Glb => write_binary(&json, Some(&file.data), [].into_iter(), &[]),
        _ => Ok(json.into_bytes()),
    }
}

fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// A property of vertices or corners: a table, and the index of each corner's value.
struct Column<'a> {
    values: Cow<'a, Values>,
    components: usize,
    /// The value index of each corner; `None` for a vertex property.
    indices: Option<Vec<u32>>,
}

impl<'a> Column<'a> {
    fn find(
        attributes: &'a Attributes,
        name: &str,
        components: std::ops::RangeInclusive<usize>,
    ) -> Option<Self> {
        if let Some(p) = attributes.vertex(name).filter(|p| fits(p, &components)) {
            return Some(Self {
                values: Cow::Borrowed(&p.values),
                components: p.components,
                indices: None,
            });
        }
        let p = attributes.corner(name)?;
        let is_there = components.contains(&p.components) && p.indices.iter().any(|&i| i != NONE);
        is_there.then(|| Self {
            values: Cow::Borrowed(&p.values),
            components: p.components,
            indices: Some(distinct(&p.values, p.components, &p.indices)),
        })
    }

    fn value<const N: usize>(&self, number: usize) -> [f64; N] {
        let mut value = [0.0; N];
        for (k, x) in value.iter_mut().enumerate().take(self.components) {
            *x = self.values.get(number * self.components + k).unwrap_or(0.0);
        }
        value
    }
}

fn fits(property: &Property, components: &std::ops::RangeInclusive<usize>) -> bool {
    components.contains(&property.components) && !is_list(&property.values)
}

/// Merges the indices of equal values, so that no vertex is split unnecessarily.
fn distinct(values: &Values, components: usize, indices: &[u32]) -> Vec<u32> {
    let mut first: HashMap<[u64; 4], u32> = HashMap::new();
    let mut number = vec![NONE; values.len().checked_div(components).unwrap_or(0)];
    let mut out = Vec::with_capacity(indices.len());
    for &index in indices {
        let Some(number) = number.get_mut(index as usize) else {
            out.push(NONE);
            continue;
        };
        if *number == NONE {
            let mut bits = [0; 4];
            for (k, bits) in bits.iter_mut().enumerate().take(components) {
                let value = values.get(index as usize * components + k).unwrap_or(0.0);
                *bits = value.to_bits();
            }
            *number = *first.entry(bits).or_insert(index);
        }
        out.push(*number);
    }
    out
}

/// The vertices of the new file.
struct Split<'a> {
    normal: Option<Column<'a>>,
    uv: Option<Column<'a>>,
    color: Option<Column<'a>>,
    /// For each new vertex, the old one and its value indices for normals, UVs and colours.
    vertices: Vec<(u32, [u32; 3])>,
    /// The faces as indices of new vertices.
    faces: FaceList,
    /// Unit normals for corners without one.
    flat: Vec<Vector3<f64>>,
}

/// Normal indices from this value on refer to face normals.
const FLAT: u32 = 1 << 31;

impl<'a> Split<'a> {
    fn new(contents: &'a Contents<'_>) -> Self {
        let attributes = &contents.attributes;
        let mut normal = Column::find(attributes, NORMAL, 3..=3);
        let uv = Column::find(attributes, UV, 2..=3);
        let color = Column::find(attributes, COLOR, 3..=4);
        let mut flat = Vec::new();
        if let Some(indices) = normal.as_mut().and_then(|n| n.indices.as_mut()) {
            // glTF normals have unit length; a corner without one gets that of its face.
            for (face, polygon) in contents.faces.iter().enumerate() {
                let corners = &mut indices[contents.faces.corner_range(face)];
                if corners.contains(&NONE) {
                    let number = FLAT + flat.len() as u32;
                    flat.push(flat_normal(&contents.positions, polygon));
                    corners
                        .iter_mut()
                        .filter(|n| **n == NONE)
                        .for_each(|n| *n = number);
                }
            }
        }
        let columns = [&normal, &uv, &color];
        // Most vertices have one combination; additional ones form a chain from the first.
        let num_vertices = contents.positions.len();
        let mut chains: Vec<Vec<[u32; 3]>> = vec![Vec::new(); num_vertices];
        let mut copies = Vec::with_capacity(contents.faces.num_corners());
        let mut numbers: HashMap<(u32, [u32; 3]), u32> = HashMap::new();
        for (corner, &v) in contents.faces.corners().iter().enumerate() {
            let key = columns.map(|column| match column {
                Some(Column {
                    indices: Some(indices),
                    ..
                }) => indices[corner],
                _ => v,
            });
            let chain = &mut chains[v as usize];
            let copy = *numbers.entry((v, key)).or_insert_with(|| {
                chain.push(key);
                (chain.len() - 1) as u32
            });
            copies.push(copy);
        }
        let mut vertices = Vec::with_capacity(num_vertices);
        let mut starts = Vec::with_capacity(num_vertices);
        for (v, chain) in (0u32..).zip(&chains) {
            starts.push(vertices.len() as u32);
            if chain.is_empty() {
                // An unused vertex has the values at its own index, or none.
                let own = columns.map(|column| match column {
                    Some(Column { indices: None, .. }) => v,
                    _ => NONE,
                });
                vertices.push((v, own));
            }
            vertices.extend(chain.iter().map(|&key| (v, key)));
        }
        let mut corner = 0;
        let faces = contents.faces.iter().map(|polygon| {
            let new = polygon.iter().map(|&v| {
                corner += 1;
                starts[v as usize] + copies[corner - 1]
            });
            new.collect::<Vec<u32>>()
        });
        let faces = faces.collect();
        Self {
            normal,
            uv,
            color,
            vertices,
            faces,
            flat,
        }
    }

    /// The unit normal of a new vertex.
    fn normal(&self, column: &Column<'_>, number: u32) -> [f32; 3] {
        let normal = match number.checked_sub(FLAT) {
            Some(flat) => self.flat.get(flat as usize).copied().unwrap_or_default(),
            None => column.value::<3>(number as usize).into(),
        };
        let unit = normal
            .try_normalize(0.0)
            .filter(|n| n.iter().all(|x| x.is_finite()));
        let unit = match unit {
            // A normal that already has unit length keeps its bits.
            Some(_) if (normal.norm() - 1.0).abs() < 1e-6 => normal,
            Some(unit) => unit,
            None => Vector3::z(),
        };
        [unit.x as f32, unit.y as f32, unit.z as f32]
    }
}

/// The unit normal of a polygon (Newell), or up if it has none.
fn flat_normal(positions: &[Point3<f64>], polygon: &[u32]) -> Vector3<f64> {
    let p = |k: usize| positions[polygon[k % polygon.len()] as usize];
    let sum: Vector3<f64> = (1..polygon.len())
        .map(|k| (p(k) - p(0)).cross(&(p(k + 1) - p(0))))
        .sum();
    sum.try_normalize(0.0).unwrap_or_else(Vector3::z)
}

/// The parts of a new file.
#[derive(Default)]
struct NewFile {
    data: Vec<u8>,
    views: Vec<String>,
    accessors: Vec<String>,
    has_materials: bool,
}

const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

impl NewFile {
    /// Completes a view that started at this byte.
    fn view(&mut self, start: usize, target: u32, stride: Option<usize>) -> usize {
        let stride = stride.map(|stride| format!(",\"byteStride\":{stride}"));
        let stride = stride.unwrap_or_default();
        self.end_view(start, &format!("{stride},\"target\":{target}"))
    }

    /// Completes a view that started at this byte, with additional members.
    fn end_view(&mut self, start: usize, members: &str) -> usize {
        self.views.push(format!(
            "{{\"buffer\":0,\"byteOffset\":{start},\"byteLength\":{}{members}}}",
            self.data.len() - start,
        ));
        self.data.resize(self.data.len().next_multiple_of(4), 0);
        self.views.len() - 1
    }

    fn accessor(&mut self, view: usize, count: usize, text: &str) -> usize {
        let text = format!("{{\"bufferView\":{view},\"count\":{count},{text}}}");
        self.accessors.push(text);
        self.accessors.len() - 1
    }

    /// The attributes of all primitives, as JSON.
    fn attributes(
        &mut self,
        split: &Split<'_>,
        positions: &[Point3<f64>],
        origin: &Point3<f64>,
    ) -> Result<String, IoError> {
        let count = split.vertices.len();
        let mut singles = Vec::with_capacity(count);
        for &(vertex, _) in &split.vertices {
            let p = Point3::from(positions[vertex as usize] - origin);
            if let Some(&value) = p.iter().find(|&&x| !(x as f32).is_finite()) {
                return Err(IoError::DoesNotFit {
                    vertex: vertex as usize,
                    value,
                    number_type: "float",
                });
            }
            singles.push([p.x as f32, p.y as f32, p.z as f32]);
        }
        let bounds = limits(singles.iter().map(|p| p.map(f64::from)));
        let text = format!(
            "\"componentType\":5126,\"type\":\"VEC3\",\"min\":{},\"max\":{}",
            array(&bounds[0]),
            array(&bounds[1])
        );
        let accessor = self.floats(singles.as_flattened(), count, &text);
        let mut attributes = format!("\"POSITION\":{accessor}");
        if let Some(column) = &split.normal {
            let normals = split
                .vertices
                .iter()
                .map(|&(_, [n, ..])| split.normal(column, n));
            let normals: Vec<[f32; 3]> = normals.collect();
            let text = "\"componentType\":5126,\"type\":\"VEC3\"";
            let accessor = self.floats(normals.as_flattened(), count, text);
            attributes.push_str(&format!(",\"NORMAL\":{accessor}"));
        }
        if let Some(column) = &split.uv {
            let uvs = split.vertices.iter().map(|&(_, [_, n, _])| match n {
                NONE => [0.0; 2],
                n => {
                    let [u, v] = column.value(n as usize);
                    // Pointing down, as in glTF.
                    [u as f32, (1.0 - v) as f32].map(finite)
                }
            });
            let uvs: Vec<[f32; 2]> = uvs.collect();
            let text = "\"componentType\":5126,\"type\":\"VEC2\"";
            let accessor = self.floats(uvs.as_flattened(), count, text);
            attributes.push_str(&format!(",\"TEXCOORD_0\":{accessor}"));
        }
        if let Some(column) = &split.color {
            let accessor = self.colors(split, column);
            attributes.push_str(&format!(",\"COLOR_0\":{accessor}"));
        }
        Ok(attributes)
    }

    fn floats(&mut self, values: &[f32], count: usize, text: &str) -> usize {
        let start = self.data.len();
        self.data
            .extend(values.iter().flat_map(|x| x.to_le_bytes()));
        let view = self.view(start, VERTICES, None);
        self.accessor(view, count, text)
    }

    /// Writes colours in their own type if glTF supports it, otherwise as real numbers.
    fn colors(&mut self, split: &Split<'_>, column: &Column<'_>) -> usize {
        let start = self.data.len();
        let (code, size) = match &*column.values {
            Values::U8(_) => (5121, 1),
            Values::U16(_) => (5123, 2),
            _ => (5126, 4),
        };
        let unit = column.values.unit();
        // Elements start at multiples of four bytes.
        let stride = (size * column.components).next_multiple_of(4);
        for &(_, [.., n]) in &split.vertices {
            let value: [f64; 4] = match n {
                NONE => [unit; 4],
                n => column.value(n as usize),
            };
            for &x in value.iter().take(column.components) {
                match size {
                    1 => self.data.push(x as u8),
                    2 => self.data.extend((x as u16).to_le_bytes()),
                    _ => self.data.extend(finite((x / unit) as f32).to_le_bytes()),
                }
            }
            self.data.resize(self.data.len().next_multiple_of(4), 0);
        }
        let view = self.view(start, VERTICES, Some(stride));
        let text = format!(
            "\"componentType\":{code},\"type\":\"VEC{}\"{}",
            column.components,
            if code == 5126 {
                ""
            } else {
                ",\"normalized\":true"
            }
        );
        self.accessor(view, split.vertices.len(), &text)
    }

    /// Writes one primitive per material, in index order, and one for faces without a material.
    fn primitives(
        &mut self,
        split: &Split<'_>,
        positions: &[Point3<f64>],
        materials: Option<&Labels>,
        attributes: &str,
        recuts: &Recuts,
    ) -> Vec<String> {
        let places: Vec<Point3<f64>> = split
            .vertices
            .iter()
            .map(|&(v, _)| positions[v as usize])
            .collect();
        let mut cutter = Cutter::new(&places, split.faces.num_corners(), recuts);
        // The last list contains the faces without a material.
        let num_materials = materials.map_or(0, |labels| labels.names.len());
        let mut lists: Vec<Vec<u32>> = vec![Vec::new(); num_materials + 1];
        for (face, polygon) in split.faces.iter().enumerate() {
            let label = materials.and_then(|labels| labels.faces.get(face).copied());
            let label = label.map_or(num_materials, |l| (l as usize).min(num_materials));
            cutter.cut(face as u32, polygon, |triangle| {
                lists[label].extend_from_slice(&triangle)
            });
        }
        // The largest value of an index type is reserved.
        let is_small = split.vertices.len() <= usize::from(u16::MAX);
        let mut primitives = Vec::new();
        for (label, list) in lists
            .iter()
            .enumerate()
            .filter(|(_, list)| !list.is_empty())
        {
            let start = self.data.len();
            let code = if is_small {
                self.data
                    .extend(list.iter().flat_map(|&i| (i as u16).to_le_bytes()));
                5123
            } else {
                self.data.extend(list.iter().flat_map(|&i| i.to_le_bytes()));
                5125
            };
            let view = self.view(start, INDICES, None);
            let text = format!("\"componentType\":{code},\"type\":\"SCALAR\"");
            let accessor = self.accessor(view, list.len(), &text);
            let material = if label < num_materials {
                self.has_materials = true;
                format!(",\"material\":{label}")
            } else {
                String::new()
            };
            primitives.push(format!(
                "{{\"attributes\":{{{attributes}}},\"indices\":{accessor}{material}}}"
            ));
        }
        primitives
    }
}

impl NewFile {
    /// Writes the materials, textures and images as members of the root. The bytes of the images
    /// are added to the data.
    fn materials(
        &mut self,
        labels: Option<&Labels>,
        materials: &Materials,
    ) -> Result<String, IoError> {
        let names = labels.filter(|_| self.has_materials);
        let names = names.map_or(&[][..], |labels| &labels.names);
        let mut list = Cow::Borrowed(&materials.list);
        if list.is_empty() {
            // Only the names of these are known.
            list = Cow::Owned(names.iter().map(Material::named).collect());
        }
        if list.is_empty() {
            return Ok(String::new());
        }
        let mut views = Vec::with_capacity(materials.images.len());
        for image in &materials.images {
            let start = self.data.len();
            self.data.extend_from_slice(image.bytes());
            views.push(self.end_view(start, ""));
        }
        new_materials::members(&list, &materials.images, &views)
    }
}

fn finite(x: f32) -> f32 {
    if x.is_finite() { x } else { 0.0 }
}
