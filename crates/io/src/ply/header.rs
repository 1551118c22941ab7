//! Header: located, checked more strictly than the parser does, and parsed.

use std::collections::HashSet;
use std::fmt::Write as _;
use std::io::Cursor;
use std::ops::Range;

use foldhash::fast::RandomState;
use ply_rs::parser::{Parser, Reader};
use ply_rs::ply::{self, DefaultElement, Encoding, PropertyType};

use crate::error::IoError;
use crate::limits::Limits;
use crate::text::{self, Line, Lines, Token};

use super::{problem, quote};

/// A parsed header and its location.
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Declaration>,
    /// Number of its last line.
    pub(super) last_line: usize,
    /// Offset of the line `end_header`.
    pub(super) last_start: usize,
    /// Offset of the first row.
    pub(super) end: usize,
    /// Byte ranges of the texts of `comment` and `obj_info`.
    pub(super) comments: Vec<Range<usize>>,
}

/// An element as declared in the header.
pub(super) struct Declaration {
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) properties: Vec<(String, PropertyType)>,
    pub(super) place: DeclarationPlace,
}

/// The location of a declaration, so that it can be replaced.
#[derive(Clone, Debug)]
pub(super) struct DeclarationPlace {
    /// The lines of the element and of its properties, including line endings.
    pub(super) lines: Vec<Range<usize>>,
    /// The row count.
    pub(super) count: Range<usize>,
}

impl Header {
    /// Reads the header of a file.
    ///
    /// The lines are normalized before the `ply-rs` parser sees them: one space between words,
    /// `\n` at the end, empty comments, odd names replaced. Tabs, carriage returns and odd bytes
    /// in comments and names therefore do not matter.
    pub(super) fn read(bytes: &[u8], limits: &Limits) -> Result<Self, IoError> {
        let start = text::after_bom(bytes);
        let mut lines = Lines::new(bytes, start);
        let mut scan = Scan::default();
        let last_start = loop {
            let at = lines.position();
            let line = lines.next().ok_or_else(|| {
                problem(
                    lines.number.max(1),
                    "the file ends before `end_header`; it was cut short",
                )
            })?;
            limits.check_line(line.text.len())?;
            if scan.line(line, lines.position())? {
                break at;
            }
            let memory = scan.seen.len().saturating_mul(DECLARATION);
            limits.check_memory(bytes.len().saturating_add(memory), 0, 0)?;
        };
        let parsed = parse(&scan.plain)?;
        let last_line = lines.number;
        // The parser merges names that it considers equal.
        let kept = parsed.elements.len() == scan.elements.len()
            && parsed
                .elements
                .values()
                .zip(&scan.elements)
                .all(|(def, (_, names, _))| def.properties.len() == names.len());
        if let Some(line) = scan.twice.or((!kept).then_some(last_line)) {
            let text = "an element, or a property of an element, is declared twice";
            return Err(problem(line, text));
        }
        let elements = parsed.elements.into_values().zip(scan.elements);
        let elements = elements.map(|(def, (name, names, place))| Declaration {
            name,
            count: def.count,
            properties: names
                .into_iter()
                .zip(def.properties.into_values().map(|p| p.data_type))
                .collect(),
            place,
        });
        Ok(Self {
            encoding: parsed.encoding,
            elements: elements.collect(),
            last_line,
            last_start,
            end: end_of_header(bytes, start, lines.position()),
            comments: scan.comments,
        })
    }
}

/// The contents of the header lines.
#[derive(Default)]
struct Scan {
    /// The normalized lines for the parser.
    plain: String,
    elements: Vec<(String, Vec<String>, DeclarationPlace)>,
    comments: Vec<Range<usize>>,
    /// Element and property names so far, to detect duplicates.
    seen: HashSet<(usize, Vec<u8>), RandomState>,
    /// The first line with a duplicate declaration.
    twice: Option<usize>,
}

