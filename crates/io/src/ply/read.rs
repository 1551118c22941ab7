//! Reading of rows into positions and faces.

use nalgebra::Point3;

use crate::error::{IoError, quote};
use crate::faces::FaceList;
use crate::limits::Limits;
use crate::room;

use super::layout::{ElementKind, Layout, NumberType, Property};
use super::rows::{Encoded, Number, RowName, real};
use super::strips::Strip;

/// The destination of the rows.
pub(super) struct Body<'a> {
    pub(super) limits: &'a Limits,
    num_bytes: usize,
    /// The number of vertices that the header promises, since faces may precede them.
    pub(super) num_vertices: usize,
    pub(super) positions: Vec<Point3<f64>>,
    /// The offset of each vertex row, unless all rows have a fixed size.
    pub(super) starts: Vec<usize>,
    pub(super) faces: FaceList,
    /// The start of the rows of each element, and the end of the last one.
    pub(super) elements: Vec<usize>,
}

impl<'a> Body<'a> {
    pub(super) fn new(layout: &Layout, num_bytes: usize, limits: &'a Limits) -> Self {
        Self {
            limits,
            num_bytes,
            num_vertices: layout.num_vertices,
            positions: Vec::new(),
            starts: Vec::new(),
            faces: FaceList::new(),
            elements: Vec::new(),
        }
    }

    /// Checks the total number of corners against the limits.
    #[inline]
    pub(super) fn check_corners(&self, num_corners: usize) -> Result<(), IoError> {
        self.limits.check_corners(num_corners)?;
        self.limits
            .check_memory(self.num_bytes, self.num_vertices, num_corners)
    }
}

/// Reads all rows.
pub(super) fn read_rows<E: Encoded>(
    bytes: &[u8],
    layout: &Layout,
    body: &mut Body<'_>,
) -> Result<(), IoError> {
    let mut at = layout.header_end[1];
    for element in &layout.elements {
        body.elements.push(at);
        let (done, next) = E::read_fast(bytes, at, element, body)?;
        at = next;
        for number in done..element.count {
            let row = Row {
                bytes,
                start: E::row_start(bytes, at),
                name: RowName { element, number },
            };
            at = row.read::<E>(body)?;
        }
    }
    body.elements.push(at);
    Ok(())
}

struct Row<'a> {
    bytes: &'a [u8],
    start: usize,
    name: RowName<'a>,
}

