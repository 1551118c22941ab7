//! The axis-aligned bounding box.

use nalgebra::{Point3, Vector3};

use crate::scalar::{Scalar, scalar};
use crate::surface::Surface;

/// An axis-aligned box.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct BoundingBox<T: Scalar> {
    /// The corner with the smallest coordinates.
    pub min: Point3<T>,
    /// The corner with the largest coordinates.
    pub max: Point3<T>,
}

impl<T: Scalar> BoundingBox<T> {
    /// The smallest box that contains all points, or `None` if there are none.
    ///
    /// ```
    /// use cotan_geometry::BoundingBox;
    /// use nalgebra::Point3;
    /// let points = [Point3::new(0.0, 1.0, 5.0), Point3::new(2.0, -1.0, 5.0)];
    /// let bounds = BoundingBox::of(&points).expect("two points");
    /// assert_eq!(bounds.longest_side(), 2.0);
    /// assert_eq!(bounds.center(), Point3::new(1.0, 0.0, 5.0));
    /// ```
    pub fn of<'p>(points: impl IntoIterator<Item = &'p Point3<T>>) -> Option<Self> {
        let mut points = points.into_iter();
        let first = *points.next()?;
        let start = Self {
            min: first,
            max: first,
        };
        Some(points.fold(start, |b, p| Self {
            min: b.min.inf(p),
            max: b.max.sup(p),
        }))
    }

    /// The lengths of the sides.
    pub fn extents(&self) -> Vector3<T> {
        self.max - self.min
    }

    /// The length of the diagonal.
    pub fn diagonal(&self) -> T {
        self.extents().norm()
    }

    /// The length of the longest side. The paper scales it to 1 when it measures errors.
    pub fn longest_side(&self) -> T {
        self.extents().max()
    }

    /// The centre.
    pub fn center(&self) -> Point3<T> {
        let half = scalar::<T>(0.5);
        // Halves are added because the sum of two huge coordinates would overflow.
        Point3::from(self.min.coords * half + self.max.coords * half)
    }

    /// Returns true if `point` lies in the box or on its border.
    pub fn contains(&self, point: &Point3<T>) -> bool {
        (0..3).all(|k| self.min[k] <= point[k] && point[k] <= self.max[k])
    }
}

/// [`Surface::bounding_box`] as a function.
pub fn bounding_box<T: Scalar>(surface: &Surface<'_, T>) -> BoundingBox<T> {
    // A surface has a face and therefore a vertex, so the fallback to the origin is never used.
    BoundingBox::of(surface.positions().values()).unwrap_or(BoundingBox {
        min: Point3::origin(),
        max: Point3::origin(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::bar;

    #[test]
    fn a_bar_fills_its_box() {
        let shape = bar::<f32>([1.0, 2.0, 3.0], [1, 1, 1]);
        let bounds = bounding_box(&shape.surface());
        assert_eq!(bounds.extents(), Vector3::new(1.0, 2.0, 3.0));
        assert_eq!(bounds.longest_side(), 3.0);
        assert!((bounds.diagonal() - 14.0_f32.sqrt()).abs() < 1e-6);
        assert!(shape.positions().values().all(|p| bounds.contains(p)));
        assert!(!bounds.contains(&Point3::new(0.0, 0.0, 1.6)));
    }

    #[test]
    fn no_points_have_no_box() {
        assert_eq!(BoundingBox::<f64>::of(&[]), None);
    }
}
