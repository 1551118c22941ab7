//! New STL files, which are binary.

use nalgebra::Point3;

use super::binary::{self, FACET, TITLE};
use super::{ATTRIBUTE, rebuild};
use crate::attributes::{NORMAL, Property, Values};
use crate::contents::{Contents, lost_properties};
use crate::error::IoError;
use crate::precision::{Rounding, single};
use crate::recut::Cutter;

/// Lists what a new STL file cannot represent.
pub(crate) fn losses(contents: &Contents<'_>) -> Vec<String> {
    let (positions, faces) = (&contents.positions, &contents.faces);
    let attributes = &contents.attributes;
    let mut losses = Vec::new();
    let is_used = faces.used_vertices(positions.len());
    match is_used.iter().filter(|&&used| !used).count() {
        0 => {}
        1 => losses.push("a vertex that no face uses".to_owned()),
        n => losses.push(format!("{n} vertices that no face uses")),
    }
    let rounding = Rounding::measure(positions, faces, |v| single(positions[v]));
    losses.extend(rounding.map(|rounding| rounding.loss()));
    match faces.iter().filter(|polygon| polygon.len() > 3).count() {
        0 => {}
        1 => losses.push("a polygon (it becomes triangles)".to_owned()),
        n => losses.push(format!("{n} polygons (they become triangles)")),
    }
    losses.extend(lost_properties(
        attributes.vertices.iter(),
        attributes.faces.iter().filter(|p| !is_kept(p)),
        attributes.corners.iter(),
    ));
    losses.extend(contents.lost_names());
    match attributes.comments.len() {
        0 => {}
        1 => losses.push("a comment".to_owned()),
        n => losses.push(format!("{n} comments")),
    }
    losses
}

fn is_kept(property: &Property) -> bool {
    is_normal(property) || is_attribute(property)
}

fn is_normal(property: &Property) -> bool {
    property.name == NORMAL
        && property.components == 3
        && !matches!(property.values, Values::Lists { .. })
}

fn is_attribute(property: &Property) -> bool {
    property.name == ATTRIBUTE
        && property.components == 1
        && matches!(property.values, Values::U16(_))
}

/// Writes a new binary STL. Polygons are triangulated, coordinates rounded to 32 bits.
///
/// A document without faces is an error.
pub(crate) fn write_new(contents: &Contents<'_>) -> Result<Vec<u8>, IoError> {
    let (positions, faces) = (&*contents.positions, &*contents.faces);
    if faces.is_empty() {
        return Err(IoError::NoFaces {
            num_vertices: positions.len(),
        });
    }
    let num_facets = faces.num_triangles();
    let too_many = || IoError::OverLimit {
        what: "facets of a binary STL",
        limit: u32::MAX.into(),
    };
    let count = u32::try_from(num_facets).map_err(|_| too_many())?;
    let properties = &contents.attributes.faces;
    let normals = properties.iter().find(|p| is_normal(p));
    let attributes = properties.iter().find(|p| is_attribute(p));

    let length = usize::try_from(binary::length(count)).map_err(|_| too_many())?;
    let mut bytes = Vec::with_capacity(length);
    bytes.extend_from_slice(TITLE_TEXT);
    bytes.resize(TITLE, 0);
    bytes.extend_from_slice(&count.to_le_bytes());
    let recuts = contents.recuts();
    let mut cutter = Cutter::new(positions, faces.num_corners(), &recuts);
    for (face, polygon) in faces.iter().enumerate() {
        let given = normals.and_then(|p| normal(p, face));
        let attribute = attributes.and_then(|p| p.values.get(face));
        // The cast is exact: the values are 16-bit integers.
        let attribute = attribute.map_or(0, |a| a as u16);
        let mut outcome = Ok(());
        cutter.cut(face as u32, polygon, |triangle| {
            if outcome.is_ok() {
                outcome = push(&mut bytes, positions, triangle, given, attribute);
            }
        });
        outcome?;
    }
    Ok(bytes)
}

/// The header; it must not start with `solid`.
pub(super) const TITLE_TEXT: &[u8] = b"cotan";

fn push(
    bytes: &mut Vec<u8>,
    positions: &[Point3<f64>],
    triangle: [u32; 3],
    given: Option<[f32; 3]>,
    attribute: u16,
) -> Result<(), IoError> {
    let corners = triangle.map(|v| positions[v as usize]);
    let normal = given.unwrap_or_else(|| rebuild::normal(&corners).map(|x| x as f32));
    let mut row = [0u8; FACET];
    binary::set(&mut row, 0, normal);
    for (k, (v, position)) in triangle.into_iter().zip(corners).enumerate() {
        binary::set(&mut row, k + 1, binary::single(v, position)?);
    }
    binary::set_attribute(&mut row, attribute);
    bytes.extend_from_slice(&row);
    Ok(())
}

/// The normal of a face as 32-bit numbers; `None` if one is too large.
fn normal(property: &Property, face: usize) -> Option<[f32; 3]> {
    let mut normal = [0.0; 3];
    for (axis, x) in normal.iter_mut().enumerate() {
        let given = property.values.get(3 * face + axis)?;
        *x = given as f32;
        if x.is_infinite() && given.is_finite() {
            return None;
        }
    }
    Some(normal)
}
