//! Interpolation of vertex attributes on the sphere.

use std::ops::Mul;

use cotan_geometry::Scalar;
use cotan_halfedge::VertexMap;
use cotan_parallel as parallel;
use nalgebra::{Point, SVector};

use super::error::SphereError;
use super::locate::Located;
use super::map::SphereMap;

/// Values that can be interpolated between the corners of a triangle: numbers, vectors, points.
pub trait Attribute<T: Scalar>: Clone + Send + Sync {
    /// Computes Σ w_k a_k over the three corners. With weights 1, 0, 0 the result is exactly the
    /// first value, provided that all are finite.
    fn blend(corners: [&Self; 3], weights: [T; 3]) -> Self;

    /// |a − b|².
    fn distance_squared(&self, other: &Self) -> f64;
}

macro_rules! impl_attribute_for_number {
    ($number:ty) => {
        impl Attribute<$number> for $number {
            fn blend([a, b, c]: [&Self; 3], [u, v, w]: [$number; 3]) -> Self {
                a * u + b * v + c * w
            }

            fn distance_squared(&self, other: &Self) -> f64 {
                (self.as_f64() - other.as_f64()).powi(2)
            }
        }
    };
}

impl_attribute_for_number!(f32);
impl_attribute_for_number!(f64);

impl<T: Scalar, const N: usize> Attribute<T> for SVector<T, N> {
    fn blend([a, b, c]: [&Self; 3], [u, v, w]: [T; 3]) -> Self {
        a.mul(u) + b.mul(v) + c.mul(w)
    }

    fn distance_squared(&self, other: &Self) -> f64 {
        (self - other).map(T::as_f64).norm_squared()
    }
}

impl<T: Scalar, const N: usize> Attribute<T> for Point<T, N> {
    fn blend(corners: [&Self; 3], weights: [T; 3]) -> Self {
        SVector::blend(corners.map(|p| &p.coords), weights).into()
    }

    fn distance_squared(&self, other: &Self) -> f64 {
        self.coords.distance_squared(&other.coords)
    }
}

impl<T: Scalar> SphereMap<T> {
    /// Interpolates an attribute at a point of the sphere.
    ///
    /// **Shapes**: one value per vertex of this map's mesh.
    ///
    /// # Errors
    /// [`SphereError::Mismatch`] if there is not one value per vertex, or if the location belongs
    /// to another map and its face does not exist here.
    pub fn interpolate<A: Attribute<T>>(
        &self,
        attribute: &VertexMap<A>,
        at: &Located<T>,
    ) -> Result<A, SphereError> {
        self.check_attribute(attribute)?;
        self.check_place(at)?;
        Ok(self.blend(attribute, at))
    }

    /// Like [`SphereMap::interpolate`], at many points, in parallel.
    ///
    /// # Errors
    /// Same as [`SphereMap::interpolate`].
    pub fn interpolate_all<A: Attribute<T>>(
        &self,
        attribute: &VertexMap<A>,
        at: &[Located<T>],
    ) -> Result<Vec<A>, SphereError> {
        self.check_attribute(attribute)?;
        at.iter().try_for_each(|place| self.check_place(place))?;
        let blend = |i: usize| self.blend(attribute, &at[i]);
        Ok(parallel::filled(at.len(), blend))
    }

    /// The blend of the three corners, unchecked.
    pub(crate) fn blend<A: Attribute<T>>(&self, attribute: &VertexMap<A>, at: &Located<T>) -> A {
        let corners = self.mesh().triangle(at.face).map(|v| &attribute[v]);
        A::blend(corners, at.barycentric)
    }

    /// Checks that there is one value per vertex.
    pub(crate) fn check_attribute<A>(&self, attribute: &VertexMap<A>) -> Result<(), SphereError> {
        let (values, vertices) = (attribute.len(), self.mesh().num_vertices());
        if values != vertices {
            return Err(SphereError::Mismatch(format!(
                "there are {values} values for the {vertices} vertices of the map; give one value a vertex"
            )));
        }
        Ok(())
    }

    fn check_place(&self, at: &Located<T>) -> Result<(), SphereError> {
        let faces = self.mesh().num_faces();
        if at.face.index() >= faces {
            return Err(SphereError::Mismatch(format!(
                "face {} was located on another map; this one has {faces} faces",
                at.face
            )));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use cotan_geometry::icosphere;
    use cotan_geometry::testing::directions;
    use cotan_halfedge::FaceId;
    use nalgebra::{Point3, Vector2, Vector3};
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn linear_functions_are_met_on_the_flat_triangle(d in directions(), slope in directions()) {
            let shape = icosphere::<f64>(2);
            let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
            let place = map.point_location().locate(&d).unwrap();
            let height = shape.positions().map(|p| slope.dot(&p.coords));
            let point = map.interpolate(shape.positions(), &place).unwrap();
            let value = map.interpolate(&height, &place).unwrap();
            prop_assert!((value - slope.dot(&point.coords)).abs() < 1e-14);
            // The point is also where the direction pierces the triangle.
            prop_assert!((point.coords.normalize() - d).norm() < 1e-14);
        }
    }

    #[test]
    fn a_corner_gives_its_value_to_the_bit() {
        let corners = [
            &Point3::new(0.1_f32, 0.2, 0.3),
            &Point3::origin(),
            &Point3::origin(),
        ];
        assert_eq!(Point3::blend(corners, [1.0, 0.0, 0.0]), *corners[0]);
        let corners = [
            &Vector2::new(0.1, 0.2),
            &Vector2::zeros(),
            &Vector2::zeros(),
        ];
        assert_eq!(Vector2::blend(corners, [1.0, 0.0, 0.0]), *corners[0]);
        assert_eq!(f64::blend([&0.1, &7.0, &8.0], [0.0, 1.0, 0.0]), 7.0);
        assert_eq!(Vector3::x().distance_squared(&-Vector3::<f32>::x()), 4.0);
    }

    #[test]
    fn mismatched_inputs_are_refused() {
        let shape = icosphere::<f64>(0);
        let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
        let place = map.point_location().locate(&Vector3::x()).unwrap();
        let short = VertexMap::filled(3, 0.0);
        assert!(map.interpolate(&short, &place).is_err());
        let foreign = Located {
            face: FaceId::new(20),
            ..place
        };
        let values = VertexMap::filled(12, 0.0);
        assert!(map.interpolate(&values, &foreign).is_err());
        assert!(map.interpolate_all(&values, &[place, foreign]).is_err());
        assert_eq!(map.interpolate_all(&values, &[place]), Ok(vec![0.0]));
    }
}
