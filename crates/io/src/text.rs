//! Text files as bytes: lines and tokens, without UTF-8 checks and without copies.

/// Where the text starts: after a UTF-8 byte order mark, if there is one.
pub(crate) fn after_bom(bytes: &[u8]) -> usize {
    if bytes.starts_with(b"\xef\xbb\xbf") {
        3
    } else {
        0
    }
}

/// A name or comment of unknown encoding: UTF-8, or else Latin-1, in which every byte is a
/// character.
pub(crate) fn decode(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
    }
}

/// The part of a line before `#`.
pub(crate) fn before_comment(line: &[u8]) -> &[u8] {
    line.split(|&b| b == b'#').next().unwrap_or(line)
}

/// A line without its end.
#[derive(Clone, Copy)]
pub(crate) struct Line<'a> {
    /// Counted from 1.
    pub(crate) number: usize,
    /// Where the line starts in the file.
    pub(crate) start: usize,
    pub(crate) text: &'a [u8],
}

/// The lines of a file; `\n`, `\r\n` and a lone `\r` end a line.
#[derive(Clone)]
pub(crate) struct Lines<'a> {
    bytes: &'a [u8],
    next: usize,
    /// Number of the last line that was given out.
    pub(crate) number: usize,
}

impl<'a> Lines<'a> {
    pub(crate) fn new(bytes: &'a [u8], start: usize) -> Self {
        Self {
            bytes,
            next: start,
            number: 0,
        }
    }

    /// Where the following line starts.
    pub(crate) fn position(&self) -> usize {
        self.next
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = Line<'a>;

    #[inline]
    fn next(&mut self) -> Option<Line<'a>> {
        let rest = self
            .bytes
            .get(self.next..)
            .filter(|rest| !rest.is_empty())?;
        let length = memchr::memchr2(b'\n', b'\r', rest).unwrap_or(rest.len());
        let end = match rest[length..] {
            [b'\r', b'\n', ..] => 2,
            [] => 0,
            _ => 1,
        };
        let line = Line {
            number: self.number + 1,
            start: self.next,
            text: &rest[..length],
        };
        self.number += 1;
        self.next += length + end;
        Some(line)
    }
}

/// A word between blanks.
#[derive(Clone, Copy)]
pub(crate) struct Token<'a> {
    /// Where the token starts in the text that is split.
    pub(crate) start: usize,
    pub(crate) text: &'a [u8],
}

/// The tokens of a text up to a comment: whatever stands between blanks and line ends before `#`.
///
/// A backslash before a line end (the line continuation of OBJ) counts as a blank.
pub(crate) struct Tokens<'a> {
    text: &'a [u8],
    next: usize,
}

impl<'a> Tokens<'a> {
    pub(crate) fn new(text: &'a [u8]) -> Self {
        Self { text, next: 0 }
    }
}

#[inline]
fn is_blank(b: u8) -> bool {
    b <= b' '
}

impl<'a> Iterator for Tokens<'a> {
    type Item = Token<'a>;

    #[inline]
    fn next(&mut self) -> Option<Token<'a>> {
        let text = self.text;
        let mut start = self.next;
        loop {
            match text.get(start) {
                Some(&b) if is_blank(b) => start += 1,
                Some(b'\\') if matches!(text.get(start + 1), Some(b'\n' | b'\r')) => start += 1,
                Some(b'#') | None => {
                    self.next = start;
                    return None;
                }
                Some(_) => break,
            }
        }
        let mut end = start + 1;
        while let Some(&b) = text.get(end) {
            if is_blank(b)
                || b == b'#'
                || (b == b'\\' && matches!(text.get(end + 1), Some(b'\n' | b'\r')))
            {
                break;
            }
            end += 1;
        }
        self.next = end;
        Some(Token {
            start,
            text: &text[start..end],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_utf_8_or_latin_1() {
        assert_eq!(decode("Wände".as_bytes()), "Wände");
        assert_eq!(decode(b"W\xe4nde"), "Wände");
    }

    #[test]
    fn every_line_end_ends_one_line() {
        let lines: Vec<_> = Lines::new(b"a\nb\r\n\rc", 0)
            .map(|line| (line.number, line.start, line.text))
            .collect();
        let expected: [(usize, usize, &[u8]); 4] =
            [(1, 0, b"a"), (2, 2, b"b"), (3, 5, b""), (4, 6, b"c")];
        assert_eq!(lines, expected);
    }

    #[test]
    fn tokens_end_at_blanks_comments_and_continuations() {
        let tokens = |text| {
            Tokens::new(text)
                .map(|token| token.text)
                .collect::<Vec<_>>()
        };
        assert_eq!(
            tokens(b" a\t bc\\\r\nd\\e f#g h"),
            [&b"a"[..], b"bc", b"d\\e", b"f"]
        );
        assert!(tokens(b"  # a b").is_empty());
    }
}
