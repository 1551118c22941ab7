//! The statements of an OBJ file: a line, with the lines that continue it after a backslash at
//! the end.

use crate::number;
use crate::text::{Lines, Token, Tokens};

/// A statement, blank line or comment line of the file.
#[derive(Clone, Copy)]
pub(super) struct Statement<'a> {
    /// The 1-based number of its first line.
    pub(super) line: usize,
    /// Its offset in the file.
    pub(super) start: usize,
    /// The text without the ending of its last line.
    pub(super) text: &'a [u8],
    /// The offset of the following statement.
    pub(super) end: usize,
}

/// Iterator over the statements of a file.
pub(super) struct Statements<'a> {
    bytes: &'a [u8],
    lines: Lines<'a>,
}

impl<'a> Statements<'a> {
    /// Iterates over the statements from `start` on, which is preceded by `num_lines` lines.
    pub(super) fn new(bytes: &'a [u8], start: usize, num_lines: usize) -> Self {
        let mut lines = Lines::new(bytes, start);
        lines.number = num_lines;
        Self { bytes, lines }
    }

    /// Number of the last line returned.
    pub(super) fn num_lines(&self) -> usize {
        self.lines.number
    }
}

impl<'a> Iterator for Statements<'a> {
    type Item = Statement<'a>;

    #[inline]
    fn next(&mut self) -> Option<Statement<'a>> {
        let line = self.lines.next()?;
        let mut last = line;
        while is_continued(last.text) {
            match self.lines.next() {
                Some(next) => last = next,
                None => break,
            }
        }
        Some(Statement {
            line: line.number,
            start: line.start,
            text: &self.bytes[line.start..last.start + last.text.len()],
            end: self.lines.position(),
        })
    }
}

/// Returns `true` if the next line belongs to the same statement.
///
/// A comment may end in a backslash (a Windows path) and must not swallow a vertex.
#[inline]
pub(super) fn is_continued(line: &[u8]) -> bool {
    line.ends_with(b"\\") && memchr::memchr(b'#', line).is_none()
}

impl<'a> Statement<'a> {
    /// The first word; empty for a blank line and for a comment.
    #[inline]
    pub(super) fn keyword(&self) -> &'a [u8] {
        Tokens::new(self.text)
            .next()
            .map_or(&[][..], |token| token.text)
    }

    /// The words after the first one, up to a comment.
    ///
    /// Their offsets are relative to the statement.
    #[inline]
    pub(super) fn arguments(&self) -> Tokens<'a> {
        let mut tokens = Tokens::new(self.text);
        tokens.next();
        tokens
    }

    /// Everything after the first word without surrounding whitespace: names may contain spaces,
    /// and `#` too.
    pub(super) fn name(&self) -> &'a [u8] {
        let mut tokens = Tokens::new(self.text);
        let start = tokens.next().map_or(0, |t| t.start + t.text.len());
        trim(&self.text[start..])
    }

    /// The comment at the end, without the `#` and one space after it.
    pub(super) fn comment(&self) -> Option<&'a [u8]> {
        let at = memchr::memchr(b'#', self.text)?;
        let text = &self.text[at + 1..];
        Some(text.strip_prefix(b" ").unwrap_or(text))
    }
}

/// Removes surrounding whitespace and continuation marks.
fn trim(mut text: &[u8]) -> &[u8] {
    loop {
        text = match text {
            [b, rest @ ..] if *b <= b' ' => rest,
            [b'\\', rest @ ..] if matches!(rest, [b'\n' | b'\r', ..]) => rest,
            _ => break,
        };
    }
    loop {
        text = match text {
            [rest @ .., b] if *b <= b' ' => rest,
            _ => return text,
        };
    }
}

/// Decodes a name or comment as UTF-8 or, failing that, as Latin-1, in which every byte is a
/// character.
pub(super) fn decode(bytes: &[u8]) -> String {
    let plain = |bytes: &[u8]| match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
    };
    if !bytes.windows(2).any(|w| matches!(w, b"\\\n" | b"\\\r")) {
        return plain(bytes);
    }
    // Continuation lines form one name, joined by spaces.
    let mut joined = Vec::with_capacity(bytes.len());
    let mut rest = bytes;
    while let [b, tail @ ..] = rest {
        rest = tail;
        if *b == b'\\' && matches!(tail, [b'\n' | b'\r', ..]) {
            rest = tail.strip_prefix(b"\r").unwrap_or(tail);
            rest = rest.strip_prefix(b"\n").unwrap_or(rest);
            joined.push(b' ');
        } else {
            joined.push(*b);
        }
    }
    plain(&joined)
}

