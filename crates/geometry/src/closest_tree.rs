//! Closest points on triangles that carry labels, so that a query can skip some of them.
//!
//! A bounding-box tree whose nodes know the least and the greatest mark below them. A query that
//! is to skip the triangles of its own cluster skips whole subtrees of it, which keeps the cost of
//! "the closest point on any other part" at O(log n).

use nalgebra::{Point3, Vector3};

use crate::surface::Positions;
use crate::triangle_tree::triangle_corners;

/// A tree of labelled triangles for closest-point queries.
#[derive(Debug)]
pub struct ClosestTree {
    nodes: Vec<Node>,
    /// The triangles in the order of the leaves, and their labels.
    triangles: Vec<[u32; 3]>,
    labels: Vec<u32>,
    corners: Vec<[Point3<f64>; 3]>,
}

/// The mark of each label, as the nodes of a tree see it: the least and the greatest below each.
#[derive(Clone, Debug)]
pub struct Marks {
    of_label: Vec<u32>,
    of_node: Vec<[u32; 2]>,
}

impl Marks {
    /// The mark of a label.
    pub fn of(&self, label: u32) -> u32 {
        self.of_label[label as usize]
    }
}

/// The closest point of a query.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Closest {
    /// The vertices of the triangle that has it.
    pub triangle: [u32; 3],
    /// The label of that triangle.
    pub label: u32,
    /// The barycentric coordinates of the point.
    pub shares: [f64; 3],
    /// The distance.
    pub distance: f64,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    min: Point3<f64>,
    max: Point3<f64>,
    /// A leaf has the triangles `first..first + count`; another node has the children `i + 1` and
    /// `first`, and the count 0.
    first: u32,
    count: u32,
}

/// Triangles of a leaf.
const LEAF: usize = 4;

impl ClosestTree {
    /// Builds a tree over triangles, each with a label.
    ///
    /// **Shapes**: one label per triangle. Labels without a triangle are allowed.
    ///
    /// # Panics
    /// If the two lists differ in length, or a corner does not exist.
    pub fn build(triangles: &[[u32; 3]], labels: &[u32], positions: &Positions<f64>) -> Self {
        assert_eq!(triangles.len(), labels.len(), "one label per triangle");
        let corners: Vec<[Point3<f64>; 3]> = triangles
            .iter()
            .map(|t| triangle_corners(*t, positions))
            .collect();
        let mut all: Vec<Item> = corners.iter().zip(0..).map(Item::new).collect();
        all.sort_by_key(|item| labels[item.triangle as usize]);
        let label = |item: &Item| labels[item.triangle as usize];
        let mut groups: Vec<Group<'_>> = all
            .chunk_by_mut(|a, b| label(a) == label(b))
            .map(|members| Group::new(members, &corners))
            .collect();
        let mut nodes = Vec::with_capacity(triangles.len().max(1));
        let mut order = Vec::with_capacity(triangles.len());
        if !groups.is_empty() {
            join(&mut nodes, &mut groups, &mut order, &corners);
        }
        let pick = |i: &u32| *i as usize;
        Self {
            nodes,
            triangles: order.iter().map(|i| triangles[pick(i)]).collect(),
            labels: order.iter().map(|i| labels[pick(i)]).collect(),
            corners: order.iter().map(|i| corners[pick(i)]).collect(),
        }
    }

    /// Gives every label a mark, for queries that skip by marks.
    ///
    /// **Shapes**: one mark per label.
    pub fn marks(&self, of_label: Vec<u32>) -> Marks {
        let mut of_node = vec![[u32::MAX, 0]; self.nodes.len()];
        for i in (0..self.nodes.len()).rev() {
            let node = &self.nodes[i];
            of_node[i] = match node.count {
                0 => {
                    let [a, b] = [of_node[i + 1], of_node[node.first as usize]];
                    [a[0].min(b[0]), a[1].max(b[1])]
                }
                _ => self.leaf(node).fold([u32::MAX, 0], |[least, most], k| {
                    let mark = of_label[self.labels[k] as usize];
                    [least.min(mark), most.max(mark)]
                }),
            };
        }
        Marks { of_label, of_node }
    }

