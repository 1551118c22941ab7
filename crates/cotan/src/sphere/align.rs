//! Rotational alignment of one sphere map to another, by landmarks or by an attribute of both.

use cotan_geometry::{Positions, Scalar, Surface};
use cotan_halfedge::{VertexId, VertexMap};
use nalgebra::{Rotation3, Vector3};

use super::error::SphereError;
use super::interpolate::Attribute;
use super::map::SphereMap;
use super::rotate::rotation_between;
use super::rotation_search::{Turnable, Wanted};

/// A map that was rotated to match another.
#[derive(Clone, PartialEq, Debug)]
pub struct Aligned<T: Scalar> {
    /// The rotated map, checked.
    pub map: SphereMap<T>,
    /// The rotation that was applied.
    pub rotation: Rotation3<f64>,
    /// The remaining error: the root mean square of the distances of the landmarks on the unit
    /// sphere, or of the difference of the attributes over the sphere, in their unit.
    pub residual: f64,
}

impl<T: Scalar> SphereMap<T> {
    /// Rotates this map so that its vertices in `pairs` come as close as possible, in the
    /// least-squares sense, to those of `target`.
    ///
    /// **Shapes**: pairs of a vertex of this map and one of `target`, at least two.
    ///
    /// # Errors
    /// [`SphereError::Mismatch`] if a vertex does not exist or the pairs do not determine a
    /// rotation; [`SphereError::Flipped`] as in [`SphereMap::rotated`].
    ///
    /// **Source**: Wahba 1965; Kabsch 1976; Horn 1987.
    pub fn align_landmarks(
        &self,
        target: &SphereMap<T>,
        pairs: &[(VertexId, VertexId)],
    ) -> Result<Aligned<T>, SphereError> {
        let directions: Vec<(Vector3<f64>, Vector3<f64>)> = pairs
            .iter()
            .map(|&(from, to)| Ok((self.direction_of(from)?, target.direction_of(to)?)))
            .collect::<Result<_, SphereError>>()?;
        let rotation = rotation_between(&directions)?;
        let missed =
            |(from, to): &(Vector3<f64>, Vector3<f64>)| (rotation * from - to).norm_squared();
        let squares: f64 = directions.iter().map(missed).sum();
        Ok(Aligned {
            map: self.rotated(&rotation)?,
            rotation,
            residual: (squares / directions.len() as f64).sqrt(),
        })
    }

    /// Rotates this map so that one of its attributes matches an attribute of `target` with the
    /// least mean square difference over the sphere.
    ///
    /// The attribute may be the source positions (for shapes in similar poses), a curvature, or
    /// [`SphereMap::area_density`], which does not depend on poses. All rotations are tried in
    /// steps of 9° on samples of both attributes. The best ones are refined, the last one to 1e-5
    /// rad; details finer than the sample spacing (4°, in the end 2°) are ignored. If several
    /// rotations match equally well, as for a sphere, any one of them may be chosen.
    ///
    /// **Shapes**: one value per vertex, for this map and for `target`.
    ///
    /// # Errors
    /// [`SphereError::Mismatch`] if there is not one value per vertex; [`SphereError::Flipped`]
    /// as in [`SphereMap::rotated`].
    pub fn align<A: Attribute<T>>(
        &self,
        attribute: &VertexMap<A>,
        target: &SphereMap<T>,
        target_attribute: &VertexMap<A>,
    ) -> Result<Aligned<T>, SphereError> {
        target.check_attribute(target_attribute)?;
        let location = target.point_location();
        let wanted = |level| Wanted::of(&location, target_attribute, level);
        let (coarse, fine) = (wanted(COARSE_LEVEL)?, wanted(FINE_LEVEL)?);
        let turnable = Turnable::new(self, attribute)?;
        let rotation = turnable.search(&coarse, &fine);
        Ok(Aligned {
            map: self.rotated(&rotation)?,
            rotation,
            residual: turnable.mean_square(&fine, &rotation).sqrt(),
        })
    }

