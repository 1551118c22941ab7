//! A second walk over rows that were already read, which locates each number, in every encoding.

use std::ops::Range;

use crate::attributes::Values;
use crate::error::{self, IoError, Place, quote};
use crate::number;
use crate::text::{self, Lines};

use super::groups::Group;
use super::layout::{Element, NumberType, Property};
use super::read::Body;

/// A number in a type of PLY.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Number {
    Integer(i64),
    Single(f32),
    Double(f64),
}

impl Number {
    /// Zero in this type.
    pub(super) fn zero(number: NumberType) -> Self {
        match number {
            NumberType::F32 => Self::Single(0.0),
            NumberType::F64 => Self::Double(0.0),
            _ => Self::Integer(0),
        }
    }
}

/// A row, for error messages.
#[derive(Clone, Copy)]
pub(super) struct RowName<'a> {
    pub(super) element: &'a Element,
    pub(super) number: usize,
}

impl RowName<'_> {
    pub(super) fn quoted(self) -> error::Element {
        error::Element::new(&quote(self.element.name.as_bytes()), self.number)
    }

    pub(super) fn cut_short(self, place: Place) -> IoError {
        IoError::CutShort {
            place,
            element: self.quoted(),
            promised: self.element.count as u64,
        }
    }
}

/// The encoding of numbers and rows in a file.
pub(super) trait Encoded {
    /// `true` if rows are lines.
    const IS_TEXT: bool;

    /// The range of the next number from `at`; `None` at the end of the row or file.
    fn next(bytes: &[u8], at: usize, number: NumberType) -> Option<Range<usize>>;

    /// The end of `count` further numbers.
    fn skip(bytes: &[u8], at: usize, count: usize, number: NumberType) -> Option<usize>;

    /// Parses a number from its bytes; `None` if it is not one of this type.
    fn number(word: &[u8], number: NumberType) -> Option<Number>;

    /// Appends a number, which its type must be able to represent.
    fn push(out: &mut Vec<u8>, number: NumberType, value: Number);

    /// Appends numbers as they are encoded in a file.
    fn push_raw(out: &mut Vec<u8>, raw: &[u8]);

    /// The start of the row that follows `at`.
    fn row_start(bytes: &[u8], at: usize) -> usize;

    /// The end of the row whose last number ends at `at`.
    fn row_end(bytes: &[u8], at: usize) -> usize;

    /// Appends the items of a list that was read before; `None` if one is not of its type.
    fn items(bytes: &[u8], cell: &Cell, number: NumberType, items: &mut Values) -> Option<()> {
        let mut at = cell.items.start;
        for _ in 0..cell.length {
            let word = Self::next(bytes, at, number)?;
            at = word.end;
            let end = items.len();
            put(items, end, Self::number(&bytes[word], number)?);
        }
        Some(())
    }

    /// The columns of fixed-size rows that were read before.
    fn columns_fast(_bytes: &[u8], _element: &Element, _groups: &[Group]) -> Option<Vec<Values>> {
        None
    }

    /// The location of `at` for error messages.
    fn place(bytes: &[u8], at: usize) -> Place;

    /// Parses an integer; its type only determines its size in bytes.
    fn integer(word: &[u8], number: NumberType) -> Option<i64>;

    /// The error for a row that starts at `start` and lacks the last `rest` of its properties.
    fn too_short(bytes: &[u8], start: usize, rest: usize, row: RowName<'_>) -> IoError;

    /// Reads rows of the most common forms, and returns their number and the offset after them.
    /// The remaining rows, and all errors, are left to the general walk.
    fn read_fast(
        _bytes: &[u8],
        at: usize,
        _element: &Element,
        _body: &mut Body<'_>,
    ) -> Result<(usize, usize), IoError> {
        Ok((0, at))
    }

    /// Locates a property that starts at `at`, and its items if it is a list.
    fn property(bytes: &[u8], at: usize, property: Property) -> Option<Cell> {
        match property {
            Property::Coordinate(_, number) | Property::Scalar(number) => Some(Cell {
                span: Self::next(bytes, at, number)?,
                items: 0..0,
                length: 0,
            }),
            Property::Corners(length, item) | Property::List(length, item) => {
                let first = Self::next(bytes, at, length)?;
                let count = Self::integer(&bytes[first.clone()], length)?;
                let count = usize::try_from(count).ok()?;
                let end = Self::skip(bytes, first.end, count, item)?;
                Some(Cell {
                    span: first.start..end,
                    items: first.end..end,
                    length: count,
                })
            }
        }
    }
}

/// The location of a property in a row.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(super) struct Cell {
    pub(super) span: Range<usize>,
    /// For a list: its items, without the length prefix.
    pub(super) items: Range<usize>,
    /// For a list: its number of items.
    pub(super) length: usize,
}