    /// The closest point within `limit` on a triangle that is not skipped. `skips(least, greatest)`
    /// tells for a range of marks whether everything with such marks is skipped; at a triangle
    /// both are its own mark. `counts` sees the label of a triangle at last.
    pub fn closest(
        &self,
        point: Point3<f64>,
        limit: f64,
        marks: &Marks,
        skips: impl Fn(u32, u32) -> bool,
        counts: impl Fn(u32) -> bool,
    ) -> Option<Closest> {
        let mut best: Option<Closest> = None;
        let mut reach = limit * limit;
        let mut stack: Vec<(u32, f64)> = Vec::with_capacity(64);
        self.push(0, point, reach, marks, &skips, &mut stack);
        while let Some((index, squared)) = stack.pop() {
            if squared > reach {
                continue;
            }
            let node = &self.nodes[index as usize];
            if node.count == 0 {
                self.push(node.first, point, reach, marks, &skips, &mut stack);
                self.push(index + 1, point, reach, marks, &skips, &mut stack);
                // The nearer child is popped first.
                if let [.., a, b] = stack.as_mut_slice()
                    && a.1 < b.1
                    && [a.0, b.0] == [node.first, index + 1]
                {
                    std::mem::swap(a, b);
                }
                continue;
            }
            for k in self.leaf(node) {
                let label = self.labels[k];
                let mark = marks.of(label);
                if skips(mark, mark) || !counts(label) {
                    continue;
                }
                let shares = closest_on_triangle(point, &self.corners[k]);
                let offset = point - at(&self.corners[k], shares);
                let squared = offset.norm_squared();
                let is_closer = match &best {
                    None => squared <= reach,
                    Some(_) => squared < reach,
                };
                if is_closer {
                    reach = squared;
                    best = Some(Closest {
                        triangle: self.triangles[k],
                        label,
                        shares,
                        distance: squared.sqrt(),
                    });
                }
            }
        }
        best
    }

    /// Returns false if no triangle that is not skipped is within `limit` of any point of a box,
    /// given by its corners: a query from a point in it would find nothing.
    pub fn may_reach(
        &self,
        corners: [Point3<f64>; 2],
        limit: f64,
        marks: &Marks,
        skips: impl Fn(u32, u32) -> bool,
    ) -> bool {
        let reach = limit * limit;
        let mut stack: Vec<u32> = Vec::with_capacity(64);
        stack.push(0);
        while let Some(index) = stack.pop() {
            let Some(node) = self.nodes.get(index as usize) else {
                continue;
            };
            let [least, most] = marks.of_node[index as usize];
            if node.squared_gap(&corners) > reach || skips(least, most) {
                continue;
            }
            if node.count > 0 {
                return true;
            }
            stack.extend([node.first, index + 1]);
        }
        false
    }

    /// Calls `each` with the label of every triangle within `limit` of a point and its distance,
    /// until `skips` refuses its marks. Triangles of one label may be reported several times.
    pub fn each_within(
        &self,
        point: Point3<f64>,
        limit: f64,
        marks: &Marks,
        skips: impl Fn(u32, u32) -> bool,
        mut each: impl FnMut(u32, f64),
    ) {
        let reach = limit * limit;
        let mut stack: Vec<(u32, f64)> = Vec::with_capacity(64);
        self.push(0, point, reach, marks, &skips, &mut stack);
        while let Some((index, _)) = stack.pop() {
            let node = &self.nodes[index as usize];
            if node.count == 0 {
                self.push(node.first, point, reach, marks, &skips, &mut stack);
                self.push(index + 1, point, reach, marks, &skips, &mut stack);
                continue;
            }
            for k in self.leaf(node) {
                let label = self.labels[k];
                let mark = marks.of(label);
                if skips(mark, mark) {
                    continue;
                }
                let shares = closest_on_triangle(point, &self.corners[k]);
                let squared = (point - at(&self.corners[k], shares)).norm_squared();
                if squared <= reach {
                    each(label, squared.sqrt());
                }
            }
        }
    }

    fn leaf(&self, node: &Node) -> impl Iterator<Item = usize> + use<> {
        let first = node.first as usize;
        first..first + node.count as usize
    }

    fn push(
        &self,
        index: u32,
        point: Point3<f64>,
        reach: f64,
        marks: &Marks,
        skips: &impl Fn(u32, u32) -> bool,
        stack: &mut Vec<(u32, f64)>,
    ) {
        let Some(node) = self.nodes.get(index as usize) else {
            return;
        };
        let [least, most] = marks.of_node[index as usize];
        let squared = node.squared_distance(point);
        if squared <= reach && !skips(least, most) {
            stack.push((index, squared));
        }
    }
}

impl Node {
    #[inline(always)]
    fn squared_distance(&self, p: Point3<f64>) -> f64 {
        let mut sum = 0.0;
        for k in 0..3 {
            let outside = (self.min[k] - p[k]).max(p[k] - self.max[k]).max(0.0);
            sum += outside * outside;
        }
        sum
    }

