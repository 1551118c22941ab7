//! Point location: finding the triangle of a sphere map that a direction pierces.
//!
//! A ray from the centre along the direction d meets the flat triangle a, b, c exactly if det(a,
//! b, d), det(b, c, d) and det(c, a, d) are all non-negative. Their signs are exact, and the
//! triangles of a [`SphereMap`] cover the sphere once, also by exact signs, so every direction
//! has a face, however small or thin the face is. A bounding-box tree over the flat triangles
//! finds the few candidates. Around vertices with high valence, the search uses their angles.
//!
//! **Source**: Shewchuk's adaptive predicates (1997), by the `robust` crate.

use cotan_geometry::{Positions, Scalar, scalar};
use cotan_halfedge::FaceId;
use cotan_parallel::Chunks;
use nalgebra::Vector3;
use robust::{Coord3D, orient3d};

use super::barycentric::barycentric;
use super::error::SphereError;
use super::map::SphereMap;
use super::ray_tree::RayTree;
use super::wedges::{Wedge, wedges};

/// A point of a sphere map: a face, and the point of its flat triangle that the direction
/// pierces.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Located<T: Scalar> {
    /// The face.
    pub face: FaceId,
    /// Weights of the face's corners, in the order of
    /// [`HalfedgeMesh::triangle`](cotan_halfedge::HalfedgeMesh::triangle). Each is in 0 … 1, and
    /// they sum to 1 up to rounding.
    pub barycentric: [T; 3],
}

/// Finds faces of a sphere map. Created by [`SphereMap::point_location`].
#[derive(Clone, Debug)]
pub struct PointLocation<'a, T: Scalar> {
    map: &'a SphereMap<T>,
    /// Over `faces`, followed by `wedges`.
    tree: RayTree,
    /// The faces that are not in any wedge, in ascending order.
    faces: Vec<FaceId>,
    wedges: Vec<Wedge>,
}

impl<T: Scalar> SphereMap<T> {
    /// Prepares for point location: O(n log n) once, then about O(log n) per query.
    #[must_use]
    pub fn point_location(&self) -> PointLocation<'_, T> {
        let (wedges, faces) = wedges(self);
        let boxes = |i: usize| match faces.get(i) {
            Some(&face) => self.corners(face),
            None => {
                let [low, high] = wedges[i - faces.len()].corners(self);
                [low, high, high]
            }
        };
        PointLocation {
            map: self,
            tree: RayTree::build(faces.len() + wedges.len(), boxes),
            faces,
            wedges,
        }
    }

    /// The images of a face's corners.
    pub(crate) fn corners(&self, face: FaceId) -> [Vector3<f64>; 3] {
        let corners = self.mesh().triangle(face);
        corners.map(|v| self.positions()[v].coords.map(T::as_f64))
    }
}

impl<T: Scalar> PointLocation<'_, T> {
    /// Finds the face that `direction` pierces. At an edge or a vertex, the face with the lowest
    /// index is returned.
    ///
    /// A direction of unit length, up to the rounding of `T`, is used as it is. Any other
    /// direction is first normalized in `f64`.
    ///
    /// ```
    /// use cotan::sphere::SphereMap;
    /// use nalgebra::Vector3;
    /// let shape = cotan::shapes::icosphere::<f64>(2);
    /// let map = SphereMap::new(shape.connectivity(), shape.positions().clone())?;
    /// let place = map.point_location().locate(&Vector3::new(1.0, 2.0, 3.0))?;
    /// assert!(place.barycentric.iter().all(|w| (0.0..=1.0).contains(w)));
    /// # Ok::<(), cotan::sphere::SphereError>(())
    /// ```
    ///
    /// # Errors
    /// [`SphereError::Mismatch`] if the direction is zero or not finite.
    pub fn locate(&self, direction: &Vector3<T>) -> Result<Located<T>, SphereError> {
        let unit = unit_direction(direction).ok_or_else(|| {
            SphereError::Mismatch(format!(
                "the direction ({}, {}, {}) points nowhere",
                direction.x, direction.y, direction.z
            ))
        })?;
        Ok(self.locate_unit(&unit))
    }

    /// Locates many directions, in parallel.
    ///
    /// # Errors
    /// Same as [`PointLocation::locate`].
    pub fn locate_all(&self, directions: &Positions<T>) -> Result<Vec<Located<T>>, SphereError> {
        const CHUNKS: Chunks = Chunks::of(1 << 8);
        let points = directions.as_slice();
        let places = CHUNKS.filled(points.len(), |i| self.locate(&points[i].coords));
        places.into_iter().collect()
    }

    /// The map that is searched.
    pub fn map(&self) -> &SphereMap<T> {
        self.map
    }

    /// The face that a unit vector pierces.
    pub(crate) fn locate_unit(&self, d: &Vector3<f64>) -> Located<T> {
        let mut found: Option<FaceId> = None;
        self.tree.visit(d, |i| {
            let candidates = match self.faces.get(i) {
                Some(&face) => [Some(face), None],
                None => self.wedges[i - self.faces.len()].candidates(self.map, d),
            };
            for f in candidates.into_iter().flatten() {
                if found.is_some_and(|best| best < f) {
                    continue;
                }
                match place(&self.map.corners(f), d) {
                    Place::Outside => {}
                    Place::Border => found = Some(f),
                    Place::Inside => {
                        found = Some(f);
                        return Search::Done;
                    }
                }
            }
            Search::On
        });
        let face = found.unwrap_or_else(|| self.nearest_face(d));
        let barycentric = barycentric(&self.map.corners(face), d);
        Located {
            face,
            barycentric: barycentric.map(scalar),
        }
    }

    /// A face at the nearest vertex, for coordinates so small that their products underflow and
    /// the signs are lost.
    fn nearest_face(&self, d: &Vector3<f64>) -> FaceId {
        let (mesh, positions) = (self.map.mesh(), self.map.positions());
        let distance = |v| (positions[v].coords.map(T::as_f64) - d).norm_squared();
        let nearest = mesh
            .vertices()
            .min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
        nearest
            .and_then(|v| mesh.vertex_faces(v).next())
            .unwrap_or(FaceId::new(0))
    }
}

