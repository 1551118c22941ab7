//! Stanford PLY, text and binary of both byte orders.
//!
//! The header is scanned and bounded here and then parsed by the `ply-rs` crate; the rows are
//! walked here, for three reasons. Their coordinates are to be replaced in place, which keeps
//! every other property, element and comment of the file. A table of hash maps costs 1.7 s where
//! the walk takes milliseconds. And exporters write blank lines, `nan` qualities and `.5`, which
//! that crate refuses. Source: G. Turk, "The PLY Polygon File Format", 1994.

mod ascii;
mod binary;
mod header;
mod layout;
mod rewrite;
mod write;

use nalgebra::Point3;
use ply_rs::ply::Encoding;

use crate::document::Document;
use crate::error::{IoError, Place, quote};
use crate::faces::FaceList;
use crate::limits::Limits;
use crate::source::{Rows, Source};

pub(crate) use rewrite::VertexRows;
pub(crate) use write::write;

use header::Header;
use layout::{ElementKind, Layout};

/// Reads a PLY file.
pub(crate) fn read(bytes: Vec<u8>, limits: &Limits) -> Result<Document, IoError> {
    let header = Header::read(&bytes)?;
    let layout = Layout::new(&header, bytes.len())?;
    limits.check_vertices(layout.num_vertices)?;
    limits.check_faces(layout.num_faces)?;
    let mut body = Body::new(&layout, limits);
    match header.ply.encoding {
        Encoding::Ascii => ascii::read(&bytes, &header, &layout, &mut body)?,
        Encoding::BinaryLittleEndian => {
            binary::read::<binary::Little>(&bytes, &header, &layout, &mut body)?;
        }
        Encoding::BinaryBigEndian => {
            binary::read::<binary::Big>(&bytes, &header, &layout, &mut body)?;
        }
    }
    let Body {
        positions,
        faces,
        starts,
        ..
    } = body;
    let contents = layout.contents(&header);
    let vertex = layout
        .elements
        .into_iter()
        .find(|e| e.kind == ElementKind::Vertex);
    let rows = VertexRows {
        encoding: header.ply.encoding,
        properties: vertex.map(|e| e.properties).unwrap_or_default(),
    };
    Document::from_source(
        positions,
        faces,
        Source::new(bytes, starts, Rows::Ply(rows), contents),
    )
}

/// What the rows are read into.
struct Body<'a> {
    limits: &'a Limits,
    /// The number of vertices that the header promises: faces may stand before them.
    num_vertices: usize,
    positions: Vec<Point3<f64>>,
    /// Where the row of each vertex starts.
    starts: Vec<usize>,
    faces: FaceList,
}

impl<'a> Body<'a> {
    /// `layout` has bounded the counts by the bytes of the file.
    fn new(layout: &Layout, limits: &'a Limits) -> Self {
        Self {
            limits,
            num_vertices: layout.num_vertices,
            positions: Vec::with_capacity(layout.num_vertices),
            starts: Vec::with_capacity(layout.num_vertices),
            faces: FaceList::new(),
        }
    }

    #[inline]
    fn push_vertex(
        &mut self,
        position: Point3<f64>,
        start: usize,
        place: impl Fn() -> Place,
    ) -> Result<(), IoError> {
        if let Some(value) = position.iter().find(|x| !x.is_finite()) {
            let vertex = self.positions.len();
            return Err(IoError::NonFinite {
                place: place(),
                vertex,
                value: value.to_string(),
            });
        }
        self.positions.push(position);
        self.starts.push(start);
        Ok(())
    }

    #[inline]
    fn push_corner(&mut self, index: i64, place: impl Fn() -> Place) -> Result<(), IoError> {
        match u32::try_from(index) {
            Ok(vertex) if (vertex as usize) < self.num_vertices => {
                self.faces.push_corner(vertex);
                Ok(())
            }
            _ => Err(IoError::IndexOutOfRange {
                place: place(),
                face: self.faces.len(),
                index,
                first: 0,
                num_vertices: self.num_vertices,
            }),
        }
    }

    #[inline]
    fn end_face(&mut self, place: impl Fn() -> Place) -> Result<(), IoError> {
        let face = self.faces.len();
        let degree = self.faces.end_face();
        if degree < 3 {
            return Err(IoError::TooFewCorners {
                place: place(),
                face,
                degree,
            });
        }
        self.limits.check_corners(self.faces.num_corners())
    }
}

fn problem(line: usize, text: impl Into<String>) -> IoError {
    IoError::Header {
        line,
        problem: text.into(),
    }
}