/// A walk over the rows of an element.
pub(super) struct Walk<'a> {
    bytes: &'a [u8],
    pub(super) at: usize,
    properties: &'a [Property],
    pub(super) cells: Vec<Cell>,
}

impl<'a> Walk<'a> {
    pub(super) fn new(bytes: &'a [u8], start: usize, element: &'a Element) -> Self {
        Self {
            bytes,
            at: start,
            properties: &element.properties,
            cells: vec![Cell::default(); element.properties.len()],
        }
    }

    /// Locates the cells of the next row, and returns the range of the row, or `None` at the end
    /// of the file.
    pub(super) fn next<E: Encoded>(&mut self) -> Option<Range<usize>> {
        let start = E::row_start(self.bytes, self.at);
        let mut at = start;
        for (&property, cell) in self.properties.iter().zip(&mut self.cells) {
            *cell = E::property(self.bytes, at, property)?;
            at = cell.span.end;
        }
        self.at = E::row_end(self.bytes, at);
        Some(start..self.at)
    }
}

/// Numbers as text, separated by whitespace.
pub(super) struct Text;

impl Encoded for Text {
    const IS_TEXT: bool = true;

    #[inline]
    fn next(bytes: &[u8], at: usize, _number: NumberType) -> Option<Range<usize>> {
        let mut start = at;
        while let Some(&b) = bytes.get(start) {
            match b {
                b'\n' | b'\r' => return None,
                0..=b' ' => start += 1,
                _ => {
                    let mut end = start + 1;
                    while bytes.get(end).is_some_and(|&b| b > b' ') {
                        end += 1;
                    }
                    return Some(start..end);
                }
            }
        }
        None
    }

    fn skip(bytes: &[u8], mut at: usize, count: usize, number: NumberType) -> Option<usize> {
        for _ in 0..count {
            at = Self::next(bytes, at, number)?.end;
        }
        Some(at)
    }

    #[inline]
    fn number(word: &[u8], number: NumberType) -> Option<Number> {
        match number {
            NumberType::F64 => real(word).map(Number::Double),
            NumberType::F32 => single(word).map(Number::Single),
            integer => {
                let value = number::parse_integer(word).or_else(|| {
                    // Some exporters write `255.0`.
                    let x = real(word)?;
                    (x.fract() == 0.0 && x.abs() < 1e10).then_some(x as i64)
                })?;
                integer
                    .range()
                    .contains(&value)
                    .then_some(Number::Integer(value))
            }
        }
    }

    #[inline]
    fn integer(word: &[u8], _number: NumberType) -> Option<i64> {
        number::parse_integer(word)
    }

    fn too_short(bytes: &[u8], start: usize, rest: usize, row: RowName<'_>) -> IoError {
        let place = Self::place(bytes, start);
        if start >= bytes.len() {
            return row.cut_short(place);
        }
        let (mut at, mut found) = (start, 0usize);
        while let Some(word) = Self::next(bytes, at, NumberType::F64) {
            at = word.end;
            found += 1;
        }
        IoError::TooFewNumbers {
            place,
            element: row.quoted(),
            found,
            needed: found.saturating_add(rest),
        }
    }

    fn push(out: &mut Vec<u8>, _number: NumberType, value: Number) {
        let mut text = String::new();
        match value {
            Number::Integer(x) => text.push_str(&x.to_string()),
            Number::Single(x) => number::push_f32(&mut text, x),
            Number::Double(x) => number::push_f64(&mut text, x),
        }
        Self::push_raw(out, text.as_bytes());
    }

    fn push_raw(out: &mut Vec<u8>, raw: &[u8]) {
        let raw = raw.trim_ascii();
        if raw.is_empty() {
            return;
        }
        if out.last().is_some_and(|&b| b > b' ') {
            out.push(b' ');
        }
        out.extend_from_slice(raw);
    }

