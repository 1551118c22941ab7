//! The point of a triangle, and of a tree of triangles, that is closest to a given point.

use bvh::bvh::BvhNode;
use nalgebra::{Point3, Vector3};

use super::{Box3, TriangleTree, triangle_corners};
use crate::surface::Positions;

/// The point of a triangle that is closest to a given point.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Foot {
    /// The index of the triangle.
    pub triangle: usize,
    /// The point's weights at the triangle's corners: at least 0, with a sum of 1.
    pub barycentric: [f64; 3],
    /// The point itself.
    pub point: Point3<f64>,
    /// The squared distance to the given point.
    pub squared_distance: f64,
}

impl TriangleTree {
    /// The closest point of all triangles, or `None` if none is closer than `limit`. Of several
    /// triangles at exactly the same distance, the one with the lowest index.
    pub fn closest(
        &self,
        point: &Point3<f64>,
        limit: f64,
        positions: &Positions<f64>,
    ) -> Option<Foot> {
        let mut best: Option<Foot> = None;
        let mut bound = limit * limit;
        let mut stack = Vec::with_capacity(64);
        stack.push((0, 0.0));
        while let Some((index, away)) = stack.pop() {
            if away > bound {
                continue;
            }
            match self.bvh.nodes.get(index) {
                None => {}
                Some(&BvhNode::Leaf { shape_index, .. }) => {
                    let corners = triangle_corners(self.triangles[shape_index], positions);
                    let (barycentric, nearest) = closest_on_triangle(point, &corners);
                    let squared_distance = (nearest - point).norm_squared();
                    let is_better = match &best {
                        None => squared_distance < bound,
                        Some(best) => (squared_distance, shape_index) < (bound, best.triangle),
                    };
                    if is_better {
                        bound = squared_distance;
                        best = Some(Foot {
                            triangle: shape_index,
                            barycentric,
                            point: nearest,
                            squared_distance,
                        });
                    }
                }
                Some(BvhNode::Node {
                    child_l_index,
                    child_l_aabb,
                    child_r_index,
                    child_r_aabb,
                    ..
                }) => {
                    let left = (*child_l_index, squared_distance(child_l_aabb, point));
                    let right = (*child_r_index, squared_distance(child_r_aabb, point));
                    // The nearer child is pushed last, so it is popped first.
                    stack.extend(if left.1 <= right.1 {
                        [right, left]
                    } else {
                        [left, right]
                    });
                }
            }
        }
        best
    }
}

/// The point of a triangle that is closest to `point`, with its barycentric coordinates: at least
/// 0, with a sum of 1. A triangle without area is treated as its three sides.
pub fn closest_on_triangle(
    point: &Point3<f64>,
    corners: &[Point3<f64>; 3],
) -> ([f64; 3], Point3<f64>) {
    let [a, b, c] = corners;
    let (ab, ac, from_a) = (b - a, c - a, point - a);
    let normal = ab.cross(&ac);
    let squared = normal.norm_squared();
    if squared > 0.0 {
        let v = from_a.cross(&ac).dot(&normal) / squared;
        let w = ab.cross(&from_a).dot(&normal) / squared;
        let u = 1.0 - v - w;
        if u >= 0.0 && v >= 0.0 && w >= 0.0 {
            return ([u, v, w], a + ab * v + ac * w);
        }
    }
    let mut best = ([1.0, 0.0, 0.0], *a);
    let mut least = f64::INFINITY;
    for side in 0..3 {
        let next = (side + 1) % 3;
        let (from, along) = (corners[side], corners[next] - corners[side]);
        let t = share_along(&(point - from), &along);
        let place = if t == 1.0 {
            corners[next]
        } else {
            from + along * t
        };
        let away = (place - point).norm_squared();
        if away < least {
            let mut barycentric = [0.0; 3];
            barycentric[side] = 1.0 - t;
            barycentric[next] = t;
            (best, least) = ((barycentric, place), away);
        }
    }
    best
}

/// The share of `along` at which it is closest to `offset`, in 0 … 1.
fn share_along(offset: &Vector3<f64>, along: &Vector3<f64>) -> f64 {
    let squared = along.norm_squared();
    if squared > 0.0 {
        (offset.dot(along) / squared).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

/// The squared distance of a point from a box; 0 inside.
fn squared_distance(bounds: &Box3, point: &Point3<f64>) -> f64 {
    (0..3)
        .map(|k| {
            let outside = (bounds.min[k] - point[k]).max(point[k] - bounds.max[k]);
            outside.max(0.0).powi(2)
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing;

    proptest! {
        #[test]
        fn the_closest_point_is_no_farther_than_any_sample(
            corners in prop::array::uniform3(prop::array::uniform3(-1.0..1.0_f64)),
            point in prop::array::uniform3(-2.0..2.0_f64),
        ) {
            let corners = corners.map(Point3::from);
            let point = Point3::from(point);
            let (barycentric, nearest) = closest_on_triangle(&point, &corners);
            prop_assert!(barycentric.iter().all(|b| (0.0..=1.0).contains(b)));
            prop_assert!((barycentric.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            let away = (nearest - point).norm();
            for i in 0..=20 {
                for j in 0..=20 - i {
                    let (v, w) = (f64::from(i) / 20.0, f64::from(j) / 20.0);
                    let sample = corners[0]
                        + (corners[1] - corners[0]) * v
                        + (corners[2] - corners[0]) * w;
                    prop_assert!(away <= (sample - point).norm() + 1e-12);
                }
            }
        }

        #[test]
        fn the_tree_finds_the_closest_of_all_triangles(
            shape in testing::surfaces(),
            direction in testing::directions(),
            away in 0.0..2.0_f64,
        ) {
            let triangles: Vec<[u32; 3]> =
                shape.to_triangles().chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
            let tree = TriangleTree::build(triangles.clone(), shape.positions());
            let bounds = shape.surface().bounding_box();
            let point = bounds.center() + direction * (away * bounds.diagonal());
            let foot = tree.closest(&point, f64::INFINITY, shape.positions()).unwrap();
            let least = triangles
                .iter()
                .map(|t| {
                    let corners = triangle_corners(*t, shape.positions());
                    (closest_on_triangle(&point, &corners).1 - point).norm_squared()
                })
                .fold(f64::INFINITY, f64::min);
            prop_assert_eq!(foot.squared_distance, least);
            let below = tree.closest(&point, foot.squared_distance.sqrt() * 0.99, shape.positions());
            prop_assert!(below.is_none());
        }
    }

    #[test]
    fn a_triangle_without_area_has_a_closest_point() {
        let [a, b] = [Point3::origin(), Point3::new(2.0, 0.0, 0.0)];
        let point = Point3::new(0.5, 1.0, 0.0);
        let (_, nearest) = closest_on_triangle(&point, &[a, a, b]);
        assert_eq!(nearest, Point3::new(0.5, 0.0, 0.0));
        let (barycentric, nearest) = closest_on_triangle(&point, &[a, a, a]);
        assert_eq!((barycentric, nearest), ([1.0, 0.0, 0.0], a));
    }
}
