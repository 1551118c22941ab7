//! Text files as bytes: lines, tokens and numbers, without UTF-8 checks and without copies.

use std::fmt::Write as _;

/// Where the text starts: after a UTF-8 byte order mark, if there is one.
pub(crate) fn after_bom(bytes: &[u8]) -> usize {
    if bytes.starts_with(b"\xef\xbb\xbf") {
        3
    } else {
        0
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
        let length = rest
            .iter()
            .position(|&b| b == b'\n' || b == b'\r')
            .unwrap_or(rest.len());
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

/// The nearest f64 to a decimal number; `None` for anything else.
///
/// Up to 2^53 in the digits and 10^±22 in the exponent both operands of one multiplication or
/// division are exact, so its result is the correctly rounded one (Clinger 1990, "How to read
/// floating point numbers accurately", section 3). Everything else goes to the standard library,
/// including `nan` and `inf`, which the caller refuses where they matter.
#[inline]
pub(crate) fn parse_f64(text: &[u8]) -> Option<f64> {
    parse_short(text).or_else(|| std::str::from_utf8(text).ok()?.parse().ok())
}

#[inline]
fn parse_short(text: &[u8]) -> Option<f64> {
    let (negative, digits) = match text {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        rest => (false, rest),
    };
    // 19 digits cannot overflow 64 bits; longer numbers are left to the standard library.
    const MOST_DIGITS: usize = 19;
    let mut mantissa = 0u64;
    let mut num_digits = 0;
    let mut exponent = 0i32;
    let mut at = 0;
    while let Some(d) = digit(digits, at) {
        mantissa = mantissa.wrapping_mul(10).wrapping_add(d);
        num_digits += 1;
        at += 1;
    }
    if digits.get(at) == Some(&b'.') {
        at += 1;
        let point = at;
        while let Some(d) = digit(digits, at) {
            mantissa = mantissa.wrapping_mul(10).wrapping_add(d);
            num_digits += 1;
            at += 1;
        }
        // A number of more than 19 digits is refused below, so the cast keeps the value.
        exponent = ((at - point) as i32).wrapping_neg();
    }
    if num_digits == 0 || num_digits > MOST_DIGITS {
        return None;
    }
    match digits.get(at..) {
        Some([]) => {}
        Some([b'e' | b'E', rest @ ..]) => exponent += parse_exponent(rest)?,
        _ => return None,
    }
    if mantissa > 1 << 53 {
        return None;
    }
    let magnitude = mantissa as f64;
    let power = *POWERS_OF_TEN.get(exponent.unsigned_abs() as usize)?;
    let value = if exponent < 0 {
        magnitude / power
    } else {
        magnitude * power
    };
    Some(if negative { -value } else { value })
}

#[inline]
fn digit(text: &[u8], at: usize) -> Option<u64> {
    let d = text.get(at)?.wrapping_sub(b'0');
    (d < 10).then_some(u64::from(d))
}

/// An exponent of at most three digits.
fn parse_exponent(text: &[u8]) -> Option<i32> {
    let (sign, digits) = match text {
        [b'-', rest @ ..] => (-1, rest),
        [b'+', rest @ ..] => (1, rest),
        rest => (1, rest),
    };
    if digits.is_empty() || digits.len() > 3 {
        return None;
    }
    let mut value = 0;
    for &b in digits {
        let d = b.wrapping_sub(b'0');
        if d > 9 {
            return None;
        }
        value = value * 10 + i32::from(d);
    }
    Some(sign * value)
}

/// The powers of ten that an f64 holds exactly.
const POWERS_OF_TEN: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// A decimal integer with an optional sign; `None` for anything else or beyond 18 digits.
#[inline]
pub(crate) fn parse_integer(text: &[u8]) -> Option<i64> {
    let (negative, digits) = match text {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        rest => (false, rest),
    };
    if digits.is_empty() || digits.len() > 18 {
        return None;
    }
    let mut value = 0i64;
    for &b in digits {
        let d = b.wrapping_sub(b'0');
        if d > 9 {
            return None;
        }
        value = value * 10 + i64::from(d);
    }
    Some(if negative { -value } else { value })
}

/// Appends the shortest decimal number that reads back as `value`.
pub(crate) fn push_f64(out: &mut String, value: f64) {
    // Writing to a String cannot fail.
    let _ = if is_plain(value.abs()) {
        write!(out, "{value}")
    } else {
        write!(out, "{value:e}")
    };
}

/// Appends the shortest decimal number that reads back as `value` in 32 bits.
pub(crate) fn push_f32(out: &mut String, value: f32) {
    let plain = is_plain(f64::from(value.abs()));
    let _ = if plain {
        write!(out, "{value}")
    } else {
        write!(out, "{value:e}")
    };
}

/// Whether a magnitude is written without an exponent (which would cost up to 300 zeros).
fn is_plain(magnitude: f64) -> bool {
    magnitude == 0.0 || (1e-5..1e16).contains(&magnitude)
}
