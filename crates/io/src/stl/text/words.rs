//! The words of a text STL. There are no comments; every byte up to the space character separates
//! words.

use std::ops::Range;

/// A word and its offset in the file.
#[derive(Clone, Copy, Default)]
pub(super) struct Word<'a> {
    pub(super) start: usize,
    pub(super) text: &'a [u8],
}

impl Word<'_> {
    /// Returns `true` if it is this keyword, ignoring case.
    #[inline]
    pub(super) fn is(&self, keyword: &str) -> bool {
        self.text.eq_ignore_ascii_case(keyword.as_bytes())
    }

    pub(super) fn end(&self) -> usize {
        self.start + self.text.len()
    }
}

/// Iterator over the words of a file from an offset on.
pub(super) struct Words<'a> {
    bytes: &'a [u8],
    at: usize,
    line_start: usize,
    longest_line: usize,
}

impl<'a> Words<'a> {
    pub(super) fn new(bytes: &'a [u8], start: usize) -> Self {
        Self {
            bytes,
            at: start,
            line_start: start,
            longest_line: 0,
        }
    }

    /// Offset of the end of the last word.
    pub(super) fn at(&self) -> usize {
        self.at
    }

    /// The length of the longest line so far.
    pub(super) fn longest_line(&self) -> usize {
        self.longest_line.max(self.at - self.line_start)
    }

    #[inline]
    fn end_line(&mut self) {
        self.longest_line = self.longest_line();
        self.line_start = self.at + 1;
    }

    #[inline]
    pub(super) fn next(&mut self) -> Option<Word<'a>> {
        while let Some(&b) = self.bytes.get(self.at) {
            if b > b' ' {
                break;
            }
            if b == b'\n' || b == b'\r' {
                self.end_line();
            }
            self.at += 1;
        }
        let rest = self.bytes.get(self.at..).filter(|rest| !rest.is_empty())?;
        let length = rest.iter().position(|&b| b <= b' ').unwrap_or(rest.len());
        let word = Word {
            start: self.at,
            text: &rest[..length],
        };
        self.at += length;
        Some(word)
    }

    /// Returns the rest of the line without surrounding whitespace, and skips past its end.
    ///
    /// In a file without line endings, a name also ends before `facet normal`.
    pub(super) fn solid_name(&mut self) -> Range<usize> {
        let line = self.rest_of_line();
        let Some(length) = facet_in(line) else {
            let name = trimmed(self.at, line);
            self.skip_line();
            return name;
        };
        let name = trimmed(self.at, &line[..length]);
        self.at += length;
        name
    }

    /// Returns `true` if a facet starts on the rest of the line.
    pub(super) fn line_has_facet(&self) -> bool {
        facet_in(self.rest_of_line()).is_some()
    }

    fn rest_of_line(&self) -> &'a [u8] {
        let rest = self.bytes.get(self.at..).unwrap_or(&[]);
        let length = rest.iter().position(|&b| b == b'\n' || b == b'\r');
        &rest[..length.unwrap_or(rest.len())]
    }

    /// Skips past the end of the line.
    pub(super) fn skip_line(&mut self) {
        self.at += self.rest_of_line().len();
        match self.bytes.get(self.at..) {
            Some([b'\r', b'\n', ..]) => {
                self.end_line();
                self.at += 2;
                self.line_start = self.at;
            }
            Some([_, ..]) => {
                self.end_line();
                self.at += 1;
            }
            _ => {}
        }
    }
}

const FACET: &[u8] = b"facet normal";

/// The offset at which a facet starts in a line.
fn facet_in(line: &[u8]) -> Option<usize> {
    line.windows(FACET.len())
        .position(|window| window.eq_ignore_ascii_case(FACET))
        .filter(|&at| at == 0 || line[at - 1] <= b' ')
}

/// The range of a text that starts at `start`, without surrounding whitespace.
fn trimmed(start: usize, text: &[u8]) -> Range<usize> {
    let is_blank = |b: &u8| *b <= b' ';
    let Some(first) = text.iter().position(|b| !is_blank(b)) else {
        return start..start;
    };
    let last = text.iter().rposition(|b| !is_blank(b)).unwrap_or(first);
    start + first..start + last + 1
}
