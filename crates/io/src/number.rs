//! Conversion between decimal text and floating point: correctly rounded parsing, and shortest
//! round-trip formatting.

use std::fmt::Write as _;

/// Parses a decimal number to the nearest `f64`; `None` for anything else.
///
/// With at most 2^53 in the digits and 10^±22 in the exponent, both operands of one
/// multiplication or division are exact, so its result is correctly rounded (Clinger 1990, "How
/// to read floating point numbers accurately", section 3). Everything else goes to a full parser,
/// including `nan` and `inf`, which the caller rejects where they matter.
#[inline]
pub(crate) fn parse_f64(text: &[u8]) -> Option<f64> {
    parse_short(text).or_else(|| fast_float2::parse(text).ok())
}

/// Parses a decimal number that starts at `at`, and returns it with the offset after it, which
/// must hold whitespace or a line ending.
///
/// Returns `None` if it does not, or if the number is too close to the end of the text to load
/// eight bytes at once.
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
            num_fraction += count;
            mantissa = mantissa
                .wrapping_mul(TENS[count])
                .wrapping_add(u64::from(fraction));
            if count == 8 {
                let (fraction, count) = digits8(text, end + 16)?;
                num_fraction += count;
                mantissa = mantissa
                    .wrapping_mul(TENS[count])
                    .wrapping_add(u64::from(fraction));
            }
        }
        end += num_fraction;
    }
    // Zeros before and directly after the point count as digits here. With more digits the
    // mantissa may have overflowed.
    let num_digits = num_whole + num_fraction;
    if *text.get(end)? > b' ' || num_digits == 0 || num_digits > MOST_DIGITS {
        return long_decimal(text, at);
    }
    let magnitude = if mantissa <= 1 << 53 {
        mantissa as f64 / POWERS_OF_TEN[num_fraction]
    } else {
        match tenths(mantissa, num_fraction) {
            Some(magnitude) => magnitude,
            None => return long_decimal(text, at),
        }
    };
    let value = if first == b'-' { -magnitude } else { magnitude };
    Some((value, end))
}

/// Returns the `f64` nearest to `mantissa` · 10^−`count`, for a mantissa above 2^53 and up to 19
/// decimals, or `None` if 64 bits of the power of ten are not enough to determine it.
///
/// Lemire 2021, "Number parsing at a gigabyte per second", section 5: the product of the mantissa
/// and the power, both normalized to 64 bits, is below the true product by less than one unit in
/// its upper 64 bits. The bits after the 53 significant ones therefore determine the rounding,
/// unless they are so close to one half that the truncated part matters.
#[inline]
fn tenths(mantissa: u64, count: usize) -> Option<f64> {
    let (power, exponent) = *TENTHS.get(count)?;
    let shift = mantissa.leading_zeros();
    let product = u128::from(mantissa << shift) * u128::from(power);
    // Exactly 53 bits, followed by the rounding bits.
    let top = product.leading_zeros();
    let product = product << top;
    let bits = (product >> 75) as u64;
    let rest = product & ((1 << 75) - 1);
    let half = 1u128 << 74;
    // The truncation error is less than 2^64, or twice that after the shift.
    if rest.abs_diff(half) <= 1 << 65 {
        return None;
    }
    let rounded = bits + u64::from(rest > half);
    // The value is rounded · 2^(75 − top − shift) · 2^exponent. All of these are normal numbers,
    // and the exponent is also correct after a carry into the 54th bit.
    let power_of_two = 75 - top as i32 - shift as i32 + exponent;
    Some(rounded as f64 * f64::from_bits(((1023 + power_of_two) as u64) << 52))
}

/// The powers 10^0 to 10^−19, each as 64 bits (rounded down) times a power of two.
const TENTHS: [(u64, i32); 20] = {
    let mut powers = [(0, 0); 20];
    let mut count = 0;
    let mut ten: u128 = 1;
    while count < powers.len() {
        // The largest shift for which the quotient has 64 bits.
        let bits = 128 - ten.leading_zeros() as i32;
        let mut shift = 62 + bits;
        if ((1u128 << shift) / ten) >> 63 == 0 {
            shift += 1;
        }
        powers[count] = (((1u128 << shift) / ten) as u64, -shift);
        ten *= 10;
        count += 1;
    }
    powers
};

/// Parses a number of any form.
#[inline(never)]
fn long_decimal(text: &[u8], at: usize) -> Option<(f64, usize)> {
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

/// Maximum number of digits that cannot overflow 64 bits.
const MOST_DIGITS: usize = 19;

#[inline]
fn parse_short(text: &[u8]) -> Option<f64> {
    let (negative, digits) = match text {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        rest => (false, rest),
    };
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
        // Numbers with more than 19 digits are rejected below, so the cast preserves the value.
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

/// Parses an exponent of at most three digits.
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

/// The powers of ten that are exact in `f64`.
const POWERS_OF_TEN: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

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
