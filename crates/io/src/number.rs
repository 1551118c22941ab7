//! Conversion between decimal text and floating point: correctly rounded parsing, and shortest
//! round-trip formatting.

use std::fmt::Write as _;

/// Parses a decimal number to the nearest `f64`; `None` for anything else.
///
/// `nan` and `inf` are numbers here; the caller rejects them where they matter.
#[inline]
pub(crate) fn parse_f64(text: &[u8]) -> Option<f64> {
    fast_float2::parse(text).ok()
}

/// Parses a decimal number that starts at `at`, and returns it with the offset after it, which
/// must hold whitespace or a line ending; `None` if it does not.
#[inline]
pub(crate) fn decimal(text: &[u8], at: usize) -> Option<(f64, usize)> {
    let (value, length) = fast_float2::parse_partial(text.get(at..)?).ok()?;
    let end = at + length;
    (*text.get(end)? <= b' ').then_some((value, end))
}

/// Parses up to eight digits starting at `at`, and returns the number and the digit count; `None`
/// if fewer than eight bytes are available.
///
/// All eight bytes are processed at once: those from the first non-digit on are shifted out,
/// zeros are shifted in at the front, and three multiplications combine the digits in pairs.
#[inline]
pub(crate) fn digits8(text: &[u8], at: usize) -> Option<(u32, usize)> {
    let bytes = *text.get(at..)?.first_chunk::<8>()?;
    let digits = u64::from_le_bytes(bytes) ^ 0x3030_3030_3030_3030;
    // The high bit of every byte above 9. A carry affects only bytes after such a byte.
    let others = (digits.wrapping_add(0x7676_7676_7676_7676) | digits) & 0x8080_8080_8080_8080;
    let count = (others.trailing_zeros() / 8) as usize;
    if count == 0 {
        return Some((0, 0));
    }
    let digits = digits << (8 * (8 - count));
    let pairs = digits.wrapping_mul(10).wrapping_add(digits >> 8);
    let low = (pairs & 0x0000_00ff_0000_00ff).wrapping_mul(0x000f_4240_0000_0064);
    let high = ((pairs >> 16) & 0x0000_00ff_0000_00ff).wrapping_mul(0x0000_2710_0000_0001);
    Some(((low.wrapping_add(high) >> 32) as u32, count))
}

/// Parses a decimal integer with an optional sign; `None` for anything else or more than 18
/// digits.
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

/// Appends an integer.
pub(crate) fn push_integer(out: &mut String, mut value: u64) {
    // `u64::MAX` has 20 digits.
    let mut digits = [b'0'; 20];
    let mut start = digits.len();
    loop {
        start -= 1;
        digits[start] += (value % 10) as u8;
        value /= 10;
        if value == 0 {
            break;
        }
    }
    out.extend(digits[start..].iter().map(|&d| char::from(d)));
}

/// Appends the shortest decimal number that parses back to `value`.
pub(crate) fn push_f64(out: &mut String, value: f64) {
    // Writing to a String cannot fail.
    let _ = if is_plain(value.abs()) {
        write!(out, "{value}")
    } else {
        write!(out, "{value:e}")
    };
}

/// Appends the shortest decimal number that parses back to `value` as `f32`.
pub(crate) fn push_f32(out: &mut String, value: f32) {
    let plain = is_plain(f64::from(value.abs()));
    let _ = if plain {
        write!(out, "{value}")
    } else {
        write!(out, "{value:e}")
    };
}

