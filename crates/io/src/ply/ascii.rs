//! Text rows: one row a line, blank lines skipped.

use std::ops::Range;

use nalgebra::Point3;

use crate::coordinate::coordinate;
use crate::error::{self, IoError, Place, quote};
use crate::number::parse_integer;
use crate::text::{Line, Lines, Tokens};

use super::Body;
use super::header::Header;
use super::layout::{Element, ElementKind, Layout, Property};

/// Reads all rows.
pub(super) fn read(
    bytes: &[u8],
    header: &Header,
    layout: &Layout,
    body: &mut Body<'_>,
) -> Result<(), IoError> {
    let mut lines = Lines::new(bytes, header.end);
    lines.number = header.last_line;
    for element in &layout.elements {
        for number in 0..element.count {
            let line = lines.find(|line| !line.text.trim_ascii().is_empty());
            let line = line.ok_or_else(|| IoError::CutShort {
                place: Place::Line(lines.number),
                element: error::Element::new(&element.name, number),
                promised: element.count as u64,
            })?;
            read_row(line, element, number, body)?;
        }
    }
    Ok(())
}

fn read_row(
    line: Line<'_>,
    element: &Element,
    number: usize,
    body: &mut Body<'_>,
) -> Result<(), IoError> {
    let place = Place::Line(line.number);
    let mut row = Row {
        tokens: Tokens::new(line.text),
        num_read: 0,
    };
    let too_few = |found, more: usize| IoError::TooFewNumbers {
        place,
        element: error::Element::new(&element.name, number),
        found,
        needed: more.saturating_add(found),
    };
    let integer = |token: &[u8]| {
        parse_integer(token).ok_or_else(|| IoError::BadNumber {
            place,
            element: error::Element::new(&element.name, number),
            text: quote(token),
            expected: "an integer",
        })
    };
    let mut position = Point3::origin();
    for (i, property) in element.properties.iter().enumerate() {
        let rest = element.properties.len() - i;
        let token = row.next().ok_or_else(|| too_few(row.num_read, rest))?;
        match *property {
            Property::Coordinate(axis, _) => position[axis] = coordinate(token, number, place)?,
            Property::Scalar(_) => {}
            Property::Corners(..) => {
                for _ in 0..list_length(integer(token)?, place, element, number)? {
                    let token = row.next().ok_or_else(|| too_few(row.num_read, rest))?;
                    body.push_corner(integer(token)?, || place)?;
                }
            }
            Property::List(..) => {
                for _ in 0..list_length(integer(token)?, place, element, number)? {
                    row.next().ok_or_else(|| too_few(row.num_read, rest))?;
                }
            }
        }
    }
    match element.kind {
        ElementKind::Vertex => body.push_vertex(position, line.start, || place),
        ElementKind::Face => body.end_face(|| place),
        ElementKind::Other => Ok(()),
    }
}

fn list_length(
    length: i64,
    place: Place,
    element: &Element,
    number: usize,
) -> Result<usize, IoError> {
    usize::try_from(length).map_err(|_| IoError::BadNumber {
        place,
        element: error::Element::new(&element.name, number),
        text: length.to_string(),
        expected: "the length of a list",
    })
}

/// The tokens of a row, counted.
struct Row<'a> {
    tokens: Tokens<'a>,
    num_read: usize,
}

impl<'a> Row<'a> {
    #[inline]
    fn next(&mut self) -> Option<&'a [u8]> {
        let token = self.tokens.next()?;
        self.num_read += 1;
        Some(token.text)
    }
}

/// Where the coordinates of the vertex row at `start` stand, by axis.
pub(super) fn locate(
    bytes: &[u8],
    start: usize,
    properties: &[Property],
) -> Option<[Range<usize>; 3]> {
    let mut tokens = Tokens::new(bytes.get(start..)?);
    let mut places = [0..0, 0..0, 0..0];
    for property in properties {
        let token = tokens.next()?;
        match *property {
            Property::Coordinate(axis, _) => {
                places[axis] = start + token.start..start + token.start + token.text.len();
            }
            Property::Scalar(_) => {}
            Property::Corners(..) | Property::List(..) => {
                for _ in 0..parse_integer(token.text)? {
                    tokens.next()?;
                }
            }
        }
    }
    Some(places)
}
