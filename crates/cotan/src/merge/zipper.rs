//! A strip of triangles between two polygons.

use nalgebra::Point3;

/// Triangles between two closed polygons that run the same way, and the rungs between them.
pub(super) struct Strip {
    /// The edges across the strip as (index in the first, index in the second), in order. Both
    /// indices grow; they wrap once around.
    pub(super) rungs: Vec<[usize; 2]>,
}

/// A triangle of a strip.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Triangle {
    /// An edge of the first polygon, `[from, to]`, and a vertex of the second.
    OnFirst([usize; 2], usize),
    /// A vertex of the first polygon, and an edge of the second, `[from, to]`.
    OnSecond(usize, [usize; 2]),
}

impl Strip {
    /// The strip whose rungs have the least sum of squared lengths, among those that begin with a
    /// rung between the first vertex of `first` and a vertex of `second` at most three places from
    /// the one closest to it.
    ///
    /// Dynamic programming over the pairs of vertices: m n steps per start, and as many bits of
    /// memory.
    pub(super) fn between(first: &[Point3<f64>], second: &[Point3<f64>]) -> Self {
        let n = second.len();
        let distance = |j: usize| (second[j] - first[0]).norm_squared();
        let nearest = (0..n).min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
        let nearest = nearest.unwrap_or(0);
        let reach = STARTS.min((n - 1) / 2);
        let starts = (0..=2 * reach).map(|k| (nearest + n + k - reach) % n);
        let costs = starts.map(|start| (cheapest(first, second, start, &mut ()), start));
        let best = costs.min_by(|a, b| a.0.total_cmp(&b.0));
        let start = best.map_or(nearest, |(_, start)| start);
        let mut steps = Steps::new(first.len(), n);
        cheapest(first, second, start, &mut steps);
        Self {
            rungs: steps.rungs(start),
        }
    }

    /// The triangles between consecutive rungs.
    pub(super) fn triangles(&self) -> impl Iterator<Item = Triangle> {
        let count = self.rungs.len();
        (0..count).map(move |k| {
            let [[i, j], [next_i, next_j]] = [self.rungs[k], self.rungs[(k + 1) % count]];
            if i == next_i {
                Triangle::OnSecond(i, [j, next_j])
            } else {
                Triangle::OnFirst([i, next_i], j)
            }
        })
    }
}

/// Receives, for each pair, whether its cheapest path comes along the first polygon.
trait Record {
    fn came_along_first(&mut self, i: usize, j: usize, yes: bool);
}

impl Record for () {
    fn came_along_first(&mut self, _: usize, _: usize, _: bool) {}
}

/// One bit for each pair of vertices, both ends included.
struct Steps {
    size: [usize; 2],
    bits: Vec<u64>,
}

impl Steps {
    fn new(m: usize, n: usize) -> Self {
        Self {
            size: [m, n],
            bits: vec![0; ((m + 1) * (n + 1)).div_ceil(64)],
        }
    }

    fn place(&self, i: usize, j: usize) -> (usize, u64) {
        let k = i * (self.size[1] + 1) + j;
        (k / 64, 1 << (k % 64))
    }

    /// Follows the path back from the end, where both polygons have been walked around.
    fn rungs(&self, start: usize) -> Vec<[usize; 2]> {
        let [m, n] = self.size;
        let (mut i, mut j) = (m, n);
        let mut rungs = Vec::with_capacity(m + n);
        while (i, j) != (0, 0) {
            let (word, bit) = self.place(i, j);
            if self.bits[word] & bit != 0 {
                i -= 1;
            } else {
                j -= 1;
            }
            rungs.push([i % m, (start + j) % n]);
        }
        rungs.reverse();
        rungs
    }
}

impl Record for Steps {
    fn came_along_first(&mut self, i: usize, j: usize, yes: bool) {
        if yes {
            let (word, bit) = self.place(i, j);
            self.bits[word] |= bit;
        }
    }
}

/// The sum of squared lengths of all rungs but the first.
fn cheapest(
    first: &[Point3<f64>],
    second: &[Point3<f64>],
    start: usize,
    record: &mut impl Record,
) -> f64 {
    let (m, n) = (first.len(), second.len());
    // costs[j]: the cheapest path to (i, j), one row at a time.
    let mut costs = vec![0.0; n + 1];
    for i in 0..=m {
        for j in 0..=n {
            if i + j == 0 {
                continue;
            }
            let rung = (second[(start + j) % n] - first[i % m]).norm_squared();
            let along_first = if i > 0 { costs[j] } else { f64::INFINITY };
            let along_second = if j > 0 { costs[j - 1] } else { f64::INFINITY };
            let came_along_first = along_first <= along_second;
            record.came_along_first(i, j, came_along_first);
            costs[j] = rung + along_first.min(along_second);
        }
    }
    costs[n]
}

/// On either side of the closest vertex.
const STARTS: usize = 3;

#[cfg(test)]
mod tests {
    use super::*;

    fn circle(count: usize, turn: f64, z: f64) -> Vec<Point3<f64>> {
        let angle = |k| std::f64::consts::TAU * k as f64 / count as f64 + turn;
        (0..count)
            .map(|k| Point3::new(angle(k).cos(), angle(k).sin(), z))
            .collect()
    }

    #[test]
    fn every_edge_of_both_circles_has_one_triangle() {
        for (m, n) in [(3, 3), (12, 12), (7, 30), (40, 5)] {
            let (first, second) = (circle(m, 0.0, 0.0), circle(n, 1.0, 0.3));
            let strip = Strip::between(&first, &second);
            assert_eq!(strip.rungs.len(), m + n);
            let mut used = (vec![0; m], vec![0; n]);
            for triangle in strip.triangles() {
                match triangle {
                    Triangle::OnFirst([i, next], _) => {
                        assert_eq!(next, (i + 1) % m);
                        used.0[i] += 1;
                    }
                    Triangle::OnSecond(_, [j, next]) => {
                        assert_eq!(next, (j + 1) % n);
                        used.1[j] += 1;
                    }
                }
            }
            assert!(used.0.into_iter().chain(used.1).all(|count| count == 1));
        }
    }

    #[test]
    fn equal_circles_are_joined_by_straight_rungs_and_one_diagonal_each() {
        let (first, second) = (circle(16, 0.0, 0.0), circle(16, 0.0, 0.2));
        let strip = Strip::between(&first, &second);
        let straight = strip.rungs.iter().filter(|[i, j]| i == j).count();
        assert_eq!(straight, 16);
    }
}
