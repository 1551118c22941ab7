//! Queries of a surface: closest points, rays, signed distances, inside and outside.

use std::ops::ControlFlow;
use std::sync::OnceLock;

use cotan_halfedge::{FaceId, HalfedgeMesh, VertexId};
use cotan_parallel::Chunks;
use nalgebra::{Point3, Vector3};

use crate::scalar::{Scalar, scalar};
use crate::surface::{Positions, Surface};
use crate::triangle_tree::{Boundaries, Meeting, Ray, TriangleTree, triangle_corners};

/// A point on a surface: a face and weights of its corners.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SurfacePoint {
    /// The face.
    pub face: FaceId,
    /// The weights of its corners in the order of [`HalfedgeMesh::triangle`]: at least 0, with a
    /// sum of 1.
    pub barycentric: [f64; 3],
}

impl SurfacePoint {
    /// The point at a vertex, on one of its faces. `None` for a vertex without faces.
    #[must_use]
    pub fn at_vertex(mesh: &HalfedgeMesh, vertex: VertexId) -> Option<Self> {
        let face = mesh.vertex_faces(vertex).next()?;
        let corners = mesh.triangle(face);
        Some(Self {
            face,
            barycentric: corners.map(|v| if v == vertex { 1.0 } else { 0.0 }),
        })
    }

    /// The position of the point.
    #[must_use]
    pub fn position<T: Scalar>(&self, surface: &Surface<'_, T>) -> Point3<T> {
        let corners = surface.mesh().triangle(self.face);
        let mut sum = Vector3::zeros();
        for (v, weight) in corners.into_iter().zip(self.barycentric) {
            sum += surface.position(v).coords * scalar::<T>(weight);
        }
        sum.into()
    }
}

/// The point of a surface that is closest to a given point.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ClosestPoint {
    /// The face and the barycentric coordinates.
    pub on: SurfacePoint,
    /// The position of the closest point.
    pub position: Point3<f64>,
    /// Its distance from the given point.
    pub distance: f64,
}

/// An intersection of a ray and a surface.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RayHit {
    /// The face and the barycentric coordinates.
    pub on: SurfacePoint,
    /// The distance from the ray's origin.
    pub distance: f64,
}

/// A surface prepared for queries. Owns a copy of the triangles and positions, in double
/// precision.
///
/// All queries take `&self`; those of many points run in parallel, one answer per point in order.
/// Lengths are in the units of the positions. **Memory**: about 300 bytes per face, and about 100
/// more after the first winding number.
///
/// ```
/// use cotan_geometry::{SurfaceTree, icosphere};
/// use nalgebra::Point3;
///
/// let ball = icosphere::<f64>(4);
/// let tree = SurfaceTree::new(&ball);
/// let outside = Point3::new(0.0, 0.0, 3.0);
/// assert!((tree.closest(&outside).distance - 2.0).abs() < 0.01);
/// assert!((tree.signed_distance(&Point3::origin()) + 1.0).abs() < 0.01);
/// assert!(tree.contains(&Point3::origin()) && !tree.contains(&outside));
/// ```
#[derive(Debug)]
pub struct SurfaceTree {
    tree: TriangleTree,
    positions: Positions<f64>,
    /// Computed for the first winding number.
    boundaries: OnceLock<Boundaries>,
}