/// The references of a face corner, as written in the file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Corner {
    pub(super) vertex: i64,
    pub(super) texture: Option<i64>,
    pub(super) normal: Option<i64>,
}

/// The expected form of a corner, for error messages.
pub(super) const CORNER: &str = "a corner (v, v/vt, v//vn or v/vt/vn)";

/// Parses a corner: `v`, `v/vt`, `v//vn` or `v/vt/vn`, including empty references after a slash.
pub(super) fn corner(token: &[u8]) -> Option<Corner> {
    let mut parts = token.split(|&b| b == b'/');
    let vertex = number::parse_integer(parts.next()?)?;
    let mut reference = || match parts.next() {
        None | Some([]) => Some(None),
        Some(text) => number::parse_integer(text).map(Some),
    };
    let corner = Corner {
        vertex,
        texture: reference()?,
        normal: reference()?,
    };
    parts.next().is_none().then_some(corner)
}

/// Resolves an index to a 0-based element, given that `so_far` elements precede it and there are
/// `total` in the file.
///
/// Negative indices count back from the latest.
#[inline]
pub(super) fn resolve(index: i64, so_far: usize, total: usize) -> Option<u32> {
    let element = if index < 0 {
        usize::try_from((so_far as i64).checked_add(index)?).ok()?
    } else {
        usize::try_from(index.checked_sub(1)?).ok()?
    };
    (element < total)
        .then(|| u32::try_from(element).ok())
        .flatten()
}

/// The part of a corner's token after its vertex: from the first slash on.
pub(super) fn suffix(token: &[u8]) -> &[u8] {
    let slash = memchr::memchr(b'/', token).unwrap_or(token.len());
    &token[slash..]
}

/// The part of a token after its last slash with its offset, if the token has the two slashes of
/// a normal.
pub(super) fn normal_part(token: Token<'_>) -> Option<(usize, &[u8])> {
    let first = memchr::memchr(b'/', token.text)?;
    let second = first + 1 + memchr::memchr(b'/', &token.text[first + 1..])?;
    Some((token.start + second + 1, &token.text[second + 1..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(file: &[u8]) -> Vec<(usize, &[u8], usize)> {
        Statements::new(file, 0, 0)
            .map(|s| (s.line, s.text, s.end))
            .collect()
    }

    #[test]
    fn a_backslash_continues_a_statement_and_not_a_comment() {
        assert_eq!(
            texts(b"f 1 \\\r\n2 \\\n3\n# a\\\nv\nv 1 # b\\\nv\\"),
            [
                (1, &b"f 1 \\\r\n2 \\\n3"[..], 13),
                (4, b"# a\\", 18),
                (5, b"v", 20),
                (6, b"v 1 # b\\", 29),
                (7, b"v\\", 31),
            ]
        );
    }

    #[test]
    fn names_are_whole_and_of_any_encoding() {
        let name = |text: &[u8]| Statements::new(text, 0, 0).next().map(|s| decode(s.name()));
        assert_eq!(name(b"g  a b \t"), Some("a b".to_owned()));
        assert_eq!(name(b"usemtl red #2"), Some("red #2".to_owned()));
        assert_eq!(name(b"g \\\n a \\\r\nb\n"), Some("a  b".to_owned()));
        assert_eq!(name(b"o K\xf6rper"), Some("K\u{f6}rper".to_owned()));
        assert_eq!(name("o Körper".as_bytes()), Some("Körper".to_owned()));
        assert_eq!(name(b"g"), Some(String::new()));
    }

    #[test]
    fn corners_and_their_parts() {
        let of = |vertex, texture, normal| {
            Some(Corner {
                vertex,
                texture,
                normal,
            })
        };
        assert_eq!(corner(b"3"), of(3, None, None));
        assert_eq!(corner(b"3/-1"), of(3, Some(-1), None));
        assert_eq!(corner(b"3//4"), of(3, None, Some(4)));
        assert_eq!(corner(b"-3/5/4"), of(-3, Some(5), Some(4)));
        assert_eq!(corner(b"3//"), of(3, None, None));
        for bad in [&b"/1"[..], b"1/x", b"1/2/3/4", b"1//6148914691236517206"] {
            assert_eq!(corner(bad), None);
        }
        assert_eq!(resolve(-1, 3, 5), Some(2));
        assert_eq!(resolve(5, 3, 5), Some(4));
        for index in [0, 6, -4, i64::MIN, i64::MAX] {
            assert_eq!(resolve(index, 3, 5), None);
        }
    }
}
