//! The legend of a heat map: title, colours and numbers.

use cotan_tool::{ColorScale, Overflow};

use super::image::Image;
use super::text::{self, INK, LINE};

/// The smallest width of a bar that fits its title.
pub(super) fn least_width(scale: &ColorScale) -> usize {
    text::width(scale.title()) + 2 * BORDER
}

/// A strip of `width` pixels with the bar in its centre.
pub(super) fn draw(scale: &ColorScale, width: usize, paper: [u8; 3]) -> Image {
    let mut strip = Image::filled(width, HEIGHT, paper);
    let length = width
        .saturating_sub(2 * (BORDER + TIP))
        .clamp(1, MAX_LENGTH);
    let left = width.saturating_sub(length) / 2;
    text::draw(&mut strip, scale.title(), [width / 2, TOP]);
    for x in 0..length {
        let share = x as f64 / (length - 1).max(1) as f64;
        strip.fill([left + x, BAR_TOP], [1, THICKNESS], scale.color_at(share));
    }
    let [below, above] = scale.overflows();
    if below == Overflow::Some {
        let color = scale.color_at(0.0);
        tip(&mut strip, color, |x| left.checked_sub(1 + x));
    }
    if above == Overflow::Some {
        let color = scale.color_at(1.0);
        tip(&mut strip, color, |x| Some(left + length + x));
    }
    for (value, label) in scale.ticks() {
        let Some(share) = scale.share(value) else {
            continue;
        };
        let x = left + (share * (length - 1) as f64).round() as usize;
        strip.fill([x, BAR_TOP + THICKNESS], [1, TICK], INK);
        text::draw(&mut strip, &label, [x, LABEL_TOP]);
    }
    strip
}

/// A triangle at an end of the bar that indicates values beyond the numbers.
fn tip(strip: &mut Image, color: [u8; 3], column: impl Fn(usize) -> Option<usize>) {
    for x in 0..TIP {
        let inset = (x * THICKNESS / 2) / TIP;
        if let Some(at) = column(x) {
            strip.fill([at, BAR_TOP + inset], [1, THICKNESS - 2 * inset], color);
        }
    }
}

/// Lengths in pixels, first vertical, then horizontal.
const TOP: usize = 16;
const BAR_TOP: usize = TOP + LINE + 10;
const THICKNESS: usize = 24;
const TICK: usize = 7;
const LABEL_TOP: usize = BAR_TOP + THICKNESS + TICK + 3;
const HEIGHT: usize = LABEL_TOP + LINE + 14;
const BORDER: usize = 40;
const TIP: usize = 16;

/// A longer bar would not show more.
const MAX_LENGTH: usize = 900;
