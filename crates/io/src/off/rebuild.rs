//! The text of a mesh made of the vertices and faces of an OFF file.
//!
//! Rows are copied unchanged together with the comments before them. Comments before dropped rows
//! are kept. Vertices that are not separated by lines are written one per line.
//!
//! The file is not written anew from its attributes, because these lack further numbers, rows
//! after the last face, the places of comments, and which faces have no colour.

use std::fmt::Write as _;
use std::ops::Range;

use super::OffFile;
use super::attributes::{FaceRow, FaceRows, comments};
use super::words::is_line_end;
use crate::attributes::NONE;
use crate::remap::Remap;
use crate::source::TextPatch;

pub(super) fn rebuild(file: &OffFile, remap: &Remap) -> Vec<u8> {
    let mut out = Text::default();
    let section = file.layout.vertices.clone();
    let mut head = TextPatch::new(file.bytes.get(..section.start).unwrap_or(&[]));
    let counts = [remap.vertices.len(), remap.faces.len()];
    for (place, count) in file.header.counts.iter().zip(counts) {
        head.replace(place.start, place.len(), |out| {
            // Writing to a String cannot fail.
            let _ = write!(out, "{count}");
        });
    }
    out.push(&head.finish());
    match file.layout.width {
        None => vertices_by_lines(file, remap, &mut out),
        Some(_) => {
            for comment in comments(file.bytes.get(section).unwrap_or(&[])) {
                out.push(&[b"# ", comment, b"\n"].concat());
            }
            for &vertex in &remap.vertices {
                let words = file.vertex_words(vertex as usize);
                let words: Vec<&[u8]> = words.map(|word| word.text).collect();
                out.push(&words.join(&b' '));
            }
        }
    }
    faces(file, remap, &mut out);
    out.bytes
}

/// A row that is longer than this and copied more than once loses its comment: many copies of a
/// row as long as the file would exhaust memory.
const LONGEST_COPY: usize = 1 << 10;
/// Maximum number of meaningful values after x y z: a normal, a colour, texture coordinates.
const MAX_FURTHER: usize = 9;

fn vertices_by_lines(file: &OffFile, remap: &Remap, out: &mut Text) {
    let starts = &file.layout.starts;
    let mut before = Before::new(file.layout.vertices.start);
    let row = |vertex: usize| starts.get(vertex).map(|&start| line_of(&file.bytes, start));
    let mut is_written = vec![false; starts.len()];
    for &vertex in &remap.vertices {
        let vertex = vertex as usize;
        before.copy_to(vertex + 1, row, file, out);
        let Some(row) = row(vertex) else { continue };
        if std::mem::replace(&mut is_written[vertex], true) && row.len() > LONGEST_COPY {
            let words = file.vertex_words(vertex).take(3 + MAX_FURTHER);
            let words: Vec<&[u8]> = words.map(|word| word.text).collect();
            out.push(&words.join(&b' '));
        } else {
            out.push(&file.bytes[row]);
        }
    }
    before.copy_to(starts.len(), row, file, out);
}

fn faces(file: &OffFile, remap: &Remap, out: &mut Text) {
    let rows: Vec<FaceRow> = FaceRows::new(file).collect();
    let section = file.layout.vertices.end;
    let mut before = Before::new(section);
    // A face begins at its line start, or after the vertices if the last one shares that line.
    let row_of = |row: &FaceRow| line_start(&file.bytes, row.start).max(section)..row.end;
    let row = |face: usize| rows.get(face).map(row_of);
    let mut corners = String::new();
    for (face, polygon) in remap.faces.iter().enumerate() {
        corners.clear();
        let _ = write!(corners, "{}", polygon.len());
        for v in polygon {
            let _ = write!(corners, " {v}");
        }
        let source = remap.face_sources.get(face).copied().unwrap_or(NONE) as usize;
        let Some(old) = rows.get(source) else {
            corners.push('\n');
            out.push(corners.as_bytes());
            continue;
        };
        before.copy_to(source + 1, row, file, out);
        let line = row_of(old);
        let written = file.bytes.get(old.start..old.corners_end).unwrap_or(&[]);
        let mut words = super::words::Words::new(written, 0);
        let mut new = corners.split(' ');
        let is_same = loop {
            match (words.next(), new.next()) {
                (None, None) => break true,
                (Some(word), Some(new)) if word.text == new.as_bytes() => {}
                _ => break false,
            }
        };
        if is_same {
            out.push(file.bytes.get(line).unwrap_or(&[]));
        } else {
            out.push(file.bytes.get(line.start..old.start).unwrap_or(&[]));
            out.bytes.extend_from_slice(corners.as_bytes());
            let rest = file.bytes.get(old.corners_end..old.end).unwrap_or(&[]);
            out.bytes.extend_from_slice(rest);
        }
    }
    before.copy_to(rows.len(), row, file, out);
    // Rows that were not promised, and comments.
    let end = rows.last().map_or(section, |row| row.end);
    out.push(file.bytes.get(end..).unwrap_or(&[]));
}

/// Copies the text between the rows, each piece once and in order.
struct Before {
    /// The next row whose preceding text has not been copied.
    next: usize,
    /// The end of the last row before it.
    end: usize,
}

impl Before {
    fn new(start: usize) -> Self {
        Self {
            next: 0,
            end: start,
        }
    }

    /// Copies the text before all rows up to `count`.
    fn copy_to(
        &mut self,
        count: usize,
        row: impl Fn(usize) -> Option<Range<usize>>,
        file: &OffFile,
        out: &mut Text,
    ) {
        while self.next < count {
            let Some(row) = row(self.next) else { return };
            out.push(file.bytes.get(self.end..row.start).unwrap_or(&[]));
            self.end = row.end;
            self.next += 1;
        }
    }
}

/// Text in which every piece starts on a line of its own.
#[derive(Default)]
struct Text {
    bytes: Vec<u8>,
}

impl Text {
    /// Appends text that starts a line.
    fn push(&mut self, text: &[u8]) {
        let ends_line = self.bytes.last().is_none_or(|&b| is_line_end(b));
        if !ends_line && !text.is_empty() && self.bytes != b"\xef\xbb\xbf" {
            self.bytes.push(b'\n');
        }
        self.bytes.extend_from_slice(text);
    }
}

fn line_start(bytes: &[u8], at: usize) -> usize {
    let before = bytes.get(..at).unwrap_or(&[]);
    let end = before.iter().rposition(|&b| is_line_end(b));
    end.map_or(0, |end| end + 1)
}

/// The line that contains a byte, including the line ending.
fn line_of(bytes: &[u8], at: usize) -> Range<usize> {
    let mut words = super::words::Words::new(bytes, at);
    words.skip_line();
    line_start(bytes, at)..words.at()
}