    /// Computes ln of (fraction of the source's area / fraction of the sphere's area) around each
    /// vertex: the density with which the map packs the source. It depends on neither pose nor
    /// size.
    ///
    /// **Shapes**: `source` has one position per vertex; the result has one value per vertex.
    /// **Units**: dimensionless. Clamped to ±40 where an area is zero.
    ///
    /// # Errors
    /// [`SphereError::Surface`] if the positions do not form a surface on this mesh.
    pub fn area_density(&self, source: &Positions<T>) -> Result<VertexMap<T>, SphereError> {
        let areas = Surface::new(self.mesh(), source)?
            .one_ring_areas()
            .map(|a| a.as_f64());
        let mut on_sphere = VertexMap::filled(areas.len(), 0.0);
        for face in self.mesh().faces() {
            let angle = self.solid_angle(face);
            for v in self.mesh().triangle(face) {
                on_sphere[v] += angle;
            }
        }
        let total = |areas: &VertexMap<f64>| areas.values().sum::<f64>();
        let ratio = total(&on_sphere) / total(&areas);
        let density = |(a, b): (&f64, &f64)| T::of_f64((a / b * ratio).ln().clamp(-40.0, 40.0));
        Ok(areas
            .values()
            .zip(on_sphere.values())
            .map(density)
            .collect())
    }
}

/// Gives 642 samples.
const COARSE_LEVEL: u32 = 3;
/// Gives 2562 samples.
const FINE_LEVEL: u32 = 4;

#[cfg(test)]
mod tests {
    use cotan_geometry::testing::rotations;
    use cotan_geometry::{Mesh, icosphere};
    use nalgebra::Point3;
    use proptest::prelude::*;

    use super::*;

    /// A sphere with a nose and an ear, and its map.
    fn head<T: Scalar>() -> (Mesh<T>, Positions<T>) {
        let shape = icosphere::<T>(3);
        let bump = |p: &Point3<T>, axis: Vector3<f64>, height: f64| {
            height * (6.0 * (p.coords.map(T::as_f64).dot(&axis.normalize()) - 1.0)).exp()
        };
        let source = shape.positions().map(|p| {
            let nose = bump(p, Vector3::new(1.0, 0.2, 0.1), 0.9);
            let ear = bump(p, Vector3::new(-0.2, 1.0, 0.5), 0.5);
            p * T::of_f64(1.0 + nose + ear)
        });
        (shape, source)
    }

    fn farthest<T: Scalar>(a: &SphereMap<T>, b: &SphereMap<T>) -> f64 {
        let pairs = a.positions().values().zip(b.positions().values());
        pairs
            .map(|(p, q)| (p - q).norm().as_f64())
            .fold(0.0, f64::max)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(3))]

        #[test]
        fn a_turned_map_is_turned_back(turn in rotations()) {
            let (shape, source) = head::<f64>();
            let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
            let turned = map.rotated(&turn).unwrap();
            let by_place = turned.align(&source, &map, &source).unwrap();
            prop_assert!(farthest(&by_place.map, &map) < 1e-4, "{}", farthest(&by_place.map, &map));
            prop_assert!(by_place.residual < 1e-4);
            let density = map.area_density(&source).unwrap();
            let by_density = turned.align(&density, &map, &density).unwrap();
            prop_assert!(farthest(&by_density.map, &map) < 1e-4, "{}", farthest(&by_density.map, &map));
        }

        #[test]
        fn landmarks_turn_back_exactly(turn in rotations()) {
            let (shape, _) = head::<f64>();
            let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
            let turned = map.rotated(&turn).unwrap();
            let pairs = [3, 50, 100].map(|v| (VertexId::new(v), VertexId::new(v)));
            let aligned = turned.align_landmarks(&map, &pairs).unwrap();
            prop_assert!(farthest(&aligned.map, &map) < 1e-13);
            prop_assert!(aligned.residual < 1e-13);
        }
    }

    #[test]
    fn single_precision_aligns_too_and_threads_change_no_bit() {
        let (shape, source) = head::<f32>();
        let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
        let turned = map
            .rotated(&Rotation3::new(Vector3::new(2.0, -1.0, 0.5)))
            .unwrap();
        let run = |threads| {
            cotan_parallel::on_threads(threads, || turned.align(&source, &map, &source).unwrap())
                .unwrap()
        };
        let aligned = run(1);
        assert!(farthest(&aligned.map, &map) < 1e-3);
        assert_eq!(aligned, run(3));
    }

    #[test]
    fn mismatched_inputs_are_refused() {
        let (shape, source) = head::<f64>();
        let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
        let short = Positions::filled(3, Point3::origin());
        assert!(map.align(&short, &map, &source).is_err());
        assert!(map.align(&source, &map, &short).is_err());
        assert!(map.area_density(&short).is_err());
        let missing = [(VertexId::new(0), VertexId::new(9999))];
        assert!(map.align_landmarks(&map, &missing).is_err());
        assert!(map.align_landmarks(&map, &[]).is_err());
    }
}
