//! Wavefront OBJ: `v` and `f` are read, everything else is kept as it stands.
//!
//! Vertices keep the numbers of the file, also those that no face uses. Accepted are `v x y z`
//! with anything behind (a weight, a colour), `f` with corners `v`, `v/vt`, `v//vn`, `v/vt/vn`,
//! negative indices counted from the latest vertex, references to vertices further down,
//! lines continued by a backslash, comments, and every line end. Source: Wavefront, "Object
//! Files (.obj)", Advanced Visualizer manual, appendix B1.

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
use crate::text::{self, Lines, Tokens};
use crate::writer::Contents;

/// Reads an OBJ file.
pub(crate) fn read(bytes: Vec<u8>, limits: &Limits) -> Result<Document, IoError> {
    let mut reader = Reader::new(limits);
    let mut lines = Lines::new(&bytes, text::after_bom(&bytes));
    while let Some(line) = lines.next() {
        let statement = continued(&bytes, line, &mut lines);
        let Some(keyword) = Tokens::new(statement).next() else {
            reader.num_comments += usize::from(statement.contains(&b'#'));
            continue;
        };
        let after = keyword.start + keyword.text.len();
        let place = Place::Line(line.number);
        match keyword.text {
            b"v" => reader.vertex(&statement[after..], line.start + after, place)?,
            b"f" => reader.face(&statement[after..], line.number)?,
            other => reader.count(other),
        }
    }
    reader.check_forward_references()?;
    let (extras, num_normals) = (reader.extras(), reader.num_normals());
    let Reader {
        positions,
        faces,
        starts,
        ..
    } = reader;
    let parsed = Parsed {
        positions,
        faces,
        ..Parsed::default()
    };
    let file = ObjFile {
        bytes,
        starts,
        extras,
        num_normals,
    };
    Document::from_source(parsed, file)
}

/// An OBJ file as it was read.
#[derive(Debug)]
struct ObjFile {
    bytes: Vec<u8>,
    /// Where the x of each vertex stands.
    starts: Vec<usize>,
    extras: Vec<String>,
    num_normals: usize,
}

impl SourceFile for ObjFile {
    fn format(&self) -> Format {
        Format::Obj
    }

    fn attributes(&self, _mesh: Mesh<'_>) -> Result<Attributes, IoError> {
        Ok(Attributes::default())
    }

    fn has_normals(&self) -> bool {
        self.num_normals > 0
    }

    fn extras(&self) -> Vec<String> {
        self.extras.clone()
    }

    fn write(&self, _format: Format, moves: &Moves<'_>) -> Result<Vec<u8>, IoError> {
        Ok(rewrite_tokens(&self.bytes, &self.starts, moves))
    }

    fn rebuild(&self, _remap: &Remap, _mesh: Mesh<'_>) -> Result<Arc<dyn SourceFile>, IoError> {
        Err(IoError::Unsupported {
            feature: "repairing an OBJ".to_owned(),
            remedy: "convert it",
        })
    }
}

/// The line together with the lines that a backslash at its end continues it with.
#[inline]
fn continued<'a>(bytes: &'a [u8], line: text::Line<'a>, lines: &mut Lines<'a>) -> &'a [u8] {
    let mut end = line.start + line.text.len();
    // A comment may end in a backslash (a Windows path) and must not swallow a vertex.
    if line.text.ends_with(b"\\") && !line.text.trim_ascii_start().starts_with(b"#") {
        while bytes[..end].ends_with(b"\\") {
            let Some(next) = lines.next() else { break };
            end = next.start + next.text.len();
        }
    }
    &bytes[line.start..end]
}

struct Reader<'a> {
    limits: &'a Limits,
    positions: Vec<Point3<f64>>,
    faces: FaceList,
    /// Where the x of each vertex stands.
    starts: Vec<usize>,
    /// The largest reference to a vertex further down: its number, its face, its line.
    forward: Option<(i64, usize, usize)>,
    num_comments: usize,
    num_coloured: usize,
    /// How many statements of each kind of [`OTHERS`] there are.
    others: [usize; OTHERS.len()],
}

/// Statements that are kept and not read, in words.
const OTHERS: [(&[&[u8]], &str); 7] = [
    (&[b"vt"], "texture coordinates (vt)"),
    (&[b"vn"], "normals (vn)"),
    (&[b"usemtl", b"mtllib"], "materials (usemtl, mtllib)"),
    (&[b"g", b"o"], "groups and objects (g, o)"),
    (&[b"s"], "smoothing groups (s)"),
    (&[b"l", b"p"], "lines and points (l, p)"),
    (
        &[b"vp", b"curv", b"curv2", b"surf", b"cstype"],
        "free-form geometry",
    ),
];