/// Continuation of a search.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Search {
    /// There may be more candidates.
    On,
    /// No better candidate can follow.
    Done,
}

/// The position of a direction relative to the cone of a triangle.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Place {
    Inside,
    Border,
    Outside,
}

/// The position of d relative to the cone of an upright triangle, by exact signs.
pub(crate) fn place([a, b, c]: &[Vector3<f64>; 3], d: &Vector3<f64>) -> Place {
    let mut place = Place::Inside;
    for (p, q) in [(a, b), (b, c), (c, a)] {
        let side = side(p, q, d);
        if side < 0.0 {
            return Place::Outside;
        }
        if side == 0.0 {
            place = Place::Border;
        }
    }
    place
}

/// A number with the exact sign of det(p, q, d).
pub(super) fn side(p: &Vector3<f64>, q: &Vector3<f64>, d: &Vector3<f64>) -> f64 {
    let coord = |p: &Vector3<f64>| Coord3D {
        x: p.x,
        y: p.y,
        z: p.z,
    };
    // d comes last, so that the first, fast stage uses p − d and q − d, which suffices for small
    // triangles.
    -orient3d(coord(&Vector3::zeros()), coord(p), coord(q), coord(d))
}

/// A direction in `f64`, of unit length within the rounding of `T`.
pub(crate) fn unit_direction<T: Scalar>(direction: &Vector3<T>) -> Option<Vector3<f64>> {
    let d = direction.map(T::as_f64);
    // Not normalized, because that would move a vertex of the map away from itself.
    if (d.norm_squared() - 1.0).abs() <= 8.0 * T::default_epsilon().as_f64() {
        return Some(d);
    }
    let largest = d.amax();
    (largest > 0.0 && largest.is_finite()).then(|| (d / largest).normalize())
}

#[cfg(test)]
mod tests {
    use cotan_geometry::testing::{directions, spheres};
    use cotan_geometry::{icosphere, tetrahedron};
    use nalgebra::Point3;
    use proptest::prelude::*;

    use super::*;
    use crate::sphere::testing::{splintered, squeezed};

    /// The images of points inside faces are located again, as exactly as the directions are
    /// represented.
    fn round_trip<T: Scalar>(map: &SphereMap<T>, weights: [f64; 3], tolerance: f64) {
        let location = map.point_location();
        for face in map.mesh().faces() {
            let [a, b, c] = map.corners(face);
            let p = a * weights[0] + b * weights[1] + c * weights[2];
            let d = p.normalize().map(T::of_f64);
            let place = location.locate(&d).unwrap();
            assert_eq!(place.face, face);
            let [a, b, c] = map.corners(face);
            let [u, v, w] = place.barycentric.map(T::as_f64);
            let again = (a * u + b * v + c * w).normalize();
            let error = (again - d.map(T::as_f64).normalize()).norm();
            assert!(error < tolerance, "{error:e} in face {face}");
        }
    }

    fn weights() -> impl Strategy<Value = [f64; 3]> {
        [0.0..1.0_f64, 0.0..1.0, 0.0..1.0].prop_map(|w| {
            let sum: f64 = w.iter().sum();
            w.map(|x| (x + 0.01) / (sum + 0.03))
        })
    }

