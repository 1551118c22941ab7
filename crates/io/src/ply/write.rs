//! A new PLY file.

use ply_rs::ply::{
    Addable, DefaultElement, ElementDef, Encoding, Header, PropertyDef, PropertyType, ScalarType,
};
use ply_rs::writer::Writer;

use crate::attributes::{
    Attributes, COLOR, CornerProperty, NONE, NORMAL, Property, UV, Values, with_numbers,
};
use crate::contents::{Contents, named};
use crate::error::IoError;
use crate::faces::FaceList;

use super::decode::TEXCOORD;
use super::groups::{COLORS, NORMALS, UVS};
use super::layout::CORNERS;
use super::names::Names;

/// Lists what a new PLY file cannot represent.
pub(crate) fn losses(contents: &Contents<'_>) -> Vec<String> {
    let (faces, attributes) = (&contents.faces, &contents.attributes);
    let mut losses = Vec::new();
    let uv = texcoord(attributes);
    let others = attributes.corners.iter().filter(|&p| {
        let is_written = uv.is_some_and(|uv| std::ptr::eq(uv, p));
        !is_written && is_used(p)
    });
    losses.extend(named("corner", others.map(|p| p.name.as_str())));
    if let Some(uv) = uv {
        if uv.components > 2 {
            losses.push("further components of the texture coordinates".to_owned());
        }
        let is_mixed = |face: usize| {
            let indices = uv.indices.get(faces.corner_range(face)).unwrap_or(&[]);
            indices.contains(&NONE) && indices.iter().any(|&i| i != NONE)
        };
        if (0..faces.len()).any(is_mixed) {
            let text = "the lack of texture coordinates at corners whose face has some elsewhere";
            losses.push(text.to_owned());
        }
    }
    losses.extend(contents.lost_names());
    losses
}

/// The corner property that is written as texture coordinates.
fn texcoord(attributes: &Attributes) -> Option<&CornerProperty> {
    attributes
        .corner(UV)
        .filter(|uv| uv.components >= 2 && !matches!(uv.values, Values::Lists { .. }))
        .filter(|uv| is_used(uv))
}

fn is_used(property: &CornerProperty) -> bool {
    property.indices.iter().any(|&i| i != NONE)
}

/// Writes a binary little-endian PLY file with `double` coordinates, and properties in their own
/// types.
pub(crate) fn write_new(contents: &Contents<'_>) -> Result<Vec<u8>, IoError> {
    let (positions, faces, attributes) =
        (&contents.positions, &contents.faces, &contents.attributes);
    let mut names = Names::default();
    names.reserve(&["x", "y", "z"]);
    let vertex = columns(&attributes.vertices, &mut names);
    let mut names = Names::default();
    names.reserve(&CORNERS);
    let uv = texcoord(attributes).map(|uv| Corners {
        uv,
        length: length_type(faces.iter().map(|polygon| 2 * polygon.len())),
    });
    if uv.is_some() {
        names.reserve(&[TEXCOORD]);
    }
    let face = columns(&attributes.faces, &mut names);

    // Most readers expect a one-byte length; only larger polygons require a longer one.
    let length = length_type(faces.iter().map(<[u32]>::len));
    let size = |columns: &[Column<'_>]| columns.iter().map(Column::room).sum::<usize>();
    let mut out = Vec::with_capacity(
        1024 + 24 * positions.len() + 5 * faces.num_corners() + size(&vertex) + size(&face),
    );
    let mut header = Header::new();
    header.encoding = Encoding::BinaryLittleEndian;
    header.comments = attributes.comments.iter().map(|c| one_line(c)).collect();
    let double = || PropertyType::Scalar(ScalarType::Double);
    let mut element = element("vertex", positions.len());
    for axis in ["x", "y", "z"] {
        declare(&mut element, axis, double());
    }
    vertex
        .iter()
        .for_each(|column| column.declare(&mut element));
    header.elements.add(element);
    let mut element = self::element("face", faces.len());
    // `int` rather than `uint`, which some readers do not support; vertex indices are below 2^31.
    let list = PropertyType::List(length.clone(), ScalarType::Int);
    declare(&mut element, CORNERS[0], list);
    face.iter().for_each(|column| column.declare(&mut element));
    if let Some(corners) = &uv {
        let list = PropertyType::List(corners.length.clone(), scalar(&corners.uv.values));
        declare(&mut element, TEXCOORD, list);
    }
    header.elements.add(element);
    Writer::<DefaultElement>::new()
        .write_header(&mut out, &header)
        .map_err(IoError::Write)?;

    for (v, p) in positions.iter().enumerate() {
        p.iter()
            .for_each(|x| out.extend_from_slice(&x.to_le_bytes()));
        vertex.iter().for_each(|column| column.push(&mut out, v));
    }
    for (f, polygon) in faces.iter().enumerate() {
        push_length(&mut out, &length, polygon.len());
        for v in polygon {
            out.extend_from_slice(&v.to_le_bytes());
        }
        face.iter().for_each(|column| column.push(&mut out, f));
        if let Some(corners) = &uv {
            corners.push(&mut out, faces, f);
        }
    }
    Ok(out)
}

/// A property as the columns of a file.
struct Column<'a> {
    names: Vec<String>,
    values: &'a Values,
    /// Number of components per element; lists have one name and any number of items.
    components: usize,
    /// The type of the length of a list.
    length: Option<ScalarType>,
}