impl<'a> Reader<'a> {
    fn new(limits: &'a Limits) -> Self {
        Self {
            limits,
            positions: Vec::new(),
            faces: FaceList::new(),
            starts: Vec::new(),
            forward: None,
            num_comments: 0,
            num_coloured: 0,
            others: [0; OTHERS.len()],
        }
    }

    #[inline]
    fn vertex(&mut self, numbers: &[u8], start: usize, place: Place) -> Result<(), IoError> {
        let vertex = self.positions.len();
        let mut tokens = Tokens::new(numbers);
        let (position, x) = coordinate::position(&mut tokens, vertex, place)?;
        self.starts.push(start + x);
        // x y z r g b, against x y z w.
        self.num_coloured += usize::from(tokens.nth(2).is_some());
        self.positions.push(position);
        self.limits.check_vertices(self.positions.len())
    }

    #[inline]
    fn face(&mut self, corners: &[u8], line: usize) -> Result<(), IoError> {
        let face = self.faces.len();
        let place = Place::Line(line);
        for token in Tokens::new(corners) {
            let index = corner(token.text).ok_or_else(|| IoError::BadNumber {
                place,
                element: Element::new("face", face),
                text: quote(token.text),
                expected: "a corner (v, v/vt, v//vn or v/vt/vn)",
            })?;
            let vertex = self.resolve(index, face, line)?;
            self.faces.push_corner(vertex);
        }
        let degree = self.faces.end_face();
        if degree < 3 {
            return Err(IoError::TooFewCorners {
                place,
                face,
                degree,
            });
        }
        self.limits.check_corners(self.faces.num_corners())?;
        self.limits.check_faces(self.faces.len())
    }

    /// The vertex, counted from 0, that an index of the file means.
    #[inline]
    fn resolve(&mut self, index: i64, face: usize, line: usize) -> Result<u32, IoError> {
        let num_vertices = self.positions.len() as i64;
        let vertex = if index < 0 {
            num_vertices + index
        } else {
            index - 1
        };
        let vertex = u32::try_from(vertex).map_err(|_| self.out_of_range(index, face, line))?;
        if index > num_vertices && self.forward.is_none_or(|(largest, ..)| index > largest) {
            self.forward = Some((index, face, line));
        }
        Ok(vertex)
    }

    fn check_forward_references(&self) -> Result<(), IoError> {
        match self.forward {
            Some((index, face, line)) if index > self.positions.len() as i64 => {
                Err(self.out_of_range(index, face, line))
            }
            _ => Ok(()),
        }
    }

    fn out_of_range(&self, index: i64, face: usize, line: usize) -> IoError {
        let num_vertices = self.positions.len();
        IoError::IndexOutOfRange {
            place: Place::Line(line),
            face,
            index,
            first: 1,
            num_vertices,
        }
    }

    fn count(&mut self, keyword: &[u8]) {
        if let Some(kind) = OTHERS
            .iter()
            .position(|(words, _)| words.contains(&keyword))
        {
            self.others[kind] += 1;
        }
    }

    fn num_normals(&self) -> usize {
        self.others[1]
    }

    fn extras(&self) -> Vec<String> {
        let mut extras = Vec::new();
        if self.num_comments > 0 {
            extras.push(format!("{} comments", self.num_comments));
        }
        if self.num_coloured > 0 {
            extras.push(format!("colours of {} vertices", self.num_coloured));
        }
        for (&count, (_, name)) in self.others.iter().zip(&OTHERS) {
            if count > 0 {
                extras.push(format!("{count} {name}"));
            }
        }
        extras
    }
}

/// The vertex index of `v`, `v/vt`, `v//vn` or `v/vt/vn`.
#[inline]
fn corner(token: &[u8]) -> Option<i64> {
    match token.iter().position(|&b| b == b'/') {
        None => number::parse_integer(token),
        Some(slash) => {
            let rest = &token[slash..];
            let well_formed = rest
                .iter()
                .all(|b| matches!(b, b'/' | b'-' | b'+' | b'0'..=b'9'));
            number::parse_integer(&token[..slash]).filter(|_| well_formed)
        }
    }
}

/// What a new OBJ file cannot hold, in words.
pub(crate) fn losses(_attributes: &Attributes) -> Vec<String> {
    Vec::new()
}

