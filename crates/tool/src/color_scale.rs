//! Conversion of numbers to colours, with one scale for all panels of a picture.

use colorous::Gradient;

/// A mapping from numbers to colours, with a title.
///
/// The range excludes the outermost hundredth of the values, so that a few extreme faces do not
/// use up the colours for all others. Values out of range get the colour of the end, which the
/// colour bar indicates by an arrow.
#[derive(Clone, Debug)]
pub struct ColorScale {
    title: String,
    gradient: Gradient,
    low: f64,
    high: f64,
    /// The overflow at each end of the range.
    overflows: [Overflow; 2],
}

/// The presence of values beyond an end of the range.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Overflow {
    /// There are none.
    None,
    /// There are some, shown in the colour of the end.
    Some,
}

impl ColorScale {
    /// Creates a scale for values of both signs with a meaningful zero: white at 0, blue below,
    /// red above, symmetric about 0.
    ///
    /// `title` names the quantity and its unit.
    pub fn signed(title: &str, values: impl IntoIterator<Item = f64>) -> Self {
        let values = sorted(values);
        let sizes = sorted(values.iter().map(|x| x.abs()));
        let most = nice_end(sizes.as_slice());
        Self::new(title, [-most, most], &values, colorous::RED_BLUE)
    }

    /// Creates a scale for non-negative values: dark at 0, bright at the maximum.
    pub fn size(title: &str, values: impl IntoIterator<Item = f64>) -> Self {
        let values = sorted(values);
        let most = nice_end(values.as_slice());
        Self::new(title, [0.0, most], &values, colorous::VIRIDIS)
    }

    fn new(title: &str, [low, high]: [f64; 2], sorted: &[f64], gradient: Gradient) -> Self {
        let overflow = |is: Option<bool>| match is {
            Some(true) => Overflow::Some,
            _ => Overflow::None,
        };
        Self {
            title: title.to_owned(),
            gradient,
            low,
            high,
            overflows: [
                overflow(sorted.first().map(|&x| x < low)),
                overflow(sorted.last().map(|&x| x > high)),
            ],
        }
    }

    /// The quantity and its unit.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// The values at the two ends.
    pub fn range(&self) -> [f64; 2] {
        [self.low, self.high]
    }

    /// The overflow at the low end and at the high end.
    pub fn overflows(&self) -> [Overflow; 2] {
        self.overflows
    }

    /// The position of a value between the ends of the scale, from 0 to 1; `None` for NaN.
    pub fn share(&self, value: f64) -> Option<f64> {
        let share = (value - self.low) / (self.high - self.low);
        (!value.is_nan()).then(|| share.clamp(0.0, 1.0))
    }

    /// The 8-bit colour at a position on the scale.
    pub fn color_at(&self, share: f64) -> [u8; 3] {
        // The gradient runs from red to blue.
        let along = match self.low < 0.0 {
            true => 1.0 - share,
            false => share,
        };
        self.gradient.eval_continuous(along).into_array()
    }

    /// The linear colour of a value; grey for NaN.
    pub fn color(&self, value: f64) -> [f32; 3] {
        self.share(value)
            .map_or(NO_VALUE, |share| decode(self.color_at(share)))
    }

    /// The distance of a value from the middle of a signed scale, or from the low end of a size
    /// scale, from 0 to 1; 0 for NaN.
    pub fn strength(&self, value: f64) -> f64 {
        let share = self.share(value);
        match self.low < 0.0 {
            true => share.map_or(0.0, |share| (2.0 * share - 1.0).abs()),
            false => share.unwrap_or(0.0),
        }
    }

    /// Round numbers along the scale, each with its text.
    pub fn ticks(&self) -> Vec<(f64, String)> {
        let step = round_step((self.high - self.low) / MAX_TICKS);
        let count = |end: f64| (end / step * (1.0 + 1e-9)).trunc() as i64;
        let digits = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
        let is_plain = (1e-3..1e6).contains(&self.high);
        let label = |x: f64| match is_plain {
            true => format!("{x:.digits$}"),
            false if x == 0.0 => "0".to_owned(),
            false => format!("{x:.1e}"),
        };
        (count(self.low)..=count(self.high))
            .map(|k| (k as f64 * step, label(k as f64 * step)))
            .collect()
    }
}

/// Converts an 8-bit colour to linear.
///
/// Uses the square, which is close enough to sRGB and the same on every machine.
pub fn decode(encoded: [u8; 3]) -> [f32; 3] {
    encoded.map(|c| (f32::from(c) / 255.0).powi(2))
}