/// Properties with more components are written as a list.
const MAX_COMPONENTS: usize = 16;

fn columns<'a>(properties: &'a [Property], names: &mut Names) -> Vec<Column<'a>> {
    // Properties with conventional names get them first, wherever they are.
    let mut usual: Vec<Option<Vec<String>>> = vec![None; properties.len()];
    for common in [NORMAL, COLOR, UV] {
        let first = properties.iter().position(|p| p.name == common);
        let Some((i, of_property)) = first.and_then(|i| Some((i, usual_names(&properties[i])?)))
        else {
            continue;
        };
        names.reserve(of_property);
        if common == COLOR {
            // Otherwise a plain property of that name would be mistaken for part of the colour.
            names.reserve(&COLORS[0]);
        }
        usual[i] = Some(of_property.iter().map(|&name| name.to_owned()).collect());
    }
    let properties = properties.iter().zip(usual);
    properties
        .map(|(p, usual)| {
            let length = match &p.values {
                Values::Lists { ends, .. } => {
                    let starts = std::iter::once(&0).chain(ends);
                    let lengths = ends.iter().zip(starts).map(|(end, start)| end - start);
                    Some(length_type(lengths))
                }
                _ if p.components > MAX_COMPONENTS => {
                    Some(length_type(std::iter::once(p.components)))
                }
                _ => None,
            };
            let given = match usual {
                Some(names) => names,
                None if length.is_some() || p.components == 1 => vec![names.give(&p.name)],
                None => (0..p.components)
                    .map(|k| names.give(&format!("{}_{k}", p.name)))
                    .collect(),
            };
            Column {
                names: given,
                values: &p.values,
                components: p.components,
                length,
            }
        })
        .collect()
}

/// The names under which other programs look for a property.
fn usual_names(p: &Property) -> Option<&'static [&'static str]> {
    let is_color = matches!(
        p.values,
        Values::U8(_) | Values::U16(_) | Values::F32(_) | Values::F64(_)
    );
    match (p.name.as_str(), p.components, &p.values) {
        (_, _, Values::Lists { .. }) => None,
        (NORMAL, 3, _) => Some(&NORMALS),
        (COLOR, 3, _) if is_color => Some(&COLORS[0][..3]),
        (COLOR, 4, _) if is_color => Some(&COLORS[0]),
        (UV, 2, _) => Some(&UVS[0]),
        _ => None,
    }
}

