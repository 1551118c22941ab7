//! What the flow remembers of the original mesh.

use std::sync::Arc;

use cotan_geometry::{Positions, Scalar, Surface, one_ring_areas, vertex_normals};
use cotan_halfedge::{HalfedgeMesh, VertexMap};
use cotan_laplacian::{OneRings, Operator};
use nalgebra::Vector3;

/// The original mesh in box units (its bounding box has its lower corner at 0 and longest side 1),
/// and its Laplacian coordinates split into what the orientations need.
#[derive(Debug)]
pub struct Rest<'m, T: Scalar> {
    mesh: &'m HalfedgeMesh,
    operator: Operator<T>,
    positions: Positions<T>,
    laplacian: VertexMap<Vector3<T>>,
    magnitudes: VertexMap<T>,
    normals: VertexMap<Vector3<T>>,
    areas: VertexMap<T>,
    /// Half the symmetrised weight of each edge, in ring order: the membrane's stiffness.
    stiffness: Vec<f64>,
    diagonal: T,
}

impl<'m, T: Scalar> Rest<'m, T> {
    pub(crate) fn new(
        mesh: &'m HalfedgeMesh,
        positions: Positions<T>,
        operator: Operator<T>,
        diagonal: T,
    ) -> Result<Self, cotan_geometry::SurfaceError> {
        let n = mesh.num_vertices();
        let surface = Surface::new(mesh, &positions)?;
        let mut laplacian = VertexMap::filled(n, Vector3::zeros());
        operator.apply(&positions, &mut laplacian);
        let magnitudes = laplacian.map(|ell| ell.norm());
        let normals = vertex_normals(&surface);
        let areas = one_ring_areas(&surface);
        let weights = operator.weights();
        let stiffness = operator
            .rings()
            .halfedges()
            .iter()
            .map(|&h| 0.25 * (weights[h].as_f64() + weights[h.twin()].as_f64()))
            .collect();
        Ok(Self {
            mesh,
            operator,
            positions,
            laplacian,
            magnitudes,
            normals,
            areas,
            stiffness,
            diagonal,
        })
    }

    /// The mesh with its original positions, in box units.
    pub fn surface(&self) -> Surface<'_, T> {
        Surface::assume_checked(self.mesh, &self.positions)
    }

    /// The connectivity.
    pub fn mesh(&self) -> &'m HalfedgeMesh {
        self.mesh
    }

    /// The operator of the original mesh, L⁰.
    pub fn operator(&self) -> &Operator<T> {
        &self.operator
    }

    /// The one-rings, for sums over neighbours.
    pub fn rings(&self) -> &Arc<OneRings> {
        self.operator.rings()
    }

    /// The original positions, in box units.
    pub fn positions(&self) -> &Positions<T> {
        &self.positions
    }

    /// The original Laplacian coordinates ℓ⁰, in box units.
    pub fn laplacian(&self) -> &VertexMap<Vector3<T>> {
        &self.laplacian
    }

    /// The original scalar field |ℓ⁰|, in box units.
    pub fn magnitudes(&self) -> &VertexMap<T> {
        &self.magnitudes
    }

    /// The original unit vertex normals N⁰ (zero where undefined).
    pub fn normals(&self) -> &VertexMap<Vector3<T>> {
        &self.normals
    }

    /// The original areas A⁰: sums over the triangles around each vertex, in box units squared.
    pub fn areas(&self) -> &VertexMap<T> {
        &self.areas
    }

    /// Diagonal of the bounding box, in box units (between 1 and √3).
    pub fn diagonal(&self) -> T {
        self.diagonal
    }

    /// Neighbours of vertex number `i` with their place in the ring order.
    pub(crate) fn ring(&self, i: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        let neighbours = self.rings().neighbours();
        self.rings().range(i).map(|k| (k, neighbours[k].index()))
    }

    /// Half the symmetrised weight of each edge, in ring order.
    pub(crate) fn stiffness(&self) -> &[f64] {
        &self.stiffness
    }

    /// (L⁰x)_i, in double precision.
    pub(crate) fn apply_operator(&self, positions: &Positions<T>, i: usize) -> Vector3<f64> {
        let x = positions.as_slice();
        let mut sum = Vector3::zeros();
        for (j, h) in self.rings().ring(i) {
            sum += (x[j.index()] - x[i]).map(T::as_f64) * self.operator.weights()[h].as_f64();
        }
        sum
    }
}
