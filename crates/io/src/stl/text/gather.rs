//! The text of a mesh made of the facets of a text STL.
//!
//! Facets are copied unchanged, each in its original solid. Solids without remaining facets are
//! kept.
//!
//! The file is not written anew from its attributes, because new files are binary: coordinates
//! would be rounded to 32 bits, and the solids would be lost.

use std::ops::Range;

use nalgebra::Point3;

use super::{CORNER_AT, NORMAL_AT, NUM_WORDS, TextStl};
use crate::error::IoError;
use crate::number;
use crate::remap::Remap;
use crate::source::{Mesh, TextPatch};
use crate::stl::rebuild::{self, Facet};

pub(super) fn gather(file: &TextStl, remap: &Remap, mesh: Mesh<'_>) -> Result<Vec<u8>, IoError> {
    let mut new = Gathered {
        file,
        out: Vec::with_capacity(file.bytes.len()),
        current: None,
        num_opened: 0,
    };
    for face in 0..remap.faces.len() {
        let facet = Facet::new(remap, mesh, face)?;
        let solid = new.solid_of(&facet);
        new.open(solid);
        new.facet(&facet, mesh);
    }
    new.open(None);
    Ok(new.out)
}

/// The text written so far.
struct Gathered<'a> {
    file: &'a TextStl,
    out: Vec<u8>,
    /// The solid to which facets are being written.
    current: Option<usize>,
    /// The number of solids opened so far, including empty ones.
    num_opened: usize,
}

/// A solid with longer header lines is not reopened for a facet that closes a hole: many copies
/// of a name as long as the file would exhaust memory.
const LONGEST_COPY: usize = 1 << 10;

impl Gathered<'_> {
    /// The solid of a facet; one that closes a hole goes with its neighbour.
    fn solid_of(&self, facet: &Facet) -> Option<usize> {
        let solids = &self.file.layout.solids;
        let solid = solids.partition_point(|s| s.facets.end <= facet.neighbour as usize);
        let solid = solid.min(solids.len().checked_sub(1)?);
        let next = solids.get(solid)?;
        let length = (next.body - next.start) + (next.end - next.body_end);
        match self.current {
            Some(current) if facet.source.is_none() && length > LONGEST_COPY => Some(current),
            _ => Some(solid),
        }
    }

    /// Continues with another solid, or to the end. Solids in between without facets are kept.
    fn open(&mut self, solid: Option<usize>) {
        if solid.is_some() && solid == self.current {
            return;
        }
        let solids = &self.file.layout.solids;
        if let Some(current) = self.current.and_then(|current| solids.get(current)) {
            self.copy(current.body_end..current.end);
        }
        let between = self.num_opened..solid.unwrap_or(solids.len()).min(solids.len());
        for empty in solids.get(between).unwrap_or(&[]) {
            self.copy(empty.start..empty.body);
            self.copy(empty.body_end..empty.end);
        }
        match solid.and_then(|number| solids.get(number)) {
            Some(next) => self.copy(next.start..next.body),
            // Copy the text after the last solid.
            None => self.copy(solids.last().map_or(0, |last| last.end)..self.file.bytes.len()),
        }
        self.num_opened = self.num_opened.max(solid.map_or(solids.len(), |s| s + 1));
        self.current = solid;
    }

    /// Copies a part of the file, keeping the words on both sides of the seam separate.
    fn copy(&mut self, range: Range<usize>) {
        let text = self.file.bytes.get(range).unwrap_or(&[]);
        self.push(text);
    }

    fn push(&mut self, text: &[u8]) {
        let ends_in_word = self.out.last().is_some_and(|b| !b.is_ascii_whitespace());
        let starts_with_word = text.first().is_some_and(|b| !b.is_ascii_whitespace());
        // The byte order mark is not a word of the first solid.
        if ends_in_word && starts_with_word && self.out != b"\xef\xbb\xbf" {
            self.out.push(b'\n');
        }
        self.out.extend_from_slice(text);
    }

    fn facet(&mut self, facet: &Facet, mesh: Mesh<'_>) {
        let file = self.file;
        let Some(source) = facet.source else {
            let text = new_facet(facet.positions(mesh));
            return self.push(text.as_bytes());
        };
        let words = file.words(source as usize);
        let (start, end) = (words[0].start, words[NUM_WORDS - 1].end());
        let solid = self.current.and_then(|s| file.layout.solids.get(s));
        let (body, first) = solid.map_or((0, 0), |s| (s.body, s.facets.start));
        // A facet is copied with the whitespace before it, as far as that belongs to its solid.
        let before = file.bytes.get(body..start).unwrap_or(&[]);
        let mut offset = body + before.trim_ascii_end().len();
        if self.out.ends_with(b"\n") && source as usize != first {
            let blanks = file.bytes.get(offset..start).unwrap_or(&[]);
            offset += match blanks {
                [b'\r', b'\n', ..] => 2,
                [b'\r' | b'\n', ..] => 1,
                _ => 0,
            };
        }
        let text = file.bytes.get(offset..end).unwrap_or(&[]);
        let mut patch = TextPatch::new(text);
        let mut replace = |at: usize, new: [String; 3]| {
            for (word, new) in words[at..].iter().zip(new) {
                if word.text != new.as_bytes() {
                    patch.replace(word.start - offset, word.text.len(), |out| {
                        out.push_str(&new);
                    });
                }
            }
        };
        if facet.is_turned {
            let normal = [0, 1, 2].map(|k| negated(words[NORMAL_AT + k].text));
            replace(NORMAL_AT, normal);
        }
        for (k, (at, corner)) in CORNER_AT.into_iter().zip(facet.corners).enumerate() {
            if corner.old == Some(3 * source + k as u32) {
                continue;
            }
            let new = match corner.old {
                Some(old) => {
                    let words = file.words(old as usize / 3);
                    let at = CORNER_AT[old as usize % 3];
                    [0, 1, 2].map(|k| String::from_utf8_lossy(words[at + k].text).into_owned())
                }
                None => {
                    let position = mesh.positions[corner.vertex as usize];
                    <[f64; 3]>::from(position.coords).map(shortest)
                }
            };
            replace(at, new);
        }
        let text = patch.finish();
        self.push(&text);
    }
}

/// The text of a facet that closes a hole.
fn new_facet(corners: [Point3<f64>; 3]) -> String {
    let triple = |numbers: [f64; 3]| numbers.map(shortest).join(" ");
    let normal = triple(rebuild::normal(&corners));
    let [a, b, c] = corners.map(|p| triple(p.coords.into()));
    format!(
        "facet normal {normal}\nouter loop\nvertex {a}\nvertex {b}\nvertex {c}\nendloop\nendfacet"
    )
}

fn shortest(x: f64) -> String {
    let mut text = String::new();
    number::push_f64(&mut text, x);
    text
}

/// Negates a number while keeping its digits. Zeros and non-numbers are unchanged.
fn negated(text: &[u8]) -> String {
    let written = String::from_utf8_lossy(text);
    match number::parse_f64(text) {
        Some(x) if x != 0.0 && !x.is_nan() => match written.strip_prefix('-') {
            Some(magnitude) => magnitude.to_owned(),
            None => format!("-{}", written.strip_prefix('+').unwrap_or(&written)),
        },
        _ => written.into_owned(),
    }
}
