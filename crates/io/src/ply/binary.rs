//! Binary rows of either byte order, walked in place.

use nalgebra::Point3;

use crate::error::{self, IoError, Place};

use super::Body;
use super::header::Header;
use super::layout::{Element, ElementKind, Layout, NumberType, Property};

/// A byte order.
pub(super) trait ByteOrder {
    /// The bytes of a number in little-endian order.
    fn little<const N: usize>(bytes: [u8; N]) -> [u8; N];
}

/// Least significant byte first.
pub(super) struct Little;
/// Most significant byte first.
pub(super) struct Big;

impl ByteOrder for Little {
    #[inline]
    fn little<const N: usize>(bytes: [u8; N]) -> [u8; N] {
        bytes
    }
}

impl ByteOrder for Big {
    #[inline]
    fn little<const N: usize>(mut bytes: [u8; N]) -> [u8; N] {
        bytes.reverse();
        bytes
    }
}

/// Reads all rows.
pub(super) fn read<B: ByteOrder>(
    bytes: &[u8],
    header: &Header,
    layout: &Layout,
    body: &mut Body<'_>,
) -> Result<(), IoError> {
    let mut cursor = Cursor {
        bytes,
        at: header.end,
    };
    for element in &layout.elements {
        for number in 0..element.count {
            read_row::<B>(&mut cursor, element, body)?.ok_or_else(|| IoError::CutShort {
                place: Place::Byte(bytes.len()),
                element: error::Element::new(&element.name, number),
                promised: element.count as u64,
            })?;
        }
    }
    Ok(())
}

/// Reads a row; `None` if the file ends in it.
#[inline]
fn read_row<B: ByteOrder>(
    cursor: &mut Cursor<'_>,
    element: &Element,
    body: &mut Body<'_>,
) -> Result<Option<()>, IoError> {
    let start = cursor.at;
    let place = || Place::Byte(start);
    let mut position = Point3::origin();
    for property in &element.properties {
        match *property {
            Property::Coordinate(axis, number) => match cursor.real::<B>(number) {
                Some(x) => position[axis] = x,
                None => return Ok(None),
            },
            Property::Corners(length, item) => {
                let Some(bytes) = cursor.list::<B>(length, item) else {
                    return Ok(None);
                };
                // The usual type by itself: the loop below then has no branch on the type.
                if item == NumberType::I32 {
                    for index in bytes.as_chunks::<4>().0 {
                        body.push_corner(i32::from_le_bytes(B::little(*index)).into(), place)?;
                    }
                } else {
                    let mut indices = Cursor { bytes, at: 0 };
                    while let Some(index) = indices.integer::<B>(item) {
                        body.push_corner(index, place)?;
                    }
                }
            }
            other => {
                if cursor.skip::<B>(other).is_none() {
                    return Ok(None);
                }
            }
        }
    }
    match element.kind {
        ElementKind::Vertex => body.push_vertex(position, start, place)?,
        ElementKind::Face => body.end_face(place)?,
        ElementKind::Other => {}
    }
    Ok(Some(()))
}

/// Where the coordinates of the vertex row at `start` stand.
pub(super) fn locate<B: ByteOrder>(
    bytes: &[u8],
    start: usize,
    properties: &[Property],
) -> Option<[usize; 3]> {
    let mut cursor = Cursor { bytes, at: start };
    let mut places = [0; 3];
    for &property in properties {
        if let Property::Coordinate(axis, _) = property {
            places[axis] = cursor.at;
        }
        cursor.skip::<B>(property)?;
    }
    Some(places)
}

/// A place in the bytes; every step ends in `None` where the bytes do.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    #[inline]
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let taken = self.bytes.get(self.at..)?.get(..count)?;
        self.at += count;
        Some(taken)
    }

    #[inline]
    fn array<B: ByteOrder, const N: usize>(&mut self) -> Option<[u8; N]> {
        let array = *self.bytes.get(self.at..)?.first_chunk()?;
        self.at += N;
        Some(B::little(array))
    }

    #[inline]
    fn integer<B: ByteOrder>(&mut self, number: NumberType) -> Option<i64> {
        Some(match number {
            NumberType::I8 => i8::from_le_bytes(self.array::<B, 1>()?).into(),
            NumberType::U8 => u8::from_le_bytes(self.array::<B, 1>()?).into(),
            NumberType::I16 => i16::from_le_bytes(self.array::<B, 2>()?).into(),
            NumberType::U16 => u16::from_le_bytes(self.array::<B, 2>()?).into(),
            NumberType::I32 => i32::from_le_bytes(self.array::<B, 4>()?).into(),
            NumberType::U32 => u32::from_le_bytes(self.array::<B, 4>()?).into(),
            // The layout admits only integers where this is called.
            NumberType::F32 | NumberType::F64 => return None,
        })
    }

    #[inline]
    fn real<B: ByteOrder>(&mut self, number: NumberType) -> Option<f64> {
        Some(match number {
            NumberType::F32 => f32::from_le_bytes(self.array::<B, 4>()?).into(),
            NumberType::F64 => f64::from_le_bytes(self.array::<B, 8>()?),
            // At most 32 bits, so the conversion is exact.
            integer => self.integer::<B>(integer)? as f64,
        })
    }

    /// The bytes of the items of a list; a negative length counts as an end of the file.
    #[inline]
    fn list<B: ByteOrder>(&mut self, length: NumberType, item: NumberType) -> Option<&'a [u8]> {
        let length = usize::try_from(self.integer::<B>(length)?).ok()?;
        self.take(length.checked_mul(item.size())?)
    }

    #[inline]
    fn skip<B: ByteOrder>(&mut self, property: Property) -> Option<()> {
        match property {
            Property::Coordinate(_, number) | Property::Scalar(number) => {
                self.take(number.size())?;
            }
            Property::Corners(length, item) | Property::List(length, item) => {
                self.list::<B>(length, item)?;
            }
        }
        Some(())
    }
}
