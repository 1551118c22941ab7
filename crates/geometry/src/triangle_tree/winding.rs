//! Generalized winding numbers: how often triangles surround a point.
//!
//! ```text
//! w(p) = Σ_T Ω_T(p) / 4π        Ω_T = signed solid angle of triangle T seen from p
//! ```
//!
//! Evaluated hierarchically and exactly: outside the box of a node, its triangles have the same
//! winding number as the cone from any point of the box over their boundary, which has far fewer
//! triangles. Inside the box, the two children are summed.
//!
//! **Source**: Jacobson, Kavan, Sorkine-Hornung 2013, Robust inside-outside segmentation using
//! generalized winding numbers, sections 3 and 4; Van Oosterom and Strackee 1983 for the solid
//! angle.

use std::f64::consts::PI;

use bvh::bvh::BvhNode;
use nalgebra::Point3;

use super::{Box3, TriangleTree, triangle_corners};
use crate::surface::Positions;

/// Boundaries of the nodes of a [`TriangleTree`], for winding numbers.
#[derive(Debug)]
pub(crate) struct Boundaries {
    /// The edges of all nodes, node by node.
    edges: Vec<[u32; 2]>,
    /// For each node the range of its edges, or `None` for a node whose triangles are summed.
    ranges: Vec<Option<(usize, usize)>>,
    /// The lower and upper corner of the root's box.
    root: [Point3<f64>; 2],
}

/// An undirected edge, and how often it is traversed upwards minus downwards.
type Chain = Vec<([u32; 2], i32)>;

impl Boundaries {
    /// Collects the boundary of every node with enough triangles.
    pub(crate) fn new(tree: &TriangleTree, positions: &Positions<f64>) -> Self {
        let nodes = &tree.bvh.nodes;
        let mut chains: Vec<Chain> = vec![Chain::new(); nodes.len()];
        let mut sizes = vec![1_usize; nodes.len()];
        let mut edges = Vec::new();
        let mut ranges = vec![None; nodes.len()];
        // `bvh` stores a node before its children.
        for i in (0..nodes.len()).rev() {
            chains[i] = match &nodes[i] {
                BvhNode::Leaf { shape_index, .. } => around(tree.triangles[*shape_index]),
                BvhNode::Node {
                    child_l_index,
                    child_r_index,
                    ..
                } => {
                    sizes[i] = sizes[*child_l_index] + sizes[*child_r_index];
                    let left = std::mem::take(&mut chains[*child_l_index]);
                    let right = std::mem::take(&mut chains[*child_r_index]);
                    sum(&left, &right)
                }
            };
            if sizes[i] >= FEWEST && chains[i].len() < sizes[i] {
                let start = edges.len();
                for &([low, high], count) in &chains[i] {
                    let edge = if count > 0 { [low, high] } else { [high, low] };
                    edges.extend(std::iter::repeat_n(edge, count.unsigned_abs() as usize));
                }
                ranges[i] = Some((start, edges.len()));
            }
        }
        let points = tree
            .triangles
            .iter()
            .flat_map(|t| triangle_corners(*t, positions));
        let root = points.fold(
            [
                Point3::from([f64::INFINITY; 3]),
                Point3::from([f64::NEG_INFINITY; 3]),
            ],
            |[min, max], p| [min.inf(&p), max.sup(&p)],
        );
        Self {
            edges,
            ranges,
            root,
        }
    }

    /// The winding number of all triangles around a point.
    pub(crate) fn winding_number(
        &self,
        tree: &TriangleTree,
        positions: &Positions<f64>,
        point: &Point3<f64>,
    ) -> f64 {
        let mut total = 0.0;
        let mut stack = Vec::with_capacity(64);
        stack.push((0, self.root));
        while let Some((index, [min, max])) = stack.pop() {
            let is_outside = (0..3).any(|k| point[k] < min[k] || point[k] > max[k]);
            if let (true, Some(&Some((start, end)))) = (is_outside, self.ranges.get(index)) {
                total += cone(&self.edges[start..end], positions, point);
                continue;
            }
            match tree.bvh.nodes.get(index) {
                None => {}
                Some(&BvhNode::Leaf { shape_index, .. }) => {
                    let corners = triangle_corners(tree.triangles[shape_index], positions);
                    total += solid_angle(point, &corners);
                }
                Some(BvhNode::Node {
                    child_l_index,
                    child_l_aabb: left,
                    child_r_index,
                    child_r_aabb: right,
                    ..
                }) => {
                    stack.push((*child_r_index, corners_of(right)));
                    stack.push((*child_l_index, corners_of(left)));
                }
            }
        }
        total / (4.0 * PI)
    }
}

/// The lower and the upper corner of a box.
fn corners_of(bounds: &Box3) -> [Point3<f64>; 2] {
    // `bvh` uses another version of nalgebra.
    [&bounds.min, &bounds.max].map(|p| Point3::new(p[0], p[1], p[2]))
}

/// The boundary of a triangle, in ascending order.
fn around([a, b, c]: [u32; 3]) -> Chain {
    let directed = |a: u32, b: u32| ([a.min(b), a.max(b)], if a < b { 1 } else { -1 });
    let mut chain = vec![directed(a, b), directed(b, c), directed(c, a)];
    chain.sort_unstable();
    chain
}