impl SurfaceTree {
    /// Builds the tree.
    #[must_use]
    pub fn new<'m, T: Scalar>(surface: impl Into<Surface<'m, T>>) -> Self {
        let surface = surface.into();
        let mesh = surface.mesh();
        let positions = surface.positions().map(|p| p.map(T::as_f64));
        let corners = |f| mesh.triangle(f).map(|v| v.index() as u32);
        Self {
            tree: TriangleTree::build(mesh.faces().map(corners).collect(), &positions),
            positions,
            boundaries: OnceLock::new(),
        }
    }

    /// The closest point of the surface. Of several faces at the same distance, the first.
    #[must_use]
    pub fn closest(&self, point: &Point3<f64>) -> ClosestPoint {
        self.closest_within(point, f64::INFINITY)
            // A surface has at least one face; a point that is not finite is close to none.
            .unwrap_or_else(|| ClosestPoint {
                on: SurfacePoint {
                    face: FaceId::new(0),
                    barycentric: [1.0, 0.0, 0.0],
                },
                position: self.corners(0)[0],
                distance: f64::INFINITY,
            })
    }

    /// The closest point of the surface, or `None` if none is closer than `limit`. A small limit
    /// makes the search faster.
    #[must_use]
    pub fn closest_within(&self, point: &Point3<f64>, limit: f64) -> Option<ClosestPoint> {
        let foot = self.tree.closest(point, limit, &self.positions)?;
        Some(ClosestPoint {
            on: SurfacePoint {
                face: FaceId::new(foot.triangle),
                barycentric: foot.barycentric,
            },
            position: foot.point,
            distance: foot.squared_distance.sqrt(),
        })
    }

    /// The first intersection with a ray, from either side.
    #[must_use]
    pub fn first_hit(&self, ray: &Ray) -> Option<RayHit> {
        let meeting = self.tree.first(ray, &self.positions)?;
        Some(self.hit(ray, meeting))
    }

    /// All intersections with a ray, by distance. A ray through an edge hits both its faces.
    #[must_use]
    pub fn hits(&self, ray: &Ray) -> Vec<RayHit> {
        let mut meetings = Vec::new();
        let all = |meeting| {
            meetings.push(meeting);
            ControlFlow::Continue(f64::INFINITY)
        };
        self.tree
            .walk(ray, f64::INFINITY, usize::MAX, &self.positions, all);
        meetings.sort_by(|a, b| {
            let by_distance = a.distance.total_cmp(&b.distance);
            by_distance.then(a.triangle.cmp(&b.triangle))
        });
        meetings.into_iter().map(|m| self.hit(ray, m)).collect()
    }

    /// The generalized winding number: how often the surface surrounds the point. For a closed
    /// surface that is oriented outwards and does not cross itself, 1 inside and 0 outside, up to
    /// rounding; for one with holes a number between these.
    ///
    /// **Source**: Jacobson, Kavan, Sorkine-Hornung 2013, Robust inside-outside segmentation using
    /// generalized winding numbers.
    #[must_use]
    pub fn winding_number(&self, point: &Point3<f64>) -> f64 {
        let boundaries = self
            .boundaries
            .get_or_init(|| Boundaries::new(&self.tree, &self.positions));
        boundaries.winding_number(&self.tree, &self.positions, point)
    }

    /// Returns true if the winding number is above ½.
    #[must_use]
    pub fn contains(&self, point: &Point3<f64>) -> bool {
        self.winding_number(point) > 0.5
    }

    /// The distance from the surface, negative where [`Self::contains`] holds.
    #[must_use]
    pub fn signed_distance(&self, point: &Point3<f64>) -> f64 {
        let distance = self.closest(point).distance;
        if self.contains(point) {
            -distance
        } else {
            distance
        }
    }

    /// [`Self::closest`] of many points.
    #[must_use]
    pub fn closest_of(&self, points: &[Point3<f64>]) -> Vec<ClosestPoint> {
        CHUNKS.filled(points.len(), |i| self.closest(&points[i]))
    }

    /// [`Self::first_hit`] of many rays.
    #[must_use]
    pub fn first_hits(&self, rays: &[Ray]) -> Vec<Option<RayHit>> {
        CHUNKS.filled(rays.len(), |i| self.first_hit(&rays[i]))
    }

    /// [`Self::winding_number`] of many points.
    #[must_use]
    pub fn winding_numbers(&self, points: &[Point3<f64>]) -> Vec<f64> {
        CHUNKS.filled(points.len(), |i| self.winding_number(&points[i]))
    }

    /// [`Self::signed_distance`] of many points.
    #[must_use]
    pub fn signed_distances(&self, points: &[Point3<f64>]) -> Vec<f64> {
        CHUNKS.filled(points.len(), |i| self.signed_distance(&points[i]))
    }

    /// The corners of a face.
    fn corners(&self, face: usize) -> [Point3<f64>; 3] {
        triangle_corners(self.tree.triangles()[face], &self.positions)
    }

    fn hit(&self, ray: &Ray, meeting: Meeting) -> RayHit {
        let corners = self.corners(meeting.triangle);
        let place = ray.at(meeting.distance);
        // The ray meets the triangle up to rounding; the nearest point is inside.
        let (barycentric, _) = crate::triangle_tree::closest_on_triangle(&place, &corners);
        RayHit {
            on: SurfacePoint {
                face: FaceId::new(meeting.triangle),
                barycentric,
            },
            distance: meeting.distance,
        }
    }
}

/// Points per task.
const CHUNKS: Chunks = Chunks::of(64);

#[cfg(test)]
mod tests {
    use cotan_parallel::on_threads;
    use proptest::prelude::*;

    use super::*;
    use crate::shapes::{bar, icosphere};
    use crate::testing;

