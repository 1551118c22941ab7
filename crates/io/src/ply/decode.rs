//! Decoding of the PLY data beyond positions and faces, on request.

use std::collections::HashMap;

use foldhash::fast::RandomState;

use crate::attributes::{Attributes, CornerProperty, NONE, Property, UV, Values};
use crate::error::{IoError, quote};
use crate::faces::FaceList;
use crate::text::decode;

use super::PlyFile;
use super::groups::{self, Group};
use super::layout::{Element, ElementKind};
use super::rows::{Cell, Encoded, RowName, Walk, put, with_encoding, zeros};

/// The name of the list of texture coordinates at the corners of a face.
pub(super) const TEXCOORD: &str = "texcoord";

/// Decodes the attributes of a file with these faces.
pub(super) fn attributes(file: &PlyFile, faces: &FaceList) -> Result<Attributes, IoError> {
    let mut attributes = Attributes {
        vertices: with_encoding!(file.layout.encoding, properties(file, ElementKind::Vertex))?,
        faces: with_encoding!(file.layout.encoding, properties(file, ElementKind::Face))?,
        comments: file
            .layout
            .comments
            .iter()
            .map(|comment| decode(&file.bytes[comment.clone()]))
            .collect(),
        ..Attributes::default()
    };
    if let Some(i) = attributes.faces.iter().position(|p| p.name == TEXCOORD)
        && let Some(uv) = corner_uv(&attributes.faces[i].values, faces)
    {
        attributes.faces.remove(i);
        attributes.corners.push(uv);
    }
    Ok(attributes)
}

fn properties<E: Encoded>(file: &PlyFile, kind: ElementKind) -> Result<Vec<Property>, IoError> {
    let Some(number) = file.layout.find(kind) else {
        return Ok(Vec::new());
    };
    let element = &file.layout.elements[number];
    let groups = groups::of(element);
    if groups.is_empty() {
        return Ok(Vec::new());
    }
    let start = file.elements[number];
    let columns = match E::columns_fast(&file.bytes[start..], element, &groups) {
        Some(columns) => columns,
        None => columns::<E>(&file.bytes, start, element, &groups)?,
    };
    let properties = groups.into_iter().zip(columns);
    Ok(properties
        .map(|(group, values)| Property {
            name: group.name,
            components: group.members.len(),
            values,
        })
        .collect())
}

/// The values of each group, row by row.
fn columns<E: Encoded>(
    bytes: &[u8],
    start: usize,
    element: &Element,
    groups: &[Group],
) -> Result<Vec<Values>, IoError> {
    // Rows were counted when the file was read, so there are bytes for each number.
    let empty = |group: &Group| match group.is_list {
        true => Values::Lists {
            ends: Vec::new(),
            items: Box::new(zeros(group.number, 0)),
        },
        false => zeros(group.number, group.members.len() * element.count),
    };
    let mut columns: Vec<Values> = groups.iter().map(empty).collect();
    let mut walk = Walk::new(bytes, start, element);
    for number in 0..element.count {
        let name = RowName { element, number };
        let Some(row) = walk.next::<E>() else {
            return Err(E::too_short(bytes, bytes.len(), 0, name));
        };
        for (group, values) in groups.iter().zip(&mut columns) {
            let first = number * group.members.len();
            for (component, &member) in group.members.iter().enumerate() {
                let cell = &walk.cells[member];
                let good = match &mut *values {
                    Values::Lists { ends, items } => {
                        let good = E::items(bytes, cell, group.number, items);
                        ends.push(items.len());
                        good
                    }
                    values => E::number(&bytes[cell.span.clone()], group.number)
                        .map(|value| put(values, first + component, value)),
                };
                good.ok_or_else(|| bad::<E>(bytes, row.start, cell, group, name))?;
            }
        }
    }
    Ok(columns)
}

/// The error for a number, or for the first invalid item of a list.
fn bad<E: Encoded>(
    bytes: &[u8],
    row: usize,
    cell: &Cell,
    group: &Group,
    name: RowName<'_>,
) -> IoError {
    let mut word = cell.span.clone();
    if group.is_list {
        let mut at = cell.items.start;
        while let Some(item) = E::next(bytes, at, group.number).filter(|i| i.end <= cell.items.end)
        {
            at = item.end;
            word = item;
            if E::number(&bytes[word.clone()], group.number).is_none() {
                break;
            }
        }
    }
    IoError::BadNumber {
        place: E::place(bytes, row),
        element: name.quoted(),
        text: quote(&bytes[word]),
        expected: group.number.expected(),
    }
}

/// Texture coordinates of corners, if every list holds two numbers per corner or is empty.
///
/// Equal pairs become one entry, in the order of first use, as in an OBJ.
fn corner_uv(lists: &Values, faces: &FaceList) -> Option<CornerProperty> {
    let Values::Lists { ends, items } = lists else {
        return None;
    };
    let mut start = 0;
    for (&end, polygon) in ends.iter().zip(faces.iter()) {
        let length = end - start;
        if length != 0 && length != 2 * polygon.len() {
            return None;
        }
        start = end;
    }
    if items.is_empty() {
        return None;
    }
    let mut numbers: HashMap<[u64; 2], u32, RandomState> = HashMap::default();
    let mut table: Vec<usize> = Vec::new();
    let mut indices = Vec::new();
    let mut start = 0;
    for (&end, polygon) in ends.iter().zip(faces.iter()) {
        if start == end {
            indices.resize(indices.len() + polygon.len(), NONE);
        }
        for pair in (start..end).step_by(2) {
            let bits = |at: usize| items.get(at).map_or(0, f64::to_bits);
            let number = numbers
                .entry([bits(pair), bits(pair + 1)])
                .or_insert_with(|| {
                    table.push(pair / 2);
                    (table.len() - 1) as u32
                });
            indices.push(*number);
        }
        start = end;
    }
    Some(CornerProperty {
        name: UV.to_owned(),
        components: 2,
        values: items.gather(2, table.into_iter()),
        indices,
    })
}
