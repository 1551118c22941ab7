//! Decimal numbers to bits and back: exactly rounded, and the shortest that reads back.

use std::fmt::Write as _;

/// The nearest f64 to a decimal number; `None` for anything else.
///
/// Up to 2^53 in the digits and 10^±22 in the exponent both operands of one multiplication or
/// division are exact, so its result is the correctly rounded one (Clinger 1990, "How to read
/// floating point numbers accurately", section 3). Everything else goes to the standard library,
/// including `nan` and `inf`, which the caller refuses where they matter.
#[inline]
pub(crate) fn parse_f64(text: &[u8]) -> Option<f64> {
    parse_short(text).or_else(|| fast_float2::parse(text).ok())
}

/// A decimal number that starts at `at` and the place behind it, where a blank or line end stands;
/// `None` if it is not followed by one of those, or too close to the end of the text for a look
/// at eight bytes at once.
#[inline]
pub(crate) fn decimal(text: &[u8], at: usize) -> Option<(f64, usize)> {
    let first = *text.get(at)?;
    let start = at + usize::from(first == b'-');
    let (whole, num_whole) = digits8(text, start)?;
    let mut mantissa = u64::from(whole);
    let mut end = start + num_whole;
    let mut num_fraction = 0;
    if num_whole < 8 && text.get(end) == Some(&b'.') {
        end += 1;
        let (fraction, count) = digits8(text, end)?;
        mantissa = mantissa * TENS[count] + u64::from(fraction);
        num_fraction = count;
        if count == 8 {
            let (fraction, count) = digits8(text, end + 8)?;
            // Up to 7 digits before the point and 8 behind it: no overflow with 4 more.
            if count > 4 {
                return long_decimal(text, at);
            }
            mantissa = mantissa * TENS[count] + u64::from(fraction);
            num_fraction += count;
        }
        end += num_fraction;
    }
    let is_short = num_whole + num_fraction > 0 && mantissa <= 1 << 53;
    if *text.get(end)? > b' ' || !is_short {
        return long_decimal(text, at);
    }
    let magnitude = mantissa as f64 / POWERS_OF_TEN[num_fraction];
    let value = if first == b'-' { -magnitude } else { magnitude };
    Some((value, end))
}

/// A number of any form.
#[inline(never)]
fn long_decimal(text: &[u8], at: usize) -> Option<(f64, usize)> {
    let (value, length) = fast_float2::parse_partial(text.get(at..)?).ok()?;
    let end = at + length;
    (*text.get(end)? <= b' ').then_some((value, end))
}

/// The number that up to eight digits from `at` on give, and how many there are; `None` if there
/// are not eight bytes.
///
/// All eight bytes are worked on at once: those behind the first that is no digit are shifted
/// out, zeros come in at the front, and three multiplications join the digits in pairs.
#[inline]
pub(crate) fn digits8(text: &[u8], at: usize) -> Option<(u32, usize)> {
    let bytes = *text.get(at..)?.first_chunk::<8>()?;
    let digits = u64::from_le_bytes(bytes) ^ 0x3030_3030_3030_3030;
    // The high bit of every byte above 9; a carry reaches only bytes behind such a one.
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

/// Powers of ten.
const TENS: [u64; 9] = [
    1,
    10,
    100,
    1_000,
    10_000,
    100_000,
    1_000_000,
    10_000_000,
    100_000_000,
];

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

/// Appends a whole number.
pub(crate) fn push_integer(out: &mut String, mut value: u64) {
    // The largest has 20 digits.
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

    proptest! {
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