    #[inline]
    fn row_start(bytes: &[u8], mut at: usize) -> usize {
        while bytes.get(at).is_some_and(|&b| b <= b' ') {
            at += 1;
        }
        at
    }

    #[inline]
    fn row_end(bytes: &[u8], mut at: usize) -> usize {
        while bytes.get(at).is_some_and(|&b| b != b'\n' && b != b'\r') {
            at += 1;
        }
        at
    }

    fn place(bytes: &[u8], at: usize) -> Place {
        let lines = Lines::new(bytes, text::after_bom(bytes));
        Place::Line(lines.take_while(|line| line.start <= at).count())
    }
}

/// Parses a real number, including the forms in which the C libraries of Windows write NaN and
/// infinity.
pub(super) fn real(word: &[u8]) -> Option<f64> {
    number::parse_f64(word).or_else(|| {
        let (negative, word) = match word {
            [b'-', rest @ ..] => (true, rest),
            [b'+', rest @ ..] => (false, rest),
            rest => (false, rest),
        };
        let starts = |with: &[u8]| {
            word.get(..with.len())
                .is_some_and(|start| start.eq_ignore_ascii_case(with))
        };
        if starts(b"1.#INF") {
            Some(if negative {
                -f64::INFINITY
            } else {
                f64::INFINITY
            })
        } else if starts(b"1.#") || starts(b"nan(") {
            Some(f64::NAN)
        } else {
            None
        }
    })
}

/// Parses the nearest `f32` to a decimal number.
fn single(word: &[u8]) -> Option<f32> {
    let x = real(word)?;
    // Rounding twice differs from rounding once only at the midpoint between two `f32` values,
    // which is elsewhere for subnormals.
    let middle = x.to_bits() & 0x1fff_ffff == 0x1000_0000;
    if middle || (x.abs() < f64::from(f32::MIN_POSITIVE) && x != 0.0) {
        return std::str::from_utf8(word).ok()?.parse().ok();
    }
    Some(x as f32)
}

/// Zeros of a type, to be [set](put) one by one.
pub(super) fn zeros(number: NumberType, count: usize) -> Values {
    match number {
        NumberType::I8 => Values::I8(vec![0; count]),
        NumberType::U8 => Values::U8(vec![0; count]),
        NumberType::I16 => Values::I16(vec![0; count]),
        NumberType::U16 => Values::U16(vec![0; count]),
        NumberType::I32 => Values::I32(vec![0; count]),
        NumberType::U32 => Values::U32(vec![0; count]),
        NumberType::F32 => Values::F32(vec![0.0; count]),
        NumberType::F64 => Values::F64(vec![0.0; count]),
    }
}

/// Puts a number of the type of `values` at `index`, or appends it there.
#[inline]
pub(super) fn put(values: &mut Values, index: usize, value: Number) {
    fn put<T>(numbers: &mut Vec<T>, index: usize, value: T) {
        match numbers.get_mut(index) {
            Some(number) => *number = value,
            None => numbers.push(value),
        }
    }
    match (values, value) {
        (Values::I8(v), Number::Integer(x)) => put(v, index, x as i8),
        (Values::U8(v), Number::Integer(x)) => put(v, index, x as u8),
        (Values::I16(v), Number::Integer(x)) => put(v, index, x as i16),
        (Values::U16(v), Number::Integer(x)) => put(v, index, x as u16),
        (Values::I32(v), Number::Integer(x)) => put(v, index, x as i32),
        (Values::U32(v), Number::Integer(x)) => put(v, index, x as u32),
        (Values::F32(v), Number::Single(x)) => put(v, index, x),
        (Values::F64(v), Number::Double(x)) => put(v, index, x),
        // The number was read in the type of the values.
        _ => {}
    }
}

/// Calls a function with the encoding of a file as its type parameter.
macro_rules! with_encoding {
    ($encoding:expr, $function:ident($($argument:expr),* $(,)?)) => {
        match $encoding {
            ply_rs::ply::Encoding::Ascii => $function::<crate::ply::rows::Text>($($argument),*),
            ply_rs::ply::Encoding::BinaryLittleEndian => {
                $function::<crate::ply::binary::Little>($($argument),*)
            }
            ply_rs::ply::Encoding::BinaryBigEndian => {
                $function::<crate::ply::binary::Big>($($argument),*)
            }
        }
    };
}
pub(super) use with_encoding;