impl Scan {
    /// Processes one line, which ends before `next`. Returns `true` for the last line of the
    /// header.
    fn line(&mut self, line: Line<'_>, next: usize) -> Result<bool, IoError> {
        let words: Vec<_> = words(line.text).take(WORDS).collect();
        let refused = || {
            let text = format!("`{}` does not belong in a PLY header", quote(line.text));
            problem(line.number, text)
        };
        let Some(keyword) = words.first() else {
            return Err(refused());
        };
        match (line.number, keyword.text) {
            (1, b"ply") | (2.., b"format") => {}
            (2.., b"element") => {
                let name = words.get(1).map_or(&b""[..], |word| word.text);
                let place = DeclarationPlace {
                    lines: std::iter::once(line.start..next).collect(),
                    count: words.get(2).map_or(0..0, |word| {
                        let start = line.start + word.start;
                        start..start + word.text.len()
                    }),
                };
                self.elements.push((
                    String::from_utf8_lossy(name).into_owned(),
                    Vec::new(),
                    place,
                ));
                self.see(0, name, line.number);
            }
            (2.., b"property") => {
                let number = self.elements.len();
                let name = words.last().map_or(&b""[..], |word| word.text);
                // Without an element, the parser rejects the line.
                if let Some((_, names, place)) = self.elements.last_mut() {
                    names.push(String::from_utf8_lossy(name).into_owned());
                    place.lines.push(line.start..next);
                    self.see(number, name, line.number);
                }
            }
            (2.., b"comment" | b"obj_info") => {
                let end = line.start + line.text.len();
                let start = line.start + keyword.start + keyword.text.len();
                // One space separates the keyword from the text.
                self.comments.push((start + 1).min(end)..end);
                self.plain.push_str("comment\n");
                return Ok(false);
            }
            (2.., b"end_header") => {
                self.plain.push_str("end_header\n");
                return Ok(true);
            }
            _ => return Err(refused()),
        }
        let name_at = match keyword.text {
            b"element" => Some(1),
            b"property" if words.len() > 2 => Some(words.len() - 1),
            _ => None,
        };
        for (i, word) in words.iter().enumerate() {
            if i > 0 {
                self.plain.push(' ');
            }
            if name_at == Some(i) {
                self.push_name(word.text);
            } else {
                self.plain.push_str(&String::from_utf8_lossy(word.text));
            }
        }
        self.plain.push('\n');
        Ok(false)
    }

    fn see(&mut self, element: usize, name: &[u8], line: usize) {
        if !self.seen.insert((element, name.to_vec())) && self.twice.is_none() {
            self.twice = Some(line);
        }
    }

    /// Appends a name. A name that the parser would reject is replaced by a numbered one.
    fn push_name(&mut self, name: &[u8]) {
        match std::str::from_utf8(name) {
            Ok(name) if is_plain_name(name) => self.plain.push_str(name),
            _ => {
                // Writing to a String cannot fail.
                let _ = write!(self.plain, "_odd_name_{}", self.seen.len());
            }
        }
    }
}

/// The words of a line. Unlike other formats, PLY has no comments at line ends.
fn words(line: &[u8]) -> impl Iterator<Item = Token<'_>> {
    let mut at = 0;
    std::iter::from_fn(move || {
        let start = at + line.get(at..)?.iter().position(|&b| b > b' ')?;
        let rest = &line[start..];
        let length = rest.iter().position(|&b| b <= b' ').unwrap_or(rest.len());
        at = start + length;
        Some(Token {
            start,
            text: &rest[..length],
        })
    })
}

/// Approximate memory in bytes for a declared element or property, here and in the parser.
const DECLARATION: usize = 512;

/// More words than any header line has.
const WORDS: usize = 8;

/// Returns `true` if every reader accepts this as a name.
pub(super) fn is_plain_name(name: &str) -> bool {
    let is_word = |b: u8| b.is_ascii_alphanumeric() || b == b'_' || b == b'-';
    name.bytes().all(is_word) && name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
}

fn parse(plain: &str) -> Result<ply::Header, IoError> {
    let mut reader = Reader::new(Cursor::new(plain.as_bytes()));
    Parser::<DefaultElement>::new()
        .read_header(&mut reader)
        .map_err(|error| {
            match error
                .line()
                .and_then(|line| Some((line, plain.lines().nth(line - 1)?)))
            {
                Some((line, text)) => problem(
                    line,
                    format!(
                        "`{}` is not understood; expected are `format ascii|binary_little_endian|\
                     binary_big_endian 1.0`, `element NAME COUNT`, `property TYPE NAME` or \
                     `property list TYPE TYPE NAME` with the types char uchar short ushort int \
                     uint float double",
                        quote(text.as_bytes())
                    ),
                ),
                None => problem(plain.lines().count(), error.to_string()),
            }
        })
}

/// Returns the offset of the first row, given the offset at which the line after `end_header`
/// would start.
///
/// If the header lines end in a lone carriage return (as written by Rhino), a line feed after the
/// last one is already data.
fn end_of_header(bytes: &[u8], start: usize, after: usize) -> usize {
    let first_end = bytes[start..]
        .iter()
        .position(|&b| b == b'\r' || b == b'\n');
    let lone_cr = first_end
        .is_some_and(|at| bytes[start + at] == b'\r' && bytes.get(start + at + 1) != Some(&b'\n'));
    if lone_cr && bytes[..after].ends_with(b"\r\n") {
        after - 1
    } else {
        after
    }
}
