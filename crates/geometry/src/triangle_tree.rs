//! A bounding-box tree over triangles, for queries by ray, by line of sight, by box and by closest
//! point. [`SurfaceTree`](crate::SurfaceTree) answers in faces and points of a surface.
//!
//! The crate `bvh` builds the tree, in parallel. The traversal here visits the nearest box first,
//! so that a ray stops at the first triangle it meets. When the shape moves, the boxes are
//! refitted without rebuilding the tree, which takes a fraction of the time.

mod closest;
mod winding;

use std::ops::ControlFlow;

use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::{BHShape, BoundingHierarchy};
use bvh::bvh::{Bvh, BvhNode};
use nalgebra::{Point3, Vector3};

use crate::bounds::BoundingBox;
use crate::surface::Positions;

pub use closest::{Foot, closest_on_triangle};
pub(crate) use winding::Boundaries;
pub use winding::solid_angle;

type Box3 = Aabb<f64, 3>;

/// A bounding-box tree over triangles.
#[derive(Debug)]
pub struct TriangleTree {
    bvh: Bvh<f64, 3>,
    triangles: Vec<[u32; 3]>,
}

/// A half-line.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Ray {
    /// The origin of the ray.
    pub origin: Point3<f64>,
    /// Its direction, of length 1.
    pub direction: Vector3<f64>,
}

impl Ray {
    /// The point at `distance` from the origin.
    #[must_use]
    pub fn at(&self, distance: f64) -> Point3<f64> {
        self.origin + self.direction * distance
    }
}

/// An intersection of a ray and a triangle.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Meeting {
    /// The index of the triangle.
    pub triangle: usize,
    /// Its distance from the ray's origin.
    pub distance: f64,
}

impl TriangleTree {
    /// Builds a tree over triangles, given by the indices of their corners.
    pub fn build(triangles: Vec<[u32; 3]>, positions: &Positions<f64>) -> Self {
        let mut leaves: Vec<Leaf> = triangles
            .iter()
            .map(|t| Leaf {
                bounds: bounds(*t, positions),
                node: 0,
            })
            .collect();
        Self {
            bvh: Bvh::build_par(&mut leaves),
            triangles,
        }
    }

    /// Predicts the bytes that [`Self::build`] takes, of which it keeps about three quarters.
    pub fn predicted_bytes(num_triangles: usize) -> u64 {
        // 2 m − 1 nodes; the leaves, and their order, are needed until it is built.
        let kept = 2 * size_of::<BvhNode<f64, 3>>() + size_of::<[u32; 3]>();
        let built = size_of::<Leaf>() + 2 * size_of::<usize>();
        (num_triangles as u64).saturating_mul((kept + built) as u64)
    }

    /// The triangles, in their original order.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Fits the boxes to moved vertices. Queries stay correct, but become slow if triangles that
    /// were close together move far apart.
    pub fn refit(&mut self, positions: &Positions<f64>) {
        let mut boxes = vec![Box3::empty(); self.bvh.nodes.len()];
        // `bvh` stores a node before its children.
        for i in (0..self.bvh.nodes.len()).rev() {
            boxes[i] = match &mut self.bvh.nodes[i] {
                BvhNode::Leaf { shape_index, .. } => {
                    bounds(self.triangles[*shape_index], positions)
                }
                BvhNode::Node {
                    child_l_index,
                    child_l_aabb,
                    child_r_index,
                    child_r_aabb,
                    ..
                } => {
                    *child_l_aabb = boxes[*child_l_index];
                    *child_r_aabb = boxes[*child_r_index];
                    child_l_aabb.join(child_r_aabb)
                }
            };
        }
    }

    /// The first triangle along the ray.
    pub fn first(&self, ray: &Ray, positions: &Positions<f64>) -> Option<Meeting> {
        let mut best = None;
        self.walk(ray, f64::INFINITY, usize::MAX, positions, |meeting| {
            best = Some(meeting);
            ControlFlow::Continue(meeting.distance)
        });
        best
    }

