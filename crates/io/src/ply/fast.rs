//! Bulk reading of the most common binary rows.

use std::slice::ChunksExact;

use nalgebra::Point3;

use crate::attributes::Values;
use crate::error::IoError;
use crate::faces::FaceList;
use crate::room;

use super::binary::ByteOrder;
use super::groups::Group;
use super::layout::{Element, ElementKind, NumberType, Property};
use super::read::Body;

/// Reads rows from `at`, and returns their number and the offset after them.
pub(super) fn read<B: ByteOrder>(
    bytes: &[u8],
    at: usize,
    element: &Element,
    body: &mut Body<'_>,
) -> Result<(usize, usize), IoError> {
    let rest = &bytes[at.min(bytes.len())..];
    let (size, num_rows) = match (element.kind, element.stride()) {
        (ElementKind::Vertex, Some(size)) => (size, vertices::<B>(rest, element, size, body)?),
        (ElementKind::Face, _) => triangles::<B>(rest, element, body)?,
        (ElementKind::Edge | ElementKind::Other, Some(size)) => {
            let there = rest.len().checked_div(size).unwrap_or(0);
            (size, there.min(element.count))
        }
        _ => (0, 0),
    };
    Ok((num_rows, at + num_rows * size))
}

/// Reads vertices from rows of a fixed size, up to the first that is not finite.
fn vertices<B: ByteOrder>(
    rest: &[u8],
    element: &Element,
    size: usize,
    body: &mut Body<'_>,
) -> Result<usize, IoError> {
    let mut places = [(0, NumberType::F32); 3];
    let mut offset = 0;
    for property in &element.properties {
        if let Property::Coordinate(axis, number) = *property {
            places[axis] = (offset, number);
        }
        offset += property.fixed_size().unwrap_or(0);
    }
    let offsets = places.map(|(offset, _)| offset);
    let types = places.map(|(_, number)| number);
    if size == 0 {
        return Ok(0);
    }
    let num_rows = (rest.len() / size).min(element.count);
    let rows = rest[..num_rows * size].chunks_exact(size);
    body.positions.clear();
    room::reserve_exact(&mut body.positions, num_rows)?;
    match types {
        [NumberType::F32, NumberType::F32, NumberType::F32] => {
            body.positions.extend(rows.map(|row| {
                let single = |at| f64::from(f32::from_le_bytes(number::<B, 4>(row, at)));
                Point3::from(offsets.map(single))
            }));
        }
        [NumberType::F64, NumberType::F64, NumberType::F64] => {
            body.positions.extend(rows.map(|row| {
                Point3::from(offsets.map(|at| f64::from_le_bytes(number::<B, 8>(row, at))))
            }));
        }
        _ => return Ok(0),
    }
    // Check in chunks, which needs no branch per vertex.
    let is_finite = |p: &Point3<f64>| p.iter().fold(true, |all, x| all & x.is_finite());
    let num_finite = body
        .positions
        .chunks(1024)
        .position(|chunk| !chunk.iter().fold(true, |all, p| all & is_finite(p)))
        .map(|chunk| {
            let start = 1024 * chunk;
            let finite = body.positions[start..].iter().position(|p| !is_finite(p));
            start + finite.unwrap_or(0)
        });
    if let Some(num_finite) = num_finite {
        body.positions.truncate(num_finite);
    }
    Ok(body.positions.len())
}

/// Reads leading triangles from rows with a list of corners and otherwise only scalars, and
/// returns the row size and the number of rows.
fn triangles<B: ByteOrder>(
    rest: &[u8],
    element: &Element,
    body: &mut Body<'_>,
) -> Result<(usize, usize), IoError> {
    let Some((before, after)) = beside_corners(element) else {
        return Ok((0, 0));
    };
    let size = before + 13 + after;
    let num_rows = (rest.len() / size).min(element.count);
    // Rows that exceed a limit are left to the general walk, which reports the offending row.
    let is_within = body.check_corners(num_rows.saturating_mul(3)).is_ok()
        && body.limits.check_degree(3).is_ok();
    if !is_within {
        return Ok((0, 0));
    }
    let mut corners: Vec<u32> = Vec::new();
    room::reserve_exact(&mut corners, 3 * num_rows)?;
    corners.resize(3 * num_rows, 0);
    let num_vertices = u32::try_from(body.num_vertices).unwrap_or(u32::MAX);
    let rows = rest[..num_rows * size].chunks_exact(size);
    let mut num_good = 0;
    for (row, triangle) in rows.zip(corners.as_chunks_mut::<3>().0) {
        let Some(list) = row[before..].first_chunk::<13>() else {
            break;
        };
        *triangle = [1, 5, 9].map(|at| u32::from_le_bytes(number::<B, 4>(list, at)));
        // As unsigned numbers, negative indices are large.
        let largest = triangle[0].max(triangle[1]).max(triangle[2]);
        if list[0] != 3 || largest >= num_vertices {
            break;
        }
        num_good += 1;
    }
    corners.truncate(3 * num_good);
    body.faces = FaceList::from_triangles(corners)?;
    Ok((size, num_good))
}

/// The number of bytes before and after the list of corners, if all other properties have a fixed
/// size.
fn beside_corners(element: &Element) -> Option<(usize, usize)> {
    let (mut before, mut after) = (0, 0);
    let mut has_corners = false;
    for property in &element.properties {
        match *property {
            Property::Corners(
                NumberType::U8 | NumberType::I8,
                NumberType::I32 | NumberType::U32,
            ) => has_corners = true,
            other if has_corners => after += other.fixed_size()?,
            other => before += other.fixed_size()?,
        }
    }
    Some((before, after))
}

/// Reads the columns of `rows`, which have a fixed size.
pub(super) fn columns<B: ByteOrder>(
    rows: &[u8],
    element: &Element,
    groups: &[Group],
) -> Option<Vec<Values>> {
    let size = element.stride().filter(|&size| size > 0)?;
    let rows = rows.get(..size.checked_mul(element.count)?)?;
    let mut offsets = Vec::with_capacity(element.properties.len());
    let mut offset = 0;
    for property in &element.properties {
        offsets.push(offset);
        offset += property.fixed_size()?;
    }
    let column = |group: &Group| {
        let at: Vec<usize> = group
            .members
            .iter()
            .map(|&member| offsets[member])
            .collect();
        let rows = rows.chunks_exact(size);
        macro_rules! values {
            ($($kind:ident: $number:ty),+) => {
                match group.number {
                    $(NumberType::$kind => Values::$kind(gather(rows, &at, |row, at| {
                        <$number>::from_le_bytes(number::<B, { size_of::<$number>() }>(row, at))
                    })),)+
                }
            };
        }
        values!(I8: i8, U8: u8, I16: i16, U16: u16, I32: i32, U32: u32, F32: f32, F64: f64)
    };
    Some(groups.iter().map(column).collect())
}

fn gather<T>(
    rows: ChunksExact<'_, u8>,
    offsets: &[usize],
    read: impl Fn(&[u8], usize) -> T,
) -> Vec<T> {
    let mut out = Vec::with_capacity(rows.len() * offsets.len());
    for row in rows {
        out.extend(offsets.iter().map(|&at| read(row, at)));
    }
    out
}

/// The bytes of a number in a sufficiently long row, in little-endian order.
#[inline(always)]
fn number<B: ByteOrder, const N: usize>(row: &[u8], at: usize) -> [u8; N] {
    B::little(
        row.get(at..)
            .and_then(|rest| rest.first_chunk())
            .copied()
            .unwrap_or([0; N]),
    )
}
