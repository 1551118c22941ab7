//! Lines of text on an image, in a small bitmap font (Noto Sans Mono).
//!
//! A bitmap font needs no outlines and no system files: the same text gives the same pixels
//! everywhere.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

use super::image::Image;

/// Height of a line, in pixels.
pub(super) const LINE: usize = SIZE.val();

/// Width of a line, in pixels.
pub(super) fn width(text: &str) -> usize {
    text.chars().count() * get_raster_width(WEIGHT, SIZE)
}

/// Draws a line centred at `x` with its top at `y`, clipped to the image.
pub(super) fn draw(image: &mut Image, text: &str, [x, y]: [usize; 2]) {
    let start = x.saturating_sub(width(text) / 2);
    for (k, character) in text.chars().enumerate() {
        let x = start + k * get_raster_width(WEIGHT, SIZE);
        // Characters missing from the font become question marks.
        let known = get_raster(character, WEIGHT, SIZE);
        let Some(glyph) = known.or_else(|| get_raster('?', WEIGHT, SIZE)) else {
            continue;
        };
        for (dy, row) in glyph.rows().enumerate() {
            for (dx, &ink) in row.iter().enumerate() {
                if let Some(pixel) = image.pixel_mut(x + dx, y + dy) {
                    *pixel = blend(*pixel, ink);
                }
            }
        }
    }
}

fn blend(paper: [u8; 3], ink: u8) -> [u8; 3] {
    let ink = u32::from(ink);
    [0, 1, 2].map(|k| {
        let mixed = u32::from(paper[k]) * (255 - ink) + u32::from(INK[k]) * ink;
        ((mixed + 127) / 255) as u8
    })
}

/// The colour of text.
pub(super) const INK: [u8; 3] = [38, 42, 48];

const WEIGHT: FontWeight = FontWeight::Regular;
const SIZE: RasterHeight = RasterHeight::Size24;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_drawn_only_in_its_rectangle() {
        let mut image = Image::filled(80, 40, [255; 3]);
        draw(&mut image, "-1.5", [40, 10]);
        let mut is_inked = |x, y| image.pixel_mut(x, y).is_some_and(|p| *p != [255; 3]);
        let half = width("-1.5") / 2;
        let inside = |x: usize, y: usize| {
            (40 - half..=40 + half).contains(&x) && (10..10 + LINE).contains(&y)
        };
        let mut inked = 0;
        for (x, y) in (0..80).flat_map(|x| (0..40).map(move |y| (x, y))) {
            let ink = is_inked(x, y);
            assert!(!ink || inside(x, y), "{x} {y}");
            inked += usize::from(ink);
        }
        assert!(inked > 30, "{inked}");
        // Odd characters and positions do no harm.
        draw(&mut image, "\u{1F42A}", [75, 35]);
    }
}
