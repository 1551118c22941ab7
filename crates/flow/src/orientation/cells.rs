//! Cells of triangles, and averages over one-rings, for the orientations that fit rotations.

use std::ops::{AddAssign, Mul};

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::{FaceId, FaceMap, HalfedgeId, HalfedgeMesh, VertexId, VertexMap};
use cotan_laplacian::OneRings;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use crate::rest::Rest;

pub(crate) fn as_f64<T: Scalar>(v: Vector3<T>) -> Vector3<f64> {
    v.map(T::as_f64)
}

/// The three halfedges of a triangle.
pub(crate) fn triangle_halfedges(mesh: &HalfedgeMesh, face: FaceId) -> [HalfedgeId; 3] {
    let h = mesh.face_halfedge(face);
    [h, mesh.next(h), mesh.prev(h)]
}

/// Current and original vector along a halfedge.
pub(crate) fn edge_pair<T: Scalar>(
    rest: &Rest<'_, T>,
    positions: &Positions<T>,
    h: HalfedgeId,
) -> (Vector3<f64>, Vector3<f64>) {
    let (from, to) = (rest.mesh().origin(h), rest.mesh().target(h));
    (
        as_f64(positions[to] - positions[from]),
        as_f64(rest.positions()[to] - rest.positions()[from]),
    )
}

/// Σ_e cot_e e e⁰ᵀ over the three edges of every triangle.
///
/// The sum of cot_e |e|² over a triangle is its Dirichlet energy, never negative, whatever the
/// signs of the cotangents: a fit by these sums is safe where one by single edges with negative
/// weights is not.
pub(crate) fn face_covariances<T: Scalar>(
    rest: &Rest<'_, T>,
    positions: &Positions<T>,
) -> FaceMap<Matrix3<f64>> {
    let mesh = rest.mesh();
    let covariance = |f: usize| {
        let mut sum = Matrix3::zeros();
        for h in triangle_halfedges(mesh, FaceId::new(f)) {
            let (e, e0) = edge_pair(rest, positions, h);
            sum += e * (e0 * rest.cotangents()[h]).transpose();
        }
        sum
    };
    FaceMap::from_vec(
        (0..mesh.num_faces())
            .into_par_iter()
            .with_min_len(1 << 10)
            .map(covariance)
            .collect(),
    )
}

/// Sum over the triangles around a vertex.
pub(crate) fn ring_covariance(
    mesh: &HalfedgeMesh,
    faces: &FaceMap<Matrix3<f64>>,
    vertex: VertexId,
) -> Matrix3<f64> {
    mesh.vertex_faces(vertex).map(|f| faces[f]).sum()
}

/// (Ω a)_j = mean of a over j and its neighbours, `times` times.
pub(crate) fn average<A>(rings: &OneRings, values: &VertexMap<A>, times: usize) -> VertexMap<A>
where
    A: Copy + Send + Sync + AddAssign + Mul<f64, Output = A>,
{
    repeat(rings, values, times, |values, i| {
        let mut sum = values[i];
        for (j, _) in rings.ring(i) {
            sum += values[j.index()];
        }
        sum * cell_share(rings, i)
    })
}

/// (Ωᵀ a)_i = Σ_j a_j / (1 + valence j) over i and its neighbours, `times` times: the adjoint of
/// [`average`].
pub(crate) fn spread<A>(rings: &OneRings, values: &VertexMap<A>, times: usize) -> VertexMap<A>
where
    A: Copy + Send + Sync + AddAssign + Mul<f64, Output = A>,
{
    repeat(rings, values, times, |values, i| {
        let mut sum = values[i] * cell_share(rings, i);
        for (j, _) in rings.ring(i) {
            sum += values[j.index()] * cell_share(rings, j.index());
        }
        sum
    })
}

/// One part in the vertex and its neighbours.
pub(crate) fn cell_share(rings: &OneRings, i: usize) -> f64 {
    1.0 / (1 + rings.range(i).len()) as f64
}

fn repeat<A: Copy + Send + Sync>(
    rings: &OneRings,
    values: &VertexMap<A>,
    times: usize,
    row: impl Fn(&[A], usize) -> A + Sync + Send,
) -> VertexMap<A> {
    let once = |values: &VertexMap<A>| {
        (0..rings.num_vertices())
            .into_par_iter()
            .with_min_len(1 << 10)
            .map(|i| row(values.as_slice(), i))
            .collect()
    };
    if times == 0 {
        return values.clone();
    }
    let mut result = VertexMap::from_vec(once(values));
    for _ in 1..times {
        result = VertexMap::from_vec(once(&result));
    }
    result
}

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::icosphere;

    use super::*;

    fn values(n: usize, phase: f64) -> VertexMap<f64> {
        VertexMap::from_vec((0..n).map(|i| (1.7 * i as f64 + phase).sin()).collect())
    }

    #[test]
    fn spreading_is_the_adjoint_of_averaging() {
        let shape = icosphere::<f64>(2);
        let rings = OneRings::new(&shape.mesh);
        let (a, b) = (
            values(shape.positions.len(), 0.2),
            values(shape.positions.len(), 1.3),
        );
        let dot = |a: &VertexMap<f64>, b: &VertexMap<f64>| -> f64 {
            a.values().zip(b.values()).map(|(a, b)| a * b).sum()
        };
        for times in 0..3 {
            let left = dot(&average(&rings, &a, times), &b);
            let right = dot(&a, &spread(&rings, &b, times));
            assert!((left - right).abs() < 1e-12, "{left} {right}");
        }
    }

    #[test]
    fn the_mean_of_a_constant_is_the_constant() {
        let shape = icosphere::<f64>(1);
        let rings = OneRings::new(&shape.mesh);
        let mean = average(&rings, &VertexMap::filled(shape.positions.len(), 2.5), 2);
        assert!(mean.values().all(|m| (m - 2.5).abs() < 1e-14));
    }
}
