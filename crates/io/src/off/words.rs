//! The lines of an OFF file, and its words regardless of line endings.

use crate::error::{Element, IoError, Place};
use crate::limits::Limits;
use crate::text::{self, Line, Lines, Token};

/// The non-blank lines, without their comments.
#[derive(Clone)]
pub(super) struct Rows<'a> {
    num_bytes: usize,
    lines: Lines<'a>,
    limits: &'a Limits,
}

impl<'a> Rows<'a> {
    pub(super) fn new(bytes: &'a [u8], start: usize, limits: &'a Limits) -> Self {
        Self {
            num_bytes: bytes.len(),
            lines: Lines::new(bytes, start),
            limits,
        }
    }

    /// The size of the whole file in bytes.
    pub(super) fn num_bytes(&self) -> usize {
        self.num_bytes
    }

    /// Offset of the following line.
    pub(super) fn position(&self) -> usize {
        self.lines.position()
    }

    pub(super) fn next(&mut self) -> Result<Option<Line<'a>>, IoError> {
        for line in self.lines.by_ref() {
            self.limits.check_line(line.text.len())?;
            let text = text::before_comment(line.text);
            if text.iter().any(|&b| b > b' ') {
                return Ok(Some(Line { text, ..line }));
            }
        }
        Ok(None)
    }

    pub(super) fn expect(
        &mut self,
        kind: &'static str,
        number: usize,
        promised: usize,
    ) -> Result<Line<'a>, IoError> {
        let last = Place::Line(self.lines.number);
        self.next()?.ok_or_else(|| IoError::CutShort {
            place: match self.lines.number {
                0 => last,
                line => Place::Line(line),
            },
            element: Element::new(kind, number),
            promised: promised as u64,
        })
    }
}

/// The words of a file without comments; tokens contain their offset in the file.
#[derive(Clone)]
pub(super) struct Words<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Words<'a> {
    pub(super) fn new(bytes: &'a [u8], start: usize) -> Self {
        Self { bytes, at: start }
    }

    /// Offset of the end of the last word.
    pub(super) fn at(&self) -> usize {
        self.at
    }

    /// The rest of the line.
    pub(super) fn rest_of_line(&self) -> &'a [u8] {
        let rest = self.bytes.get(self.at..).unwrap_or(&[]);
        let length = rest.iter().position(|b| is_line_end(*b));
        &rest[..length.unwrap_or(rest.len())]
    }

    /// Skips past the end of the line.
    pub(super) fn skip_line(&mut self) {
        self.at += self.rest_of_line().len();
        self.at += match self.bytes.get(self.at..) {
            Some([b'\r', b'\n', ..]) => 2,
            Some([_, ..]) => 1,
            _ => 0,
        };
    }
}

impl<'a> Iterator for Words<'a> {
    type Item = Token<'a>;

    fn next(&mut self) -> Option<Token<'a>> {
        loop {
            match *self.bytes.get(self.at)? {
                b'#' => self.at += self.rest_of_line().len(),
                b if b <= b' ' => self.at += 1,
                _ => break,
            }
        }
        let start = self.at;
        let rest = self.bytes.get(start..).unwrap_or(&[]);
        let length = rest.iter().position(|&b| b <= b' ' || b == b'#');
        let text = &rest[..length.unwrap_or(rest.len())];
        self.at += text.len();
        Some(Token { start, text })
    }
}

pub(super) fn is_line_end(b: u8) -> bool {
    b == b'\n' || b == b'\r'
}

/// The 1-based number of the line that contains a byte.
pub(super) fn line_number(bytes: &[u8], at: usize) -> usize {
    let lines = Lines::new(bytes, 0).take_while(|line| line.start <= at);
    lines.count().max(1)
}
