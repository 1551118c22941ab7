//! Triangle strips, as in the PLY files of early scanners.

/// A strip that is being unrolled.
///
/// Triangle i has the corners i, i + 1, i + 2 of the strip, and every other triangle is reversed,
/// so that all have the same orientation.
#[derive(Clone, Copy, Default)]
pub(super) struct Strip {
    /// The last two corners.
    last: [u32; 2],
    num_corners: usize,
}

impl Strip {
    /// Adds the next corner, and returns the triangle that it completes, if any.
    ///
    /// A triangle with a repeated corner only continues the strip.
    pub(super) fn push(&mut self, c: u32) -> Option<[u32; 3]> {
        let [a, b] = self.last;
        let number = self.num_corners;
        self.last = [b, c];
        self.num_corners += 1;
        if number < 2 || a == b || b == c || a == c {
            None
        } else if number.is_multiple_of(2) {
            Some([a, b, c])
        } else {
            Some([b, a, c])
        }
    }
}
