//! Text STL: words between blanks, 21 of them a facet.
//!
//! Keywords are read in any case of letters and lines may end anywhere, except that the name of a
//! solid is what follows on its line. A normal may be no number (`nan`, `-1.#IND`).

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use nalgebra::Point3;

use super::rebuild::{self, Facet};
use super::soup::Soup;
use super::words::{Word, Words};
use crate::attributes::{Attributes, LabelKind, Labels, NONE, NORMAL, Property, Values};
use crate::document::Document;
use crate::error::{Element, IoError, Place, quote};
use crate::format::Format;
use crate::limits::Limits;
use crate::number;
use crate::remap::Remap;
use crate::source::{Mesh, Moves, SourceFile, TextPatch};
use crate::text as lines;

/// Where in a file its end or its first facet is looked for, to tell its format.
const WINDOW: usize = 1 << 16;

/// Whether a text starts as an STL does: `solid`, and facets or the end behind the name.
pub(super) fn is_text(bytes: &[u8]) -> bool {
    let window = &bytes[..bytes.len().min(WINDOW)];
    let mut words = Words::new(window, lines::after_bom(window));
    let Some(first) = words.next() else {
        return false;
    };
    if !first.is("solid") {
        return false;
    }
    words.solid_name();
    words.next().is_some_and(|word| {
        ["facet", "endsolid", "solid"]
            .iter()
            .any(|keyword| word.is(keyword))
    })
}

/// Whether what is known to be an STL can only be a text: no binary header without a zero byte has
/// a count of facets below 2^24.
pub(super) fn starts_as_text(bytes: &[u8]) -> bool {
    let window = &bytes[..bytes.len().min(super::binary::HEADER)];
    let first = Words::new(window, lines::after_bom(window)).next();
    first.is_some_and(|word| word.is("solid")) && !window.contains(&0)
}

pub(super) fn read(bytes: Vec<u8>, limits: &Limits) -> Result<Document, IoError> {
    let mut soup = Soup::new(limits, bytes.len());
    let layout = scan(&bytes, limits, |layout, corners| {
        let held = layout.num_bytes();
        soup.set_held(bytes.len().saturating_add(held));
        let mut positions = [([0; 3], Point3::origin()); 3];
        for (corner, words) in positions.iter_mut().zip(corners) {
            let mut position = Point3::origin();
            for (x, word) in position.iter_mut().zip(words) {
                *x = coordinate(&bytes, word, layout.facets.len(), soup.next_vertex())?;
            }
            // A negative zero is the same place as a positive one.
            let place = position.coords.map(|x| (x + 0.0).to_bits()).into();
            *corner = (place, position);
        }
        soup.facet(positions)
    })?;
    Document::from_source(soup.finish(Vec::new()), TextStl { bytes, layout })
}

/// Where the solids and facets of a file stand.
#[derive(Debug, Default)]
struct Layout {
    solids: Vec<Solid>,
    /// Where the word `facet` of each facet starts.
    facets: Vec<usize>,
    /// Whether a normal is not zero.
    has_normals: bool,
}

impl Layout {
    fn num_bytes(&self) -> usize {
        self.solids.len() * size_of::<Solid>() + self.facets.len() * size_of::<usize>()
    }
}

/// A solid: its text goes from the end of the one before to the end of its `endsolid` line.
#[derive(Debug)]
struct Solid {
    start: usize,
    /// Where its name stands.
    name: Range<usize>,
    /// The end of its `solid` line.
    body: usize,
    /// The end of its last facet, or its `body` if it has none.
    body_end: usize,
    end: usize,
    /// Its facets.
    facets: Range<usize>,
}