impl Row<'_> {
    /// Reads the row and returns the offset of its end.
    #[inline]
    fn read<E: Encoded>(&self, body: &mut Body<'_>) -> Result<usize, IoError> {
        let Self { bytes, start, name } = *self;
        let element = name.element;
        let mut at = start;
        let mut position = Point3::origin();
        for (i, &property) in element.properties.iter().enumerate() {
            let too_short = || E::too_short(bytes, start, element.properties.len() - i, name);
            match property {
                Property::Coordinate(axis, number) => {
                    let word = E::next(bytes, at, number).ok_or_else(too_short)?;
                    at = word.end;
                    position[axis] = self.coordinate::<E>(&bytes[word], number)?;
                }
                Property::Scalar(number) => {
                    at = E::next(bytes, at, number).ok_or_else(too_short)?.end;
                }
                Property::Corners(length, item) | Property::List(length, item) => {
                    let word = E::next(bytes, at, length).ok_or_else(too_short)?;
                    at = word.end;
                    let word = &bytes[word];
                    let count = E::integer(word, length)
                        .and_then(|count| usize::try_from(count).ok())
                        .ok_or_else(|| self.bad::<E>(word, "the length of a list"))?;
                    if matches!(property, Property::List(..)) {
                        at = E::skip(bytes, at, count, item).ok_or_else(too_short)?;
                        continue;
                    }
                    let is_strip = element.kind == ElementKind::Strips;
                    if !is_strip {
                        body.limits.check_degree(count)?;
                    }
                    let mut strip = Strip::default();
                    for _ in 0..count {
                        // One corner, or one triangle of a strip.
                        body.faces.make_room(1, 3)?;
                        let word = E::next(bytes, at, item).ok_or_else(too_short)?;
                        at = word.end;
                        let word = &bytes[word];
                        let index = E::integer(word, item)
                            .ok_or_else(|| self.bad::<E>(word, "an integer"))?;
                        if is_strip {
                            self.strip_corner::<E>(body, &mut strip, index)?;
                        } else {
                            let vertex = self.vertex::<E>(body, index)?;
                            body.faces.push_corner(vertex);
                        }
                    }
                }
            }
        }
        let end = E::row_end(bytes, at);
        if E::IS_TEXT {
            body.limits.check_line(end - start)?;
        }
        match element.kind {
            ElementKind::Vertex => {
                if E::IS_TEXT || element.stride().is_none() {
                    room::push(&mut body.starts, start)?;
                }
                room::push(&mut body.positions, position)?;
            }
            ElementKind::Face => self.end_face::<E>(body)?,
            _ => {}
        }
        Ok(end)
    }

    #[inline]
    fn coordinate<E: Encoded>(&self, word: &[u8], number: NumberType) -> Result<f64, IoError> {
        let value = if E::IS_TEXT {
            // As written in the text, regardless of the type.
            real(word)
        } else {
            E::number(word, number).map(|value| match value {
                Number::Integer(x) => x as f64,
                Number::Single(x) => x.into(),
                Number::Double(x) => x,
            })
        };
        match value {
            Some(x) if x.is_finite() => Ok(x),
            Some(x) => Err(IoError::NonFinite {
                place: E::place(self.bytes, self.start),
                vertex: self.name.number,
                value: if E::IS_TEXT {
                    quote(word)
                } else {
                    x.to_string()
                },
            }),
            None => Err(self.bad::<E>(word, "a number")),
        }
    }

    #[inline]
    fn vertex<E: Encoded>(&self, body: &Body<'_>, index: i64) -> Result<u32, IoError> {
        match u32::try_from(index) {
            Ok(vertex) if (vertex as usize) < body.num_vertices => Ok(vertex),
            _ => Err(IoError::IndexOutOfRange {
                place: E::place(self.bytes, self.start),
                face: body.faces.len(),
                index,
                first: 0,
                num_vertices: body.num_vertices,
            }),
        }
    }

    fn strip_corner<E: Encoded>(
        &self,
        body: &mut Body<'_>,
        strip: &mut Strip,
        index: i64,
    ) -> Result<(), IoError> {
        if index == -1 {
            *strip = Strip::default();
            return Ok(());
        }
        let vertex = self.vertex::<E>(body, index)?;
        if let Some(triangle) = strip.push(vertex) {
            body.limits.check_faces(body.faces.len() + 1)?;
            body.check_corners(body.faces.num_corners() + 3)?;
            for vertex in triangle {
                body.faces.push_corner(vertex);
            }
            body.faces.end_face();
        }
        Ok(())
    }

    #[inline]
    fn end_face<E: Encoded>(&self, body: &mut Body<'_>) -> Result<(), IoError> {
        body.faces.make_room(1, 0)?;
        let degree = body.faces.end_face();
        if degree < 3 {
            return Err(IoError::TooFewCorners {
                place: E::place(self.bytes, self.start),
                face: self.name.number,
                degree,
            });
        }
        body.check_corners(body.faces.num_corners())
    }

    fn bad<E: Encoded>(&self, word: &[u8], expected: &'static str) -> IoError {
        let text = if E::IS_TEXT {
            quote(word)
        } else {
            let bytes: Vec<String> = word.iter().map(|b| format!("{b:02x}")).collect();
            format!("bytes {}", bytes.join(" "))
        };
        IoError::BadNumber {
            place: E::place(self.bytes, self.start),
            element: self.name.quoted(),
            text,
            expected,
        }
    }
}
