//! Transfer of attributes and shapes to the vertices of another mesh on the sphere.

use cotan_geometry::{Mesh, Positions, Scalar, icosphere};
use cotan_halfedge::{HalfedgeMesh, VertexMap};

use super::error::SphereError;
use super::interpolate::Attribute;
use super::map::SphereMap;

impl<T: Scalar> SphereMap<T> {
    /// Evaluates an attribute in given directions, for example at the vertices of another map.
    ///
    /// For several attributes, locate the directions once with
    /// [`PointLocation::locate_all`](super::PointLocation::locate_all), and call
    /// [`interpolate_all`](SphereMap::interpolate_all) for each attribute.
    ///
    /// **Shapes**: one value per vertex of this map as input, one value per direction as output.
    ///
    /// # Errors
    /// [`SphereError::Mismatch`] if there is not one value per vertex, or if a direction is zero
    /// or not finite.
    pub fn resample<A: Attribute<T>>(
        &self,
        attribute: &VertexMap<A>,
        directions: &Positions<T>,
    ) -> Result<VertexMap<A>, SphereError> {
        self.check_attribute(attribute)?;
        let places = self.point_location().locate_all(directions)?;
        let values = self.interpolate_all(attribute, &places)?;
        Ok(VertexMap::from_vec(values))
    }

    /// Remeshes the shape with an icosphere of `level` subdivisions (10·4^level + 2 vertices):
    /// evenly sized triangles on the sphere, placed at the corresponding points of the source.
    ///
    /// The vertices lie on the source mesh. With increasing level the volume converges to that of
    /// the source. Limbs that the map shrinks get few vertices.
    ///
    /// **Shapes**: `source` has one position per vertex of this map, the original shape.
    ///
    /// ```
    /// use cotan::sphere::SphereMap;
    /// let sphere = cotan::shapes::icosphere::<f64>(2);
    /// let map = SphereMap::new(sphere.connectivity(), sphere.positions().clone())?;
    /// let stretch = nalgebra::Scale3::new(3.0, 2.0, 1.0);
    /// let ellipsoid = sphere.positions().map(|p| stretch * p);
    /// let fine = map.remesh(&ellipsoid, 4)?;
    /// assert_eq!(fine.num_vertices(), 2562);
    /// # Ok::<(), cotan::sphere::SphereError>(())
    /// ```
    ///
    /// # Errors
    /// [`SphereError::Setting`] if the level is above 8; [`SphereError::Mismatch`] if there is
    /// not one position per vertex.
    pub fn remesh(&self, source: &Positions<T>, level: u32) -> Result<Mesh<T>, SphereError> {
        let target = icosphere_of_level(level)?;
        let positions = self.resample(source, target.positions())?;
        let (connectivity, _) = target.into_parts();
        Ok(Mesh::assume_checked(connectivity, positions))
    }

    /// Like [`SphereMap::remesh`], with the mesh of another map.
    ///
    /// # Errors
    /// [`SphereError::Mismatch`] if there is not one position per vertex.
    pub fn remesh_onto(
        &self,
        source: &Positions<T>,
        target: &SphereMap<T>,
    ) -> Result<Mesh<T>, SphereError> {
        Ok(Mesh::assume_checked(
            HalfedgeMesh::clone(target.mesh()),
            self.resample(source, target.positions())?,
        ))
    }
}

/// The unit icosphere of a checked level.
pub(crate) fn icosphere_of_level<T: Scalar>(level: u32) -> Result<Mesh<T>, SphereError> {
    if level > MAX_LEVEL {
        return Err(SphereError::Setting {
            setting: "level",
            range: "at most 8",
            value: f64::from(level),
        });
    }
    Ok(icosphere(level))
}

/// The limit of [`icosphere`], which would otherwise clamp the level silently.
const MAX_LEVEL: u32 = 8;

#[cfg(test)]
mod tests {
    use cotan_geometry::testing::{blobs, rotations};
    use nalgebra::Point3;
    use proptest::prelude::*;

    use super::*;

    /// An icosphere with its own map.
    fn sphere<T: Scalar>(level: u32) -> Mesh<T> {
        icosphere(level)
    }

    #[test]
    fn the_identity_map_of_an_icosphere_reproduces_it() {
        let shape = sphere::<f64>(4);
        let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
        assert_eq!(map.remesh(shape.positions(), 4), Ok(shape.clone()));
        assert_eq!(map.remesh_onto(shape.positions(), &map), Ok(shape.clone()));
        let shape = sphere::<f32>(3);
        let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
        assert_eq!(map.remesh(shape.positions(), 3), Ok(shape.clone()));
    }

    #[test]
    fn the_volume_converges_with_the_level() {
        let shape = sphere::<f64>(3);
        let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
        // Rotated relative to the target, so that no edges coincide.
        let turn = nalgebra::Rotation3::new(nalgebra::Vector3::new(0.3, -0.5, 0.2));
        let map = map.rotated(&turn).unwrap();
        let source = shape
            .positions()
            .map(|p| Point3::new(3.0 * p.x, p.y, 2.0 * p.z));
        let exact = Mesh::new(shape.connectivity().clone(), source.clone()).unwrap();
        let exact = exact.surface().volume();
        let error = |level| {
            let shape = map.remesh(&source, level).unwrap();
            (shape.surface().volume() / exact - 1.0).abs()
        };
        let errors = [2, 3, 4, 5, 6].map(error);
        assert!(errors.windows(2).all(|e| e[1] < 0.5 * e[0]), "{errors:?}");
        assert!(errors[4] < 1e-3, "{errors:?}");
    }

    proptest! {
        #[test]
        fn turning_map_and_target_alike_changes_nothing(shape in blobs(), turn in rotations()) {
            let ball = shape.positions().map(|p| Point3::from(p.coords.normalize()));
            if let Ok(map) = SphereMap::new(shape.connectivity(), ball) {
                let (_, target) = sphere::<f64>(2).into_parts();
                let before = map.resample(shape.positions(), &target).unwrap();
                let map = map.rotated(&turn).unwrap();
                let turned = target.map(|p| turn * p);
                let after = map.resample(shape.positions(), &turned).unwrap();
                for (a, b) in before.values().zip(after.values()) {
                    prop_assert!((a - b).norm() < 1e-13);
                }
            }
        }
    }

    #[test]
    fn a_level_beyond_eight_is_refused() {
        let shape = sphere::<f64>(0);
        let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
        let refused = map.remesh(shape.positions(), 9);
        assert!(matches!(refused, Err(SphereError::Setting { .. })));
    }
}