/// Walks through the file; `facet` gets what was found before and the words of three corners.
fn scan<'a>(
    bytes: &'a [u8],
    limits: &Limits,
    mut facet: impl FnMut(&Layout, [[Word<'a>; 3]; 3]) -> Result<(), IoError>,
) -> Result<Layout, IoError> {
    let mut words = Words::new(bytes, lines::after_bom(bytes));
    let mut layout = Layout::default();
    let mut end = 0;
    while let Some(word) = words.next() {
        if !word.is("solid") {
            return Err(unexpected(bytes, word, "`solid`"));
        }
        let name = words.solid_name();
        let body = words.at();
        let first = layout.facets.len();
        let mut body_end = body;
        loop {
            limits.check_line(words.longest_line())?;
            let Some(word) = words.next() else {
                return Err(cut_short(bytes, layout.facets.len(), "an `endsolid`"));
            };
            if word.is("endsolid") {
                break;
            }
            if !word.is("facet") {
                return Err(unexpected(bytes, word, "`facet` or `endsolid`"));
            }
            let number = layout.facets.len();
            let (has_normal, corners) = read_facet(bytes, &mut words, number)?;
            facet(&layout, corners)?;
            layout.facets.push(word.start);
            layout.has_normals |= has_normal;
            body_end = words.at();
        }
        if words.line_has_facet() {
            let problem = "facets stand on the line of an `endsolid`; they belong on a new one";
            return Err(malformed(bytes, words.at(), problem.to_owned()));
        }
        words.skip_line();
        let start = std::mem::replace(&mut end, words.at());
        layout.solids.push(Solid {
            start,
            name,
            body,
            body_end,
            end,
            facets: first..layout.facets.len(),
        });
        limits.check_memory(bytes.len().saturating_add(layout.num_bytes()), 0, 0)?;
    }
    limits.check_line(words.longest_line())?;
    Ok(layout)
}

/// What follows the word `facet`: whether its normal is not zero, and the words of its corners.
fn read_facet<'a>(
    bytes: &'a [u8],
    words: &mut Words<'a>,
    facet: usize,
) -> Result<(bool, [[Word<'a>; 3]; 3]), IoError> {
    let next = |words: &mut Words<'a>, expected: &str| {
        words
            .next()
            .ok_or_else(|| cut_short(bytes, facet, &format!("facet {facet}, before {expected}")))
    };
    let keyword = |words: &mut Words<'a>, expected: &str| {
        let word = next(words, expected)?;
        if word.is(expected) {
            return Ok(());
        }
        // A word that the end of the file cuts is no wrong word.
        if word.end() == bytes.len() {
            return Err(cut_short(bytes, facet, &format!("facet {facet}")));
        }
        let reason = match expected {
            "vertex" | "endloop" => "; a facet has three vertices",
            _ => "",
        };
        let expected = format!("`{expected}`");
        Err(malformed(
            bytes,
            word.start,
            format!(
                "facet {facet} has `{}` where {expected} is expected{reason}",
                quote(word.text)
            ),
        ))
    };
    let triple = |words: &mut Words<'a>| {
        let mut number = || next(words, "a number");
        Ok::<_, IoError>([number()?, number()?, number()?])
    };
    keyword(words, "normal")?;
    let mut has_normal = false;
    for word in triple(words)? {
        let number = normal_number(word.text).ok_or_else(|| bad_number(bytes, word, facet))?;
        has_normal |= number != 0.0;
    }
    keyword(words, "outer")?;
    keyword(words, "loop")?;
    let mut corner = || {
        keyword(words, "vertex")?;
        triple(words)
    };
    let corners = [corner()?, corner()?, corner()?];
    keyword(words, "endloop")?;
    keyword(words, "endfacet")?;
    Ok((has_normal, corners))
}

fn coordinate(bytes: &[u8], word: Word<'_>, facet: usize, vertex: usize) -> Result<f64, IoError> {
    match number::parse_f64(word.text) {
        Some(x) if x.is_finite() => Ok(x),
        Some(_) => Err(IoError::NonFinite {
            place: line(bytes, word.start),
            vertex,
            value: quote(word.text),
        }),
        None => Err(bad_number(bytes, word, facet)),
    }
}

/// A number of a normal; NaN for what C libraries write for it, which is no decimal number.
fn normal_number(text: &[u8]) -> Option<f64> {
    number::parse_f64(text).or_else(|| {
        let magnitude = text.strip_prefix(b"-").unwrap_or(text);
        let is_nan = magnitude
            .get(..3)
            .is_some_and(|start| start.eq_ignore_ascii_case(b"nan"));
        (is_nan || magnitude.starts_with(b"1.#")).then_some(f64::NAN)
    })
}

fn line(bytes: &[u8], at: usize) -> Place {
    let lines = lines::Lines::new(bytes, 0).take_while(|line| line.start <= at);
    Place::Line(lines.count().max(1))
}

fn malformed(bytes: &[u8], at: usize, problem: String) -> IoError {
    IoError::Malformed {
        place: line(bytes, at),
        problem,
    }
}

fn unexpected(bytes: &[u8], word: Word<'_>, expected: &str) -> IoError {
    let found = quote(word.text);
    malformed(
        bytes,
        word.start,
        format!("`{found}` stands where {expected} is expected"),
    )
}

fn cut_short(bytes: &[u8], facets: usize, missing: &str) -> IoError {
    let problem = if missing.starts_with("facet") {
        format!("the file ends in {missing}; it was cut short")
    } else {
        format!("the file ends after {facets} facets without {missing}; it was cut short")
    };
    malformed(bytes, bytes.len(), problem)
}

fn bad_number(bytes: &[u8], word: Word<'_>, facet: usize) -> IoError {
    IoError::BadNumber {
        place: line(bytes, word.start),
        element: Element::new("facet", facet),
        text: quote(word.text),
        expected: "a number",
    }
}

/// A text STL as it was read.
#[derive(Debug)]
struct TextStl {
    bytes: Vec<u8>,
    layout: Layout,
}

/// The numbers of a facet among its words.
const NORMAL_AT: usize = 2;
const CORNER_AT: [usize; 3] = [8, 12, 16];
/// How many words a facet has.
const NUM_WORDS: usize = 21;

impl TextStl {
    /// The words of a facet, which were checked when the file was read.
    fn words(&self, facet: usize) -> [Word<'_>; NUM_WORDS] {
        let start = self.layout.facets.get(facet).copied();
        let mut words = Words::new(&self.bytes, start.unwrap_or(self.bytes.len()));
        std::array::from_fn(|_| words.next().unwrap_or_default())
    }

