//! Geomview OFF, with one vertex or face a line; what stands behind them is kept and not read.
//!
//! Header words are `OFF` with the prefixes `ST`, `C` and `N` (texture coordinates, colours and
//! normals, which all stand behind x y z); the counts follow on the same line or the next one,
//! the number of edges may be missing. Source: Geomview manual, section "OFF Files".

use std::fmt::Write as _;
use std::sync::Arc;

use nalgebra::Point3;

use crate::attributes::Attributes;
use crate::coordinate;
use crate::document::{Document, Parsed};
use crate::error::{Element, IoError, Place, quote};
use crate::faces::FaceList;
use crate::format::Format;
use crate::limits::Limits;
use crate::number;
use crate::remap::Remap;
use crate::source::{Mesh, Moves, SourceFile, rewrite_tokens};
use crate::text::{self, Line, Lines, Tokens};
use crate::writer::Contents;

/// Whether a word is the header of an OFF file, of any kind (also those that are refused).
pub(crate) fn is_header_word(word: &[u8]) -> bool {
    let Some(mut prefix) = word.strip_suffix(b"OFF") else {
        return false;
    };
    for part in [&b"ST"[..], b"C", b"N", b"4", b"n"] {
        prefix = prefix.strip_prefix(part).unwrap_or(prefix);
    }
    prefix.is_empty()
}

/// Reads an OFF file; the header word may be missing.
pub(crate) fn read(bytes: Vec<u8>, limits: &Limits) -> Result<Document, IoError> {
    let lines = Lines::new(&bytes, text::after_bom(&bytes));
    let mut rows = Rows {
        lines,
        num_comments: 0,
    };
    let header = Header::read(&mut rows, bytes.len(), limits)?;
    let mut extras = Vec::new();

    let mut positions = Vec::with_capacity(header.num_vertices);
    let mut starts = Vec::with_capacity(header.num_vertices);
    let mut has_more = false;
    for vertex in 0..header.num_vertices {
        let row = rows.expect("vertex", vertex, header.num_vertices)?;
        let (position, start, more) = read_vertex(row, vertex)?;
        positions.push(position);
        starts.push(start);
        has_more |= more;
    }
    if has_more {
        extras.push("further numbers of the vertices (colours, normals, …)".to_owned());
    }

    let mut faces = FaceList::new();
    let mut has_colours = false;
    for face in 0..header.num_faces {
        let row = rows.expect("face", face, header.num_faces)?;
        has_colours |= read_face(row, positions.len(), &mut faces)?;
        limits.check_corners(faces.num_corners())?;
    }
    if has_colours {
        extras.push("colours of faces".to_owned());
    }
    if let Some(row) = rows.next() {
        let promised = header.num_faces as u64;
        return Err(IoError::MoreThanPromised {
            place: Place::Line(row.number),
            promised,
        });
    }
    if rows.num_comments > 0 {
        extras.push(format!("{} comments", rows.num_comments));
    }
    let parsed = Parsed {
        positions,
        faces,
        ..Parsed::default()
    };
    let file = OffFile {
        has_normals: header.has_normals,
        bytes,
        starts,
        extras,
    };
    Document::from_source(parsed, file)
}

/// An OFF file as it was read.
#[derive(Debug)]
struct OffFile {
    bytes: Vec<u8>,
    /// Where the x of each vertex stands.
    starts: Vec<usize>,
    extras: Vec<String>,
    has_normals: bool,
}

impl SourceFile for OffFile {
    fn format(&self) -> Format {
        Format::Off
    }

    fn attributes(&self, _mesh: Mesh<'_>) -> Result<Attributes, IoError> {
        Ok(Attributes::default())
    }

    fn has_normals(&self) -> bool {
        self.has_normals
    }

    fn extras(&self) -> Vec<String> {
        self.extras.clone()
    }

    fn write(&self, _format: Format, moves: &Moves<'_>) -> Result<Vec<u8>, IoError> {
        Ok(rewrite_tokens(&self.bytes, &self.starts, moves))
    }

    fn rebuild(&self, _remap: &Remap, _mesh: Mesh<'_>) -> Result<Arc<dyn SourceFile>, IoError> {
        Err(IoError::Unsupported {
            feature: "repairing an OFF".to_owned(),
            remedy: "convert it",
        })
    }
}

/// The lines that are not blank, without their comments.
struct Rows<'a> {
    lines: Lines<'a>,
    num_comments: usize,
}

