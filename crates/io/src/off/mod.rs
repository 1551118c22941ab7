//! Geomview OFF: vertices, then faces, with normals, colours and texture coordinates.
//!
//! Header words are `OFF` with the prefixes `ST`, `C` and `N` in any order (texture coordinates,
//! colours, normals). The x y z of a vertex are followed by its normal, its colour and its
//! texture coordinates; three or four further numbers are a colour even if the header does not
//! declare one. The corners of a face are followed by its colour, or by one index into a colour
//! map (face property `color_index`, −1 for none). Colours are integers up to 255 or real numbers
//! up to 1; elements without a colour are white if others have one. The counts may be on the line
//! of the header word, even without a space between them, or after it. The number of edges is
//! optional.
//!
//! A vertex or face is a line. Only if that does not work are the numbers read as they come,
//! across line endings, as in Geomview. Rows after the last promised face are preserved in the
//! file but not read, with a [`Warning`]: other programs go by the counts and display only the
//! promised rows. Source: Geomview manual, section "OFF Files".
//!
//! The files of this folder are one concept and use each other freely; outside of it, only
//! [`formats`](crate::formats) and [`detect`](crate::detect) use them.

mod attributes;
mod header;
mod new;
mod rebuild;
mod words;

#[cfg(test)]
mod tests;

use std::sync::Arc;

use nalgebra::Point3;

use crate::attributes::Attributes;
use crate::coordinate;
use crate::error::{Element, IoError, Place, Warning, quote};
use crate::faces::FaceList;
use crate::format::Format;
use crate::limits::Limits;
use crate::number;
use crate::parsed::Parsed;
use crate::remap::Remap;
use crate::room;
use crate::source::{Mesh, Moves, Reading, SourceFile, TextPatch};
use crate::text::{self, Line, Token, Tokens};

use header::Header;
use words::{Rows, Words, line_number};

pub(crate) use header::is_header_word;
pub(crate) use new::{losses, write_new};

/// Name of the face property that holds colour map indices.
const COLOR_INDEX: &str = "color_index";

/// Reads an OFF file; the header word may be missing.
pub(crate) fn read(bytes: Vec<u8>, limits: &Limits) -> Result<Reading, IoError> {
    let (parsed, file) = parse(bytes, limits)?;
    Ok(Reading::new(parsed, file))
}

/// Reads a document.
#[cfg(test)]
fn open(bytes: Vec<u8>, limits: &Limits) -> Result<crate::Document, IoError> {
    crate::Document::from_reading(read(bytes, limits)?)
}

fn parse(bytes: Vec<u8>, limits: &Limits) -> Result<(Parsed, OffFile), IoError> {
    let mut rows = Rows::new(&bytes, text::after_bom(&bytes), limits);
    let header = Header::read(&mut rows, bytes.len(), limits)?;
    let body = read_rows(rows, &header, limits).or_else(|error| {
        // Violated limits and invalid coordinates are errors regardless of the line structure.
        let is_final = matches!(error, IoError::OverLimit { .. } | IoError::NonFinite { .. });
        if is_final {
            return Err(error);
        }
        let free = header
            .free_forms(&bytes)
            .find_map(|(start, width)| read_free(&bytes, start, width, &header, limits).ok());
        free.ok_or(error)
    })?;
    let Body {
        positions,
        faces,
        layout,
        warnings,
    } = body;
    let parsed = Parsed {
        positions,
        faces,
        warnings,
        ..Parsed::default()
    };
    let file = OffFile {
        bytes,
        header,
        layout,
    };
    Ok((parsed, file))
}

/// The data after the header.
#[derive(Default)]
struct Body {
    positions: Vec<Point3<f64>>,
    faces: FaceList,
    layout: Layout,
    warnings: Vec<Warning>,
}

/// The locations of the rows of a file.
#[derive(Debug, Default)]
struct Layout {
    /// The offset of the x of each vertex.
    starts: Vec<usize>,
    /// The number of values of each vertex after x y z, if not determined by line endings.
    width: Option<usize>,
    /// The byte range of the vertices.
    vertices: std::ops::Range<usize>,
    num_faces: usize,
    /// `true` if vertices or faces have numbers of unknown meaning.
    has_unknown: [bool; 2],
    /// The number of rows after the faces.
    num_unpromised: usize,
}

