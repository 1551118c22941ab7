//! Boundary vertices: their one-ring sum is not along the normal, so its rest components are
//! carried by a frame of normal and boundary direction.

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::{HalfedgeMesh, VertexId, VertexMap};
use nalgebra::{Matrix3, Vector3};

use crate::rest::Rest;

/// Components of ℓ⁰ at the boundary vertices in the frame (N, N × τ, τ), τ the direction from the
/// previous to the next boundary vertex, made tangential.
#[derive(Debug)]
pub(crate) struct BoundaryFrames<T> {
    components: VertexMap<Option<Vector3<T>>>,
}

impl<T: Scalar> BoundaryFrames<T> {
    /// Measures the components on the original mesh.
    pub(crate) fn new(rest: &Rest<T>) -> Self {
        let components = VertexMap::from_fn(rest.mesh().num_vertices(), |v| {
            let frame = frame(rest.mesh(), rest.positions(), rest.normals()[v], v)?;
            Some(frame.tr_mul(&rest.laplacian()[v]))
        });
        Self { components }
    }

    /// ℓ⁰ of a boundary vertex, carried to the current frame; `None` for an interior vertex or one
    /// whose frame is degenerate.
    pub(crate) fn carry(
        &self,
        mesh: &HalfedgeMesh,
        positions: &Positions<T>,
        normal: Vector3<T>,
        vertex: VertexId,
    ) -> Option<Vector3<T>> {
        let components = self.components.get(vertex).copied().flatten()?;
        Some(frame(mesh, positions, normal, vertex)? * components)
    }
}

/// Columns N, N × τ, τ.
fn frame<T: Scalar>(
    mesh: &HalfedgeMesh,
    positions: &Positions<T>,
    normal: Vector3<T>,
    vertex: VertexId,
) -> Option<Matrix3<T>> {
    let h = mesh.vertex_halfedge(vertex);
    if !mesh.is_boundary_halfedge(h) {
        return None;
    }
    let along = positions[mesh.target(h)] - positions[mesh.origin(mesh.prev(h))];
    let tangent = along - normal * along.dot(&normal);
    let length = tangent.norm();
    if !(length > T::zero() && normal.norm_squared() > T::zero()) {
        return None;
    }
    let tangent = tangent / length;
    Some(Matrix3::from_columns(&[
        normal,
        normal.cross(&tangent),
        tangent,
    ]))
}
