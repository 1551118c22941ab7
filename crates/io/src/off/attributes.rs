//! Normals, colours, texture coordinates and comments, decoded on request.

use super::words::Words;
use super::{COLOR_INDEX, OffFile};
use crate::attributes::{Attributes, COLOR, NORMAL, Property, UV, Values};
use crate::error::{Element, IoError, quote};
use crate::number;
use crate::text::{self, Lines, Token, Tokens};

pub(super) fn decode(file: &OffFile) -> Result<Attributes, IoError> {
    Ok(Attributes {
        vertices: vertices(file)?,
        faces: faces(file)?,
        comments: comments(&file.bytes).map(text::decode).collect(),
        ..Attributes::default()
    })
}

fn vertices(file: &OffFile) -> Result<Vec<Property>, IoError> {
    let header = &file.header;
    let (mut normals, mut uvs) = (Vec::new(), Vec::new());
    let mut colors = Colors::default();
    let mut words = Vec::new();
    for vertex in 0..file.layout.starts.len() {
        words.clear();
        words.extend(file.vertex_words(vertex).skip(3));
        let element = || Element::new("vertex", vertex);
        let number = |word: &Token<'_>| {
            number::parse_f64(word.text).ok_or_else(|| bad(file, word, element(), "a number"))
        };
        let fixed = header.fixed_numbers();
        if words.len() < fixed {
            return Err(IoError::TooFewNumbers {
                place: file.place(file.layout.starts[vertex]),
                element: element(),
                found: words.len() + 3,
                needed: fixed + 3,
            });
        }
        let mut rest = words.as_slice();
        if header.has_normals {
            let (normal, behind) = rest.split_at(3);
            for word in normal {
                normals.push(number(word)?);
            }
            rest = behind;
        }
        let num_colors = header.color_numbers(words.len()).unwrap_or(0);
        let (color, behind) = rest.split_at(num_colors);
        colors
            .push(color)
            .map_err(|word| bad(file, &word, element(), COLOR_NUMBER))?;
        if header.has_uvs {
            // Numbers that are neither stand before them, like a colour.
            for word in &behind[behind.len() - 2..] {
                uvs.push(number(word)?);
            }
        }
    }
    let property = |name: &str, components, values: Vec<f64>| Property {
        name: name.to_owned(),
        components,
        values: Values::F64(values),
    };
    let normals = header.has_normals.then(|| property(NORMAL, 3, normals));
    let uvs = header.has_uvs.then(|| property(UV, 2, uvs));
    Ok([normals, colors.finish(), uvs]
        .into_iter()
        .flatten()
        .collect())
}

fn faces(file: &OffFile) -> Result<Vec<Property>, IoError> {
    let mut colors = Colors::default();
    let mut indices = Vec::new();
    let mut words = Vec::new();
    for (face, row) in FaceRows::new(file).enumerate() {
        words.clear();
        words.extend(Tokens::new(&file.bytes[row.corners_end..row.end]));
        // Make the token offsets relative to the whole text.
        words
            .iter_mut()
            .for_each(|word| word.start += row.corners_end);
        let mut index = NO_INDEX;
        if let [word] = words.as_slice() {
            let element = Element::new("face", face);
            index = number::parse_integer(word.text)
                .and_then(|index| i32::try_from(index).ok())
                .ok_or_else(|| bad(file, word, element, "a number of a colour map"))?;
        }
        indices.push(index);
        let color = match words.len() {
            3 | 4 => words.as_slice(),
            _ => &[],
        };
        colors
            .push(color)
            .map_err(|word| bad(file, &word, Element::new("face", face), COLOR_NUMBER))?;
    }
    let has_indices = indices.iter().any(|&index| index != NO_INDEX);
    let indices = has_indices.then(|| Property {
        name: COLOR_INDEX.to_owned(),
        components: 1,
        values: Values::I32(indices),
    });
    Ok([colors.finish(), indices].into_iter().flatten().collect())
}

/// The colour map index of a face without one.
pub(super) const NO_INDEX: i32 = -1;

const COLOR_NUMBER: &str = "a whole number from 0 to 255 or a real number";

fn bad(file: &OffFile, word: &Token<'_>, element: Element, expected: &'static str) -> IoError {
    IoError::BadNumber {
        place: file.place(word.start),
        element,
        text: quote(word.text),
        expected,
    }
}