    /// Returns true if the ray meets, closer than `limit`, a triangle accepted by `counts`.
    pub fn meets_any(
        &self,
        ray: &Ray,
        limit: f64,
        positions: &Positions<f64>,
        counts: impl Fn([u32; 3]) -> bool,
    ) -> bool {
        let mut is_met = false;
        self.walk(ray, limit, usize::MAX, positions, |meeting| {
            is_met = counts(self.triangles[meeting.triangle]);
            if is_met {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(limit)
            }
        });
        is_met
    }

    /// Calls `meets` for the intersections of the ray with triangles closer than a limit, roughly
    /// in order of distance. `meets` returns the new limit or ends the walk. The walk also ends
    /// after `most` triangles.
    pub fn walk(
        &self,
        ray: &Ray,
        mut limit: f64,
        mut most: usize,
        positions: &Positions<f64>,
        mut meets: impl FnMut(Meeting) -> ControlFlow<(), f64>,
    ) {
        let line = Line::new(ray);
        let mut stack = Vec::with_capacity(64);
        stack.push((0, 0.0));
        while let Some((index, entry)) = stack.pop() {
            if entry > limit {
                continue;
            }
            match self.bvh.nodes.get(index) {
                None => {}
                Some(&BvhNode::Leaf { shape_index, .. }) => {
                    if most == 0 {
                        return;
                    }
                    most -= 1;
                    let met = triangle_on_ray(
                        ray,
                        triangle_corners(self.triangles[shape_index], positions),
                    );
                    let Some(distance) = met.filter(|d| *d < limit) else {
                        continue;
                    };
                    let triangle = shape_index;
                    match meets(Meeting { triangle, distance }) {
                        ControlFlow::Continue(new) => limit = new,
                        ControlFlow::Break(()) => return,
                    }
                }
                Some(BvhNode::Node {
                    child_l_index,
                    child_l_aabb,
                    child_r_index,
                    child_r_aabb,
                    ..
                }) => {
                    let left = line.entry(child_l_aabb, limit);
                    let right = line.entry(child_r_aabb, limit);
                    let left = left.map(|entry| (*child_l_index, entry));
                    let right = right.map(|entry| (*child_r_index, entry));
                    // The nearer child is pushed last, so it is popped first.
                    match (left, right) {
                        (Some(l), Some(r)) if l.1 <= r.1 => stack.extend([r, l]),
                        (l, r) => stack.extend(l.into_iter().chain(r)),
                    }
                }
            }
        }
    }

    /// Returns true if `wanted` holds for any of the triangles whose boxes overlap or touch the
    /// given one. At most `most` triangles are tested.
    pub fn any_overlapping(
        &self,
        bounds: &BoundingBox<f64>,
        mut most: usize,
        mut wanted: impl FnMut([u32; 3]) -> bool,
    ) -> bool {
        let overlaps = |other: &Box3| {
            (0..3).all(|k| bounds.min[k] <= other.max[k] && other.min[k] <= bounds.max[k])
        };
        let ended = self.visit(overlaps, |triangle| {
            if most == 0 {
                return ControlFlow::Break(false);
            }
            most -= 1;
            if wanted(triangle) {
                ControlFlow::Break(true)
            } else {
                ControlFlow::Continue(())
            }
        });
        ended == ControlFlow::Break(true)
    }

    /// Calls `each` with the triangles whose boxes, treated as balls, satisfy
    /// `wanted(centre, radius)`.
    pub fn each_near(
        &self,
        wanted: impl Fn(Point3<f64>, f64) -> bool,
        mut each: impl FnMut([u32; 3]),
    ) {
        let enters = |bounds: &Box3| {
            let (center, radius) = ball(bounds);
            wanted(center, radius)
        };
        let _ = self.visit(enters, |triangle| -> ControlFlow<()> {
            each(triangle);
            ControlFlow::Continue(())
        });
    }

    /// Calls `each` with the triangles whose boxes, including all enclosing ones, are accepted by
    /// `enters`, until `each` ends the visit.
    fn visit<B>(
        &self,
        enters: impl Fn(&Box3) -> bool,
        mut each: impl FnMut([u32; 3]) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        let mut stack = Vec::with_capacity(64);
        stack.push(0);
        while let Some(index) = stack.pop() {
            match self.bvh.nodes.get(index) {
                None => {}
                Some(&BvhNode::Leaf { shape_index, .. }) => each(self.triangles[shape_index])?,
                Some(BvhNode::Node {
                    child_l_index,
                    child_l_aabb,
                    child_r_index,
                    child_r_aabb,
                    ..
                }) => {
                    let children = [(child_l_index, child_l_aabb), (child_r_index, child_r_aabb)];
                    let inside = children.into_iter().filter(|(_, bounds)| enters(bounds));
                    stack.extend(inside.map(|(child, _)| *child));
                }
            }
        }
        ControlFlow::Continue(())
    }
}

