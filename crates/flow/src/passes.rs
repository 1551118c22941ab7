//! Passes over all vertices, compiled for the widest vectors that the processor has.

use pulp::{Simd, WithSimd};

use crate::vectors::CHUNKS;

/// The work of a pass on one chunk of entries. Not a closure, since the compiler leaves those
/// outside what it compiles for wider vectors: `on` and all that its loops call must be
/// `#[inline(always)]`.
pub(crate) trait Pass<A, const N: usize>: Sync {
    /// Works on `entries`, the first of which has the index `first`. Returns sums.
    fn on(&self, first: usize, entries: &mut [A]) -> [f64; N];
}

/// As [`Pass`], for two slices of one length.
pub(crate) trait PassOfTwo<A, B, const N: usize>: Sync {
    /// Works on the entries of both slices from index `first` on.
    fn on(&self, first: usize, a: &mut [A], b: &mut [B]) -> [f64; N];
}

/// As [`Pass`], for three slices of one length, without sums.
pub(crate) trait PassOfThree<A, B, C>: Sync {
    /// Works on the entries of all slices from index `first` on.
    fn on(&self, first: usize, a: &mut [A], b: &mut [B], c: &mut [C]);
}

/// Runs a pass over all entries. Returns its sums.
pub(crate) fn run<A: Send, const N: usize>(pass: &impl Pass<A, N>, out: &mut [A]) -> [f64; N] {
    total(&CHUNKS.map(out, |first, entries| {
        pulp::Arch::new().dispatch(One {
            pass,
            first,
            entries,
        })
    }))
}

/// Runs a pass over two slices. Returns its sums.
pub(crate) fn run_both<A: Send, B: Send, const N: usize>(
    pass: &impl PassOfTwo<A, B, N>,
    a: &mut [A],
    b: &mut [B],
) -> [f64; N] {
    total(&CHUNKS.map((a, b), |first, (a, b)| {
        pulp::Arch::new().dispatch(Both { pass, first, a, b })
    }))
}

/// Runs a pass over three slices.
pub(crate) fn run_three<A: Send, B: Send, C: Send>(
    pass: &impl PassOfThree<A, B, C>,
    a: &mut [A],
    b: &mut [B],
    c: &mut [C],
) {
    CHUNKS.for_each((a, b, c), |first, (a, b, c)| {
        pulp::Arch::new().dispatch(Three {
            pass,
            first,
            a,
            b,
            c,
        });
    });
}

fn total<const N: usize>(partial: &[[f64; N]]) -> [f64; N] {
    let mut sums = [0.0; N];
    for part in partial {
        for (sum, term) in sums.iter_mut().zip(part) {
            *sum += term;
        }
    }
    sums
}

struct One<'a, P, A, const N: usize> {
    pass: &'a P,
    first: usize,
    entries: &'a mut [A],
}

impl<A, P: Pass<A, N>, const N: usize> WithSimd for One<'_, P, A, N> {
    type Output = [f64; N];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [f64; N] {
        self.pass.on(self.first, self.entries)
    }
}

struct Both<'a, P, A, B, const N: usize> {
    pass: &'a P,
    first: usize,
    a: &'a mut [A],
    b: &'a mut [B],
}

impl<A, B, P: PassOfTwo<A, B, N>, const N: usize> WithSimd for Both<'_, P, A, B, N> {
    type Output = [f64; N];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [f64; N] {
        self.pass.on(self.first, self.a, self.b)
    }
}

struct Three<'a, P, A, B, C> {
    pass: &'a P,
    first: usize,
    a: &'a mut [A],
    b: &'a mut [B],
    c: &'a mut [C],
}

impl<A, B, C, P: PassOfThree<A, B, C>> WithSimd for Three<'_, P, A, B, C> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.pass.on(self.first, self.a, self.b, self.c);
    }
}