    fn normal(&self, facet: usize) -> [f64; 3] {
        let words = self.words(facet);
        [0, 1, 2].map(|k| normal_number(words[NORMAL_AT + k].text).unwrap_or(f64::NAN))
    }

    /// The solid of each facet, and their names, each once.
    fn labels(&self) -> Option<Labels> {
        let solids = &self.layout.solids;
        if solids.iter().all(|solid| solid.name.is_empty()) {
            return None;
        }
        let mut numbers: HashMap<&[u8], u32> = HashMap::new();
        let mut names = Vec::new();
        let mut faces = Vec::new();
        for solid in solids.iter().filter(|solid| !solid.facets.is_empty()) {
            let name = &self.bytes[solid.name.clone()];
            let number = if name.is_empty() {
                NONE
            } else {
                *numbers.entry(name).or_insert_with(|| {
                    names.push(String::from_utf8_lossy(name).into_owned());
                    names.len() as u32 - 1
                })
            };
            faces.resize(solid.facets.end, number);
        }
        Some(Labels {
            kind: LabelKind::Object,
            names,
            faces,
        })
    }
}

impl SourceFile for TextStl {
    fn format(&self) -> Format {
        Format::Stl
    }

    fn attributes(&self, _mesh: Mesh<'_>) -> Result<Attributes, IoError> {
        let mut faces = Vec::new();
        if self.layout.has_normals {
            let facets = 0..self.layout.facets.len();
            faces.push(Property {
                name: NORMAL.to_owned(),
                components: 3,
                values: Values::F64(facets.flat_map(|facet| self.normal(facet)).collect()),
            });
        }
        Ok(Attributes {
            faces,
            labels: self.labels().into_iter().collect(),
            ..Attributes::default()
        })
    }

    fn has_normals(&self) -> bool {
        self.layout.has_normals
    }

    fn extras(&self) -> Vec<String> {
        Vec::new()
    }

    fn write(&self, _format: Format, moves: &Moves<'_>) -> Result<Vec<u8>, IoError> {
        if moves.moved.is_empty() {
            return Ok(self.bytes.clone());
        }
        let mut patch = TextPatch::new(&self.bytes);
        let mut normals = moves.normals.faces.iter().peekable();
        for (facet, polygon) in moves.mesh.faces.iter().enumerate() {
            let normal = normals.next_if(|(face, _)| *face as usize == facet);
            let is_moved = |v: u32| moves.moved[v as usize];
            if normal.is_none() && !polygon.iter().any(|&v| is_moved(v)) {
                continue;
            }
            let words = self.words(facet);
            let mut replace = |at: usize, numbers: [f64; 3]| {
                for (word, x) in words[at..].iter().zip(numbers) {
                    // What keeps its value keeps its digits.
                    if number::parse_f64(word.text) == Some(x) {
                        continue;
                    }
                    patch.replace(word.start, word.text.len(), |out| {
                        number::push_f64(out, x);
                    });
                }
            };
            if let Some(&(_, normal)) = normal {
                replace(NORMAL_AT, normal);
            }
            for (at, &v) in CORNER_AT.into_iter().zip(polygon) {
                if is_moved(v) {
                    replace(at, moves.mesh.positions[v as usize].coords.into());
                }
            }
        }
        Ok(patch.finish())
    }

    fn rebuild(&self, remap: &Remap, mesh: Mesh<'_>) -> Result<Arc<dyn SourceFile>, IoError> {
        let mut new = Rebuilt {
            file: self,
            out: Vec::with_capacity(self.bytes.len()),
            current: None,
            num_opened: 0,
        };
        for face in 0..remap.faces.len() {
            let facet = Facet::new(remap, mesh, face)?;
            let solids = &self.layout.solids;
            let solid = solids.partition_point(|s| s.facets.end <= facet.beside as usize);
            new.open(Some(solid));
            new.facet(&facet, mesh);
        }
        new.open(None);
        let bytes = new.out;
        let layout = scan(&bytes, &Limits::NONE, |_, _| Ok(()))?;
        Ok(Arc::new(Self { bytes, layout }))
    }
}

/// The text of a mesh made of the facets of a file.
struct Rebuilt<'a> {
    file: &'a TextStl,
    out: Vec<u8>,
    /// The solid that facets are being written of.
    current: Option<usize>,
    /// How many solids have been begun, empty ones included.
    num_opened: usize,
}

impl Rebuilt<'_> {
    /// Goes on with another solid, or to the end; solids between that have no facet stay.
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
            // What stands behind the last solid.
            None => self.copy(solids.last().map_or(0, |last| last.end)..self.file.bytes.len()),
        }
        self.num_opened = self.num_opened.max(solid.map_or(solids.len(), |s| s + 1));
        self.current = solid;
    }

    /// Copies a part of the file; words on both sides of the seam stay apart.
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
        // A facet is copied with the blanks before it, as far as they belong to its solid.
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

/// A number with the other sign and the same digits; zeros and what is no number stay.
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
