//! The header: found, checked for what a parser would take too lightly, and parsed.

use std::io::Cursor;

use ply_rs::parser::{Parser, Reader};
use ply_rs::ply::{self, DefaultElement};

use crate::error::IoError;
use crate::text::{self, Lines, Tokens};

use super::{problem, quote};

/// A header and where it ends.
pub(super) struct Header {
    pub(super) ply: ply::Header,
    /// Number of its last line.
    pub(super) last_line: usize,
    /// Where the rows start.
    pub(super) end: usize,
    /// How many comments it has (they are kept, not read).
    pub(super) num_comments: usize,
}

impl Header {
    /// Reads the header of a file.
    ///
    /// The lines are put into the plainest form (one blank between words, `\n` at the end,
    /// comments emptied) before the `ply-rs` parser sees them, so that tabs, carriage returns and
    /// odd bytes in comments do not matter.
    pub(super) fn read(bytes: &[u8]) -> Result<Self, IoError> {
        let start = text::after_bom(bytes);
        let mut lines = Lines::new(bytes, start);
        let mut plain = String::new();
        let mut num_comments = 0;
        let mut num_elements = 0;
        let mut num_properties = 0;
        loop {
            let line = lines.next().ok_or_else(|| {
                problem(
                    lines.number.max(1),
                    "the file ends before `end_header`; it was cut short",
                )
            })?;
            let mut words = Tokens::new(line.text).map(|token| token.text);
            match (line.number, words.next()) {
                (1, Some(b"ply")) | (2.., Some(b"format")) => {}
                (2.., Some(b"element")) => num_elements += 1,
                (2.., Some(b"property")) => num_properties += 1,
                (2.., Some(b"comment" | b"obj_info")) => {
                    num_comments += 1;
                    plain.push_str("comment\n");
                    continue;
                }
                (2.., Some(b"end_header")) => {
                    plain.push_str("end_header\n");
                    break;
                }
                _ => return Err(problem(line.number, not_a_header_line(line.text))),
            }
            for (i, word) in Tokens::new(line.text).enumerate() {
                let blank = if i > 0 { " " } else { "" };
                plain.push_str(blank);
                plain.push_str(&String::from_utf8_lossy(word.text));
            }
            plain.push('\n');
        }
        let ply = parse(&plain)?;
        let last_line = lines.number;
        let parsed: usize = ply.elements.values().map(|e| e.properties.len()).sum();
        if ply.elements.len() != num_elements || parsed != num_properties {
            let text = "an element, or a property of an element, is declared twice";
            return Err(problem(last_line, text));
        }
        let end = end_of_header(bytes, start, lines.position());
        Ok(Self {
            ply,
            last_line,
            end,
            num_comments,
        })
    }
}

fn not_a_header_line(line: &[u8]) -> String {
    format!("`{}` does not belong in a PLY header", quote(line))
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

/// Where the rows start, given where the line after `end_header` would.
///
/// If the header's lines end in a lone carriage return (Rhino writes such files), then a line
/// feed behind the last one is already data.
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
