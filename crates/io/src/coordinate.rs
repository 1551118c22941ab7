//! The coordinates of a vertex in a text file: three finite numbers.

use nalgebra::Point3;

use crate::error::{Element, IoError, Place, quote};
use crate::number;
use crate::text::Token;

/// Parses the position in the next three tokens, and returns it with the offset of the first
/// token.
#[inline]
pub(crate) fn position<'a>(
    tokens: &mut impl Iterator<Item = Token<'a>>,
    vertex: usize,
    place: Place,
) -> Result<(Point3<f64>, usize), IoError> {
    let mut position = Point3::origin();
    let mut start = 0;
    for axis in 0..3 {
        let token = tokens.next().ok_or_else(|| IoError::TooFewNumbers {
            place,
            element: Element::new("vertex", vertex),
            found: axis,
            needed: 3,
        })?;
        if axis == 0 {
            start = token.start;
        }
        position[axis] = coordinate(token.text, vertex, place)?;
    }
    Ok((position, start))
}

/// Parses a finite number.
#[inline]
pub(crate) fn coordinate(token: &[u8], vertex: usize, place: Place) -> Result<f64, IoError> {
    match number::parse_f64(token) {
        Some(x) if x.is_finite() => Ok(x),
        Some(_) => Err(IoError::NonFinite {
            place,
            vertex,
            value: quote(token),
        }),
        None => Err(IoError::BadNumber {
            place,
            element: Element::new("vertex", vertex),
            text: quote(token),
            expected: "a number",
        }),
    }
}