/// The sum of two sorted chains; edges that cancel are dropped.
fn sum(left: &Chain, right: &Chain) -> Chain {
    let mut total = Chain::with_capacity(left.len() + right.len());
    let (mut l, mut r) = (left.iter().peekable(), right.iter().peekable());
    loop {
        let (edge, count) = match (l.peek(), r.peek()) {
            (None, None) => break,
            (Some(a), Some(b)) if a.0 == b.0 => (a.0, a.1 + b.1),
            (Some(a), Some(b)) if a.0 < b.0 => **a,
            (Some(a), None) => **a,
            (_, Some(b)) => **b,
        };
        l.next_if(|a| a.0 == edge);
        r.next_if(|b| b.0 == edge);
        if count != 0 {
            total.push((edge, count));
        }
    }
    total
}

/// The solid angles of the cone over some edges, with its apex at the first of their ends.
fn cone(edges: &[[u32; 2]], positions: &Positions<f64>, point: &Point3<f64>) -> f64 {
    let points = positions.as_slice();
    let Some(&[apex, _]) = edges.first() else {
        return 0.0;
    };
    let triangles = edges.iter().map(|[from, to]| {
        let corners = [*from, *to, apex].map(|v| points[v as usize]);
        solid_angle(point, &corners)
    });
    triangles.sum()
}

/// The signed solid angle of a triangle as seen from a point, in −2π … 2π: positive if the
/// triangle turns its back to the point.
///
/// **Source**: Van Oosterom and Strackee 1983, The solid angle of a plane triangle.
pub fn solid_angle(point: &Point3<f64>, corners: &[Point3<f64>; 3]) -> f64 {
    let [a, b, c] = corners.map(|corner| corner - point);
    let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
    let determinant = a.dot(&b.cross(&c));
    let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
    if determinant == 0.0 {
        // Within the plane of the triangle the two sides are not told apart.
        return 0.0;
    }
    2.0 * determinant.atan2(below)
}

/// The smallest number of triangles for which a node stores its boundary.
const FEWEST: usize = 8;

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::shapes::{bumpy_plane, icosphere};
    use crate::testing;

    fn tree_of(shape: &crate::Mesh<f64>) -> TriangleTree {
        let corners = shape.to_triangles();
        let triangles = corners.chunks_exact(3).map(|t| [t[0], t[1], t[2]]);
        TriangleTree::build(triangles.collect(), shape.positions())
    }

    fn summed(tree: &TriangleTree, positions: &Positions<f64>, point: &Point3<f64>) -> f64 {
        let angles = tree
            .triangles()
            .iter()
            .map(|t| solid_angle(point, &triangle_corners(*t, positions)));
        angles.sum::<f64>() / (4.0 * PI)
    }

    proptest! {
        #[test]
        fn the_hierarchy_gives_the_sum_over_all_triangles(
            shape in testing::surfaces(),
            place in prop::array::uniform3(-0.2..1.2_f64),
        ) {
            let tree = tree_of(&shape);
            let boundaries = Boundaries::new(&tree, shape.positions());
            let bounds = shape.surface().bounding_box();
            let size = bounds.extents().component_mul(&nalgebra::Vector3::from(place));
            let point = bounds.min + size;
            let fast = boundaries.winding_number(&tree, shape.positions(), &point);
            let slow = summed(&tree, shape.positions(), &point);
            prop_assert!((fast - slow).abs() < 1e-9, "{} {}", fast, slow);
        }
    }

    #[test]
    fn a_closed_surface_surrounds_its_inside_once() {
        let shape = icosphere::<f64>(3);
        let tree = tree_of(&shape);
        let boundaries = Boundaries::new(&tree, shape.positions());
        for (x, expected) in [(0.0, 1.0), (0.5, 1.0), (0.98, 1.0), (1.02, 0.0), (7.0, 0.0)] {
            let point = Point3::new(x * 0.6, x * 0.0, x * 0.8);
            let w = boundaries.winding_number(&tree, shape.positions(), &point);
            assert!((w - expected).abs() < 1e-12, "{x}: {w}");
        }
    }

    #[test]
    fn an_open_disc_covers_the_part_of_the_view_that_it_fills() {
        // Seen from height h over its centre, a square of side 2 has the solid angle
        // 4 atan(1 / (h √(h² + 2))).
        let shape = bumpy_plane::<f64>([2.0, 2.0], [16, 16], 0.0);
        let tree = tree_of(&shape);
        let center = shape.surface().bounding_box().center();
        let boundaries = Boundaries::new(&tree, shape.positions());
        for h in [0.1_f64, 1.0, 3.0] {
            let exact = 4.0 * (1.0 / (h * (h * h + 2.0).sqrt())).atan() / (4.0 * PI);
            for side in [-1.0, 1.0] {
                let point = center + nalgebra::Vector3::z() * (side * h);
                let w = boundaries.winding_number(&tree, shape.positions(), &point);
                assert!((w.abs() - exact).abs() < 1e-12, "{w} {exact}");
            }
        }
    }
}
