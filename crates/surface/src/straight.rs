//! Straightest lines on a surface.
//!
//! A line that crosses an edge continues straight in the plane into which both faces unfold. At a
//! vertex, where no unfolding exists, it continues so that it has the same angle on its left and
//! on its right.
//!
//! **Source**: Polthier and Schmies 1998, Straightest geodesics on polyhedral surfaces.

use cotan_geometry::{
    Scalar, Surface, SurfacePoint, corner_angle, triangle_area_vector, unit_or_zero,
};
use cotan_halfedge::{FaceId, HalfedgeId, VertexId};
use nalgebra::{Point3, Vector3};

/// The reason why a traced line ends.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum LineEnd {
    /// It has the requested length.
    Length,
    /// It reached the boundary.
    Boundary,
    /// It reached a face without area, or the direction has no part along the surface.
    Degenerate,
    /// It crossed a hundred times as many edges as the surface has.
    Limit,
}

/// A straightest line.
#[derive(Clone, PartialEq, Debug)]
pub struct StraightLine {
    /// The points at which it starts, crosses edges and vertices, and ends; each on the face that
    /// it is about to cross, the last on the face where it ends.
    pub points: Vec<SurfacePoint>,
    /// Their positions.
    pub positions: Vec<Point3<f64>>,
    /// The length of the line.
    pub length: f64,
    /// Its direction where it ends, a unit vector in the last face.
    pub direction: Vector3<f64>,
    /// The reason why it ends.
    pub end: LineEnd,
}

/// Follows the straightest line from a point of the surface for a length.
///
/// `direction` is projected to the face of `from`; its length does not matter. On an edge or at a
/// vertex it may also point out of that face: the line then begins in the next one, into whose
/// plane the direction is unfolded.
///
/// **Units**: those of the positions.
#[must_use]
pub fn straight_line<'m, T: Scalar>(
    surface: impl Into<Surface<'m, T>>,
    from: &SurfacePoint,
    direction: &Vector3<f64>,
    length: f64,
) -> StraightLine {
    let surface = surface.into();
    let mut tracer = Tracer {
        surface,
        face: from.face,
        at: from.barycentric,
        direction: Vector3::zeros(),
        line: StraightLine {
            points: Vec::new(),
            positions: Vec::new(),
            length: 0.0,
            direction: Vector3::zeros(),
            end: LineEnd::Degenerate,
        },
    };
    if from.face.index() < surface.mesh().num_faces() {
        let normal = tracer.normal(from.face);
        tracer.direction = unit_or_zero(&(direction - normal * normal.dot(direction)));
        tracer.push();
        tracer.line.end = tracer.run(length);
        tracer.line.direction = tracer.direction;
    }
    tracer.line
}

struct Tracer<'m, T: Scalar> {
    surface: Surface<'m, T>,
    face: FaceId,
    /// Barycentric coordinates in the face.
    at: [f64; 3],
    /// A unit vector in the plane of the face.
    direction: Vector3<f64>,
    line: StraightLine,
}

