//! The current mesh, as updaters, orientations and energies see it.

use std::borrow::Cow;

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::VertexMap;
use nalgebra::{Matrix3, Vector3};

use crate::current::Current;
use crate::error::FlowError;
use crate::rest::Rest;

/// The current mesh, in box units.
///
/// Quantities have one entry per row, which is a vertex unless the mesh was cut into pieces: see
/// [`Rest`]. Then [`Self::normals`] and [`Self::area_vectors`] are sums over pieces that may be
/// oriented differently; a rule that needs them checks
/// [`has_copies`](cotan_halfedge::HalfedgeMesh::has_copies) or
/// [`is_shared_vertex`](cotan_halfedge::HalfedgeMesh::is_shared_vertex).
///
/// A quantity is computed on its first use, once per shape, and shared by all threads. Using
/// [`Self::laplacian`] before the others saves a pass.
#[derive(Clone, Copy, Debug)]
pub struct FlowState<'a, T: Scalar> {
    rest: &'a Rest<T>,
    current: &'a Current<T>,
    iteration: usize,
    first_rotations: Option<&'a VertexMap<Matrix3<f64>>>,
}

impl<'a, T: Scalar> FlowState<'a, T> {
    pub(crate) fn new(
        rest: &'a Rest<T>,
        current: &'a Current<T>,
        iteration: usize,
        first_rotations: Option<&'a VertexMap<Matrix3<f64>>>,
    ) -> Self {
        Self {
            rest,
            current,
            iteration,
            first_rotations,
        }
    }

    /// The original mesh.
    pub fn rest(&self) -> &'a Rest<T> {
        self.rest
    }

    /// The number of solves before this state.
    pub fn iteration(&self) -> usize {
        self.iteration
    }

    /// The current positions, in box units.
    pub fn positions(&self) -> &'a Positions<T> {
        self.current.positions()
    }

    /// The current positions per vertex of the mesh, for a
    /// [`Surface`](cotan_geometry::Surface): those of [`Self::positions`], which has one per row,
    /// repeated for copies of vertices.
    pub fn vertex_positions(&self) -> Cow<'a, Positions<T>> {
        self.current.of_vertices(self.rest)
    }

    /// ℓ = L(v)v with the weights of the *current* mesh.
    ///
    /// # Errors
    /// Errors of the scheme on the current mesh.
    pub fn laplacian(&self) -> Result<&'a VertexMap<Vector3<T>>, FlowError> {
        self.current.laplacian(self.rest)
    }

    /// L⁰v: the operator of the *original* mesh at the current positions, in double precision.
    pub fn rest_laplacian(&self) -> &'a VertexMap<Vector3<f64>> {
        self.current.rest_laplacian(self.rest)
    }

    /// Unit vertex normals, area weighted; zero where undefined.
    pub fn normals(&self) -> &'a VertexMap<Vector3<T>> {
        self.current.normals(self.rest)
    }

    /// Sums of the triangle areas around each vertex.
    pub fn areas(&self) -> &'a VertexMap<T> {
        &self.current.sums(self.rest).areas
    }

    /// Sums of the area vectors of the triangles around each vertex; on a closed mesh they sum to
    /// zero.
    pub fn area_vectors(&self) -> &'a VertexMap<Vector3<T>> {
        &self.current.sums(self.rest).area_vectors
    }

    /// A first guess of the rotation of every vertex: for the first orientation of a flow that
    /// starts from rotated handles ([`crate::Start::HandleRotations`]); `None` later.
    pub fn first_rotations(&self) -> Option<&'a VertexMap<Matrix3<f64>>> {
        self.first_rotations
    }

    /// Runs a pass that writes L⁰v on its way: see [`Self::rest_laplacian`].
    pub(crate) fn fuse_rest_laplacian<R>(&self, pass: impl FnOnce(&mut [Vector3<f64>]) -> R) -> R {
        self.current.fuse_rest_laplacian(pass)
    }
}

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::torus;
    use cotan_geometry::{one_ring_areas, vertex_normals};
    use cotan_laplacian::{Cotangent, Operator, Tutte};

    use super::*;

    /// After the positions were written no quantity of an earlier shape is read, in any order of
    /// use.
    #[test]
    fn quantities_are_those_of_the_positions_as_they_are() {
        let shape = torus::<f64>(1.0, 0.4, 12, 7);
        for is_cotangent in [true, false] {
            let rest = if is_cotangent {
                Rest::new(
                    shape.connectivity(),
                    shape.positions(),
                    Cotangent::default(),
                )
            } else {
                Rest::new(shape.connectivity(), shape.positions(), Tutte)
            };
            let rest = rest.unwrap();
            let mut current = Current::new(rest.positions().clone());
            for round in 0..3 {
                let bend = 0.3 * f64::from(round);
                for p in current.write().values_mut() {
                    p.z += bend * p.x * p.y;
                }
                let state = FlowState::new(&rest, &current, 0, None);
                if round != 1 {
                    let _ = state.normals();
                }
                let surface = shape.surface();
                let surface = surface.with_positions(state.positions());
                let operator = if is_cotangent {
                    Operator::assemble(&Cotangent::default(), &surface)
                } else {
                    Operator::assemble(&Tutte, &surface)
                };
                let operator = operator.unwrap();
                let (areas, normals) = (one_ring_areas(&surface), vertex_normals(&surface));
                let laplacian = state.laplacian().unwrap();
                for v in shape.connectivity().vertices() {
                    let ell = operator.apply_at(state.positions(), v.index());
                    assert!((laplacian[v] - ell).norm() < 1e-12);
                    let ell = rest.operator().apply_at(state.positions(), v.index());
                    assert_eq!(state.rest_laplacian()[v], ell);
                    assert!((state.areas()[v] - areas[v]).abs() < 1e-14);
                    assert!((state.normals()[v] - normals[v]).norm() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn several_threads_may_ask_at_once() {
        let shape = torus::<f64>(1.0, 0.4, 40, 30);
        let rest = Rest::new(
            shape.connectivity(),
            shape.positions(),
            Cotangent::default(),
        )
        .unwrap();
        let current = Current::new(rest.positions().clone());
        let state = FlowState::new(&rest, &current, 0, None);
        let n = shape.positions().len();
        let lengths = cotan_parallel::filled(n, |i| {
            let laplacian = state.laplacian().unwrap().as_slice();
            laplacian[i].norm() + state.normals().as_slice()[i].norm()
        });
        let expected = |i: usize| {
            let ell = state.laplacian().unwrap().as_slice()[i].norm();
            ell + state.normals().as_slice()[i].norm()
        };
        assert!((0..n).all(|i| lengths[i] == expected(i)));
    }
}
