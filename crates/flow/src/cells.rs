//! Cells of triangles, and averages over one-rings, for fitting rotations.

use cotan_geometry::Scalar;
use cotan_halfedge::{HalfedgeId, HalfedgeMap};
use cotan_laplacian::{Graph, OneRings};
use cotan_parallel as parallel;
use nalgebra::Vector3;

use crate::four::{Four, Mat3};
use crate::passes::Pass;
use crate::rest::Rest;

pub(crate) fn as_f64<T: Scalar>(v: Vector3<T>) -> Vector3<f64> {
    v.map(T::as_f64)
}

/// g_ij of every halfedge i→j:
///
/// ```text
/// g_ij = − Σ_{T at the edge ij} (cot_ij (x⁰_j − x⁰_i) + cot_ik (x⁰_k − x⁰_i))
/// ```
///
/// with k the third corner of T and cot the cotangent of the angle opposite an edge in T: the
/// gradient at i of the energy of the two triangles at the edge. With them sums over triangles are
/// sums over neighbours:
///
/// ```text
/// Σ_{T at i} Σ_{e in T} cot_e e e⁰ᵀ = Σ_j (x_j − x_i) g_jiᵀ
/// ```
///
/// The sum of cot_e |e|² over a triangle is its Dirichlet energy, never negative, whatever the
/// signs of the cotangents: a fit by these sums is safe where one by single edges with negative
/// weights is not.
pub(crate) fn edge_gradients<T: Scalar>(rest: &Rest<T>) -> HalfedgeMap<Vector3<f64>> {
    let (mesh, cotangents) = (rest.mesh(), rest.cotangents());
    let surface = rest.surface();
    let x = surface.positions();
    let edge = |h: HalfedgeId| as_f64(x[mesh.target(h)] - x[mesh.origin(h)]) * cotangents[h];
    let mut out = HalfedgeMap::filled(mesh.num_halfedges(), Vector3::zeros());
    parallel::fill(out.as_mut_slice(), |i| {
        // A boundary halfedge has no triangle, and cotangent 0.
        let h = HalfedgeId::new(i);
        let twin = h.twin();
        let mut sum = edge(twin) - edge(h);
        if !mesh.is_boundary_halfedge(h) {
            sum += edge(mesh.prev(h));
        }
        if !mesh.is_boundary_halfedge(twin) {
            sum -= edge(mesh.next(twin));
        }
        sum
    });
    out
}

/// In the order of the rings, for every halfedge h the value of `of(h)`, times a factor. Where
/// several halfedges lead to a neighbour, the sum.
pub(crate) fn in_rows(
    rings: &OneRings,
    values: &HalfedgeMap<Vector3<f64>>,
    factor: f64,
    of: impl Fn(HalfedgeId) -> HalfedgeId + Sync,
) -> Vec<[f64; 3]> {
    let mut out = vec![[0.0; 3]; rings.graph().num_entries()];
    if rings.is_shared() {
        parallel::fill(&mut out, |k| {
            let values = rings.halfedges_of(k).iter().map(|h| values[of(*h)]);
            (values.sum::<Vector3<f64>>() * factor).into()
        });
    } else {
        let halfedges = rings.halfedges();
        parallel::fill(&mut out, |k| (values[of(halfedges[k])] * factor).into());
    }
    out
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
