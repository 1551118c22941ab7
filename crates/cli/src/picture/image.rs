//! Images in memory, and as PNG.

/// The RGB values of every pixel, row by row.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Image {
    width: usize,
    pixels: Vec<[u8; 3]>,
}

impl Image {
    /// An image of one colour.
    pub(super) fn filled(width: usize, height: usize, color: [u8; 3]) -> Self {
        Self {
            width,
            pixels: vec![color; width * height],
        }
    }

    /// An image made of rows of `width` pixels.
    pub(super) fn from_pixels(width: usize, pixels: Vec<[u8; 3]>) -> Self {
        debug_assert!(width > 0 && pixels.len().is_multiple_of(width));
        Self { width, pixels }
    }

    /// Joins images of the same height from left to right.
    pub(super) fn side_by_side(images: &[Self]) -> Self {
        let width = images.iter().map(Self::width).sum();
        let height = images.iter().map(Self::height).min().unwrap_or(0);
        let rows = (0..height).flat_map(|y| images.iter().map(move |image| image.row(y)));
        Self {
            width,
            pixels: rows.flatten().copied().collect(),
        }
    }

    /// Joins images of the same width from top to bottom.
    pub(super) fn stacked(images: &[Self]) -> Self {
        Self {
            width: images.first().map_or(0, Self::width),
            pixels: images
                .iter()
                .flat_map(|image| &image.pixels)
                .copied()
                .collect(),
        }
    }

    pub(super) fn width(&self) -> usize {
        self.width
    }

    pub(super) fn height(&self) -> usize {
        self.pixels.len() / self.width.max(1)
    }

    fn row(&self, y: usize) -> &[[u8; 3]] {
        &self.pixels[y * self.width..][..self.width]
    }

    /// The pixel at a position, or `None` outside of the image.
    pub(super) fn pixel_mut(&mut self, x: usize, y: usize) -> Option<&mut [u8; 3]> {
        match x < self.width {
            true => self.pixels.get_mut(y * self.width + x),
            false => None,
        }
    }

    /// Fills a rectangle, clipped to the image.
    pub(super) fn fill(&mut self, [x, y]: [usize; 2], [width, height]: [usize; 2], color: [u8; 3]) {
        for y in y..y + height {
            for x in x..x + width {
                if let Some(pixel) = self.pixel_mut(x, y) {
                    *pixel = color;
                }
            }
        }
    }

    /// The image as a PNG file.
    pub(super) fn png(&self) -> Vec<u8> {
        let size = [self.width, self.height()];
        png(size, Depth::Eight, self.pixels.as_flattened())
    }
}

/// Bits per colour channel.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Depth {
    Eight,
    /// Big-endian.
    Sixteen,
}

/// Encodes RGB samples, row by row, as a PNG file.
pub(crate) fn png([width, height]: [usize; 2], depth: Depth, samples: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(match depth {
        Depth::Eight => png::BitDepth::Eight,
        Depth::Sixteen => png::BitDepth::Sixteen,
    });
    // Writing to memory cannot fail, and the samples have the announced size.
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(samples)?;
        writer.finish()
    });
    debug_assert!(written.is_ok(), "{written:?}");
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_join_and_rectangles_end_at_the_border() {
        let [black, white] = [0, 255].map(|c| Image::filled(2, 2, [c; 3]));
        let mut both = Image::side_by_side(&[black, white]);
        assert_eq!((both.width(), both.height()), (4, 2));
        assert_eq!(both.row(1), [[0; 3], [0; 3], [255; 3], [255; 3]]);
        both.fill([3, 1], [9, 9], [7; 3]);
        assert_eq!(both.pixel_mut(3, 1), Some(&mut [7; 3]));
        assert_eq!(both.pixel_mut(4, 0), None);
        let tall = Image::stacked(&[both.clone(), both]);
        assert_eq!((tall.width(), tall.height()), (4, 4));
    }
}