/// Reads vertices and faces line by line.
fn read_rows(mut rows: Rows<'_>, header: &Header, limits: &Limits) -> Result<Body, IoError> {
    let num_bytes = rows.num_bytes();
    let mut body = Body::new(header, num_bytes, limits)?;
    body.layout.vertices.start = rows.position();
    for vertex in 0..header.num_vertices {
        let row = rows.expect("vertex", vertex, header.num_vertices)?;
        let mut tokens = Tokens::new(row.text);
        let place = Place::Line(row.number);
        let (position, x) = coordinate::position(&mut tokens, vertex, place)?;
        body.positions.push(position);
        body.layout.starts.push(row.start + x);
        body.layout.has_unknown[0] |= header.color_numbers(tokens.count()).is_none();
    }
    body.layout.vertices.end = rows.position();
    for face in 0..header.num_faces {
        let row = rows.expect("face", face, header.num_faces)?;
        let place = || Place::Line(row.number);
        let mut tokens = Tokens::new(row.text);
        read_face(&mut tokens, &place, header, &mut body.faces, limits)?;
        body.layout.has_unknown[1] |= !matches!(tokens.count(), 0 | 1 | 3 | 4);
        limits.check_memory(num_bytes, header.num_vertices, body.faces.num_corners())?;
    }
    if let Some(row) = rows.next()? {
        body.layout.num_unpromised = 1;
        while rows.next()?.is_some() {
            body.layout.num_unpromised += 1;
        }
        body.warnings.push(Warning {
            place: Some(Place::Line(row.number)),
            message: format!(
                "{} more rows follow the {} faces that the header promises; they are kept but not read",
                body.layout.num_unpromised, header.num_faces
            ),
        });
    }
    Ok(body)
}

/// Reads vertices and faces regardless of line endings; all words must be used up.
fn read_free(
    bytes: &[u8],
    start: usize,
    width: usize,
    header: &Header,
    limits: &Limits,
) -> Result<Body, IoError> {
    let mut body = Body::new(header, bytes.len(), limits)?;
    body.layout.width = Some(width);
    body.layout.vertices.start = start;
    let mut words = Words::new(bytes, start);
    // The line does not matter: the error of the line-by-line reading is reported instead.
    let place = Place::Line(0);
    for vertex in 0..header.num_vertices {
        let (position, x) = coordinate::position(&mut words, vertex, place)?;
        body.positions.push(position);
        body.layout.starts.push(x);
        let found = words.by_ref().take(width).count();
        if found < width {
            return Err(IoError::TooFewNumbers {
                place,
                element: Element::new("vertex", vertex),
                found: found + 3,
                needed: width + 3,
            });
        }
    }
    body.layout.vertices.end = words.at();
    for _ in 0..header.num_faces {
        read_face(&mut words, &|| place, header, &mut body.faces, limits)?;
        let more = Tokens::new(words.rest_of_line()).count();
        body.layout.has_unknown[1] |= !matches!(more, 0 | 1 | 3 | 4);
        words.skip_line();
        limits.check_memory(bytes.len(), header.num_vertices, body.faces.num_corners())?;
    }
    match words.next() {
        None => Ok(body),
        Some(_) => Err(IoError::MoreThanPromised {
            place,
            promised: header.num_faces as u64,
        }),
    }
}

impl Body {
    fn new(header: &Header, num_bytes: usize, limits: &Limits) -> Result<Self, IoError> {
        limits.check_memory(num_bytes, header.num_vertices, 0)?;
        let mut body = Self::default();
        // The header is bounded by the size of the file.
        room::reserve_exact(&mut body.positions, header.num_vertices)?;
        room::reserve_exact(&mut body.layout.starts, header.num_vertices)?;
        body.layout.num_faces = header.num_faces;
        Ok(body)
    }
}

/// Appends a face.
fn read_face<'a>(
    tokens: &mut impl Iterator<Item = Token<'a>>,
    place: &impl Fn() -> Place,
    header: &Header,
    faces: &mut FaceList,
    limits: &Limits,
) -> Result<(), IoError> {
    let face = faces.len();
    let num_vertices = header.num_vertices;
    let bad = |text: &[u8], expected| IoError::BadNumber {
        place: place(),
        element: Element::new("face", face),
        text: quote(text),
        expected,
    };
    let first = tokens.next().map_or(&b""[..], |token| token.text);
    let degree = number::parse_integer(first)
        .and_then(|n| usize::try_from(n).ok())
        .ok_or_else(|| bad(first, "a number of corners"))?;
    if degree < 3 {
        return Err(IoError::TooFewCorners {
            place: place(),
            face,
            degree,
        });
    }
    for found in 0..degree {
        let token = tokens.next().ok_or_else(|| IoError::TooFewNumbers {
            place: place(),
            element: Element::new("face", face),
            found: found + 1,
            needed: degree.saturating_add(1),
        })?;
        limits.check_degree(found + 1)?;
        limits.check_corners(faces.num_corners() + 1)?;
        faces.make_room(1, 1)?;
        let index =
            number::parse_integer(token.text).ok_or_else(|| bad(token.text, "a vertex number"))?;
        match u32::try_from(index) {
            Ok(vertex) if (vertex as usize) < num_vertices => faces.push_corner(vertex),
            _ => {
                return Err(IoError::IndexOutOfRange {
                    place: place(),
                    face,
                    index,
                    first: 0,
                    num_vertices,
                });
            }
        }
    }
    faces.end_face();
    Ok(())
}

