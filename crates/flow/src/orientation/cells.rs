//! Cells of triangles, and averages over one-rings, for the orientations that fit rotations.

use cotan_geometry::Scalar;
use cotan_halfedge::{HalfedgeId, HalfedgeMap};
use cotan_laplacian::OneRings;
use nalgebra::Vector3;

use crate::polar::Mat3;
use crate::rest::Rest;
use crate::vectors::fill;

pub(crate) fn as_f64<T: Scalar>(v: Vector3<T>) -> Vector3<f64> {
    v.map(T::as_f64)
}

/// g_ij of every halfedge i→j:
///
/// ```text
/// g_ij = − Σ_{T at the edge ij} (cot_ij (x⁰_j − x⁰_i) + cot_ik (x⁰_k − x⁰_i))
/// ```
///
/// with k the third corner of T and cot the cotangent of the angle opposite an edge in T: the gradient
/// at i of the energy of the two triangles at the edge. With them sums over triangles are sums over
/// neighbours:
///
/// ```text
/// Σ_{T at i} Σ_{e in T} cot_e e e⁰ᵀ = Σ_j (x_j − x_i) g_jiᵀ
/// ```
///
/// The sum of cot_e |e|² over a triangle is its Dirichlet energy, never negative, whatever the
/// signs of the cotangents: a fit by these sums is safe where one by single edges with negative
/// weights is not.
pub(crate) fn edge_gradients<T: Scalar>(rest: &Rest<'_, T>) -> HalfedgeMap<Vector3<f64>> {
    let (mesh, cotangents, x) = (rest.mesh(), rest.cotangents(), rest.positions());
    let edge = |h: HalfedgeId| as_f64(x[mesh.target(h)] - x[mesh.origin(h)]) * cotangents[h];
    let mut out = HalfedgeMap::filled(mesh.num_halfedges(), Vector3::zeros());
    fill(out.as_mut_slice(), |i| {
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

/// In the order of the rings, for every halfedge h the value of `of(h)`, times a factor.
pub(crate) fn in_rows(
    rings: &OneRings,
    values: &HalfedgeMap<Vector3<f64>>,
    factor: f64,
    of: impl Fn(HalfedgeId) -> HalfedgeId + Sync,
) -> Vec<[f64; 3]> {
    let halfedges = rings.halfedges();
    let mut out = vec![[0.0; 3]; halfedges.len()];
    fill(&mut out, |k| (values[of(halfedges[k])] * factor).into());
    out
}

/// m += a bᵀ.
#[inline]
pub(crate) fn add_outer(m: &mut Mat3, a: &Vector3<f64>, b: &[f64; 3]) {
    for c in 0..3 {
        for r in 0..3 {
            m[3 * c + r] += a[r] * b[c];
        }
    }
}

/// m v.
#[inline]
pub(crate) fn turned(m: &Mat3, v: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(
        m[0] * v.x + m[3] * v.y + m[6] * v.z,
        m[1] * v.x + m[4] * v.y + m[7] * v.z,
        m[2] * v.x + m[5] * v.y + m[8] * v.z,
    )
}

/// Sum of `values` over i and its neighbours.
#[inline]
pub(crate) fn cell_sum(rings: &OneRings, values: &[Mat3], i: usize) -> Mat3 {
    let mut sum = values[i];
    for j in &rings.neighbours()[rings.range(i)] {
        let value = &values[j.index()];
        for k in 0..9 {
            sum[k] += value[k];
        }
    }
    sum
}

/// One part in the vertex and its neighbours.
#[inline]
pub(crate) fn cell_share(rings: &OneRings, i: usize) -> f64 {
    1.0 / (1 + rings.range(i).len()) as f64
}
