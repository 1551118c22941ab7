//! The edges of a mesh with their lengths, and distances along them.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use cotan_geometry::Scalar;
use cotan_laplacian::Graph;
use nalgebra::Vector3;

use crate::cells::as_f64;
use crate::rest::Rest;

/// The edges with their lengths.
pub(crate) struct Net<'a> {
    pub(crate) graph: &'a Graph,
    /// The original positions.
    pub(crate) points: Vec<Vector3<f64>>,
    /// The length of every entry of the graph.
    lengths: Vec<f64>,
}

impl<'a> Net<'a> {
    pub(crate) fn new<T: Scalar>(rest: &'a Rest<T>) -> Self {
        let points = rest.positions().values();
        let points: Vec<Vector3<f64>> = points.map(|p| as_f64(p.coords)).collect();
        let graph = rest.graph();
        let lengths_of = |i: usize| {
            let at = points[i];
            graph.row(i).map({
                let points = &points;
                move |(j, _)| (points[j.index()] - at).norm()
            })
        };
        let lengths = (0..points.len()).flat_map(lengths_of).collect();
        Self {
            graph,
            points,
            lengths,
        }
    }

    /// The neighbours of a vertex and the lengths of the edges to them.
    fn edges(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let row = self.graph.row(i);
        row.map(|(j, k)| (j.index(), self.lengths[k]))
    }

    pub(crate) fn neighbours(&self, i: usize) -> impl Iterator<Item = usize> + '_ {
        self.graph.neighbours()[self.graph.range(i)]
            .iter()
            .map(|j| j.index())
    }

    pub(crate) fn length(&self, i: usize, j: usize) -> f64 {
        (self.points[j] - self.points[i]).norm()
    }
}

/// Lengths of the shortest ways along the edges from the nearest of several sources.
pub(crate) struct Distances {
    of_vertex: Vec<f64>,
    pub(crate) source: Vec<u32>,
    waiting: BinaryHeap<Waiting>,
    /// Vertices farther away than this are not reached.
    limit: f64,
    reached: Vec<u32>,
    /// The first so many of the reached vertices, the farthest first. Distances only shrink, so an
    /// entry is an upper bound.
    far: BinaryHeap<Far>,
    num_far: usize,
}

/// A vertex and an upper bound of its distance.
#[derive(PartialEq)]
struct Far(f64, u32);

impl Eq for Far {}

impl PartialOrd for Far {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Far {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0).then(other.1.cmp(&self.1))
    }
}

/// A vertex and its distance, the nearest first.
#[derive(PartialEq)]
struct Waiting(f64, u32);

impl Eq for Waiting {}

impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Waiting {
    fn cmp(&self, other: &Self) -> Ordering {
        other.0.total_cmp(&self.0).then(other.1.cmp(&self.1))
    }
}

impl Distances {
    pub(crate) fn new(n: usize) -> Self {
        Self::within(n, f64::INFINITY)
    }

    /// Distances of at most `limit`.
    pub(crate) fn within(n: usize, limit: f64) -> Self {
        Self {
            of_vertex: vec![f64::INFINITY; n],
            source: vec![u32::MAX; n],
            waiting: BinaryHeap::new(),
            limit,
            reached: Vec::new(),
            far: BinaryHeap::new(),
            num_far: 0,
        }
    }

    /// Removes all sources.
    pub(crate) fn clear(&mut self) {
        for i in self.reached.drain(..) {
            self.of_vertex[i as usize] = f64::INFINITY;
            self.source[i as usize] = u32::MAX;
        }
        self.far.clear();
        self.num_far = 0;
    }

    /// The vertices that were reached, in no particular order, and their distances.
    pub(crate) fn reached(&self) -> impl Iterator<Item = (u32, f64)> + '_ {
        let distance = |i: &u32| (*i, self.of_vertex[*i as usize]);
        self.reached.iter().map(distance)
    }

    /// Adds sources.
    pub(crate) fn spread(&mut self, net: &Net<'_>, sources: impl IntoIterator<Item = usize>) {
        for source in sources {
            if self.of_vertex[source].is_infinite() {
                self.reached.push(source as u32);
            }
            self.of_vertex[source] = 0.0;
            self.source[source] = source as u32;
            self.waiting.push(Waiting(0.0, source as u32));
        }
        while let Some(Waiting(distance, i)) = self.waiting.pop() {
            let i = i as usize;
            if distance > self.of_vertex[i] {
                continue;
            }
            for (j, length) in net.edges(i) {
                let beyond = distance + length;
                let known = self.of_vertex[j];
                if beyond < known && beyond <= self.limit {
                    if known.is_infinite() {
                        self.reached.push(j as u32);
                    }
                    self.of_vertex[j] = beyond;
                    if beyond < known * (1.0 - TIE) {
                        self.source[j] = self.source[i];
                    }
                    self.waiting.push(Waiting(beyond, j as u32));
                }
            }
        }
    }

    /// The vertex that is farthest from all sources and can be reached from one; of several that
    /// are as far but for rounding the lowest.
    ///
    /// A scan of all vertices for each of hundreds of sources would take longer than the distances.
    pub(crate) fn farthest(&mut self) -> Option<(usize, f64)> {
        let added = self.reached[self.num_far..].iter();
        self.far
            .extend(added.map(|&i| Far(self.of_vertex[i as usize], i)));
        self.num_far = self.reached.len();
        let mut most = 0.0;
        let mut ties = Vec::new();
        while let Some(Far(bound, i)) = self.far.pop() {
            let distance = self.of_vertex[i as usize];
            if distance < bound {
                self.far.push(Far(distance, i));
                continue;
            }
            if ties.is_empty() {
                most = distance;
            }
            let is_farthest = distance >= most * (1.0 - TIE);
            ties.push(Far(distance, i));
            if !is_farthest || most == 0.0 {
                break;
            }
        }
        let is_farthest = |tie: &&Far| tie.0 >= most * (1.0 - TIE);
        let lowest = ties.iter().filter(is_farthest).map(|tie| tie.1).min();
        self.far.extend(ties);
        (most > 0.0).then_some((lowest? as usize, most))
    }
}

/// Lengths that differ by less, of themselves, are the same: what is decided by them does not
/// depend on how a mesh is turned or scaled.
const TIE: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::{icosphere, torus};
    use cotan_laplacian::Cotangent;

    use super::*;

    /// The same vertices as by a scan of all distances, on shapes with many ties.
    #[test]
    fn the_farthest_vertex_is_that_of_a_scan() {
        for shape in [icosphere::<f64>(3), torus(1.0, 0.3, 24, 12)] {
            let rest = Rest::new(
                shape.connectivity(),
                shape.positions(),
                Cotangent::default(),
            )
            .unwrap();
            let net = Net::new(&rest);
            let mut distances = Distances::new(shape.positions().len());
            distances.spread(&net, [5]);
            for _ in 0..100 {
                let all = &distances.of_vertex;
                let most = all.iter().copied().fold(0.0, f64::max);
                let expected = all.iter().position(|d| *d >= most * (1.0 - TIE)).unwrap();
                let (found, distance) = distances.farthest().unwrap();
                assert_eq!((found, distance), (expected, most));
                distances.spread(&net, [found]);
            }
            let n = shape.positions().len();
            distances.spread(&net, 0..n);
            assert_eq!(distances.farthest(), None);
        }
    }
}