    #[test]
    fn distances_from_a_box_are_known() {
        let shape = bar::<f64>([2.0, 2.0, 2.0], [4, 4, 4]);
        let center = shape.surface().bounding_box().center();
        let tree = SurfaceTree::new(&shape);
        let at = |x, y, z| center + Vector3::new(x, y, z);
        for (point, distance) in [
            (at(0.0, 0.0, 0.0), -1.0),
            (at(0.7, 0.1, 0.0), -0.3),
            (at(3.0, 0.2, 0.3), 2.0),
            (at(4.0, 5.0, 0.3), 5.0),
            (at(2.0, 3.0, 3.0), 3.0),
        ] {
            assert!((tree.signed_distance(&point) - distance).abs() < 1e-12);
        }
    }

    #[test]
    fn a_ray_through_a_ball_hits_it_twice() {
        let shape = icosphere::<f32>(3);
        let tree = SurfaceTree::new(&shape);
        let ray = Ray {
            origin: Point3::new(-3.0, 0.1, 0.17),
            direction: Vector3::x(),
        };
        let hits = tree.hits(&ray);
        assert_eq!(hits.len(), 2);
        assert_eq!(tree.first_hit(&ray), Some(hits[0]));
        for hit in hits {
            let position = hit.on.position(&shape.surface()).map(f64::from);
            assert!((position - ray.at(hit.distance)).norm() < 1e-6);
        }
        let away = Ray {
            direction: -Vector3::x(),
            ..ray
        };
        assert_eq!(tree.first_hits(&[away]), [None]);
    }

    #[test]
    fn a_point_that_is_not_finite_is_infinitely_far() {
        let tree = SurfaceTree::new(&icosphere::<f64>(1));
        let closest = tree.closest(&Point3::new(f64::NAN, 0.0, 0.0));
        assert_eq!(closest.distance, f64::INFINITY);
        assert!(!tree.contains(&Point3::new(0.0, f64::INFINITY, 0.0)));
    }

    proptest! {
        #[test]
        fn points_of_the_surface_are_their_own_closest_points(
            shape in testing::surfaces(),
            face in any::<prop::sample::Index>(),
            weights in (0.0..1.0_f64, 0.0..1.0_f64),
        ) {
            let face = FaceId::new(face.index(shape.num_faces()));
            let (a, b) = if weights.0 + weights.1 > 1.0 {
                (1.0 - weights.0, 1.0 - weights.1)
            } else {
                weights
            };
            let point = SurfacePoint { face, barycentric: [1.0 - a - b, a, b] };
            let position = point.position(&shape.surface());
            let closest = SurfaceTree::new(&shape).closest(&position);
            let size = shape.surface().bounding_box().diagonal();
            prop_assert!(closest.distance <= 1e-14 * (size + position.coords.norm()));
        }

        #[test]
        fn moving_and_scaling_the_surface_moves_and_scales_the_answers(
            shape in testing::closed_surfaces(),
            motion in testing::rigid_motions(),
            scale in 0.1..10.0_f64,
            place in prop::array::uniform3(-0.5..1.5_f64),
        ) {
            let bounds = shape.surface().bounding_box();
            let point = bounds.min + bounds.extents().component_mul(&Vector3::from(place));
            let go = |p: &Point3<f64>| motion * Point3::from(p.coords * scale);
            let moved = shape.with_positions(shape.positions().map(go))?;
            let (before, after) = (SurfaceTree::new(&shape), SurfaceTree::new(&moved));
            let size = scale * bounds.diagonal() + 100.0;
            let distance = scale * before.signed_distance(&point);
            prop_assert!((after.signed_distance(&go(&point)) - distance).abs() < 1e-9 * size);
            let w = before.winding_number(&point);
            prop_assert!((w - w.round()).abs() < 1e-6);
            prop_assert!((after.winding_number(&go(&point)) - w).abs() < 1e-6);
        }

        #[test]
        fn answers_do_not_depend_on_the_number_of_threads(shape in testing::surfaces()) {
            let bounds = shape.surface().bounding_box();
            let points: Vec<Point3<f64>> = (0..200)
                .map(|i| {
                    let place = Vector3::new(i % 6, (i / 6) % 6, i / 36).map(|k| f64::from(k) / 5.0);
                    bounds.min + bounds.extents().component_mul(&place)
                })
                .collect();
            let ask = || {
                let tree = SurfaceTree::new(&shape);
                (tree.closest_of(&points), tree.winding_numbers(&points))
            };
            prop_assert_eq!(on_threads(1, ask).unwrap(), on_threads(3, ask).unwrap());
        }
    }
}
