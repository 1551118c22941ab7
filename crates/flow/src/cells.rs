//! Averages over the neighbours of a vertex, for fitting rotations.

use cotan_geometry::Scalar;
use cotan_laplacian::Graph;
use nalgebra::Vector3;

use crate::four::{Four, Mat3};
use crate::passes::Pass;

pub(crate) fn as_f64<T: Scalar>(v: Vector3<T>) -> Vector3<f64> {
    v.map(T::as_f64)
}

/// (Ω a)_i for Ω the mean over a vertex and its neighbours, and (Ωᵀ a)_i where `a` holds shares.
pub(crate) struct Means<'a> {
    pub(crate) graph: &'a Graph,
    pub(crate) values: &'a [Mat3],
}

impl Means<'_> {
    /// The sum of the values of vertex `i` and its neighbours, times a factor.
    #[inline(always)]
    pub(crate) fn sum(&self, i: usize, factor: f64) -> Mat3 {
        let own = &self.values[i];
        let (mut a, mut b, mut c) = (Four::of_entries(own, 0), Four::of_entries(own, 4), own[8]);
        for j in &self.graph.neighbours()[self.graph.range(i)] {
            let value = &self.values[j.index()];
            a += Four::of_entries(value, 0);
            b += Four::of_entries(value, 4);
            c += value[8];
        }
        let (a, b) = (a * Four::all(factor), b * Four::all(factor));
        [
            a.0[0],
            a.0[1],
            a.0[2],
            a.0[3],
            b.0[0],
            b.0[1],
            b.0[2],
            b.0[3],
            c * factor,
        ]
    }

    /// The mean of the values of vertex `i` and its neighbours.
    #[inline(always)]
    pub(crate) fn mean(&self, i: usize) -> Mat3 {
        self.sum(i, cell_share(self.graph, i))
    }
}

impl Pass<Mat3, 0> for Means<'_> {
    #[inline(always)]
    fn on(&self, first: usize, entries: &mut [Mat3]) -> [f64; 0] {
        for (k, entry) in entries.iter_mut().enumerate() {
            *entry = self.mean(first + k);
        }
        []
    }
}

/// One part in the vertex and its neighbours.
#[inline(always)]
pub(crate) fn cell_share(graph: &Graph, i: usize) -> f64 {
    1.0 / (1 + graph.range(i).len()) as f64
}

/// The four entries from `at` on; the last again where there are fewer.
#[inline(always)]
pub(crate) fn four_of(entries: &[Mat3], at: usize) -> [Mat3; 4] {
    let last = entries.len() - 1;
    [
        entries[at.min(last)],
        entries[(at + 1).min(last)],
        entries[(at + 2).min(last)],
        entries[(at + 3).min(last)],
    ]
}
