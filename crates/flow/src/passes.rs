//! Passes over all vertices, compiled for the widest vectors that the processor has.

use std::ops::{Add, AddAssign, Mul, Sub};

use cotan_geometry::Scalar;
use nalgebra::Point3;
use pulp::{Simd, WithSimd};

use crate::nearest_rotation::Mat3;
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

/// Four numbers in one vector register.
#[derive(Clone, Copy)]
#[repr(align(32))]
pub(crate) struct Four(pub(crate) [f64; 4]);

impl Four {
    pub(crate) const ZERO: Self = Self([0.0; 4]);

    #[inline(always)]
    pub(crate) fn all(x: f64) -> Self {
        Self([x; 4])
    }

    /// The entries k … k + 3 of a matrix.
    #[inline(always)]
    pub(crate) fn of_entries(m: &Mat3, k: usize) -> Self {
        Self([m[k], m[k + 1], m[k + 2], m[k + 3]])
    }

    /// A vector and a zero.
    #[inline(always)]
    pub(crate) fn of_vector(v: &[f64; 3]) -> Self {
        Self([v[0], v[1], v[2], 0.0])
    }

    /// A point and a zero.
    #[inline(always)]
    pub(crate) fn of_point<T: Scalar>(p: &Point3<T>) -> Self {
        Self([p.x.as_f64(), p.y.as_f64(), p.z.as_f64(), 0.0])
    }

    #[inline(always)]
    pub(crate) fn sum(self) -> f64 {
        (self.0[0] + self.0[1]) + (self.0[2] + self.0[3])
    }

    /// The first three.
    #[inline(always)]
    pub(crate) fn vector(self) -> [f64; 3] {
        [self.0[0], self.0[1], self.0[2]]
    }

    #[inline(always)]
    pub(crate) fn over(self, other: Self) -> Self {
        let (a, b) = (self.0, other.0);
        Self([a[0] / b[0], a[1] / b[1], a[2] / b[2], a[3] / b[3]])
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        let a = self.0;
        Self([a[0].sqrt(), a[1].sqrt(), a[2].sqrt(), a[3].sqrt()])
    }
}

impl Add for Four {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let (a, b) = (self.0, other.0);
        Self([a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]])
    }
}

impl AddAssign for Four {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sub for Four {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let (a, b) = (self.0, other.0);
        Self([a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]])
    }
}

impl Mul for Four {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let (a, b) = (self.0, other.0);
        Self([a[0] * b[0], a[1] * b[1], a[2] * b[2], a[3] * b[3]])
    }
}

/// A 3 × 3 matrix by its columns.
#[derive(Clone, Copy)]
pub(crate) struct Columns([Four; 3]);

impl Columns {
    pub(crate) const ZERO: Self = Self([Four::ZERO; 3]);

    /// m += a bᵀ.
    #[inline(always)]
    pub(crate) fn add_outer(&mut self, a: Four, b: &[f64; 3]) {
        self.0[0] += a * Four::all(b[0]);
        self.0[1] += a * Four::all(b[1]);
        self.0[2] += a * Four::all(b[2]);
    }

    /// All entries times a factor.
    #[inline(always)]
    pub(crate) fn times(&self, factor: f64) -> Mat3 {
        let factor = Four::all(factor);
        let [a, b, c] = [self.0[0] * factor, self.0[1] * factor, self.0[2] * factor];
        [
            a.0[0], a.0[1], a.0[2], b.0[0], b.0[1], b.0[2], c.0[0], c.0[1], c.0[2],
        ]
    }
}

/// m v, with something else in the fourth place.
#[inline(always)]
pub(crate) fn turned(m: &Mat3, v: &[f64; 3]) -> Four {
    let last = Four([m[6], m[7], m[8], m[8]]);
    Four::of_entries(m, 0) * Four::all(v[0])
        + Four::of_entries(m, 3) * Four::all(v[1])
        + last * Four::all(v[2])
}