    fn squared_gap(&self, [min, max]: &[Point3<f64>; 2]) -> f64 {
        let gap = |k: usize| (self.min[k] - max[k]).max(min[k] - self.max[k]).max(0.0);
        (0..3).map(|k| gap(k) * gap(k)).sum()
    }
}

/// A triangle on its way into a leaf.
#[derive(Clone, Copy)]
struct Item {
    middle: Point3<f64>,
    triangle: u32,
}

impl Item {
    fn new(([a, b, c], triangle): (&[Point3<f64>; 3], u32)) -> Self {
        Self {
            middle: Point3::from((a.coords + b.coords + c.coords) / 3.0),
            triangle,
        }
    }
}

/// The triangles of one label.
struct Group<'a> {
    members: &'a mut [Item],
    min: Point3<f64>,
    max: Point3<f64>,
}

impl<'a> Group<'a> {
    fn new(members: &'a mut [Item], corners: &[[Point3<f64>; 3]]) -> Self {
        let [min, max] = bounds(members, corners);
        Self { members, min, max }
    }

    fn middle(&self) -> Point3<f64> {
        nalgebra::center(&self.min, &self.max)
    }
}

/// Appends the node of several labels and everything below it, each label with a subtree of its
/// own: a query that skips a label enters none of it.
fn join(
    nodes: &mut Vec<Node>,
    groups: &mut [Group<'_>],
    order: &mut Vec<u32>,
    corners: &[[Point3<f64>; 3]],
) {
    if let [group] = groups {
        split(nodes, group.members, order.len(), corners);
        order.extend(group.members.iter().map(|item| item.triangle));
        return;
    }
    let [mut min, mut max] = NOWHERE;
    let [mut low, mut high] = NOWHERE;
    for group in groups.iter() {
        (min, max) = (min.inf(&group.min), max.sup(&group.max));
        (low, high) = (low.inf(&group.middle()), high.sup(&group.middle()));
    }
    let index = nodes.len();
    nodes.push(Node {
        min,
        max,
        first: 0,
        count: 0,
    });
    let axis = (high - low).imax();
    groups.sort_by(|a, b| {
        let [a_key, b_key] = [a, b].map(|group| group.middle()[axis]);
        let first = |group: &Group<'_>| group.members.first().map(|item| item.triangle);
        a_key.total_cmp(&b_key).then(first(a).cmp(&first(b)))
    });
    let (left, right) = groups.split_at_mut(groups.len() / 2);
    join(nodes, left, order, corners);
    nodes[index].first = nodes.len() as u32;
    join(nodes, right, order, corners);
}

/// Nothing, as a box.
const NOWHERE: [Point3<f64>; 2] = [
    Point3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
    Point3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
];

fn bounds(members: &[Item], corners: &[[Point3<f64>; 3]]) -> [Point3<f64>; 2] {
    members.iter().fold(NOWHERE, |[min, max], item| {
        let [a, b, c] = &corners[item.triangle as usize];
        [min.inf(&a.inf(b).inf(c)), max.sup(&a.sup(b).sup(c))]
    })
}

/// Appends the node of these triangles and everything below it.
fn split(nodes: &mut Vec<Node>, items: &mut [Item], offset: usize, corners: &[[Point3<f64>; 3]]) {
    let index = nodes.len();
    let is_leaf = items.len() <= LEAF;
    let [min, max] = match is_leaf {
        true => bounds(items, corners),
        // Known when the children are.
        false => NOWHERE,
    };
    nodes.push(Node {
        min,
        max,
        first: offset as u32,
        count: items.len() as u32,
    });
    if is_leaf {
        return;
    }
    let [low, high] = items.iter().fold(NOWHERE, |[low, high], item| {
        [low.inf(&item.middle), high.sup(&item.middle)]
    });
    let axis = (high - low).imax();
    let half = items.len() / 2;
    items.select_nth_unstable_by(half, |a, b| {
        let by_place = a.middle[axis].total_cmp(&b.middle[axis]);
        by_place.then(a.triangle.cmp(&b.triangle))
    });
    let (left, right) = items.split_at_mut(half);
    split(nodes, left, offset, corners);
    let second = nodes.len();
    split(nodes, right, offset + half, corners);
    let [a, b] = [nodes[index + 1], nodes[second]];
    nodes[index] = Node {
        min: a.min.inf(&b.min),
        max: a.max.sup(&b.max),
        first: second as u32,
        count: 0,
    };
}

/// The point of a triangle with these barycentric coordinates.
fn at(corners: &[Point3<f64>; 3], shares: [f64; 3]) -> Point3<f64> {
    let sum: Vector3<f64> = corners
        .iter()
        .zip(shares)
        .map(|(c, share)| c.coords * share)
        .sum();
    Point3::from(sum)
}

/// The barycentric coordinates of the point of a triangle that is closest to `p`; a triangle
/// without area counts as its longest edge, and one without extent as its first corner.
///
/// **Source**: Ericson 2005, Real-Time Collision Detection, section 5.1.5.
fn closest_on_triangle(p: Point3<f64>, [a, b, c]: &[Point3<f64>; 3]) -> [f64; 3] {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return [1.0 - t, t, 0.0];
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return [1.0 - t, 0.0, t];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - t, t];
    }
    let sum = va + vb + vc;
    if !(sum > 0.0) {
        return closest_on_longest_edge(p, &[*a, *b, *c]);
    }
    let (v, w) = (vb / sum, vc / sum);
    [1.0 - v - w, v, w]
}