/// The location of a face.
#[derive(Clone, Copy)]
pub(super) struct FaceRow {
    /// Offset of its corner count.
    pub(super) start: usize,
    /// The end of its last corner.
    pub(super) corners_end: usize,
    /// The end of its line, including the line ending.
    pub(super) end: usize,
}

/// Iterates over the faces, which were checked when the file was read.
pub(super) struct FaceRows<'a> {
    words: Words<'a>,
    rest: usize,
}

impl<'a> FaceRows<'a> {
    pub(super) fn new(file: &'a OffFile) -> Self {
        Self {
            words: Words::new(&file.bytes, file.layout.vertices.end),
            rest: file.layout.num_faces,
        }
    }
}

impl Iterator for FaceRows<'_> {
    type Item = FaceRow;

    fn next(&mut self) -> Option<FaceRow> {
        self.rest = self.rest.checked_sub(1)?;
        let degree = self.words.next()?;
        let num_corners = number::parse_integer(degree.text)?;
        for _ in 0..num_corners {
            self.words.next()?;
        }
        let corners_end = self.words.at();
        self.words.skip_line();
        Some(FaceRow {
            start: degree.start,
            corners_end,
            end: self.words.at(),
        })
    }
}

/// The comments of a text, without the `#` and surrounding whitespace.
pub(super) fn comments(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    Lines::new(bytes, text::after_bom(bytes)).filter_map(|line| {
        let at = line.text.iter().position(|&b| b == b'#')?;
        let comment = &line.text[at + 1..];
        let comment = comment.strip_prefix(b" ").unwrap_or(comment);
        Some(comment.trim_ascii_end())
    })
}

/// The colours of elements, some of which may have none.
#[derive(Default)]
struct Colors {
    rows: Vec<(Kind, [f64; 4])>,
}

/// The number format of a colour.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    None,
    /// Only the integers 0 and 1, which may be of either kind.
    Unclear,
    /// Integers up to 255.
    Bytes,
    Reals,
}

impl Colors {
    /// Adds a colour of three or four words, or none. Returns the first invalid word as the
    /// error.
    fn push<'a>(&mut self, words: &[Token<'a>]) -> Result<(), Token<'a>> {
        let mut color = [0.0, 0.0, 0.0, f64::NAN];
        let mut kind = if words.is_empty() {
            Kind::None
        } else {
            Kind::Unclear
        };
        for (x, word) in color.iter_mut().zip(words) {
            *x = number::parse_f64(word.text).ok_or(*word)?;
            match number::parse_integer(word.text) {
                Some(0 | 1) => {}
                Some(_) if kind == Kind::Reals => {}
                Some(2..=255) => kind = Kind::Bytes,
                Some(_) => return Err(*word),
                None => kind = Kind::Reals,
            }
        }
        if words.len() == 4 && color[3].is_nan() {
            color[3] = 1.0;
        }
        self.rows.push((kind, color));
        Ok(())
    }

    fn finish(self) -> Option<Property> {
        let has = |kind| self.rows.iter().any(|row| row.0 == kind);
        if self.rows.iter().all(|row| row.0 == Kind::None) {
            return None;
        }
        // All colours have alpha if one has. Colours without alpha are opaque, missing colours
        // are white.
        let has_alpha = |row: &(Kind, [f64; 4])| !row.1[3].is_nan();
        let components = 3 + usize::from(self.rows.iter().any(has_alpha));
        let is_bytes = has(Kind::Bytes) && !has(Kind::Reals);
        let full = if is_bytes { 255.0 } else { 1.0 };
        let numbers = self.rows.iter().flat_map(|&(kind, color)| {
            let color = match kind {
                Kind::None => [full; 4],
                Kind::Bytes if !is_bytes => color.map(|x| x / 255.0),
                _ => color,
            };
            let [r, g, b, a] = color;
            let alpha = if a.is_nan() { full } else { a };
            [r, g, b, alpha].into_iter().take(components)
        });
        let values = if is_bytes {
            // The cast is exact: the values are integers up to 255.
            Values::U8(numbers.map(|x| x as u8).collect())
        } else {
            Values::F64(numbers.collect())
        };
        Some(Property {
            name: COLOR.to_owned(),
            components,
            values,
        })
    }
}
