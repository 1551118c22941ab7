//! Binary STL: 80 arbitrary bytes, the number of facets, and 50 bytes per facet, in little-endian
//! order.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::Point3;

use super::ATTRIBUTE;
use super::new::TITLE_TEXT;
use super::rebuild::{self, Facet};
use super::soup::Soup;
use crate::attributes::{Attributes, NORMAL, Property, Values};
use crate::error::{Element, IoError, Place, Warning};
use crate::format::Format;
use crate::limits::Limits;
use crate::precision;
use crate::remap::Remap;
use crate::room;
use crate::source::{Mesh, Moves, Reading, SourceFile};

/// Number of bytes before the first facet.
pub(super) const HEADER: usize = 84;
/// Number of header bytes without meaning.
pub(super) const TITLE: usize = 80;
/// Size of a facet: the normal, three corners, two attribute bytes.
pub(super) const FACET: usize = 50;
/// Offset of the attribute bytes in a facet.
const ATTRIBUTE_AT: usize = 48;
/// Size of a normal or a corner.
const TRIPLE: usize = 12;

/// The number of facets that the header promises; `None` if the file is too short for one.
pub(super) fn count(bytes: &[u8]) -> Option<u32> {
    let count = bytes.get(TITLE..HEADER)?;
    Some(u32::from_le_bytes(count.try_into().ok()?))
}

/// The length of a file with `count` facets.
pub(super) fn length(count: u32) -> u64 {
    HEADER as u64 + FACET as u64 * u64::from(count)
}

pub(super) fn read(bytes: Vec<u8>, limits: &Limits) -> Result<Reading, IoError> {
    let promised = count(&bytes).unwrap_or(0);
    let body = bytes.get(HEADER..).unwrap_or(&[]);
    let present = body.len() / FACET;
    let num_facets = promised as usize;
    if present < num_facets {
        return Err(IoError::CutShort {
            place: Place::Byte(bytes.len()),
            element: Element::new("facet", present),
            promised: promised.into(),
        });
    }
    limits.check_faces(num_facets)?;
    limits.check_corners(num_facets.saturating_mul(3))?;
    limits.check_memory(bytes.len(), 0, num_facets.saturating_mul(3))?;
    let mut soup = Soup::new(limits, bytes.len(), num_facets);
    for (facet, row) in body.chunks_exact(FACET).take(num_facets).enumerate() {
        let corner = |k: usize| {
            let position = triple(row, k + 1);
            // Negative and positive zero are the same position.
            let place = position.map(|x| (x + 0.0).to_bits());
            (place, Point3::from(position.map(f64::from)))
        };
        let corners = [corner(0), corner(1), corner(2)];
        for (k, (_, position)) in corners.iter().enumerate() {
            if let Some(axis) = position.iter().position(|x| !x.is_finite()) {
                let at = HEADER + facet * FACET + (k + 1) * TRIPLE + 4 * axis;
                return Err(IoError::NonFinite {
                    place: Place::Byte(at),
                    vertex: soup.next_vertex(),
                    value: position[axis].to_string(),
                });
            }
        }
        soup.facet(corners)?;
    }
    let end = HEADER + FACET * num_facets;
    let mut warnings = Vec::new();
    if bytes.len() > end {
        warnings.push(Warning {
            place: Some(Place::Byte(end)),
            message: format!(
                "{} bytes follow the {promised} facets that the header promises; they are kept but not read",
                bytes.len() - end
            ),
        });
    }
    Ok(Reading::new(
        soup.finish(warnings),
        BinaryStl { bytes, num_facets },
    ))
}

/// Three numbers of a facet: its normal (0) or one of its corners (1 to 3).
fn triple(row: &[u8], k: usize) -> [f32; 3] {
    let number = |axis: usize| {
        let at = TRIPLE * k + 4 * axis;
        let bytes = row.get(at..at + 4).and_then(|b| b.try_into().ok());
        f32::from_le_bytes(bytes.unwrap_or_default())
    };
    [number(0), number(1), number(2)]
}

/// A binary STL as it was read.
#[derive(Debug)]
struct BinaryStl {
    bytes: Vec<u8>,
    num_facets: usize,
}

impl BinaryStl {
    fn rows(&self) -> impl ExactSizeIterator<Item = &[u8]> {
        let body = self.bytes.get(HEADER..).unwrap_or(&[]);
        body.chunks_exact(FACET).take(self.num_facets)
    }

    fn row(&self, facet: usize) -> &[u8] {
        let start = HEADER + FACET * facet;
        self.bytes.get(start..start + FACET).unwrap_or(&[])
    }

    /// The bytes after the last facet.
    fn tail(&self) -> &[u8] {
        let end = HEADER + FACET * self.num_facets;
        self.bytes.get(end..).unwrap_or(&[])
    }
}

impl SourceFile for BinaryStl {
    fn format(&self) -> Format {
        Format::Stl
    }

    fn num_bytes(&self) -> usize {
        self.bytes.len()
    }

    fn attributes(&self, _mesh: Mesh<'_>) -> Result<Attributes, IoError> {
        let mut faces = Vec::new();
        if self.has_normals() {
            faces.push(Property {
                name: NORMAL.to_owned(),
                components: 3,
                values: Values::F32(self.rows().flat_map(|row| triple(row, 0)).collect()),
            });
        }
        let attributes: Vec<u16> = self.rows().map(attribute).collect();
        if attributes.iter().any(|&a| a != 0) {
            faces.push(Property {
                name: ATTRIBUTE.to_owned(),
                components: 1,
                values: Values::U16(attributes),
            });
        }
        Ok(Attributes {
            faces,
            ..Attributes::default()
        })
    }

