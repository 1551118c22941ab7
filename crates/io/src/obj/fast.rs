//! Fast path for lines of the common forms, parsed in one pass over the bytes: `v x y z` with
//! plain decimals, `f` with plain corners, and lines that are only counted.
//!
//! Anything else is left to the general statement reader. Both agree on every line that this one
//! accepts.

use nalgebra::Point3;

use crate::limits::Limits;
use crate::number::{self, digits8};
use crate::obj::parse::Piece;

/// Parses the line that starts at `at` into the piece and returns the start of the next one.
///
/// Returns `None`, with the piece unchanged, if the line does not have a common form or is too
/// long.
#[inline]
pub(super) fn line(piece: &mut Piece, text: &[u8], at: usize, limits: &Limits) -> Option<usize> {
    let next = match text.get(at..at + 2)? {
        b"v " => vertex(piece, text, at + 2, at, limits)?,
        b"f " => face(piece, text, at + 2, at, limits)?,
        b"vt" if text.get(at + 2) == Some(&b' ') => {
            let next = skip(text, at + 3, at, limits)?;
            piece.counts.add_texture();
            next
        }
        b"vn" if text.get(at + 2) == Some(&b' ') => {
            let next = skip(text, at + 3, at, limits)?;
            piece.counts.add_normal();
            next
        }
        _ => return None,
    };
    Some(next)
}

#[inline]
fn vertex(
    piece: &mut Piece,
    text: &[u8],
    mut at: usize,
    start: usize,
    limits: &Limits,
) -> Option<usize> {
    let mut position = [0.0; 3];
    for x in &mut position {
        at = blanks(text, at)?;
        (*x, at) = number::decimal(text, at)?;
        if !x.is_finite() {
            return None;
        }
    }
    let next = end_of_line(text, at, start, limits).or_else(|| skip(text, at, start, limits))?;
    piece.positions.push(Point3::from(position));
    Some(next)
}

#[inline]
fn face(piece: &mut Piece, text: &[u8], at: usize, start: usize, limits: &Limits) -> Option<usize> {
    let before = piece.mark();
    let next = corners(piece, text, at, start, limits);
    match next {
        Some(_) => {
            piece.end_face();
        }
        None => piece.reset(before),
    }
    next
}

/// Parses the corners of a face. If this returns `None`, the caller must drop the corners added
/// so far.
#[inline]
fn corners(
    piece: &mut Piece,
    text: &[u8],
    mut at: usize,
    start: usize,
    limits: &Limits,
) -> Option<usize> {
    let most = MAX_CORNERS.min(limits.max_degree);
    let mut degree = 0;
    loop {
        at = blanks(text, at)?;
        let first = *text.get(at)?;
        if first <= b' ' {
            break;
        }
        let is_relative = first == b'-';
        let (index, behind) = integer(text, at + usize::from(is_relative))?;
        at = behind;
        if text.get(at) == Some(&b'/') {
            at = reference(text, at + 1)?;
            if text.get(at) == Some(&b'/') {
                at = reference(text, at + 1)?;
            }
        }
        // The degree of longer faces is checked as they grow.
        if *text.get(at)? > b' ' || index == 0 || degree == most {
            return None;
        }
        if is_relative {
            piece.push_relative(piece.positions.len() as i64 - i64::from(index));
        } else {
            piece.push_absolute(index - 1);
        }
        degree += 1;
    }
    if degree < 3 {
        return None;
    }
    end_of_line(text, at, start, limits)
}

/// Maximum number of corners of a face on the fast path.
const MAX_CORNERS: usize = 16;

/// Skips whitespace from `at` on.
#[inline]
fn blanks(text: &[u8], mut at: usize) -> Option<usize> {
    while matches!(*text.get(at)?, b' ' | b'\t') {
        at += 1;
    }
    Some(at)
}

/// Parses a positive number of up to nine digits, and returns it with the offset after it.
#[inline]
fn integer(text: &[u8], at: usize) -> Option<(u32, usize)> {
    let (value, count) = digits8(text, at)?;
    match count {
        0 => None,
        8 => {
            let last = text.get(at + 8)?.wrapping_sub(b'0');
            if last > 9 {
                return Some((value, at + 8));
            }
            let next = text.get(at + 9)?.wrapping_sub(b'0');
            (next > 9).then_some((value * 10 + u32::from(last), at + 9))
        }
        _ => Some((value, at + count)),
    }
}

/// Skips a number that is not needed now.
#[inline]
fn reference(text: &[u8], mut at: usize) -> Option<usize> {
    if text.get(at) == Some(&b'-') {
        at += 1;
    }
    while text.get(at)?.is_ascii_digit() {
        at += 1;
    }
    Some(at)
}

/// Skips the line ending at `at`.
#[inline]
fn end_of_line(text: &[u8], at: usize, start: usize, limits: &Limits) -> Option<usize> {
    let length = match text.get(at)? {
        b'\n' => 1,
        b'\r' if text.get(at + 1) == Some(&b'\n') => 2,
        _ => return None,
    };
    (at - start <= limits.max_line).then_some(at + length)
}

/// Skips the rest of the line, unless a backslash continues it.
#[inline]
fn skip(text: &[u8], at: usize, start: usize, limits: &Limits) -> Option<usize> {
    let end = at + memchr::memchr2(b'\n', b'\r', text.get(at..)?)?;
    if text[..end].ends_with(b"\\") {
        return None;
    }
    end_of_line(text, end, start, limits)
}
