//! A morph between two shapes that have been mapped to the sphere.

use cotan_geometry::{Mesh, Positions, Scalar, scalar};
use cotan_halfedge::HalfedgeMesh;
use nalgebra::Point3;

use super::error::SphereError;
use super::map::SphereMap;
use super::resample::icosphere_of_level;

/// Two shapes on one mesh with corresponding vertices at the same position on the sphere, and the
/// straight paths between them.
///
/// The correspondence is defined by the maps. Use [`SphereMap::align`] or
/// [`SphereMap::align_landmarks`] to rotate one map to match the other first.
#[derive(Clone, PartialEq, Debug)]
pub struct Morph<T: Scalar> {
    mesh: HalfedgeMesh,
    start: Positions<T>,
    end: Positions<T>,
}

impl<T: Scalar> Morph<T> {
    /// Resamples both shapes on an icosphere of `level` subdivisions.
    ///
    /// **Shapes**: a map and the positions of the mesh that it maps, twice.
    ///
    /// ```
    /// use cotan::sphere::{Morph, SphereMap};
    /// let sphere = cotan::shapes::icosphere::<f64>(2);
    /// let map = SphereMap::new(sphere.connectivity(), sphere.positions().clone())?;
    /// let stretch = nalgebra::Scale3::new(3.0, 2.0, 1.0);
    /// let ellipsoid = sphere.positions().map(|p| stretch * p);
    /// let morph = Morph::on_icosphere((&map, sphere.positions()), (&map, &ellipsoid), 3)?;
    /// let half = morph.at(0.5);
    /// assert_eq!(half.len(), 642);
    /// # Ok::<(), cotan::sphere::SphereError>(())
    /// ```
    ///
    /// # Errors
    /// [`SphereError::Setting`] if the level is above 8; [`SphereError::Mismatch`] if there is
    /// not one position per vertex.
    pub fn on_icosphere(
        (start, start_shape): (&SphereMap<T>, &Positions<T>),
        (end, end_shape): (&SphereMap<T>, &Positions<T>),
        level: u32,
    ) -> Result<Self, SphereError> {
        let target = icosphere_of_level(level)?;
        Ok(Self {
            start: start.resample(start_shape, target.positions())?,
            end: end.resample(end_shape, target.positions())?,
            mesh: target.into_parts().0,
        })
    }

    /// Resamples the second shape on the mesh of the first. The first shape keeps all details;
    /// the second keeps only those sampled by the vertices of the first.
    ///
    /// # Errors
    /// [`SphereError::Mismatch`] if there is not one position per vertex.
    pub fn on_first(
        (start, start_shape): (&SphereMap<T>, &Positions<T>),
        (end, end_shape): (&SphereMap<T>, &Positions<T>),
    ) -> Result<Self, SphereError> {
        start.check_attribute(start_shape)?;
        Ok(Self {
            end: end.resample(end_shape, start.positions())?,
            start: start_shape.clone(),
            mesh: HalfedgeMesh::clone(start.mesh()),
        })
    }

    /// The common mesh of all intermediate shapes.
    pub fn mesh(&self) -> &HalfedgeMesh {
        &self.mesh
    }

    /// The positions at time `t`, (1 − t) start + t end: exactly the start at 0 and the end at 1.
    /// Times outside 0 … 1 are clamped, and NaN is treated as 0.
    #[must_use]
    pub fn at(&self, t: T) -> Positions<T> {
        if !(t > scalar(0.0)) {
            return self.start.clone();
        }
        if t >= scalar(1.0) {
            return self.end.clone();
        }
        let between = |(a, b): (&Point3<T>, &Point3<T>)| {
            Point3::from(a.coords * (T::one() - t) + b.coords * t)
        };
        self.start
            .values()
            .zip(self.end.values())
            .map(between)
            .collect()
    }

    /// The mesh and its positions at time `t`.
    #[must_use]
    pub fn shape_at(&self, t: T) -> Mesh<T> {
        Mesh::assume_checked(self.mesh.clone(), self.at(t))
    }
}

/// The straight path from a shape (at 0) to its map (at 1), vertex by vertex, for visualization.
/// The centre of the sphere is that of the shape's bounding box, and its radius is the mean
/// distance from there.
///
/// **Shapes**: one position per vertex in both; `map` is on the unit sphere.
pub fn towards_sphere<T: Scalar>(
    shape: &Positions<T>,
    map: &Positions<T>,
    share: T,
) -> Positions<T> {
    let mut corners: Option<[Point3<T>; 2]> = None;
    for p in shape.values() {
        let [low, high] = corners.get_or_insert([*p, *p]);
        *low = low.inf(p);
        *high = high.sup(p);
    }
    let [low, high] = corners.unwrap_or([Point3::origin(); 2]);
    let center = low + (high - low) * scalar::<T>(0.5);
    let count = scalar::<T>(shape.len().max(1) as f64);
    let distances = shape.values().map(|p| (p - center).norm() / count);
    let radius = distances.fold(T::zero(), |sum, d| sum + d);
    let pairs = shape.values().zip(map.values());
    pairs
        .map(|(from, on_sphere)| {
            let to = center + on_sphere.coords * radius;
            from + (to - from) * share
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use cotan_geometry::icosphere;
    use cotan_geometry::testing::blobs;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn both_ends_are_the_inputs_on_the_target(
            a in blobs(), b in blobs(), t in 0.0..1.0_f64,
        ) {
            let ball = |shape: &Mesh<f64>| shape.positions().map(|p| Point3::from(p.coords.normalize()));
            let maps = (SphereMap::new(a.connectivity(), ball(&a)), SphereMap::new(b.connectivity(), ball(&b)));
            if let (Ok(first), Ok(second)) = maps {
                let (from, to) = ((&first, a.positions()), (&second, b.positions()));
                let morph = Morph::on_icosphere(from, to, 2).unwrap();
                prop_assert_eq!(morph.shape_at(0.0), first.remesh(a.positions(), 2).unwrap());
                prop_assert_eq!(morph.shape_at(1.0), second.remesh(b.positions(), 2).unwrap());
                let own = Morph::on_first(from, to).unwrap();
                prop_assert_eq!(own.at(0.0), a.positions().clone());
                prop_assert_eq!(own.at(1.0), second.resample(b.positions(), first.positions()).unwrap());
                // Reversing the morph gives the same path.
                let back = Morph::on_icosphere(to, from, 2).unwrap();
                for (p, q) in morph.at(t).values().zip(back.at(1.0 - t).values()) {
                    prop_assert!((p - q).norm() < 1e-14);
                }
            }
        }
    }

    #[test]
    fn a_shape_morphs_to_itself_by_standing_still() {
        let shape = icosphere::<f32>(2);
        let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
        let morph = Morph::on_first((&map, shape.positions()), (&map, shape.positions())).unwrap();
        for t in [-1.0, 0.0, 0.3, 1.0, 2.0, f32::NAN] {
            for (p, q) in morph.at(t).values().zip(shape.positions().values()) {
                assert!((p - q).norm() < 1e-6);
            }
        }
    }
}
