//! Binary rows in either byte order.

use std::ops::Range;

use crate::attributes::Values;
use crate::error::{IoError, Place};

use super::fast;
use super::groups::Group;
use super::layout::{Element, NumberType};
use super::read::Body;
use super::rows::{Cell, Encoded, Number, RowName, put};

/// A byte order.
pub(super) trait ByteOrder: Send + Sync {
    /// Converts the bytes of a number to or from little-endian order.
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

/// Reads the first bytes as a little-endian number.
#[inline]
fn first<B: ByteOrder, const N: usize>(bytes: &[u8]) -> Option<[u8; N]> {
    bytes.first_chunk().map(|chunk| B::little(*chunk))
}

impl<B: ByteOrder> Encoded for B {
    const IS_TEXT: bool = false;

    #[inline]
    fn next(bytes: &[u8], at: usize, number: NumberType) -> Option<Range<usize>> {
        let end = at.checked_add(number.size())?;
        (end <= bytes.len()).then_some(at..end)
    }

    #[inline]
    fn skip(bytes: &[u8], at: usize, count: usize, number: NumberType) -> Option<usize> {
        let end = at.checked_add(count.checked_mul(number.size())?)?;
        (end <= bytes.len()).then_some(end)
    }

    #[inline]
    fn number(word: &[u8], number: NumberType) -> Option<Number> {
        let integer = match number {
            NumberType::I8 => i8::from_le_bytes(first::<B, 1>(word)?).into(),
            NumberType::U8 => u8::from_le_bytes(first::<B, 1>(word)?).into(),
            NumberType::I16 => i16::from_le_bytes(first::<B, 2>(word)?).into(),
            NumberType::U16 => u16::from_le_bytes(first::<B, 2>(word)?).into(),
            NumberType::I32 => i32::from_le_bytes(first::<B, 4>(word)?).into(),
            NumberType::U32 => u32::from_le_bytes(first::<B, 4>(word)?).into(),
            NumberType::F32 => {
                return Some(Number::Single(f32::from_le_bytes(first::<B, 4>(word)?)));
            }
            NumberType::F64 => {
                return Some(Number::Double(f64::from_le_bytes(first::<B, 8>(word)?)));
            }
        };
        Some(Number::Integer(integer))
    }

    #[inline]
    fn integer(word: &[u8], number: NumberType) -> Option<i64> {
        match <Self as Encoded>::number(word, number)? {
            Number::Integer(x) => Some(x),
            Number::Single(_) | Number::Double(_) => None,
        }
    }

    fn too_short(bytes: &[u8], _start: usize, _rest: usize, row: RowName<'_>) -> IoError {
        row.cut_short(Place::Byte(bytes.len()))
    }

    fn read_fast(
        bytes: &[u8],
        at: usize,
        element: &Element,
        body: &mut Body<'_>,
    ) -> Result<(usize, usize), IoError> {
        fast::read::<B>(bytes, at, element, body)
    }

    fn push(out: &mut Vec<u8>, number: NumberType, value: Number) {
        match value {
            Number::Single(x) => out.extend_from_slice(&B::little(x.to_le_bytes())),
            Number::Double(x) => out.extend_from_slice(&B::little(x.to_le_bytes())),
            // The low bytes of a two's complement number are the same number with fewer bits.
            Number::Integer(x) => match number.size() {
                1 => out.push(x as u8),
                2 => out.extend_from_slice(&B::little((x as u16).to_le_bytes())),
                _ => out.extend_from_slice(&B::little((x as u32).to_le_bytes())),
            },
        }
    }

    fn push_raw(out: &mut Vec<u8>, raw: &[u8]) {
        out.extend_from_slice(raw);
    }

    #[inline]
    fn row_start(_bytes: &[u8], at: usize) -> usize {
        at
    }

    #[inline]
    fn row_end(_bytes: &[u8], at: usize) -> usize {
        at
    }

    fn items(bytes: &[u8], cell: &Cell, number: NumberType, items: &mut Values) -> Option<()> {
        let list = bytes.get(cell.items.clone())?;
        match (number, items) {
            // The usual type of texture coordinates.
            (NumberType::F32, Values::F32(items)) => {
                let numbers = list.as_chunks::<4>().0.iter();
                items.extend(numbers.map(|x| f32::from_le_bytes(B::little(*x))));
            }
            (_, items) => {
                for word in list.chunks_exact(number.size()) {
                    let end = items.len();
                    put(items, end, <Self as Encoded>::number(word, number)?);
                }
            }
        }
        Some(())
    }

    fn columns_fast(rows: &[u8], element: &Element, groups: &[Group]) -> Option<Vec<Values>> {
        fast::columns::<B>(rows, element, groups)
    }

    fn place(_bytes: &[u8], at: usize) -> Place {
        Place::Byte(at)
    }
}