impl<T: Scalar> Tracer<'_, T> {
    fn run(&mut self, length: f64) -> LineEnd {
        let most = MAX_ROUNDS.saturating_mul(self.surface.mesh().num_edges());
        // The side through which the face was entered, by its opposite corner.
        let mut entered = None;
        for _ in 0..most {
            let hats = self.hats();
            let rates = hats.map(|hat| hat.dot(&self.direction));
            if !rates.iter().any(|rate| *rate < 0.0) {
                return LineEnd::Degenerate;
            }
            let (mut exit, mut step) = (None, f64::INFINITY);
            for k in 0..3 {
                let reach = self.at[k] / -rates[k];
                if rates[k] < 0.0 && Some(k) != entered && reach < step {
                    (exit, step) = (Some(k), reach);
                }
            }
            let left = length - self.line.length;
            let (Some(exit), true) = (exit, step < left) else {
                self.advance(rates, left.max(0.0));
                self.line.length = length.max(self.line.length);
                self.push();
                return LineEnd::Length;
            };
            self.advance(rates, step);
            self.line.length += step;
            self.at[exit] = 0.0;
            let at_vertex = (0..3).find(|k| self.at[*k] >= 1.0 - AT_VERTEX);
            let goes_on = match at_vertex {
                Some(k) if step > 0.0 => self.pass_vertex(k),
                _ => self.cross_side(exit),
            };
            let Some(corner) = goes_on else {
                self.push();
                return LineEnd::Boundary;
            };
            entered = corner;
            self.push();
        }
        LineEnd::Limit
    }

    fn advance(&mut self, rates: [f64; 3], step: f64) {
        for k in 0..3 {
            self.at[k] = (self.at[k] + rates[k] * step).max(0.0);
        }
        let total: f64 = self.at.iter().sum();
        self.at.iter_mut().for_each(|weight| *weight /= total);
    }

    /// Continues in the face beyond the side opposite to a corner. Returns the corner of the new
    /// face opposite to that side, or `None` at the boundary.
    fn cross_side(&mut self, corner: usize) -> Option<Option<usize>> {
        let mesh = self.surface.mesh();
        let h = self.side(self.face, corner);
        let beyond = mesh.face(h.twin())?;
        let along = unit_or_zero(&self.vector(h));
        let inwards = self.normal(self.face).cross(&along);
        let (on, out) = (self.direction.dot(&along), -self.direction.dot(&inwards));
        let beyond_inwards = self.normal(beyond).cross(&-along);
        self.direction = unit_or_zero(&(along * on + beyond_inwards * out));
        let weights = [0, 1, 2].map(|k| (mesh.triangle(self.face)[k], self.at[k]));
        let corners = mesh.triangle(beyond);
        self.at = corners.map(|v| {
            let found = weights.iter().find(|(of, _)| *of == v);
            found.map_or(0.0, |(_, weight)| *weight)
        });
        self.face = beyond;
        let (origin, target) = (mesh.origin(h), mesh.target(h));
        Some(corners.iter().position(|v| *v != origin && *v != target))
    }

    /// Continues from a corner of the face so that the angles on both sides are equal. Returns
    /// `None` at the boundary.
    fn pass_vertex(&mut self, corner: usize) -> Option<Option<usize>> {
        let mesh = self.surface.mesh();
        let v = mesh.triangle(self.face)[corner];
        if mesh.is_boundary_vertex(v) {
            return None;
        }
        let fan: Vec<HalfedgeId> = mesh.outgoing_halfedges(v).collect();
        let angles: Vec<f64> = fan.iter().map(|h| self.angle_after(*h)).collect();
        let total: f64 = angles.iter().sum();
        let own = fan.iter().position(|h| mesh.face(*h) == Some(self.face))?;
        let back = -self.direction;
        let first = self.vector(fan[own]);
        let within = cotan_geometry::angle_between(&first, &back).min(angles[own]);
        let mut turn = within + 0.5 * total;
        let mut k = own;
        // At most twice around.
        for _ in 0..2 * fan.len() {
            if turn <= angles[k] {
                break;
            }
            turn -= angles[k];
            k = (k + 1) % fan.len();
        }
        let h = fan[k];
        let face = mesh.face(h)?;
        let along = unit_or_zero(&self.vector(h));
        let up = self.normal(face).cross(&along);
        self.direction = along * turn.cos() + up * turn.sin();
        self.face = face;
        self.at = mesh.triangle(face).map(|c| if c == v { 1.0 } else { 0.0 });
        // Both sides at the vertex were entered; the line leaves through the third.
        Some(None)
    }

    /// The angle of the face of an outgoing halfedge at its origin.
    fn angle_after(&self, h: HalfedgeId) -> f64 {
        let mesh = self.surface.mesh();
        let [a, b, c] = [mesh.origin(h), mesh.target(h), mesh.origin(mesh.prev(h))];
        corner_angle(&self.position(a), &self.position(b), &self.position(c))
    }

    /// The halfedge of a face opposite to a corner.
    fn side(&self, face: FaceId, corner: usize) -> HalfedgeId {
        let mesh = self.surface.mesh();
        let first = mesh.face_halfedge(face);
        match corner {
            0 => mesh.next(first),
            1 => mesh.prev(first),
            _ => first,
        }
    }

    fn position(&self, v: VertexId) -> Point3<f64> {
        self.surface.position(v).map(T::as_f64)
    }

    fn vector(&self, h: HalfedgeId) -> Vector3<f64> {
        self.surface.halfedge_vector(h).map(T::as_f64)
    }

    fn corners(&self, face: FaceId) -> [Point3<f64>; 3] {
        self.surface.mesh().triangle(face).map(|v| self.position(v))
    }

    fn normal(&self, face: FaceId) -> Vector3<f64> {
        let [a, b, c] = self.corners(face);
        unit_or_zero(&triangle_area_vector(&a, &b, &c))
    }

    /// The gradients of the barycentric coordinates of the face.
    fn hats(&self) -> [Vector3<f64>; 3] {
        let corners = self.corners(self.face);
        let [a, b, c] = &corners;
        let area_vector = triangle_area_vector(a, b, c);
        let squared = area_vector.norm_squared();
        if !(squared > 0.0) {
            return [Vector3::zeros(); 3];
        }
        let turned = area_vector / (2.0 * squared);
        [0, 1, 2].map(|k| turned.cross(&(corners[(k + 2) % 3] - corners[(k + 1) % 3])))
    }

    fn push(&mut self) {
        let point = SurfacePoint {
            face: self.face,
            barycentric: self.at,
        };
        let corners = self.corners(self.face);
        let mut position = Vector3::zeros();
        for (corner, weight) in corners.iter().zip(self.at) {
            position += corner.coords * weight;
        }
        self.line.points.push(point);
        self.line.positions.push(position.into());
    }
}

/// A point is at a vertex if the other weights add up to no more.
const AT_VERTEX: f64 = 1e-10;