    proptest! {
        #[test]
        fn the_image_of_a_point_is_located_at_the_point(w in weights(), level in 0..4_u32) {
            let shape = icosphere::<f64>(level);
            let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
            let location = map.point_location();
            for face in shape.connectivity().faces() {
                let [a, b, c] = map.corners(face);
                let d = a * w[0] + b * w[1] + c * w[2];
                let place = location.locate(&d).unwrap();
                prop_assert_eq!(place.face, face);
                for k in 0..3 {
                    prop_assert!((place.barycentric[k] - w[k]).abs() < 1e-13);
                }
            }
            let single = icosphere::<f32>(level);
            round_trip(&SphereMap::new(single.connectivity(), single.positions().clone()).unwrap(), w, 1e-6);
        }

        #[test]
        fn tiny_and_thin_triangles_are_found(
            w in weights(), axis in directions(), exponent in 0.0..7.0_f64,
        ) {
            // Magnified by Möbius maps: triangles with 1e-14 of the sphere's area next to large
            // ones.
            let shape = icosphere::<f64>(3);
            if let Ok(map) = squeezed(&shape, &axis, 10.0_f64.powf(-exponent)) {
                round_trip(&map, w, 4e-15);
            }
        }

        #[test]
        fn slivers_are_found(w in weights(), margin in 1.0..20.0_f64) {
            let shape = splintered(margin);
            let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
            let location = map.point_location();
            for face in shape.connectivity().faces() {
                let [a, b, c] = map.corners(face);
                let d = (a * w[0] + b * w[1] + c * w[2]).normalize();
                let place = location.locate(&d).unwrap();
                let corners = map.corners(place.face);
                prop_assert_ne!(super::place(&corners, &d), Place::Outside);
                let [u, v, w] = place.barycentric;
                let again = (corners[0] * u + corners[1] * v + corners[2] * w).normalize();
                prop_assert!((again - d).norm() < 4e-15, "{:e}", (again - d).norm());
            }
        }

        #[test]
        fn every_direction_has_a_face_and_every_vertex_itself(
            d in directions(), shape in spheres(),
        ) {
            let positions = shape.positions().map(|p| Point3::from(p.coords.normalize()));
            if let Ok(map) = SphereMap::new(shape.connectivity(), positions) {
                let location = map.point_location();
                let place = location.locate(&d).unwrap();
                prop_assert_ne!(super::place(&map.corners(place.face), &d), Place::Outside);
                for (v, p) in map.positions().iter() {
                    let place = location.locate(&p.coords).unwrap();
                    let corners = map.mesh().triangle(place.face);
                    let k = corners.iter().position(|&c| c == v);
                    prop_assert_eq!(k.map(|k| place.barycentric[k]), Some(1.0));
                }
            }
        }
    }

    #[test]
    fn of_the_faces_at_an_edge_the_lowest_is_taken() {
        let shape = tetrahedron::<f64>();
        let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
        let location = map.point_location();
        for v in shape.connectivity().vertices() {
            let place = location.locate(&shape.positions()[v].coords).unwrap();
            assert_eq!(Some(place.face), shape.connectivity().vertex_faces(v).min());
        }
        // The midpoint of edge (0, 1) is on the x axis, on the border of faces 0 and 1.
        assert_eq!(location.locate(&Vector3::x()).unwrap().face, FaceId::new(0));
    }

    /// Around a vertex with high valence, the result equals that of a full search: at its centre,
    /// on its arcs and between them.
    #[test]
    fn faces_around_a_vertex_of_high_valence_are_those_of_a_full_search() {
        for valence in [129, 200, 1_000] {
            let shape = cotan_geometry::shapes::bipyramid::<f64>(valence);
            let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
            let location = map.point_location();
            assert!(location.faces.len() < valence / 2);
            let lowest = |d: &Vector3<f64>| {
                let is_hit = |f: &FaceId| place(&map.corners(*f), d) != Place::Outside;
                shape.connectivity().faces().find(is_hit)
            };
            let ring = shape.positions().values().take(valence).step_by(7);
            let halfway = ring.clone().flat_map(|p| {
                [1.0, -0.3, 1e-9].map(|z| (p.coords + Vector3::new(0.0, 0.0, z)).normalize())
            });
            let off = ring
                .clone()
                .map(|p| Vector3::new(p.x + 1e-3, p.y, 0.2).normalize());
            let corners = ring.map(|p| p.coords);
            for d in corners
                .chain(halfway)
                .chain(off)
                .chain([Vector3::z(), -Vector3::z()])
            {
                assert_eq!(Some(location.locate_unit(&d).face), lowest(&d), "{d}");
            }
        }
    }

    #[test]
    fn length_does_not_matter_and_nothing_points_nowhere() {
        let shape = icosphere::<f64>(2);
        let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
        let location = map.point_location();
        let d = Vector3::new(0.3, -0.2, 0.7);
        let at = |scale: f64| location.locate(&(d * scale)).unwrap().face;
        assert_eq!(at(1e-300), at(1.0));
        assert_eq!(at(1e300), at(1.0));
        for bad in [0.0, f64::NAN, f64::INFINITY] {
            let refused = location.locate(&Vector3::new(bad, 0.0, 0.0));
            assert!(matches!(refused, Err(SphereError::Mismatch(_))));
        }
    }
}
