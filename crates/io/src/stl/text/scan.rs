//! Scanner that locates the solids and facets of a text STL.

use std::ops::Range;

use super::words::{Word, Words};
use crate::error::{Element, IoError, Place, quote};
use crate::limits::Limits;
use crate::number;
use crate::room;
use crate::text as lines;

/// The locations of the solids and facets of a file.
#[derive(Debug, Default)]
pub(super) struct Layout {
    pub(super) solids: Vec<Solid>,
    /// The offset of the word `facet` of each facet.
    pub(super) facets: Vec<usize>,
    /// `true` if any normal is not zero.
    pub(super) has_normals: bool,
}

impl Layout {
    pub(super) fn num_bytes(&self) -> usize {
        self.solids.len() * size_of::<Solid>() + self.facets.len() * size_of::<usize>()
    }
}

/// A solid. Its text extends from the end of the previous one to the end of its `endsolid` line.
#[derive(Debug)]
pub(super) struct Solid {
    pub(super) start: usize,
    /// The location of its name.
    pub(super) name: Range<usize>,
    /// The end of its `solid` line.
    pub(super) body: usize,
    /// The end of its last facet, or its `body` if it has none.
    pub(super) body_end: usize,
    pub(super) end: usize,
    /// Its facets.
    pub(super) facets: Range<usize>,
}

/// Scans the file. `facet` is called with the layout so far and the words of three corners.
pub(super) fn scan<'a>(
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
            room::push(&mut layout.facets, word.start)?;
            layout.has_normals |= has_normal;
            body_end = words.at();
        }
        if words.line_has_facet() {
            let problem = "facets follow an `endsolid` on its line; start them on a new line";
            return Err(malformed(bytes, words.at(), problem.to_owned()));
        }
        words.skip_line();
        let start = std::mem::replace(&mut end, words.at());
        let solid = Solid {
            start,
            name,
            body,
            body_end,
            end,
            facets: first..layout.facets.len(),
        };
        room::push(&mut layout.solids, solid)?;
        limits.check_memory(bytes.len().saturating_add(layout.num_bytes()), 0, 0)?;
    }
    limits.check_line(words.longest_line())?;
    Ok(layout)
}

/// Reads the rest of a facet after the word `facet`. Returns `true` if its normal is not zero,
/// and the words of its corners.
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
        // A word truncated by the end of the file is not an invalid word.
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

pub(super) fn coordinate(
    bytes: &[u8],
    word: Word<'_>,
    facet: usize,
    vertex: usize,
) -> Result<f64, IoError> {
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

/// Parses a component of a normal. The non-decimal forms that C libraries write for it yield NaN.
pub(super) fn normal_number(text: &[u8]) -> Option<f64> {
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
        format!("found `{found}` where {expected} is expected"),
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
