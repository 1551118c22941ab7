//! The unit in which a flow computes.

use cotan_geometry::{Positions, Scalar, Surface, bounding_box};
use nalgebra::{Point3, Vector3};

use crate::error::FlowError;

/// Box units: the lower corner of the original mesh's bounding box at 0, its longest side 1. All
/// tolerances and errors of a flow are in this unit, and everything that updaters, orientations
/// and energies see.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct BoxUnits<T: Scalar> {
    corner: Point3<T>,
    size: T,
    diagonal: T,
}

impl<T: Scalar> BoxUnits<T> {
    /// The box units of a surface.
    ///
    /// # Errors
    /// [`FlowError::NoExtent`] if all vertices lie at one point, or too far apart for the
    /// precision.
    pub fn of(surface: &Surface<'_, T>) -> Result<Self, FlowError> {
        let bounds = bounding_box(surface);
        let size = bounds.longest_side();
        // Room above the size, so that a shape that grows without bound is seen to do so before
        // its positions overflow.
        let reach = size * T::of_f64(1e20);
        if !(size > T::zero() && reach.is_finite()) {
            return Err(FlowError::NoExtent);
        }
        // Scaled first: the squares of huge coordinates would overflow.
        Ok(Self {
            corner: bounds.min,
            size,
            diagonal: (bounds.extents() / size).norm(),
        })
    }

    /// A position of the input in box units.
    pub fn to_box(&self, p: Point3<T>) -> Point3<T> {
        Point3::from((p - self.corner) / self.size)
    }

    /// A position in box units in the units of the input. Only a flow's own
    /// [`crate::Flow::positions`] gives back the exact input where nothing has moved.
    pub fn from_box(&self, p: Point3<T>) -> Point3<T> {
        self.corner + p.coords * self.size
    }

    /// Positions of the input in box units.
    pub fn to_box_all(&self, positions: &Positions<T>) -> Positions<T> {
        positions.map(|p| self.to_box(*p))
    }

    /// A displacement, a Laplacian coordinate or another vector of lengths in box units.
    pub fn vector_to_box(&self, v: Vector3<T>) -> Vector3<T> {
        v / self.size
    }

    /// A vector of lengths in box units in the units of the input.
    pub fn vector_from_box(&self, v: Vector3<T>) -> Vector3<T> {
        v * self.size
    }

    /// The longest side of the bounding box, in the units of the input: one box unit.
    pub fn size(&self) -> T {
        self.size
    }

    /// The lower corner of the bounding box, in the units of the input.
    pub fn corner(&self) -> Point3<T> {
        self.corner
    }

    /// Diagonal of the bounding box, in box units (between 1 and √3).
    pub fn diagonal(&self) -> T {
        self.diagonal
    }
}

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::torus;

    use super::*;

    #[test]
    fn there_and_back_is_the_identity_and_the_longest_side_is_one() {
        let shape = torus::<f64>(3.0, 1.0, 12, 9);
        let units = BoxUnits::of(&shape.surface()).unwrap();
        let boxed = units.to_box_all(shape.positions());
        let bounds = bounding_box(&shape.surface().with_positions(&boxed));
        assert_eq!(bounds.min, Point3::origin());
        assert!((bounds.longest_side() - 1.0).abs() < 1e-15);
        for (p, q) in shape.positions().values().zip(boxed.values()) {
            assert!((units.from_box(*q) - p).norm() < 1e-14);
            let step = units.vector_to_box(p - units.corner());
            assert!((step - q.coords).norm() < 1e-15);
            assert!((units.vector_from_box(step) - (p - units.corner())).norm() < 1e-14);
        }
    }
}