fn closest_on_longest_edge(p: Point3<f64>, corners: &[Point3<f64>; 3]) -> [f64; 3] {
    let (mut longest, mut edge) = (0.0, None);
    for [i, j] in [[0, 1], [1, 2], [2, 0]] {
        let squared = (corners[j] - corners[i]).norm_squared();
        if squared > longest {
            (longest, edge) = (squared, Some([i, j]));
        }
    }
    let Some([i, j]) = edge else {
        return [1.0, 0.0, 0.0];
    };
    let along = (corners[j] - corners[i]).dot(&(p - corners[i])) / longest;
    let t = along.clamp(0.0, 1.0);
    let mut shares = [0.0; 3];
    (shares[i], shares[j]) = (1.0 - t, t);
    shares
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn point() -> impl Strategy<Value = Point3<f64>> {
        [-1.0..1.0f64, -1.0..1.0, -1.0..1.0].prop_map(Point3::from)
    }

    proptest! {
        /// Against all triangles one by one, with some labels skipped.
        #[test]
        fn the_closest_point_is_found_among_the_labels_that_count(
            points in proptest::collection::vec(point(), 30..90), query in point(), own in 0u32..4,
        ) {
            let positions: Positions<f64> = points.iter().copied().collect();
            let triangles: Vec<[u32; 3]> =
                (0..points.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
            let labels: Vec<u32> = (0..triangles.len() as u32).map(|t| t % 4).collect();
            let tree = ClosestTree::build(&triangles, &labels, &positions);
            let marks = tree.marks((0..4).collect());
            let skips = |least, most| least == own && most == own;
            let found = tree.closest(query, f64::INFINITY, &marks, skips, |_| true).unwrap();
            prop_assert_ne!(found.label, own);
            let distance = |t: &[u32; 3]| {
                let corners = triangle_corners(*t, &positions);
                (query - at(&corners, closest_on_triangle(query, &corners))).norm()
            };
            let others = triangles.iter().zip(&labels).filter(|(_, l)| **l != own);
            let expected = others.map(|(t, _)| distance(t)).fold(f64::INFINITY, f64::min);
            prop_assert!((found.distance - expected).abs() < 1e-12);
            let mut within = f64::INFINITY;
            tree.each_within(query, expected + 0.1, &marks, skips, |_, d| within = within.min(d));
            prop_assert!((within - expected).abs() < 1e-12);
            let cube = |size: f64| [query, query + Vector3::new(size, size, size)];
            prop_assert!(tree.may_reach(cube(0.1), expected + 1e-9, &marks, skips));
            prop_assert!(!tree.may_reach(cube(0.0), expected, &marks, |_, _| true));
            let near = tree.closest(query, 0.3, &marks, skips, |_| true).is_some();
            prop_assert!(!near || tree.may_reach(cube(0.0), 0.3, &marks, skips));
        }

        /// No sampled point of the triangle is closer.
        #[test]
        fn no_point_of_a_triangle_is_closer(
            a in point(), b in point(), c in point(), p in point(), u in 0.0..1.0f64, v in 0.0..1.0f64,
        ) {
            let corners = [a, b, c];
            let shares = closest_on_triangle(p, &corners);
            prop_assert!(shares.iter().all(|s| (-1e-12..=1.0 + 1e-12).contains(s)));
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let sample = at(&corners, [1.0 - u - v, u, v]);
            prop_assert!((p - at(&corners, shares)).norm() <= (p - sample).norm() + 1e-12);
        }
    }
}
