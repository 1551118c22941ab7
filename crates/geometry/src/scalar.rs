//! The one bound of everything that computes.

use nalgebra::RealField;
use num_traits::{FromPrimitive, ToPrimitive};

/// A floating-point type that the workspace computes with: `f32` or `f64`.
///
/// It gathers what nalgebra and num-traits ask for, so that a user's bound is one word.
/// Constants are written [`scalar`]`(0.5)`.
pub trait Scalar: RealField + Copy + FromPrimitive + ToPrimitive {
    /// The value as `f64` (exact for both types).
    fn as_f64(self) -> f64;

    /// The nearest value to an `f64`.
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

/// The constant `value` in the type at hand.
#[inline]
pub fn scalar<T: Scalar>(value: f64) -> T {
    T::of_f64(value)
}