impl<'a> Rows<'a> {
    fn next(&mut self) -> Option<Line<'a>> {
        self.lines.find_map(|line| {
            let text = text::before_comment(line.text);
            self.num_comments += usize::from(text.len() < line.text.len());
            (!text.trim_ascii().is_empty()).then_some(Line { text, ..line })
        })
    }

    fn expect(
        &mut self,
        kind: &'static str,
        number: usize,
        promised: usize,
    ) -> Result<Line<'a>, IoError> {
        self.next().ok_or_else(|| IoError::CutShort {
            place: Place::Line(self.lines.number),
            element: Element::new(kind, number),
            promised: promised as u64,
        })
    }
}

struct Header {
    num_vertices: usize,
    num_faces: usize,
    has_normals: bool,
}

impl Header {
    fn read(rows: &mut Rows<'_>, num_bytes: usize, limits: &Limits) -> Result<Self, IoError> {
        let mut row = rows.next().ok_or(IoError::UnknownFormat)?;
        let word = Tokens::new(row.text)
            .next()
            .map_or(&b""[..], |token| token.text);
        let mut counts = row.text;
        let mut has_normals = false;
        if is_header_word(word) {
            has_normals = word.contains(&b'N');
            if word.contains(&b'4') || word.contains(&b'n') {
                return Err(problem(
                    row,
                    "vertices of other than three dimensions are not read",
                ));
            }
            counts = &row.text[word_end(row.text)..];
            if Tokens::new(counts)
                .next()
                .is_some_and(|token| token.text == b"BINARY")
            {
                return Err(problem(
                    row,
                    "binary OFF is not read; convert the file to text",
                ));
            }
            if counts.trim_ascii().is_empty() {
                row = rows
                    .next()
                    .ok_or_else(|| problem(row, "the numbers of vertices and faces are missing"))?;
                counts = row.text;
            }
        }
        let mut tokens = Tokens::new(counts);
        let mut count = |name: &str, least_bytes: usize| {
            let token = tokens.next().map_or(&b""[..], |token| token.text);
            let count = number::parse_integer(token).and_then(|n| usize::try_from(n).ok());
            let count = count.ok_or_else(|| {
                problem(
                    row,
                    &format!("`{}` is not the number of {name}", quote(token)),
                )
            })?;
            if count > num_bytes / least_bytes {
                let text = format!("{count} {name} are promised, more than {num_bytes} bytes hold");
                return Err(problem(row, &text));
            }
            Ok(count)
        };
        // "0 0 0\n" and "3 0 1 2\n", less the last line end.
        let num_vertices = count("vertices", 5)?;
        let num_faces = count("faces", 7)?;
        limits.check_vertices(num_vertices)?;
        limits.check_faces(num_faces)?;
        Ok(Self {
            num_vertices,
            num_faces,
            has_normals,
        })
    }
}

fn word_end(text: &[u8]) -> usize {
    Tokens::new(text)
        .next()
        .map_or(0, |token| token.start + token.text.len())
}

fn problem(row: Line<'_>, text: &str) -> IoError {
    IoError::Header {
        line: row.number,
        problem: text.to_owned(),
    }
}

/// The position, where its x stands, and whether more numbers follow.
fn read_vertex(row: Line<'_>, vertex: usize) -> Result<(Point3<f64>, usize, bool), IoError> {
    let place = Place::Line(row.number);
    let mut tokens = Tokens::new(row.text);
    let (position, x) = coordinate::position(&mut tokens, vertex, place)?;
    Ok((position, row.start + x, tokens.next().is_some()))
}

/// Appends a face and says whether more numbers follow.
fn read_face(row: Line<'_>, num_vertices: usize, faces: &mut FaceList) -> Result<bool, IoError> {
    let place = Place::Line(row.number);
    let face = faces.len();
    let bad = |text: &[u8], expected| IoError::BadNumber {
        place,
        element: Element::new("face", face),
        text: quote(text),
        expected,
    };
    let mut tokens = Tokens::new(row.text);
    let first = tokens.next().map_or(&b""[..], |token| token.text);
    let degree = number::parse_integer(first)
        .and_then(|n| usize::try_from(n).ok())
        .ok_or_else(|| bad(first, "a number of corners"))?;
    if degree < 3 {
        return Err(IoError::TooFewCorners {
            place,
            face,
            degree,
        });
    }
    for found in 0..degree {
        let token = tokens.next().ok_or_else(|| IoError::TooFewNumbers {
            place,
            element: Element::new("face", face),
            found: found + 1,
            needed: degree.saturating_add(1),
        })?;
        let index =
            number::parse_integer(token.text).ok_or_else(|| bad(token.text, "a vertex number"))?;
        match u32::try_from(index) {
            Ok(vertex) if (vertex as usize) < num_vertices => faces.push_corner(vertex),
            _ => {
                return Err(IoError::IndexOutOfRange {
                    place,
                    face,
                    index,
                    first: 0,
                    num_vertices,
                });
            }
        }
    }
    faces.end_face();
    Ok(tokens.next().is_some())
}

