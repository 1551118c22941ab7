//! Text files as bytes: lines and tokens, without UTF-8 checks and without copies.

/// Returns the start of the text: after a UTF-8 byte order mark, if there is one.
pub(crate) fn after_bom(bytes: &[u8]) -> usize {
    if bytes.starts_with(b"\xef\xbb\xbf") {
        3
    } else {
        0
    }
}

/// Detects text in an encoding with two or four bytes per character.
///
/// Such text has a byte order mark. Otherwise it is recognized by its zeros: in at least three
/// quarters of the byte pairs at the start, one byte is zero and the other, always in the same
/// half, is an ASCII character.
pub(crate) fn wide_encoding(bytes: &[u8]) -> Option<&'static str> {
    if bytes.starts_with(b"\xff\xfe\0\0") || bytes.starts_with(b"\0\0\xfe\xff") {
        return Some("UTF-32");
    }
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
        return Some("UTF-16");
    }
    let start = &bytes[..bytes.len().min(64)];
    let pairs = start.chunks_exact(2);
    let num_pairs = pairs.len();
    let is_text = |b: u8| matches!(b, b'\t' | b'\n' | b'\r' | b' '..=b'~');
    let low_first = pairs
        .clone()
        .filter(|pair| is_text(pair[0]) && pair[1] == 0);
    let high_first = pairs
        .clone()
        .filter(|pair| pair[0] == 0 && is_text(pair[1]));
    let most = low_first.count().max(high_first.count());
    (num_pairs >= 4 && most * 4 >= num_pairs * 3).then_some("UTF-16")
}

/// Decodes a name or comment of unknown encoding as UTF-8 or, failing that, as Latin-1, in which
/// every byte is a character.
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

/// A line without its line ending.
#[derive(Clone, Copy)]
pub(crate) struct Line<'a> {
    /// 1-based line number.
    pub(crate) number: usize,
    /// Byte offset of the line in the file.
    pub(crate) start: usize,
    pub(crate) text: &'a [u8],
}

/// Iterator over the lines of a file; `\n`, `\r\n` and a lone `\r` end a line.
#[derive(Clone)]
pub(crate) struct Lines<'a> {
    bytes: &'a [u8],
    next: usize,
    /// Number of the last line returned.
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

    /// Offset of the following line.
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

/// A word delimited by whitespace.
#[derive(Clone, Copy)]
pub(crate) struct Token<'a> {
    /// Offset of the token in the text that is split.
    pub(crate) start: usize,
    pub(crate) text: &'a [u8],
}

/// Iterator over the tokens of a text: words delimited by whitespace and line endings, up to a
/// `#` comment.
///
/// A backslash before a line ending (the line continuation of OBJ) counts as whitespace.
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
    fn text_of_two_bytes_a_character_is_known_by_its_mark_or_its_zeros() {
        let text = "# a\r\nv 0 0 0\nv 1 0 0\n";
        let little: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        let big: Vec<u8> = text.encode_utf16().flat_map(u16::to_be_bytes).collect();
        let wide: Vec<u8> = text
            .chars()
            .flat_map(|c| (c as u32).to_le_bytes())
            .collect();
        for (mark, bytes) in [(&b"\xff\xfe"[..], &little), (b"\xfe\xff", &big)] {
            assert_eq!(wide_encoding(bytes), Some("UTF-16"));
            assert_eq!(wide_encoding(&[mark, bytes].concat()), Some("UTF-16"));
        }
        let marked = [&b"\xff\xfe\0\0"[..], &wide].concat();
        assert_eq!(wide_encoding(&marked), Some("UTF-32"));
        assert_eq!(wide_encoding(text.as_bytes()), None);
        assert_eq!(wide_encoding("# Wände ∆".as_bytes()), None);
        assert_eq!(wide_encoding(&[0; 84]), None);
        assert_eq!(wide_encoding(b""), None);
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