    fn has_normals(&self) -> bool {
        self.rows().any(|row| triple(row, 0) != [0.0; 3])
    }

    fn extras(&self) -> Vec<String> {
        let mut extras = Vec::new();
        let title = self.bytes.get(..TITLE).unwrap_or(&[]);
        let title = title.trim_ascii_end().split(|&b| b == 0).next();
        // The title that cotan writes carries no information.
        if title.is_some_and(|title| !title.is_empty() && title != TITLE_TEXT) {
            extras.push("the title in the header".to_owned());
        }
        match self.tail().len() {
            0 => {}
            n => extras.push(format!("{n} bytes after the last facet")),
        }
        extras
    }

    fn stored(&self, _vertex: usize, position: Point3<f64>) -> Point3<f64> {
        precision::single(position)
    }

    fn write(&self, _format: Format, moves: &Moves<'_>) -> Result<Vec<u8>, IoError> {
        let mut bytes = self.bytes.clone();
        if moves.moved.is_empty() {
            return Ok(bytes);
        }
        for (facet, polygon) in moves.mesh.faces.iter().enumerate().take(self.num_facets) {
            for (k, &v) in polygon.iter().take(3).enumerate() {
                if moves.moved[v as usize] {
                    let position = single(v, moves.mesh.positions[v as usize])?;
                    put(&mut bytes, facet, k + 1, position);
                }
            }
        }
        for &(facet, normal) in &moves.normals.faces {
            // A rotated normal has the length of the old one, which was an `f32`.
            put(&mut bytes, facet as usize, 0, normal.map(|x| x as f32));
        }
        Ok(bytes)
    }

    fn rebuild(&self, remap: &Remap, mesh: Mesh<'_>) -> Result<Arc<dyn SourceFile>, IoError> {
        let num_facets = remap.faces.len();
        let promised = u32::try_from(num_facets).map_err(|_| IoError::OverLimit {
            what: "facets of a binary STL",
            limit: u32::MAX.into(),
        })?;
        let mut bytes = Vec::new();
        let length = length(promised).saturating_add(self.tail().len() as u64);
        room::reserve_exact(&mut bytes, usize::try_from(length).unwrap_or(usize::MAX))?;
        bytes.extend_from_slice(self.bytes.get(..TITLE).unwrap_or(&[]));
        bytes.extend_from_slice(&promised.to_le_bytes());
        for face in 0..num_facets {
            let facet = Facet::new(remap, mesh, face)?;
            let mut row = [0u8; FACET];
            if let Some(source) = facet.source {
                let old = self.row(source as usize);
                row.copy_from_slice(old);
                if facet.is_turned {
                    let normal = triple(old, 0);
                    // A negative zero would be a change without meaning.
                    let flip = |x: f32| if x == 0.0 { x } else { -x };
                    set(&mut row, 0, normal.map(flip));
                }
            } else {
                let normal = rebuild::normal(&facet.positions(mesh));
                set(&mut row, 0, normal.map(|x| x as f32));
            }
            for (k, corner) in facet.corners.iter().enumerate() {
                let position = match corner.old {
                    // Copy the bytes: the positions of a vertex may differ in the sign of a zero.
                    Some(old) => triple(self.row(old as usize / 3), old as usize % 3 + 1),
                    None => single(corner.vertex, mesh.positions[corner.vertex as usize])?,
                };
                set(&mut row, k + 1, position);
            }
            bytes.extend_from_slice(&row);
        }
        bytes.extend_from_slice(self.tail());
        Ok(Arc::new(Self { bytes, num_facets }))
    }
}

fn attribute(row: &[u8]) -> u16 {
    let bytes = row.get(ATTRIBUTE_AT..FACET).and_then(|b| b.try_into().ok());
    u16::from_le_bytes(bytes.unwrap_or_default())
}

/// Converts a position to the type of the file.
pub(super) fn single(vertex: u32, position: Point3<f64>) -> Result<[f32; 3], IoError> {
    let single: [f32; 3] = position.coords.map(|x| x as f32).into();
    match single.iter().position(|x| !x.is_finite()) {
        None => Ok(single),
        Some(axis) => Err(IoError::DoesNotFit {
            vertex: vertex as usize,
            value: position[axis],
            number_type: "float",
        }),
    }
}

fn put(bytes: &mut [u8], facet: usize, k: usize, numbers: [f32; 3]) {
    let start = HEADER + FACET * facet;
    if let Some(row) = bytes.get_mut(start..start + FACET) {
        set(row, k, numbers);
    }
}

/// Replaces the normal (0) or a corner (1 to 3) of a facet.
pub(super) fn set(row: &mut [u8], k: usize, numbers: [f32; 3]) {
    for (axis, x) in numbers.into_iter().enumerate() {
        let at: Range<usize> = TRIPLE * k + 4 * axis..TRIPLE * k + 4 * axis + 4;
        if let Some(place) = row.get_mut(at) {
            place.copy_from_slice(&x.to_le_bytes());
        }
    }
}

/// Replaces the attribute bytes of a facet.
pub(super) fn set_attribute(row: &mut [u8], attribute: u16) {
    if let Some(place) = row.get_mut(ATTRIBUTE_AT..FACET) {
        place.copy_from_slice(&attribute.to_le_bytes());
    }
}
