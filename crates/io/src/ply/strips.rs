//! Triangle strips, as the PLY files of early scanners have them.

/// A strip that is being unrolled: triangle i has the corners i, i + 1, i + 2 of the strip, and
/// every other triangle is turned round, so that all face one way.
#[derive(Clone, Copy, Default)]
pub(super) struct Strip {
    /// The last two corners.
    last: [u32; 2],
    num_corners: usize,
}

impl Strip {
    /// The triangle that the next corner of the strip makes, if it makes one. A triangle with a
    /// corner twice only leads the strip on.
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