/// The corners of a triangle.
pub fn triangle_corners(triangle: [u32; 3], positions: &Positions<f64>) -> [Point3<f64>; 3] {
    let points = positions.as_slice();
    triangle.map(|v| points[v as usize])
}

/// The distance along a ray at which it meets a triangle, from either side.
///
/// **Source**: Möller and Trumbore 1997, Fast, minimum storage ray/triangle intersection. The
/// border belongs to the triangle, with a tolerance, so that a ray through an edge cannot slip
/// between two triangles.
pub fn triangle_on_ray(ray: &Ray, [a, b, c]: [Point3<f64>; 3]) -> Option<f64> {
    let (ab, ac) = (b - a, c - a);
    let p = ray.direction.cross(&ac);
    let determinant = ab.dot(&p);
    if determinant == 0.0 {
        return None;
    }
    let from_a = ray.origin - a;
    let u = from_a.dot(&p) / determinant;
    let q = from_a.cross(&ab);
    let v = ray.direction.dot(&q) / determinant;
    let distance = ac.dot(&q) / determinant;
    let is_inside = u >= -TOLERANCE && v >= -TOLERANCE && u + v <= 1.0 + TOLERANCE;
    (is_inside && distance >= 0.0).then_some(distance)
}

/// A ray prepared for box tests.
struct Line {
    origin: Point3<f64>,
    inverse: Vector3<f64>,
}

impl Line {
    fn new(ray: &Ray) -> Self {
        Self {
            origin: ray.origin,
            inverse: ray.direction.map(|d| 1.0 / d),
        }
    }

    /// The distance at which the ray enters a box, if that is below `limit`.
    #[inline]
    fn entry(&self, bounds: &Box3, limit: f64) -> Option<f64> {
        let (mut enter, mut leave) = (0.0_f64, limit);
        for k in 0..3 {
            let inverse = self.inverse[k];
            let (front, back) = if inverse >= 0.0 {
                (bounds.min[k], bounds.max[k])
            } else {
                (bounds.max[k], bounds.min[k])
            };
            // A ray within the plane of a side gives 0·∞ = NaN, which `max` and `min` ignore.
            enter = enter.max((front - self.origin[k]) * inverse);
            leave = leave.min((back - self.origin[k]) * inverse);
        }
        // A flat box is entered and left at the same distance, up to rounding.
        (enter <= leave * (1.0 + 1e-12)).then_some(enter)
    }
}

struct Leaf {
    bounds: Box3,
    node: usize,
}

impl Bounded<f64, 3> for Leaf {
    fn aabb(&self) -> Box3 {
        self.bounds
    }
}

impl BHShape<f64, 3> for Leaf {
    fn set_bh_node_index(&mut self, index: usize) {
        self.node = index;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

fn bounds(triangle: [u32; 3], positions: &Positions<f64>) -> Box3 {
    let [a, b, c] = triangle_corners(triangle, positions);
    let (min, max) = (a.inf(&b).inf(&c), a.sup(&b).sup(&c));
    // `bvh` uses another version of nalgebra, so plain arrays are passed.
    let array = |p: Point3<f64>| <[f64; 3]>::from(p);
    Box3::with_bounds(array(min).into(), array(max).into())
}

/// The bounding ball of a box.
fn ball(bounds: &Box3) -> (Point3<f64>, f64) {
    let (min, max) = (bounds.min, bounds.max);
    let center = Point3::new(
        0.5 * (min[0] + max[0]),
        0.5 * (min[1] + max[1]),
        0.5 * (min[2] + max[2]),
    );
    let corner = Point3::new(max[0], max[1], max[2]);
    (center, (corner - center).norm())
}

/// The distance outside a triangle, relative to its sides, within which a ray still hits it.
const TOLERANCE: f64 = 1e-12;
