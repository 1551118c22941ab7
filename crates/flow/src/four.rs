//! Vectors and 3 × 3 matrices of numbers that are computed with four at a time.

use std::ops::{Add, AddAssign, Mul, Sub};

use cotan_geometry::Scalar;
use nalgebra::{Matrix3, Point3};

/// A 3 × 3 matrix, column after column: entry (r, c) is at 3c + r.
pub(crate) type Mat3 = [f64; 9];

pub(crate) const IDENTITY: Mat3 = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// The entries of a matrix.
pub(crate) fn flat(matrix: &Matrix3<f64>) -> Mat3 {
    std::array::from_fn(|k| matrix[k])
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