/// A new OBJ file.
pub(crate) fn write_new(contents: &Contents<'_>) -> Result<Vec<u8>, IoError> {
    let (positions, faces) = (contents.positions.iter(), &contents.faces);
    let mut out = String::new();
    for p in positions {
        out.push('v');
        for &x in p.iter() {
            out.push(' ');
            number::push_f64(&mut out, x);
        }
        out.push('\n');
    }
    for polygon in faces.iter() {
        out.push('f');
        for &v in polygon {
            // Writing to a String cannot fail.
            let _ = write!(out, " {}", u64::from(v) + 1);
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

    #[test]
    fn every_way_to_write_a_corner_means_the_same_vertex() {
        let text = "\u{feff}# square\r\nv 0 0 0 1\r\n\tv 1 0 0 0.5 nan 0.5\r\nv +1.0 1e0 .0\r\n\
                    v 0 1 0 # the last\r\nvt 0 0\nvn 0 0 1\n\
                    f 1 2 3#x\nf 1/1 2/1 3/1 4/1\nf 1//1 2//1 3//1\nf -4/-1/-1 -3/1/1 \\\r\n-2/1/1\n";
        let document = parse(text).unwrap();
        assert_eq!(document.positions()[2], Point3::new(1.0, 1.0, 0.0));
        let faces: Vec<_> = document.faces().iter().collect();
        assert_eq!(
            faces,
            [&[0, 1, 2][..], &[0, 1, 2, 3], &[0, 1, 2], &[0, 1, 2]]
        );
        assert_eq!(
            document.losses(Format::Off),
            [
                "1 comments will be lost in OFF".to_owned(),
                "colours of 1 vertices will be lost in OFF".to_owned(),
                "1 texture coordinates (vt) will be lost in OFF".to_owned(),
                "1 normals (vn) will be lost in OFF".to_owned(),
            ]
        );
        assert!(document.losses(Format::Obj).is_empty());
    }

    #[test]
    fn a_face_may_stand_before_its_vertices() {
        let document = parse("f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n").unwrap();
        assert_eq!(document.faces().get(0), Some(&[0, 1, 2][..]));
        assert!(
            refusal("f 1 2 3\nf 1 2 4\nv 0 0 0\nv 1 0 0\nv 0 1 0\n")
                .starts_with("line 2: face 1 refers to vertex 4")
        );
    }

    #[test]
    fn a_comment_that_ends_in_a_backslash_swallows_nothing() {
        let document = parse("# C:\\meshes\\\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3").unwrap();
        assert_eq!(document.positions().len(), 3);
    }

    #[test]
    fn refusals_name_line_element_and_trouble() {
        let three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
        let with = |line: &str| refusal(&format!("{three}{line}\n"));
        assert_eq!(
            with("f 0 1 2"),
            "line 4: face 0 refers to vertex 0, but the vertices are numbered 1 to 3"
        );
        assert_eq!(
            with("f 1 2 -4"),
            "line 4: face 0 refers to vertex -4, but the vertices are numbered 1 to 3"
        );
        assert_eq!(
            with("f 1 2"),
            "line 4: face 0 has 2 corners; a face needs three or more"
        );
        assert_eq!(
            with("f 1 2 x"),
            "line 4: face 0 has `x` where a corner (v, v/vt, v//vn or v/vt/vn) is expected"
        );
        assert!(with("f 1 2/x 3").starts_with("line 4: face 0 has `2/x`"));
        assert!(with("f 1 2 99999999999999999999").starts_with("line 4: face 0 has"));
        assert_eq!(with("v 1 2"), "line 4: vertex 3 has 2 numbers; it needs 3");
        assert_eq!(
            with("v 1 2 x\u{7f}y"),
            "line 4: vertex 3 has `x\u{fffd}y` where a number is expected"
        );
        assert!(with("v 1 nan 3").starts_with("line 4: vertex 3 has the coordinate nan"));
        assert!(with("v 1 1e999 3").starts_with("line 4: vertex 3 has the coordinate 1e999"));
        assert!(refusal("").starts_with("no vertices"));
        assert!(refusal("<!DOCTYPE html>\n<p>404</p>").starts_with("no vertices"));
    }

    #[test]
    fn moved_vertices_change_and_nothing_else_does() {
        let text =
            "v  0.10 \\\n 0\t0.0  1 # w\r\no box\nv 1 0 0\nv 0 1 0\nv 9 9 9\nvt 1 1\nf 1/1 2/1 3/1";
        let mut document = parse(text).unwrap();
        document
            .set_position(0, Point3::new(-0.5, 1e-30, 12345.0))
            .unwrap();
        document
            .set_position(2, Point3::new(0.1 + 0.2, 0.0, 0.0))
            .unwrap();
        let written = String::from_utf8(document.write(Format::Obj).unwrap()).unwrap();
        let expected = text
            .replace("0.10 \\\n 0\t0.0", "-0.5 \\\n 1e-30\t12345")
            .replace("v 0 1 0", "v 0.30000000000000004 0 0");
        assert_eq!(written, expected);
    }
}
