//! Wavefront OBJ: `v` and `f` are read, everything else is kept as it stands.
//!
//! Vertices keep the numbers of the file, also those that no face uses. Accepted are `v x y z`
//! with anything behind (a weight, a colour), `f` with corners `v`, `v/vt`, `v//vn`, `v/vt/vn`,
//! negative indices counted from the latest vertex, references to vertices further down,
//! lines continued by a backslash, comments, and every line end. Source: Wavefront, "Object
//! Files (.obj)", Advanced Visualizer manual, appendix B1.

mod counts;
mod decode;
mod fast;
mod parse;
mod patch;
mod statement;

use std::sync::Arc;

use crate::attributes::Attributes;
use crate::document::{Document, Parsed};
use crate::error::IoError;
use crate::format::Format;
use crate::limits::Limits;
use crate::number;
use crate::obj::counts::Counts;
use crate::remap::Remap;
use crate::source::{Mesh, Moves, SourceFile};
use crate::writer::Contents;

/// Reads an OBJ file.
pub(crate) fn read(bytes: Vec<u8>, limits: &Limits) -> Result<Document, IoError> {
    let parse::Mesh {
        positions,
        faces,
        counts,
    } = parse::parse(&bytes, limits)?;
    let parsed = Parsed {
        positions,
        faces,
        warnings: counts.warnings(),
        ..Parsed::default()
    };
    Document::from_source(parsed, ObjFile { bytes, counts })
}

/// An OBJ file as it was read. Where its vertices stand is found again when it is needed, since
/// that takes less time than the memory is worth.
#[derive(Debug)]
struct ObjFile {
    bytes: Vec<u8>,
    counts: Counts,
}

impl SourceFile for ObjFile {
    fn format(&self) -> Format {
        Format::Obj
    }

    fn attributes(&self, mesh: Mesh<'_>) -> Result<Attributes, IoError> {
        decode::attributes(self, mesh)
    }

    fn has_normals(&self) -> bool {
        self.counts.normals() > 0
    }

    fn extras(&self) -> Vec<String> {
        self.counts.extras()
    }

    fn write(&self, _format: Format, moves: &Moves<'_>) -> Result<Vec<u8>, IoError> {
        Ok(patch::rewrite(self, moves))
    }

    fn rebuild(&self, _remap: &Remap, _mesh: Mesh<'_>) -> Result<Arc<dyn SourceFile>, IoError> {
        Err(IoError::Unsupported {
            feature: "repairing an OBJ".to_owned(),
            remedy: "convert it",
        })
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
            out.push(' ');
            number::push_integer(&mut out, u64::from(v) + 1);
        }
        out.push('\n');
    }
    Ok(out.into_bytes())
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

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
