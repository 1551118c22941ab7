//! What the flow remembers of the original mesh.

use std::sync::Arc;

use cotan_geometry::{
    Positions, Scalar, Surface, one_ring_areas, surface_centroid, vertex_normals,
};
use cotan_halfedge::{EdgeId, EdgeMap, HalfedgeMap, HalfedgeMesh, VertexMap};
use cotan_laplacian::{Cotangent, OneRings, Operator};
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
    /// Cotangent of the angle opposite each halfedge, 0 on the boundary.
    cotangents: HalfedgeMap<f64>,
    /// Half the cotangent weight of each edge: the membrane's stiffness.
    stiffness: EdgeMap<f64>,
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
        let mut cotangents = HalfedgeMap::filled(mesh.num_halfedges(), T::zero());
        Cotangent::default().opposite_cotangents(&surface, &mut cotangents);
        let cotangents = cotangents.map(|c| c.as_f64());
        let stiffness = EdgeMap::from_fn(mesh.num_edges(), |e: EdgeId| {
            let [h, twin] = e.halfedges();
            0.5 * (cotangents[h] + cotangents[twin])
        });
        Ok(Self {
            mesh,
            operator,
            positions,
            laplacian,
            magnitudes,
            normals,
            areas,
            cotangents,
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

    /// Cotangent of the angle opposite each halfedge, 0 on the boundary.
    pub(crate) fn cotangents(&self) -> &HalfedgeMap<f64> {
        &self.cotangents
    }

    /// Half the cotangent weight of each edge, whatever the scheme: the stiffness of the membrane.
    pub fn stiffness(&self) -> &EdgeMap<f64> {
        &self.stiffness
    }

    /// Twice the greatest distance of a vertex from the surface's centroid: a length of about the
    /// box's longest side that does not change when the mesh is turned.
    pub(crate) fn extent(&self) -> f64 {
        let center = surface_centroid(&self.surface());
        let farthest = self
            .positions
            .values()
            .map(|p| (p - center).norm().as_f64());
        2.0 * farthest.fold(0.0, f64::max)
    }

    /// Mean over the vertices of |Σ_j w_ij| for cotangent weights.
    pub(crate) fn mean_cotangent_diagonal(&self) -> f64 {
        let n = self.positions.len();
        let ring = |i| {
            self.rings()
                .ring(i)
                .map(|(_, h)| 2.0 * self.stiffness[h.edge()])
        };
        (0..n).map(|i| ring(i).sum::<f64>().abs()).sum::<f64>() / n as f64
    }
}
