//! Decisions drawn from the bytes of a fuzzer.

/// Bytes consumed from the front, followed by zeros.
pub(super) struct Draw<'a> {
    data: &'a [u8],
}

impl<'a> Draw<'a> {
    pub(super) fn new(data: &'a [u8]) -> Self {
        Self { data }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.data.is_empty()
    }

    fn array<const N: usize>(&mut self) -> [u8; N] {
        let mut out = [0; N];
        let count = self.data.len().min(N);
        let (taken, rest) = self.data.split_at(count);
        out[..count].copy_from_slice(taken);
        self.data = rest;
        out
    }

    pub(super) fn byte(&mut self) -> u8 {
        u8::from_le_bytes(self.array())
    }

    pub(super) fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.array())
    }

    /// A number below `bound`, which must not be 0.
    pub(super) fn below(&mut self, bound: usize) -> usize {
        match bound {
            0..=256 => usize::from(self.byte()) % bound,
            _ => self.u32() as usize % bound,
        }
    }

    /// A finite number: usually a small multiple of 1/16, sometimes any bits.
    pub(super) fn real(&mut self) -> f64 {
        match self.byte() {
            255 => {
                let x = f64::from_bits(u64::from_le_bytes(self.array()));
                if x.is_finite() { x } else { 0.5 }
            }
            254 => {
                let x = f32::from_bits(self.u32());
                if x.is_finite() { x.into() } else { 0.25 }
            }
            b => (f64::from(b) - 127.0) / 16.0,
        }
    }

    /// A name without blanks, sometimes with letters outside of ASCII.
    pub(super) fn name(&mut self) -> String {
        const LETTERS: &[char] = &['a', 'b', 'Z', '_', '0', '9', '-', '.', 'é', '語'];
        let length = 1 + self.below(6);
        // The first letter distinguishes names from keywords and numbers.
        let mut name = String::from("n");
        name.extend((0..length).map(|_| LETTERS[self.below(LETTERS.len())]));
        name
    }
}