/// The linear colour of NaN.
const NO_VALUE: [f32; 3] = [0.25, 0.25, 0.25];

/// Maximum number of steps between ticks.
const MAX_TICKS: f64 = 8.0;

/// The values in order, without NaN, with infinities clamped to the largest finite numbers.
fn sorted(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let numbers = values.into_iter().filter(|x| !x.is_nan());
    let mut sorted: Vec<f64> = numbers.map(|x| x.clamp(-f64::MAX, f64::MAX)).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted
}

/// The end of a scale for sorted sizes: above 99 of 100, and above 0.
fn nice_end(sorted: &[f64]) -> f64 {
    let place = (sorted.len() as f64 * 0.99) as usize;
    let size = sorted.get(place.min(sorted.len().saturating_sub(1)));
    match size {
        // At most half of the maximum, since the length of a signed scale must be finite too.
        Some(&size) if size > 0.0 => {
            let size = size.clamp(f64::MIN_POSITIVE * 1e16, f64::MAX / 4.0);
            let step = round_step(size / 10.0);
            (size / step).ceil() * step
        }
        _ => 1.0,
    }
}

/// The smallest of 1, 2, 5, 10, … times a power of ten that is at least `least`.
fn round_step(least: f64) -> f64 {
    let power = 10f64.powi(least.log10().floor() as i32);
    let fits = |factor: &f64| factor * power >= least * (1.0 - 1e-9);
    [1.0, 2.0, 5.0].into_iter().find(fits).unwrap_or(10.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_is_the_middle_of_a_signed_scale() {
        let scale = ColorScale::signed("x", [-0.3, 2.93, 0.1]);
        assert_eq!(scale.share(0.0), Some(0.5));
        assert_eq!(scale.strength(0.0), 0.0);
        let [red, _, blue] = scale.color_at(1.0);
        assert!(red > blue);
        let labels: Vec<String> = scale.ticks().into_iter().map(|(_, label)| label).collect();
        assert_eq!(labels, ["-3", "-2", "-1", "0", "1", "2", "3"]);
        assert_eq!(scale.overflows(), [Overflow::None; 2]);
    }

    #[test]
    fn a_few_extremes_do_not_stretch_the_scale() {
        let mut values = vec![0.4; 1000];
        values.extend([-100.0, 50.0]);
        let scale = ColorScale::signed("x", values.iter().copied());
        assert_eq!(scale.overflows(), [Overflow::Some; 2]);
        assert_eq!(scale.ticks().last().map(|(x, _)| *x), Some(0.4));
        assert_eq!(scale.share(50.0), Some(1.0));
        let scale = ColorScale::size("x", values.into_iter().map(f64::abs));
        assert_eq!(scale.overflows(), [Overflow::None, Overflow::Some]);
        assert_eq!(scale.share(0.2), Some(0.5));
    }

    #[test]
    fn any_values_have_a_scale() {
        let (nan, inf) = (f64::NAN, f64::INFINITY);
        let cases: [&[f64]; 8] = [
            &[],
            &[nan],
            &[0.0, 0.0],
            &[inf, -inf],
            &[f64::MAX, -f64::MAX],
            &[5e-324],
            &[1e-300, -1e-300],
            &[7.0],
        ];
        for values in cases {
            for scale in [
                ColorScale::signed("x", values.iter().copied()),
                ColorScale::size("x", values.iter().map(|x| x.abs())),
            ] {
                let ticks = scale.ticks();
                assert!((2..=10).contains(&ticks.len()), "{values:?} {ticks:?}");
                let mut labels: Vec<_> = ticks.iter().map(|(_, label)| label).collect();
                labels.dedup();
                assert_eq!(labels.len(), ticks.len(), "{values:?} {ticks:?}");
                for x in values.iter().copied().chain([nan, inf, -inf, 0.0]) {
                    assert!(scale.color(x).iter().all(|c| (0.0..=1.0).contains(c)));
                    assert!((0.0..=1.0).contains(&scale.strength(x)));
                }
                assert_eq!(scale.color(nan), NO_VALUE);
            }
        }
    }

    #[test]
    fn steps_are_round() {
        for (least, step) in [
            (0.9, 1.0),
            (1.1, 2.0),
            (2.1, 5.0),
            (0.06, 0.1),
            (300.0, 500.0),
        ] {
            assert!((round_step(least) / step - 1.0).abs() < 1e-12, "{least}");
        }
    }
}
