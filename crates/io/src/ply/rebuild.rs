//! The PLY file of a mesh made of another's vertices and faces.
//!
//! Rows move with their vertices and faces. Their contents are copied unchanged, except for
//! vertex indices, and for lists with the same number of items per corner of a face, whose items
//! move with the corners.
//!
//! The file is not written anew from its attributes, because these lack other elements, edges,
//! numbers that were not declared, and whether the file is text; new files are binary.

use std::ops::Range;

use crate::attributes::NONE;
use crate::error::IoError;
use crate::remap::Remap;
use crate::source::Mesh;

use super::PlyFile;
use super::layout::{CORNERS, Element, ElementKind, NumberType, Property};
use super::rows::{Encoded, Number, Walk, with_encoding};

/// The bytes of the new file.
pub(super) fn rebuild(file: &PlyFile, remap: &Remap, mesh: Mesh<'_>) -> Result<Vec<u8>, IoError> {
    with_encoding!(file.layout.encoding, build(file, remap, mesh))
}

fn build<E: Encoded>(file: &PlyFile, remap: &Remap, mesh: Mesh<'_>) -> Result<Vec<u8>, IoError> {
    let layout = &file.layout;
    let mut header = HeaderPatch::new(file);
    let mut rows = Rows {
        file,
        remap,
        mesh,
        line_end: header.line_end,
        out: Vec::new(),
    };
    let mut has_faces = false;
    for (number, element) in layout.elements.iter().enumerate() {
        let span = file.elements[number]..file.elements[number + 1];
        let count = match element.kind {
            ElementKind::Vertex => rows.vertices::<E>(element)?,
            ElementKind::Face => {
                has_faces = true;
                rows.faces::<E>(element, span.start)?
            }
            ElementKind::Strips => {
                has_faces = true;
                header.replace(element, &rows.declaration());
                rows.plain_faces::<E>()?;
                continue;
            }
            ElementKind::Edge => rows.edges::<E>(element, span)?,
            ElementKind::Other => {
                rows.copy::<E>(span)?;
                element.count
            }
        };
        header.set_count(element, count);
    }
    if !has_faces && !remap.faces.is_empty() {
        header.insert(layout.header_end[0], rows.declaration());
        rows.plain_faces::<E>()?;
    }
    // Copy the bytes after the last row.
    rows.copy::<E>(file.elements[layout.elements.len()]..file.bytes.len())?;
    let mut out = header.finish(layout.header_end[1]);
    out.extend_from_slice(&rows.out);
    Ok(out)
}

/// A copy of the header with some of its parts replaced, built from front to back.
struct HeaderPatch<'a> {
    bytes: &'a [u8],
    line_end: &'static str,
    copied: usize,
    out: Vec<u8>,
}

impl<'a> HeaderPatch<'a> {
    fn new(file: &'a PlyFile) -> Self {
        let bytes = file.bytes.as_slice();
        let first = bytes.iter().position(|&b| b == b'\n' || b == b'\r');
        let line_end = match first.map(|at| &bytes[at..]) {
            Some([b'\r', b'\n', ..]) => "\r\n",
            Some([b'\r', ..]) => "\r",
            _ => "\n",
        };
        Self {
            bytes,
            line_end,
            copied: 0,
            out: Vec::new(),
        }
    }

    fn put(&mut self, span: Range<usize>, text: &str) {
        self.out
            .extend_from_slice(&self.bytes[self.copied..span.start]);
        self.out.extend_from_slice(text.as_bytes());
        self.copied = span.end;
    }

    fn set_count(&mut self, element: &Element, count: usize) {
        if count != element.count {
            self.put(element.place.count.clone(), &count.to_string());
        }
    }

    /// Replaces the lines of an element and its properties.
    fn replace(&mut self, element: &Element, lines: &[String]) {
        let text: String = lines
            .iter()
            .flat_map(|line| [line.as_str(), self.line_end])
            .collect();
        for (i, line) in element.place.lines.iter().enumerate() {
            self.put(line.clone(), if i == 0 { &text } else { "" });
        }
    }

    fn insert(&mut self, at: usize, lines: [String; 2]) {
        for line in lines {
            self.put(at..at, &line);
            self.put(at..at, self.line_end);
        }
    }

    fn finish(mut self, end: usize) -> Vec<u8> {
        self.put(end..end, "");
        self.out
    }
}

