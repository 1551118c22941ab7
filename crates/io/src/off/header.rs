//! The header word and the counts.

use std::ops::Range;

use super::problem;
use super::words::{Rows, Words};
use crate::error::{IoError, quote};
use crate::limits::Limits;
use crate::number;
use crate::text::{self, Line, Tokens};

/// Returns `true` for the header word of any kind of OFF file (including unsupported kinds).
pub(crate) fn is_header_word(word: &[u8]) -> bool {
    prefix(word).is_some()
}

/// Returns the letters before `OFF` in a header word; `None` if it is not one.
///
/// The first count may follow directly, as in `OFF4 4 6`: many files of the ModelNet40 collection
/// lack the line ending there.
fn prefix(word: &[u8]) -> Option<&[u8]> {
    let at = word.windows(3).position(|letters| letters == b"OFF")?;
    let (prefix, behind) = (&word[..at], &word[at + 3..]);
    if !behind.iter().all(u8::is_ascii_digit) {
        return None;
    }
    // Geomview writes the prefixes in this order, MeshLab in another one.
    let mut parts = vec![&b"ST"[..], b"C", b"N", b"4", b"n"];
    let mut rest = prefix;
    while let Some(found) = parts.iter().position(|part| rest.starts_with(part)) {
        rest = &rest[parts.swap_remove(found).len()..];
    }
    rest.is_empty().then_some(prefix)
}

#[derive(Debug)]
pub(super) struct Header {
    pub(super) num_vertices: usize,
    pub(super) num_faces: usize,
    /// The locations of the two counts.
    pub(super) counts: [Range<usize>; 2],
    pub(super) has_normals: bool,
    pub(super) has_colors: bool,
    pub(super) has_uvs: bool,
    /// The end of the line with the last count.
    pub(super) end: usize,
}

impl Header {
    pub(super) fn read(
        rows: &mut Rows<'_>,
        num_bytes: usize,
        limits: &Limits,
    ) -> Result<Self, IoError> {
        let mut row = rows.next()?.ok_or(IoError::UnknownFormat)?;
        let first = Tokens::new(row.text).next();
        let word = first.map_or(&b""[..], |token| token.text);
        let mut at = 0;
        let mut flags = &b""[..];
        if let Some(prefix) = prefix(word) {
            flags = prefix;
            if flags.contains(&b'4') || flags.contains(&b'n') {
                let text = "vertices of other than three dimensions are not read; \
                            keep three coordinates, and the header word without `4` and `n`";
                return Err(problem(row, text));
            }
            at = first.map_or(0, |token| token.start + prefix.len() + b"OFF".len());
            let second = Tokens::new(&row.text[at..]).next();
            if second.is_some_and(|token| token.text == b"BINARY") {
                let text = "binary OFF is not read; convert the file to text";
                return Err(problem(row, text));
            }
        }
        let mut counts = [0, 0];
        let mut places = [0..0, 0..0];
        for (k, (name, least_bytes)) in MIN_BYTES.into_iter().enumerate() {
            // A count may be on a line of its own.
            while Tokens::new(&row.text[at..]).next().is_none() {
                row = rows
                    .next()?
                    .ok_or_else(|| problem(row, "the numbers of vertices and faces are missing"))?;
                at = 0;
            }
            let Some(token) = Tokens::new(&row.text[at..]).next() else {
                continue;
            };
            counts[k] = count(row, token.text, name, num_bytes / least_bytes, num_bytes)?;
            let start = row.start + at + token.start;
            places[k] = start..start + token.text.len();
            at += token.start + token.text.len();
        }
        let [num_vertices, num_faces] = counts;
        limits.check_vertices(num_vertices)?;
        limits.check_faces(num_faces)?;
        let has = |part: &[u8]| flags.windows(part.len()).any(|window| window == part);
        Ok(Self {
            num_vertices,
            num_faces,
            counts: places,
            has_normals: has(b"N"),
            has_colors: has(b"C"),
            has_uvs: has(b"ST"),
            end: rows.position(),
        })
    }

    /// The number of values of a vertex after x y z that are not its colour.
    pub(super) fn fixed_numbers(&self) -> usize {
        3 * usize::from(self.has_normals) + 2 * usize::from(self.has_uvs)
    }

    /// Returns how many of `further` numbers after x y z are a colour; `None` if that cannot be
    /// determined.
    pub(super) fn color_numbers(&self, further: usize) -> Option<usize> {
        let numbers = further.checked_sub(self.fixed_numbers())?;
        matches!(numbers, 0 | 3 | 4).then_some(numbers)
    }

    /// The possible start offsets of the vertices with the possible numbers of values after x y
    /// z, for files whose line structure does not determine them.
    pub(super) fn free_forms(&self, bytes: &[u8]) -> impl Iterator<Item = (usize, usize)> {
        let mut words = Words::new(bytes, self.counts[1].end);
        let same_line = !text::before_comment(words.rest_of_line())
            .trim_ascii()
            .is_empty();
        words.next();
        // The optional number of edges: on the line of the counts it is one, otherwise it may be.
        let starts = if same_line {
            vec![words.at()]
        } else {
            vec![self.end, words.at()]
        };
        let colors = if self.has_colors { &[4, 3][..] } else { &[0] };
        let fixed = self.fixed_numbers();
        starts
            .into_iter()
            .flat_map(move |start| colors.iter().map(move |color| (start, fixed + color)))
    }
}

/// The counted elements, and the minimum size of one: "0 0 0\n" and "3 0 1 2\n", less the last
/// line ending.
const MIN_BYTES: [(&str, usize); 2] = [("vertices", 5), ("faces", 7)];

fn count(
    row: Line<'_>,
    token: &[u8],
    name: &str,
    most: usize,
    num_bytes: usize,
) -> Result<usize, IoError> {
    let count = number::parse_integer(token).and_then(|n| usize::try_from(n).ok());
    let count = count.ok_or_else(|| {
        let text = format!("`{}` is not the number of {name}", quote(token));
        problem(row, &text)
    })?;
    if count > most {
        let text =
            format!("the header promises {count} {name}, more than {num_bytes} bytes can hold");
        return Err(problem(row, &text));
    }
    Ok(count)
}
