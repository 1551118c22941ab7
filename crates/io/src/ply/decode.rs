//! What a PLY file says beyond positions and faces, decoded on request.

use std::collections::HashMap;

use foldhash::fast::RandomState;

use crate::attributes::{Attributes, CornerProperty, NONE, Property, UV, Values};
use crate::error::{IoError, quote};
use crate::faces::FaceList;

use super::PlyFile;
use super::groups::{self, Group};
use super::layout::ElementKind;
use super::rows::{Encoded, RowName, Walk, put, with_encoding, zeros};

/// The list of texture coordinates of the corners of a face.
pub(super) const TEXCOORD: &str = "texcoord";

/// The attributes of a file with these faces.
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

/// Text of unknown encoding: UTF-8, or else Latin-1.
fn decode(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
    }
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
    // Rows were counted when the file was read: there are bytes for each number.
    let mut columns: Vec<Values> = groups
        .iter()
        .map(|group| {
            if group.is_list {
                Values::Lists {
                    ends: Vec::new(),
                    items: Box::new(zeros(group.number, 0)),
                }
            } else {
                zeros(group.number, group.members.len() * element.count)
            }
        })
        .collect();
    let bytes = &file.bytes;
    let mut walk = Walk::new(bytes, file.elements[number], element);
    for row in 0..element.count {
        let name = RowName {
            element,
            number: row,
        };
        let Some(span) = walk.next::<E>() else {
            return Err(E::too_short(bytes, bytes.len(), 0, name));
        };
        let bad = |word: &[u8], group: &Group| IoError::BadNumber {
            place: E::place(bytes, span.start),
            element: name.quoted(),
            text: quote(word),
            expected: group.number.expected(),
        };
        for (group, values) in groups.iter().zip(&mut columns) {
            if let Values::Lists { ends, items } = values {
                let mut at = walk.cells[group.members[0]].items.start;
                for _ in 0..walk.cells[group.members[0]].length {
                    let word = E::next(bytes, at, group.number)
                        .ok_or_else(|| E::too_short(bytes, span.start, 1, name))?;
                    at = word.end;
                    let word = &bytes[word];
                    let value = E::number(word, group.number).ok_or_else(|| bad(word, group))?;
                    let end = items.len();
                    put(items, end, value);
                }
                ends.push(items.len());
                continue;
            }
            let start = row * group.members.len();
            for (component, &member) in group.members.iter().enumerate() {
                let word = &bytes[walk.cells[member].span.clone()];
                let value = E::number(word, group.number).ok_or_else(|| bad(word, group))?;
                put(values, start + component, value);
            }
        }
    }
    let properties = groups.into_iter().zip(columns);
    Ok(properties
        .map(|(group, values)| Property {
            name: group.name,
            components: group.members.len(),
            values,
        })
        .collect())
}

/// Texture coordinates of corners, if the lists hold two numbers a corner, or nothing.
///
/// Equal pairs become one entry, in the order of first use, as an OBJ has them.
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