impl Column<'_> {
    fn declare(&self, element: &mut ElementDef) {
        for name in &self.names {
            let scalar = scalar(self.values);
            let data_type = match &self.length {
                Some(length) => PropertyType::List(length.clone(), scalar),
                None => PropertyType::Scalar(scalar),
            };
            declare(element, name, data_type);
        }
    }

    /// Its approximate size in bytes.
    fn room(&self) -> usize {
        match self.values {
            Values::Lists { ends, items } => 4 * ends.len() + width(items) * items.len(),
            numbers => width(numbers) * numbers.len(),
        }
    }

    fn push(&self, out: &mut Vec<u8>, element: usize) {
        let start = element * self.components;
        match (self.values, &self.length) {
            (Values::Lists { ends, items }, Some(length)) => {
                let start = element.checked_sub(1).map_or(0, |before| ends[before]);
                push_length(out, length, ends[element] - start);
                (start..ends[element]).for_each(|i| push_number(out, items, i));
            }
            (values, length) => {
                if let Some(length) = length {
                    push_length(out, length, self.components);
                }
                (start..start + self.components).for_each(|i| push_number(out, values, i));
            }
        }
    }
}

/// Texture coordinates of corners, written as a list per face.
struct Corners<'a> {
    uv: &'a CornerProperty,
    length: ScalarType,
}

impl Corners<'_> {
    fn push(&self, out: &mut Vec<u8>, faces: &FaceList, face: usize) {
        let indices = &self.uv.indices[faces.corner_range(face)];
        if indices.iter().all(|&i| i == NONE) {
            return push_length(out, &self.length, 0);
        }
        push_length(out, &self.length, 2 * indices.len());
        for &i in indices {
            for k in 0..2 {
                // An index out of range, like a missing entry, is written as zero.
                let at = (i as usize).saturating_mul(self.uv.components);
                push_number(out, &self.uv.values, at.saturating_add(k));
            }
        }
    }
}

fn element(name: &str, count: usize) -> ElementDef {
    let mut element = ElementDef::new(name.to_owned());
    element.count = count;
    element
}

fn declare(element: &mut ElementDef, name: &str, data_type: PropertyType) {
    let property = PropertyDef::new(name.to_owned(), data_type);
    element.properties.add(property);
}

/// The smallest type for the lengths of some lists.
fn length_type(mut lengths: impl Iterator<Item = usize>) -> ScalarType {
    if lengths.all(|length| length <= usize::from(u8::MAX)) {
        ScalarType::UChar
    } else {
        ScalarType::UInt
    }
}

fn push_length(out: &mut Vec<u8>, length_type: &ScalarType, length: usize) {
    match length_type {
        ScalarType::UChar => out.push(length as u8),
        _ => out.extend_from_slice(&(length as u32).to_le_bytes()),
    }
}

/// The type of the numbers, or of the items of lists.
fn scalar(values: &Values) -> ScalarType {
    match values {
        Values::I8(_) => ScalarType::Char,
        Values::U8(_) => ScalarType::UChar,
        Values::I16(_) => ScalarType::Short,
        Values::U16(_) => ScalarType::UShort,
        Values::I32(_) => ScalarType::Int,
        Values::U32(_) => ScalarType::UInt,
        Values::F32(_) => ScalarType::Float,
        Values::F64(_) => ScalarType::Double,
        // Lists of lists are not valid attributes.
        Values::Lists { items, .. } => match &**items {
            Values::Lists { .. } => ScalarType::Double,
            numbers => scalar(numbers),
        },
    }
}

/// The size of a number in bytes.
fn width(values: &Values) -> usize {
    match scalar(values) {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}

/// Appends a number in its own type; zero past the end.
#[inline]
fn push_number(out: &mut Vec<u8>, values: &Values, index: usize) {
    fn at<T: Copy + Default>(numbers: &[T], index: usize) -> T {
        numbers.get(index).copied().unwrap_or_default()
    }
    with_numbers!(
        values,
        v => out.extend_from_slice(&at(v, index).to_le_bytes()),
        _ => out.extend_from_slice(&0f64.to_le_bytes())
    );
}

/// Removes line endings from a comment, which would break the header.
fn one_line(comment: &str) -> String {
    comment.replace(['\n', '\r'], " ")
}