/// Crossings per edge of the surface after which a line is abandoned.
const MAX_ROUNDS: usize = 100;

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::{bar, bumpy_plane, icosphere};
    use cotan_geometry::testing::{directions, rigid_motions, surfaces};
    use cotan_geometry::{SurfaceTree, face_area_vector};
    use proptest::prelude::*;
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn on_a_plane_a_line_is_straight_also_through_vertices() {
        let shape = bumpy_plane::<f64>([4.0, 4.0], [8, 8], 0.0);
        let tree = SurfaceTree::new(&shape);
        let center = shape.surface().bounding_box().center();
        for (start, direction) in [
            ([-1.3, -0.9], [1.0, 0.37]),
            // Along a row of vertices, and along diagonals.
            ([-1.25, 0.0], [1.0, 0.0]),
            ([-1.25, -1.25], [1.0, 1.0]),
            ([-1.25, 1.25], [1.0, -1.0]),
        ] {
            let start = center + Vector3::new(start[0], start[1], 0.0);
            let direction = Vector3::new(direction[0], direction[1], 0.0);
            let line = straight_line(&shape, &tree.closest(&start).on, &direction, 2.4);
            let end = start + direction.normalize() * 2.4;
            assert_eq!(line.end, LineEnd::Length);
            assert!((line.positions[line.positions.len() - 1] - end).norm() < 1e-9);
        }
        let out = straight_line(&shape, &tree.closest(&center).on, &Vector3::x(), 9.0);
        assert_eq!(out.end, LineEnd::Boundary);
        assert!((out.length - 2.0).abs() < 1e-9);
    }

    #[test]
    fn around_a_box_a_line_comes_back() {
        let shape = bar::<f64>([2.0, 2.0, 2.0], [3, 3, 3]);
        let tree = SurfaceTree::new(&shape);
        let start = shape.surface().bounding_box().center() + Vector3::new(0.21, 0.13, 1.0);
        let line = straight_line(&shape, &tree.closest(&start).on, &Vector3::x(), 8.0);
        let end = line.positions[line.positions.len() - 1];
        assert!((end - start).norm() < 1e-9, "{end}");
        assert!((line.direction - Vector3::x()).norm() < 1e-9);
    }

    #[test]
    fn on_a_sphere_a_line_is_nearly_a_great_circle() {
        let shape = icosphere::<f64>(5);
        let from = SurfacePoint {
            face: FaceId::new(100),
            barycentric: [0.3, 0.3, 0.4],
        };
        let start = from.position(&shape.surface());
        let line = straight_line(&shape, &from, &Vector3::new(0.3, 0.8, -0.2), PI);
        let end = line.positions[line.positions.len() - 1];
        assert!((end + start.coords).coords.norm() < 0.05, "{start} {end}");
    }

    #[test]
    fn a_direction_across_the_surface_or_an_unknown_face_ends_at_once() {
        let shape = icosphere::<f64>(1);
        let from = SurfacePoint {
            face: FaceId::new(0),
            barycentric: [1.0 / 3.0; 3],
        };
        let normal = face_area_vector(&shape.surface(), from.face);
        let line = straight_line(&shape, &from, &Vector3::zeros(), 1.0);
        assert_eq!((line.end, line.length), (LineEnd::Degenerate, 0.0));
        let _ = straight_line(&shape, &from, &normal, 1.0);
        let beyond = SurfacePoint {
            face: FaceId::new(9999),
            ..from
        };
        assert!(
            straight_line(&shape, &beyond, &normal, 1.0)
                .points
                .is_empty()
        );
    }

    proptest! {
        #[test]
        fn lines_have_their_length_and_move_with_the_surface(
            shape in surfaces(),
            direction in directions(),
            motion in rigid_motions(),
            face in any::<prop::sample::Index>(),
            share in 0.0..2.0_f64,
        ) {
            let from = SurfacePoint {
                face: FaceId::new(face.index(shape.num_faces())),
                barycentric: [0.21, 0.33, 0.46],
            };
            let length = share * shape.surface().bounding_box().diagonal();
            let line = straight_line(&shape, &from, &direction, length);
            let pieces = line.positions.windows(2).map(|p| (p[1] - p[0]).norm());
            prop_assert!((pieces.sum::<f64>() - line.length).abs() < 1e-9 * (1.0 + length));
            prop_assert!(line.end != LineEnd::Length || (line.length - length).abs() < 1e-12 * length);
            let moved = shape.with_positions(shape.positions().map(|p| motion * p))?;
            let short = length.min(shape.surface().mean_edge_length());
            let [here, there] = [
                straight_line(&shape, &from, &direction, short),
                straight_line(&moved, &from, &(motion * direction), short),
            ];
            let end = |line: &StraightLine| line.positions[line.positions.len() - 1];
            prop_assert!((motion * end(&here) - end(&there)).norm() < 1e-6 * (1.0 + short));
        }
    }
}
