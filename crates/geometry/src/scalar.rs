//! The scalar type bound used by all computations.

use nalgebra::RealField;
use num_traits::{FromPrimitive, ToPrimitive};

/// A floating-point type supported by the workspace: `f32` or `f64`.
///
/// It combines the required bounds of nalgebra and num-traits into one. Constants are written as
/// [`scalar`]`(0.5)`.
pub trait Scalar: RealField + Copy + FromPrimitive + ToPrimitive {
    /// The value as `f64` (exact for both types).
    fn as_f64(self) -> f64;

    /// The value nearest to an `f64`.
    fn of_f64(value: f64) -> Self;
}

impl Scalar for f32 {
    #[inline]
    fn as_f64(self) -> f64 {
        f64::from(self)
    }

    #[inline]
    fn of_f64(value: f64) -> Self {
        value as f32
    }
}

impl Scalar for f64 {
    #[inline]
    fn as_f64(self) -> f64 {
        self
    }

    #[inline]
    fn of_f64(value: f64) -> Self {
        value
    }
}

/// Converts the constant `value` to type `T`.
#[inline]
pub fn scalar<T: Scalar>(value: f64) -> T {
    T::of_f64(value)
}