/// Returns `true` if a magnitude is written without an exponent (which could otherwise need up to
/// 300 zeros).
fn is_plain(magnitude: f64) -> bool {
    magnitude == 0.0 || (1e-5..1e16).contains(&magnitude)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn numbers_are_those_of_the_standard_library() {
        let texts = [
            "0",
            "-0",
            "1",
            "+1",
            "1.",
            ".5",
            "-.7e+2",
            ".8e-1",
            "1e22",
            "1e23",
            "1e-22",
            "1e-23",
            "9007199254740992",
            "9007199254740993",
            "0.1",
            "123456789.123456789123456789",
            "1e400",
            "4.9e-324",
            "00000000000000000000001",
            "1e0000001",
            "nan",
            "inf",
            "-Infinity",
        ];
        for text in texts {
            let expected: f64 = text.parse().unwrap();
            let found = parse_f64(text.as_bytes()).unwrap();
            assert_eq!(found.to_bits(), expected.to_bits(), "{text}");
        }
    }

    #[test]
    fn what_is_no_number_is_refused() {
        for text in [
            "", "-", ".", "e5", "1e", "1e+", "1.2.3", "0x10", "1,5", "1.#IND", "--1",
        ] {
            assert_eq!(parse_f64(text.as_bytes()), None, "{text}");
        }
        for text in ["", "-", "1.0", "1e3", "9999999999999999999"] {
            assert_eq!(parse_integer(text.as_bytes()), None, "{text}");
        }
        assert_eq!(parse_integer(b"-12"), Some(-12));
    }

    #[test]
    fn long_decimals_are_those_of_the_standard_library() {
        let mut state = 1u64;
        for _ in 0..200_000 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            // Formatted doubles, and arbitrary digits.
            let x = (state >> 11) as f64 / (1u64 << 53) as f64;
            let digits = format!("{:019}", state >> 1);
            let point = (state % 8) as usize;
            for text in [
                format!("{x}"),
                format!("{}", x * 1000.0),
                format!("-{}.{}", &digits[..point], &digits[point..]),
            ] {
                let expected: f64 = text.parse().unwrap();
                let padded = format!("{text}        ");
                let (found, end) = decimal(padded.as_bytes(), 0).unwrap();
                assert_eq!(
                    (found.to_bits(), end),
                    (expected.to_bits(), text.len()),
                    "{text}"
                );
            }
        }
        // Ties and their neighbours.
        for text in [
            "9007199254740993",
            "9007199254740993.0",
            "9007199254740993.001",
            "900719925474099.3",
        ] {
            let expected: f64 = text.parse().unwrap();
            let found = decimal(format!("{text}         ").as_bytes(), 0);
            assert_eq!(found, Some((expected, text.len())), "{text}");
        }
    }

    proptest! {
        #[test]
        fn decimals_in_a_text_round_as_in_the_standard_library(text in "-?[0-9]{0,9}(\\.[0-9]{0,24})?", behind in "[ \n\tx]") {
            let padded = format!("{text}{behind}        ");
            let expected = text.parse::<f64>().ok().filter(|_| behind != "x");
            let found = decimal(padded.as_bytes(), 0);
            let expected = expected.map(|x| (x.to_bits(), text.len()));
            prop_assert_eq!(found.map(|(x, end)| (x.to_bits(), end)), expected);
        }

        #[test]
        fn written_numbers_read_back_to_the_same_bits(bits: u64) {
            let value = f64::from_bits(bits);
            prop_assume!(value.is_finite());
            let mut text = String::new();
            push_f64(&mut text, value);
            prop_assert_eq!(parse_f64(text.as_bytes()).unwrap().to_bits(), bits);
            prop_assert!(text.len() <= 24, "{}", text);
        }

        #[test]
        fn written_singles_read_back_to_the_same_bits(bits: u32) {
            let value = f32::from_bits(bits);
            prop_assume!(value.is_finite());
            let mut text = String::new();
            push_f32(&mut text, value);
            prop_assert_eq!(text.parse::<f32>().unwrap().to_bits(), bits);
        }

        #[test]
        fn decimals_round_as_in_the_standard_library(text in "-?[0-9]{1,21}(\\.[0-9]{0,21})?(e-?[0-9]{1,3})?") {
            let expected: f64 = text.parse().unwrap();
            prop_assert_eq!(parse_f64(text.as_bytes()).unwrap().to_bits(), expected.to_bits());
        }
    }
}