/// The new rows.
struct Rows<'a> {
    file: &'a PlyFile,
    remap: &'a Remap,
    mesh: Mesh<'a>,
    line_end: &'static str,
    out: Vec<u8>,
}

impl Rows<'_> {
    fn end_row<E: Encoded>(&mut self) -> Result<(), IoError> {
        if E::IS_TEXT {
            self.out.extend_from_slice(self.line_end.as_bytes());
        }
        self.check_growth()
    }

    /// Rejects excessive growth: copies of one long row must not turn a small file into a huge
    /// one.
    fn check_growth(&self) -> Result<(), IoError> {
        let num_bytes = self.file.bytes.len();
        // The faces of a strip are longer than the strip.
        let of_faces = self.remap.faces.num_corners().saturating_mul(16);
        let most = (64usize << 20)
            .saturating_add(num_bytes.saturating_mul(8))
            .saturating_add(of_faces);
        if self.out.len() <= most {
            return Ok(());
        }
        Err(IoError::Unsupported {
            feature: format!(
                "a PLY of more than {most} bytes, made of copied rows of a file of {num_bytes}"
            ),
            remedy: "write the mesh in another format and change that file",
        })
    }

    /// Copies rows unchanged.
    fn copy<E: Encoded>(&mut self, span: Range<usize>) -> Result<(), IoError> {
        let rows = &self.file.bytes[span];
        let is_blank = E::IS_TEXT && rows.trim_ascii().is_empty();
        if !is_blank {
            E::push_raw(&mut self.out, rows);
            self.end_row::<E>()?;
        }
        Ok(())
    }

    fn vertices<E: Encoded>(&mut self, element: &Element) -> Result<usize, IoError> {
        let file = self.file;
        let mut walk = Walk::new(&file.bytes, 0, element);
        for &vertex in &self.remap.vertices {
            let vertex = vertex as usize;
            let start = file.starts.get(vertex).filter(|_| vertex < element.count);
            let row = start.and_then(|start| {
                walk.at = start;
                walk.next::<E>()
            });
            let row = row.ok_or(IoError::NoSuchVertex {
                vertex,
                num_vertices: element.count,
            })?;
            E::push_raw(&mut self.out, &file.bytes[row]);
            self.end_row::<E>()?;
        }
        Ok(self.remap.vertices.len())
    }

    fn faces<E: Encoded>(&mut self, element: &Element, start: usize) -> Result<usize, IoError> {
        let (file, remap) = (self.file, self.remap);
        let (starts, per_corner) = old_faces::<E>(file, element, start)?;
        let mut walk = Walk::new(&file.bytes, start, element);
        for (face, polygon) in remap.faces.iter().enumerate() {
            let source = remap.face_sources.get(face).copied().unwrap_or(NONE);
            let row = starts.get(source as usize).and_then(|&start| {
                walk.at = start;
                walk.next::<E>()
            });
            let mut end = 0;
            for (i, &property) in element.properties.iter().enumerate() {
                let cell = row.as_ref().map(|_| &walk.cells[i]);
                end = cell.map_or(end, |cell| cell.span.end);
                match property {
                    Property::Corners(length, item) => {
                        self.polygon::<E>(polygon, length, item)?;
                    }
                    Property::List(length, item) => match (&per_corner[i], cell) {
                        (Some(items), _) => self.corner_items::<E>(items, face, length, item)?,
                        (None, Some(cell)) => {
                            E::push_raw(&mut self.out, &file.bytes[cell.span.clone()]);
                        }
                        (None, None) => E::push(&mut self.out, length, Number::Integer(0)),
                    },
                    Property::Scalar(number) | Property::Coordinate(_, number) => match cell {
                        Some(cell) => {
                            E::push_raw(&mut self.out, &file.bytes[cell.span.clone()]);
                        }
                        None => E::push(&mut self.out, number, Number::zero(number)),
                    },
                }
            }
            if let Some(row) = row {
                // A text row may have more numbers than were declared.
                E::push_raw(&mut self.out, &file.bytes[end..row.end]);
            }
            self.end_row::<E>()?;
        }
        Ok(remap.faces.len())
    }

    fn polygon<E: Encoded>(
        &mut self,
        polygon: &[u32],
        length: NumberType,
        item: NumberType,
    ) -> Result<(), IoError> {
        self.length::<E>(polygon.len(), length)?;
        for &vertex in polygon {
            let index = index(vertex, item)?;
            E::push(&mut self.out, item, index);
        }
        Ok(())
    }

    fn length<E: Encoded>(&mut self, length: usize, number: NumberType) -> Result<(), IoError> {
        let fitting = i64::try_from(length).ok();
        let fitting = fitting.filter(|length| number.range().contains(length));
        let length = fitting.ok_or_else(|| {
            unfit(format!(
                "a list of {length} numbers in a file whose lists have lengths of type `{}`",
                number.name()
            ))
        })?;
        E::push(&mut self.out, number, Number::Integer(length));
        Ok(())
    }

    /// Writes a list whose items move with the corners of the face. It is empty if no corner has
    /// items.
    fn corner_items<E: Encoded>(
        &mut self,
        items: &CornerItems,
        face: usize,
        length: NumberType,
        item: NumberType,
    ) -> Result<(), IoError> {
        let (file, remap) = (self.file, self.remap);
        let corners = remap.faces.corner_range(face);
        let place = |corner: usize| {
            let old = *remap.corner_sources.get(corner)?;
            let place = *items.places.get(old as usize)?;
            (place != NOWHERE).then_some(place)
        };
        if corners.clone().all(|corner| place(corner).is_none()) {
            return self.length::<E>(0, length);
        }
        self.length::<E>(items.per_corner * corners.len(), length)?;
        for corner in corners {
            self.check_growth()?;
            let start = place(corner);
            let end = start.and_then(|start| E::skip(&file.bytes, start, items.per_corner, item));
            match start.zip(end) {
                Some((start, end)) => E::push_raw(&mut self.out, &file.bytes[start..end]),
                None => (0..items.per_corner)
                    .for_each(|_| E::push(&mut self.out, item, Number::zero(item))),
            }
        }
        Ok(())
    }

    /// The header lines for faces in a file that had none.
    fn declaration(&self) -> [String; 2] {
        let length = self.plain_length().name();
        [
            format!("element face {}", self.remap.faces.len()),
            format!("property list {length} int {}", CORNERS[0]),
        ]
    }

    fn plain_length(&self) -> NumberType {
        if self.remap.faces.iter().all(|polygon| polygon.len() <= 255) {
            NumberType::U8
        } else {
            NumberType::U32
        }
    }

    fn plain_faces<E: Encoded>(&mut self) -> Result<(), IoError> {
        let (length, remap) = (self.plain_length(), self.remap);
        for polygon in remap.faces.iter() {
            self.polygon::<E>(polygon, length, NumberType::I32)?;
            self.end_row::<E>()?;
        }
        Ok(())
    }

    /// For each old vertex, the first new vertex copied from it.
    fn new_numbers(&self) -> Vec<u32> {
        let mut numbers = vec![NONE; self.file.layout.num_vertices];
        let mut set = |old: u32, new: u32| {
            if let Some(number @ &mut NONE) = numbers.get_mut(old as usize) {
                *number = new;
            }
        };
        for (new, &old) in (0u32..).zip(&self.remap.vertices) {
            set(old, new);
        }
        // A vertex that was welded to another is found through its corners. A face that closes a
        // hole has no corners of its own.
        let faces = self.remap.faces.iter().zip(&self.remap.face_sources);
        for (face, (polygon, _)) in faces.enumerate().filter(|(_, (_, s))| **s != NONE) {
            let sources = self.remap.faces.corner_range(face);
            let sources = self.remap.corner_sources.get(sources).unwrap_or(&[]);
            for (&new, &source) in polygon.iter().zip(sources) {
                if let Some(&old) = self.mesh.faces.corners().get(source as usize) {
                    set(old, new);
                }
            }
        }
        numbers
    }

    /// Writes the edges between vertices that still exist, and returns their number.
    fn edges<E: Encoded>(
        &mut self,
        element: &Element,
        span: Range<usize>,
    ) -> Result<usize, IoError> {
        let end = |name: &str| {
            let property = element.names.iter().position(|n| n == name)?;
            match element.properties[property] {
                Property::Scalar(number) if number.is_integer() => Some(property),
                _ => None,
            }
        };
        let Some(ends) = end("vertex1").zip(end("vertex2")) else {
            self.copy::<E>(span)?;
            return Ok(element.count);
        };
        let new = self.new_numbers();
        let bytes = &self.file.bytes;
        let mut walk = Walk::new(bytes, span.start, element);
        let mut count = 0;
        for _ in 0..element.count {
            let Some(row) = walk.next::<E>() else { break };
            let vertex = |property: usize| {
                let number = element.properties[property].number();
                let old = E::integer(&bytes[walk.cells[property].span.clone()], number)?;
                let new = *new.get(usize::try_from(old).ok()?)?;
                (new != NONE).then_some(new)
            };
            let Some(pair) = vertex(ends.0).zip(vertex(ends.1)) else {
                continue;
            };
            let mut copied = row.start;
            for (i, &property) in element.properties.iter().enumerate() {
                let span = walk.cells[i].span.clone();
                copied = span.end;
                let vertex = match i {
                    _ if i == ends.0 => pair.0,
                    _ if i == ends.1 => pair.1,
                    _ => {
                        E::push_raw(&mut self.out, &bytes[span]);
                        continue;
                    }
                };
                let number = property.number();
                E::push(&mut self.out, number, index(vertex, number)?);
            }
            E::push_raw(&mut self.out, &bytes[copied..row.end]);
            self.end_row::<E>()?;
            count += 1;
        }
        Ok(count)
    }
}

