//! The unit of computations in edits.

use cotan_geometry::{Scalar, Surface, bounding_box};
use nalgebra::Vector3;

/// Coordinates about the centre of the bounding box, scaled by a power of two to a size of about
/// one, so that no unit under- or overflows.
pub(crate) struct Units {
    center: Vector3<f64>,
    /// One length of the mesh in this unit.
    pub(crate) scale: f64,
}

impl Units {
    pub(crate) fn of<T: Scalar>(surface: &Surface<'_, T>) -> Self {
        let bounds = bounding_box(surface);
        let (min, max) = (
            bounds.min.coords.map(T::as_f64),
            bounds.max.coords.map(T::as_f64),
        );
        let (center, side) = (min + (max - min) / 2.0, (max - min).amax());
        let exponent = if side > 0.0 {
            side.log2().floor().clamp(-1000.0, 1000.0)
        } else {
            0.0
        };
        Self {
            center,
            scale: (-exponent).exp2(),
        }
    }

    pub(crate) fn inward(&self, p: &Vector3<f64>) -> Vector3<f64> {
        (p - self.center) * self.scale
    }

    pub(crate) fn outward(&self, p: &Vector3<f64>) -> Vector3<f64> {
        p / self.scale + self.center
    }
}
