//! New OFF files.

use std::fmt::Write as _;

use super::COLOR_INDEX;
use crate::attributes::{Attributes, COLOR, NORMAL, Property, UV, Values};
use crate::contents::{Contents, lost_properties};
use crate::error::IoError;
use crate::number;

/// Lists what a new OFF file cannot represent.
pub(crate) fn losses(contents: &Contents<'_>) -> Vec<String> {
    let attributes = contents.attributes.as_ref();
    let kept = Kept::of(attributes);
    let is_lost = |p: &&Property| !kept.all().any(|kept| std::ptr::eq(kept, *p));
    let vertices = attributes.vertices.iter().filter(is_lost);
    let faces = attributes.faces.iter().filter(is_lost);
    let mut losses = lost_properties(vertices, faces, attributes.corners.iter());
    losses.extend(contents.lost_names());
    losses
}

/// The properties that OFF can represent.
struct Kept<'a> {
    normals: Option<&'a Property>,
    colors: Option<&'a Property>,
    uvs: Option<&'a Property>,
    face_colors: Option<&'a Property>,
    indices: Option<&'a Property>,
}

impl<'a> Kept<'a> {
    fn of(attributes: &'a Attributes) -> Self {
        let find = |properties: &'a [Property], name: &str, components: &[usize]| {
            properties.iter().find(|p| {
                p.name == name
                    && components.contains(&p.components)
                    && !matches!(p.values, Values::Lists { .. })
            })
        };
        let (vertices, faces) = (&attributes.vertices, &attributes.faces);
        let is_whole = |p: &&Property| !matches!(p.values, Values::F32(_) | Values::F64(_));
        Self {
            normals: find(vertices, NORMAL, &[3]),
            colors: find(vertices, COLOR, &[3, 4]),
            uvs: find(vertices, UV, &[2]),
            face_colors: find(faces, COLOR, &[3, 4]),
            indices: find(faces, COLOR_INDEX, &[1]).filter(is_whole),
        }
    }

    fn all(&self) -> impl Iterator<Item = &'a Property> {
        [
            self.normals,
            self.colors,
            self.uvs,
            self.face_colors,
            self.indices,
        ]
        .into_iter()
        .flatten()
    }
}

/// Writes a new OFF file; the header word determines the values after x y z.
pub(crate) fn write_new(contents: &Contents<'_>) -> Result<Vec<u8>, IoError> {
    let (positions, faces) = (&contents.positions, &contents.faces);
    let kept = Kept::of(&contents.attributes);
    let mut out = String::new();
    for (prefix, property) in [("ST", kept.uvs), ("C", kept.colors), ("N", kept.normals)] {
        if property.is_some() {
            out.push_str(prefix);
        }
    }
    out.push_str("OFF\n");
    let comments = contents.attributes.comments.iter();
    for line in comments.flat_map(|comment| comment.split(['\n', '\r'])) {
        let blank = if line.is_empty() { "" } else { " " };
        // Writing to a String cannot fail.
        let _ = writeln!(out, "#{blank}{line}");
    }
    let _ = writeln!(out, "{} {} 0", positions.len(), faces.len());
    let colors = kept.colors.map(Colors::new);
    for (vertex, p) in positions.iter().enumerate() {
        for (axis, &x) in p.iter().enumerate() {
            if axis > 0 {
                out.push(' ');
            }
            number::push_f64(&mut out, x);
        }
        if let Some(p) = kept.normals {
            push_numbers(&mut out, p, vertex);
        }
        if let Some(colors) = &colors {
            colors.push(&mut out, vertex);
        }
        if let Some(p) = kept.uvs {
            push_numbers(&mut out, p, vertex);
        }
        out.push('\n');
    }
    let colors = kept.face_colors.map(Colors::new);
    for (face, polygon) in faces.iter().enumerate() {
        let _ = write!(out, "{}", polygon.len());
        for v in polygon {
            let _ = write!(out, " {v}");
        }
        let index = kept.indices.and_then(|p| p.values.get(face));
        match index.filter(|&index| index >= 0.0) {
            Some(index) => {
                let _ = write!(out, " {index}");
            }
            None => {
                if let Some(colors) = &colors {
                    colors.push(&mut out, face);
                }
            }
        }
        out.push('\n');
    }
    Ok(out.into_bytes())
}

fn push_numbers(out: &mut String, property: &Property, element: usize) {
    let components = property.components;
    for index in components * element..components * (element + 1) {
        out.push(' ');
        push_number(out, &property.values, index);
    }
}

/// Appends the shortest number that parses back to the same bits.
fn push_number(out: &mut String, values: &Values, index: usize) {
    match values {
        Values::F32(v) => number::push_f32(out, v.get(index).copied().unwrap_or_default()),
        _ => number::push_f64(out, values.get(index).unwrap_or_default()),
    }
}

/// Colours as text: bytes as integers, everything else as real numbers.
struct Colors<'a> {
    property: &'a Property,
    /// The divisor of integers; `None` if they are written unchanged.
    largest: Option<f64>,
}

impl<'a> Colors<'a> {
    fn new(property: &'a Property) -> Self {
        let largest = match &property.values {
            // Colours of only zeros and ones would be read as real numbers.
            Values::U8(v) if v.iter().any(|&x| x > 1) => None,
            values => Some(values.unit()),
        };
        Self { property, largest }
    }

    fn push(&self, out: &mut String, element: usize) {
        let components = self.property.components;
        let values = &self.property.values;
        for index in components * element..components * (element + 1) {
            out.push(' ');
            let start = out.len();
            match (self.largest, values) {
                (Some(1.0), _) | (None, _) => push_number(out, values, index),
                (Some(largest), _) => {
                    number::push_f64(out, values.get(index).unwrap_or_default() / largest);
                }
            }
            let is_integer = out[start..]
                .bytes()
                .all(|b| b.is_ascii_digit() || b == b'-');
            // The decimal point distinguishes a real number from an integer.
            if self.largest.is_some() && is_integer {
                out.push_str(".0");
            }
        }
    }
}