/// The items of one list property, with the same number per corner.
struct CornerItems {
    per_corner: usize,
    /// The offset of each old corner's items, or [`NOWHERE`]. Ends with the last corner that has
    /// any.
    places: Vec<usize>,
}

const NOWHERE: usize = usize::MAX;

/// See [`old_faces`].
type OldFaces = (Vec<usize>, Vec<Option<CornerItems>>);

/// The offsets of the old face rows and, for each property, the items of the corners if it is a
/// list with the same number of items for every corner (or none for a face).
fn old_faces<E: Encoded>(
    file: &PlyFile,
    element: &Element,
    start: usize,
) -> Result<OldFaces, IoError> {
    let bytes = &file.bytes;
    let mut starts = Vec::new();
    let mut lists: Vec<Option<CornerItems>> = element
        .properties
        .iter()
        .map(|property| {
            matches!(property, Property::List(..)).then_some(CornerItems {
                per_corner: 0,
                places: Vec::new(),
            })
        })
        .collect();
    let corners = element
        .properties
        .iter()
        .position(|property| matches!(property, Property::Corners(..)));
    let mut walk = Walk::new(bytes, start, element);
    // Lists that are empty for most faces have an entry per corner but hardly any bytes.
    let most = (8usize << 20).saturating_add(bytes.len());
    let (mut num_places, mut first_corner) = (0usize, 0usize);
    for _ in 0..element.count {
        let Some(row) = walk.next::<E>() else { break };
        starts.push(row.start);
        let degree = corners.map_or(0, |corners| walk.cells[corners].length);
        for (i, list) in lists.iter_mut().enumerate() {
            let Some(items) = list else { continue };
            let cell = &walk.cells[i];
            let of_each = cell.length.checked_div(degree).unwrap_or(0);
            if cell.length == 0 {
                continue;
            }
            if of_each * degree == cell.length
                && (items.per_corner == 0 || items.per_corner == of_each)
            {
                let end = first_corner + degree;
                num_places = num_places.saturating_add(end - items.places.len());
                if num_places > most {
                    return Err(unfit(format!(
                        "more than {most} places of lists that follow the corners of faces"
                    )));
                }
                items.places.resize(first_corner, NOWHERE);
                items.per_corner = of_each;
                let mut at = cell.items.start;
                let number = element.properties[i].number();
                for _ in 0..degree {
                    items.places.push(at);
                    at = E::skip(bytes, at, of_each, number).unwrap_or(at);
                }
            } else {
                *list = None;
            }
        }
        first_corner += degree;
    }
    Ok((starts, lists))
}

fn index(vertex: u32, number: NumberType) -> Result<Number, IoError> {
    let index = i64::from(vertex);
    if number.range().contains(&index) {
        Ok(Number::Integer(index))
    } else {
        Err(unfit(format!(
            "vertex {vertex} in a file whose indices have the type `{}`",
            number.name()
        )))
    }
}

fn unfit(feature: String) -> IoError {
    IoError::Unsupported {
        feature,
        remedy: "save in another format",
    }
}
