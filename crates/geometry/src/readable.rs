//! Number formatting for human readers.

use std::fmt;

/// A number formatted for reading: at most six significant digits, no trailing zeros, and an
/// exponent if the number would be long otherwise.
///
/// Meant for messages and tables. Files and JSON keep every digit and never use it.
///
/// ```
/// use cotan_geometry::Readable;
/// assert_eq!(Readable(0.1).to_string(), "0.1");
/// assert_eq!(Readable(f64::from(0.1_f32)).to_string(), "0.1");
/// assert_eq!(Readable(1e300).to_string(), "1e300");
/// assert_eq!(Readable(-12.345_678_9).to_string(), "-12.3457");
/// ```
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug)]
pub struct Readable(pub f64);

impl fmt::Display for Readable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let x = self.0;
        if x == 0.0 || !x.is_finite() {
            // Also drops the sign of −0, which means nothing to a reader.
            let x = if x == 0.0 { 0.0 } else { x };
            return f.pad(&x.to_string());
        }
        // The exponent after rounding, which may carry: 999999.9 becomes 1e6.
        let scientific = format!("{x:.*e}", DIGITS - 1);
        let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
        let text = match exponent.parse::<i32>() {
            Ok(exponent @ PLAIN_FROM..PLAIN_BELOW) => {
                let decimals = (DIGITS as i32 - 1 - exponent).max(0) as usize;
                without_zeros(&format!("{x:.decimals$}")).to_owned()
            }
            _ => format!("{}e{exponent}", without_zeros(mantissa)),
        };
        f.pad(&text)
    }
}

/// Significant digits.
const DIGITS: usize = 6;

/// The range of decimal exponents that are written without an exponent.
const PLAIN_FROM: i32 = -4;
const PLAIN_BELOW: i32 = DIGITS as i32;

fn without_zeros(decimal: &str) -> &str {
    match decimal.contains('.') {
        true => decimal.trim_end_matches('0').trim_end_matches('.'),
        false => decimal,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn numbers_have_the_digits_that_people_read() {
        let cases = [
            (0.0, "0"),
            (-0.0, "0"),
            (1.0, "1"),
            (100.0, "100"),
            (0.1 + 0.2, "0.3"),
            (0.818_640_1, "0.81864"),
            (123_456.7, "123457"),
            (999_999.9, "1e6"),
            (1_234_567.8, "1.23457e6"),
            (2.785e-4, "0.0002785"),
            (2.785e-5, "2.785e-5"),
            (99_999.999_9e-9, "0.0001"),
            (1e300, "1e300"),
            (-1e-300, "-1e-300"),
            (f64::MAX, "1.79769e308"),
            (5e-324, "4.94066e-324"),
            (f64::NAN, "NaN"),
            (f64::NEG_INFINITY, "-inf"),
        ];
        for (x, expected) in cases {
            assert_eq!(Readable(x).to_string(), expected, "{x:e}");
        }
        assert_eq!(format!("{:>6}", Readable(0.5)), "   0.5");
    }

    proptest! {
        #[test]
        fn the_text_is_short_and_close_to_the_number(x in proptest::num::f64::NORMAL) {
            let text = Readable(x).to_string();
            prop_assert!(text.len() <= "-1.23457e-308".len(), "{text}");
            // The largest numbers may round beyond the range of `f64`.
            let read: f64 = text.parse().expect("a number");
            prop_assert!((read / x - 1.0).abs() <= 5.1e-6 || read.is_infinite(), "{x:e} {text}");
        }
    }
}