/// An OFF file as it was read.
#[derive(Debug)]
struct OffFile {
    bytes: Vec<u8>,
    header: Header,
    layout: Layout,
}

impl OffFile {
    /// The words of a vertex: x y z and the values after them.
    fn vertex_words(&self, vertex: usize) -> impl Iterator<Item = Token<'_>> {
        let start = self.layout.starts.get(vertex).copied();
        let words = Words::new(&self.bytes, start.unwrap_or(self.bytes.len()));
        let end = match self.layout.width {
            None => words.at() + words.rest_of_line().len(),
            Some(_) => usize::MAX,
        };
        let most = self.layout.width.map_or(usize::MAX, |width| width + 3);
        words.take_while(move |word| word.start < end).take(most)
    }

    /// The location of a byte, for an error.
    fn place(&self, at: usize) -> Place {
        Place::Line(line_number(&self.bytes, at))
    }
}

impl SourceFile for OffFile {
    fn format(&self) -> Format {
        Format::Off
    }

    fn num_bytes(&self) -> usize {
        self.bytes.len()
    }

    fn attributes(&self, _mesh: Mesh<'_>) -> Result<Attributes, IoError> {
        attributes::decode(self)
    }

    fn has_normals(&self) -> bool {
        self.header.has_normals
    }

    fn extras(&self) -> Vec<String> {
        let mut extras = Vec::new();
        let [vertices, faces] = self.layout.has_unknown;
        if vertices {
            extras.push("further numbers of the vertices".to_owned());
        }
        if faces {
            extras.push("further numbers of the faces".to_owned());
        }
        match self.layout.num_unpromised {
            0 => {}
            n => extras.push(format!("{n} rows after the last face")),
        }
        extras
    }

    fn write(&self, _format: Format, moves: &Moves<'_>) -> Result<Vec<u8>, IoError> {
        if moves.moved.is_empty() {
            return Ok(self.bytes.clone());
        }
        let mut patch = TextPatch::new(&self.bytes);
        let mut normals = moves.normals.vertices.iter().peekable();
        for (vertex, &moved) in moves.moved.iter().enumerate() {
            let normal = normals.next_if(|(v, _)| *v as usize == vertex);
            let position = moved.then(|| moves.mesh.positions[vertex].coords.into());
            if !moved && normal.is_none() {
                continue;
            }
            let numbers = [position, normal.map(|(_, n)| *n)];
            let numbers = numbers.into_iter().flat_map(|triple: Option<[f64; 3]>| {
                triple.map_or([None; 3], |triple| triple.map(Some))
            });
            for (word, number) in self.vertex_words(vertex).zip(numbers) {
                // A number whose value is unchanged keeps its digits.
                let number = number.filter(|&x| number::parse_f64(word.text) != Some(x));
                if let Some(x) = number {
                    patch.replace(word.start, word.text.len(), |out| {
                        number::push_f64(out, x);
                        // A whole number at the start of a line could be taken for the corners of
                        // a face, and the file be read line by line from then on.
                        let is_free = self.layout.width.is_some();
                        if is_free && number::parse_integer(out.as_bytes()).is_some() {
                            out.push_str(".0");
                        }
                    });
                }
            }
        }
        Ok(patch.finish())
    }

    fn rebuild(&self, remap: &Remap, mesh: Mesh<'_>) -> Result<Arc<dyn SourceFile>, IoError> {
        read(rebuild::rebuild(self, remap), &Limits::NONE)?.matching(remap, mesh)
    }
}

/// The error for a header line.
fn problem(row: Line<'_>, text: &str) -> IoError {
    IoError::Header {
        line: row.number,
        problem: text.to_owned(),
    }
}