/// What a new OFF file cannot hold, in words.
pub(crate) fn losses(_attributes: &Attributes) -> Vec<String> {
    Vec::new()
}

/// A new OFF file.
pub(crate) fn write_new(contents: &Contents<'_>) -> Result<Vec<u8>, IoError> {
    let (positions, faces) = (&contents.positions, &contents.faces);
    // Writing to a String cannot fail.
    let mut out = String::new();
    let _ = writeln!(out, "OFF\n{} {} 0", positions.len(), faces.len());
    for p in positions.iter() {
        for (axis, &x) in p.iter().enumerate() {
            if axis > 0 {
                out.push(' ');
            }
            number::push_f64(&mut out, x);
        }
        out.push('\n');
    }
    for polygon in faces.iter() {
        let _ = write!(out, "{}", polygon.len());
        for v in polygon {
            let _ = write!(out, " {v}");
        }
        out.push('\n');
    }
    Ok(out.into_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Document, IoError> {
        read(text.as_bytes().to_vec(), &Limits::default())
    }

    fn refusal(text: &str) -> String {
        parse(text).unwrap_err().to_string()
    }

    const BODY: &str = "0 0 0\n1 0 0\n\n1 1 0\n0 1 0\n4 0 1 2 3\n";

    #[test]
    fn headers_come_in_many_shapes() {
        for header in [
            "OFF\n4 1 0\n",
            "OFF 4 1\n",
            "# c\nOFF # c\n\n# c\n4 1 4#c\n",
            "4 1 0\r\n",
            "\u{feff}COFF\r4 1 0\r",
        ] {
            let document = parse(&format!("{header}{BODY}")).unwrap();
            assert_eq!(
                (document.positions().len(), document.faces().num_corners()),
                (4, 4),
                "{header}"
            );
        }
        for header in ["4OFF\n4 1 0\n", "nOFF\n3\n4 1 0\n", "OFF BINARY\n4 1 0\n"] {
            assert!(
                refusal(&format!("{header}{BODY}")).starts_with("line 1: "),
                "{header}"
            );
        }
    }

    #[test]
    fn further_numbers_are_kept_and_not_read() {
        let text = "STCNOFF\n3 1 0\n0 0 0  0 0 1  255 0 0 1  .5 .5\n1 0 0 nan\n0 1 0 #c\n3 0 1 2 0.5 0.5 0.5\n";
        let mut document = parse(text).unwrap();
        document
            .set_position(0, Point3::new(0.0, 0.25, 0.0))
            .unwrap();
        let written = String::from_utf8(document.write(Format::Off).unwrap()).unwrap();
        assert_eq!(written, text.replace("\n0 0 0  0", "\n0 0.25 0  0"));
        assert_eq!(document.losses(Format::Ply).len(), 3);
    }

    #[test]
    fn refusals_name_line_element_and_trouble() {
        let three = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n";
        let with = |line: &str| refusal(&format!("{three}{line}\n"));
        assert_eq!(
            with("3 0 1 3"),
            "line 6: face 0 refers to vertex 3, but the vertices are numbered 0 to 2"
        );
        assert_eq!(
            with("3 0 1 -1"),
            "line 6: face 0 refers to vertex -1, but the vertices are numbered 0 to 2"
        );
        assert_eq!(
            with("2 0 1"),
            "line 6: face 0 has 2 corners; a face needs three or more"
        );
        assert_eq!(with("4 0 1 2"), "line 6: face 0 has 4 numbers; it needs 5");
        assert_eq!(
            with("9223372036854775807 0 1 2"),
            "line 6: face 0 has `9223372036854775807` where a number of corners is expected"
        );
        assert_eq!(
            with("999999999999999999 0 1"),
            "line 6: face 0 has 3 numbers; it needs 1000000000000000000"
        );
        assert_eq!(
            with("3 0 1 2.5"),
            "line 6: face 0 has `2.5` where a vertex number is expected"
        );
        assert_eq!(
            with(""),
            "line 6: the file ends at face 0, but 1 were promised; it was cut short"
        );
        assert!(with("3 0 1 2\n3 0 2 1").starts_with("line 7: more rows follow the 1 faces"));
        assert!(
            refusal("OFF\n999999999999 1 0\n0 0 0")
                .starts_with("line 2: 999999999999 vertices are promised")
        );
        assert!(refusal("OFF\nx\n").starts_with("line 2: `x` is not the number of vertices"));
        assert!(
            refusal("OFF\n").starts_with("line 1: the numbers of vertices and faces are missing")
        );
        assert!(refusal("OFF\n0 0 0\n").starts_with("no vertices"));
        assert!(
            refusal("OFF\n3 0\n0 0 0\n1 inf 0\n")
                .starts_with("line 4: vertex 1 has the coordinate inf")
        );
    }
}
