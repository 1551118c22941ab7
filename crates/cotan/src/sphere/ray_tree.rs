//! A bounding-box tree over flat triangles, searched along a ray from the origin.
//!
//! Each node splits its triangles at the median along the longest side of its box, so the
//! structure of the tree depends only on their number: node k has the children 2k + 1 and 2k + 2.

use cotan_parallel as parallel;
use nalgebra::Vector3;

use super::locate::Search;

/// A bounding-box tree for rays from the origin.
#[derive(Clone, Debug)]
pub(crate) struct RayTree {
    /// The indices of the triangles, leaf by leaf.
    order: Vec<u32>,
    /// The boxes of the nodes, level by level.
    bounds: Vec<Bounds>,
    /// The number of levels above the leaves.
    depth: u32,
}

impl RayTree {
    /// Builds a tree of `len` triangles with these corners, or of any other objects that lie
    /// within the bounding box of three points.
    pub(crate) fn build(
        len: usize,
        corners: impl Fn(usize) -> [Vector3<f64>; 3] + Sync + Send,
    ) -> Self {
        let depth = (len / LEAF).max(1).ilog2();
        let mut boxes = parallel::filled(len, |i| (Bounds::around(&corners(i)), i as u32));
        sort(&mut boxes, depth);
        let mut tree = Self {
            order: boxes.iter().map(|&(_, i)| i).collect(),
            bounds: vec![Bounds::EMPTY; (2 << depth) - 1],
            depth,
        };
        for leaf in 0..1_usize << depth {
            let inside = &boxes[tree.range(leaf)];
            let bounds = inside.iter().fold(Bounds::EMPTY, |b, (x, _)| b.with(x));
            tree.bounds[(1 << depth) - 1 + leaf] = bounds.padded();
        }
        for node in (0..(1_usize << depth) - 1).rev() {
            tree.bounds[node] = tree.bounds[2 * node + 1].with(&tree.bounds[2 * node + 2]);
        }
        tree
    }

    /// Calls `found` for all triangles that a ray from the origin along the unit vector `d` may
    /// pierce, until `found` is done. Rounding may add triangles but never loses one.
    pub(crate) fn visit(&self, d: &Vector3<f64>, mut found: impl FnMut(usize) -> Search) {
        let first_leaf = (1_usize << self.depth) - 1;
        // At most one waiting sibling per level.
        let mut stack = [0_usize; 64];
        let mut waiting = 1;
        while waiting > 0 {
            waiting -= 1;
            let node = stack[waiting];
            if !self.bounds[node].is_hit(d) {
                continue;
            }
            if node < first_leaf {
                stack[waiting] = 2 * node + 2;
                stack[waiting + 1] = 2 * node + 1;
                waiting += 2;
                continue;
            }
            for &i in &self.order[self.range(node - first_leaf)] {
                if found(i as usize) == Search::Done {
                    return;
                }
            }
        }
    }

    /// The range of a leaf's triangles in `order`.
    fn range(&self, leaf: usize) -> std::ops::Range<usize> {
        let (mut start, mut len) = (0, self.order.len());
        for level in (0..self.depth).rev() {
            let left = len / 2;
            match leaf >> level & 1 {
                0 => len = left,
                _ => (start, len) = (start + left, len - left),
            }
        }
        start..start + len
    }
}

/// Partially sorts the boxes so that the leaves `depth` levels below contain their triangles.
fn sort(boxes: &mut [(Bounds, u32)], depth: u32) {
    if depth == 0 {
        return;
    }
    let all = boxes.iter().fold(Bounds::EMPTY, |b, (x, _)| b.with(x));
    let axis = (all.high - all.low).imax();
    let middle = boxes.len() / 2;
    boxes.select_nth_unstable_by(middle, |(a, i), (b, j)| {
        let centers = [a, b].map(|x| x.low[axis] + x.high[axis]);
        centers[0].total_cmp(&centers[1]).then(i.cmp(j))
    });
    let (left, right) = boxes.split_at_mut(middle);
    if left.len() < PARALLEL_FROM {
        sort(left, depth - 1);
        sort(right, depth - 1);
    } else {
        parallel::join(|| sort(left, depth - 1), || sort(right, depth - 1));
    }
}

/// An axis-aligned box.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    low: Vector3<f64>,
    high: Vector3<f64>,
}

impl Bounds {
    /// The bounding box of an empty set of points.
    const EMPTY: Self = Self {
        low: Vector3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
        high: Vector3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    fn around([a, b, c]: &[Vector3<f64>; 3]) -> Self {
        Self {
            low: a.inf(b).inf(c),
            high: a.sup(b).sup(c),
        }
    }

    fn with(&self, other: &Self) -> Self {
        Self {
            low: self.low.inf(&other.low),
            high: self.high.sup(&other.high),
        }
    }

    fn padded(&self) -> Self {
        Self {
            low: self.low.add_scalar(-PADDING),
            high: self.high.add_scalar(PADDING),
        }
    }

    /// Returns true if the ray from the origin along `d` meets the box.
    fn is_hit(&self, d: &Vector3<f64>) -> bool {
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for k in 0..3 {
            let (low, high) = (self.low[k], self.high[k]);
            if d[k] == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return false;
                }
                continue;
            }
            let (a, b) = (low / d[k], high / d[k]);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        enter <= leave
    }
}

/// The minimum number of triangles per leaf; there are at most twice as many.
const LEAF: usize = 4;
/// Below this number of triangles, waking another thread costs more than it saves.
const PARALLEL_FROM: usize = 1 << 12;
/// Coordinates are at most 1, so this exceeds all rounding errors in [`Bounds::is_hit`].
const PADDING: f64 = 4e-15;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_triangle_is_in_one_leaf_and_is_hit_by_its_directions() {
        for len in [1, 3, 4, 7, 8, 9, 1000] {
            let corners = |i: usize| {
                let angle = i as f64 * 2.4;
                let at = |turn: f64| Vector3::new((angle + turn).cos(), (angle + turn).sin(), turn);
                [at(0.0), at(0.1), at(0.2)]
            };
            let tree = RayTree::build(len, corners);
            let leaves = 0..1 << tree.depth;
            let mut seen: Vec<u32> = leaves
                .flat_map(|k| tree.order[tree.range(k)].to_vec())
                .collect();
            seen.sort_unstable();
            assert_eq!(seen, (0..len as u32).collect::<Vec<_>>());
            for i in 0..len {
                let d = corners(i).iter().sum::<Vector3<f64>>().normalize();
                let mut found = false;
                tree.visit(&d, |j| {
                    found |= i == j;
                    Search::On
                });
                assert!(found);
            }
        }
    }

    #[test]
    fn a_ray_that_starts_towards_the_other_side_does_not_hit() {
        let bounds = Bounds::around(&[
            Vector3::new(0.5, -0.1, -0.1),
            Vector3::x(),
            Vector3::new(0.9, 0.1, 0.1),
        ]);
        assert!(bounds.is_hit(&Vector3::x()));
        assert!(!bounds.is_hit(&-Vector3::x()));
        assert!(!bounds.is_hit(&Vector3::y()));
    }
}
