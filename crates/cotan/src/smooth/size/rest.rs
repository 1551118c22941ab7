//! Measures of the original surface, which are the same for all sizes.

use cotan_flow::BoxUnits;
use cotan_geometry::{Positions, Scalar, Surface, vertex_area_vectors};
use cotan_halfedge::{HalfedgeMap, HalfedgeMesh, VertexMap};
use cotan_laplacian::{OneRings, Operator, Symmetry};
use nalgebra::Vector3;

use crate::error::Error;
use crate::smooth::implicit::areas_of_rows;
use crate::smooth::mollified::{mollified_cotangents, with_floor};

/// The original surface in box units, in double precision, with one entry per row.
pub(crate) struct RestSurface {
    pub(crate) positions: Positions<f64>,
    /// −S, with mollified cotangents.
    pub(crate) operator: Operator<f64>,
    /// m: barycentric areas, each at least a twentieth of the largest in its ring.
    pub(crate) masses: Vec<f64>,
    /// N⁰: a third of the sum of the area vectors around each vertex; 0 where they cancel, as
    /// around the corner of a triangle that lies on its own back. No normal is known there.
    pub(crate) area_vectors: Vec<Vector3<f64>>,
    /// S x⁰.
    pub(crate) laplacian: Vec<Vector3<f64>>,
    /// q = S x⁰ · n⁰, positive where convex: the integrated curvature, which is 0 on a boundary.
    pub(crate) curvature: Vec<f64>,
    /// Whether pieces of the mesh meet. Their normals may point to different sides, so that their
    /// curvatures have no common sign there.
    pub(crate) is_seam: Vec<bool>,
}

impl RestSurface {
    pub(crate) fn new<T: Scalar>(
        surface: &Surface<'_, T>,
        units: &BoxUnits<T>,
    ) -> Result<Self, Error> {
        let mesh = surface.mesh();
        let (corner, size) = (units.corner().map(T::as_f64), units.size().as_f64());
        let to_box = |p: &nalgebra::Point3<T>| ((p.map(T::as_f64) - corner) / size).into();
        let positions: Positions<f64> = surface.positions().map(to_box);
        let positions = mesh.to_rows(&positions);
        let of_vertices = mesh.to_vertices(positions.clone());
        let rest = Surface::new(mesh, &of_vertices)?;
        let operator = operator(&rest);
        let mut masses = with_floor(mesh, &areas_of_rows(&rest)).into_vec();
        raise(&mut masses);
        let normals = rest.vertex_normals();
        let area_vectors = mesh.to_rows(&vertex_area_vectors(&rest));
        let area_vectors = area_vectors.iter().map(|(v, n)| {
            let n = n / 3.0;
            match n.norm() > CANCELLED * masses[v.index()] {
                true => n,
                false => Vector3::zeros(),
            }
        });
        let area_vectors: Vec<Vector3<f64>> = area_vectors.collect();
        let mut laplacian = VertexMap::filled(positions.len(), Vector3::zeros());
        operator.apply(&positions, &mut laplacian);
        laplacian.values_mut().for_each(|l| *l = -*l);
        let curvature = mesh.rows().map(|v| {
            let has_normal = area_vectors[v.index()] != Vector3::zeros();
            match mesh.is_inner_vertex(v) && has_normal {
                false => 0.0,
                true => laplacian[v].dot(&normals[v]),
            }
        });
        let curvature = curvature.collect();
        Ok(Self {
            curvature,
            is_seam: mesh.rows().map(|v| mesh.is_shared_vertex(v)).collect(),
            laplacian: laplacian.into_vec(),
            positions,
            operator,
            masses,
            area_vectors,
        })
    }
}

/// The mollified cotangent operator, with the rows of boundary vertices.
fn operator(surface: &Surface<'_, f64>) -> Operator<f64> {
    let mut cotangents = HalfedgeMap::default();
    mollified_cotangents(surface, &mut cotangents);
    let rings = OneRings::new(surface.mesh());
    let weight = |k: usize| {
        let halfedges = rings.halfedges_of(k).iter();
        let both = halfedges.map(|h| cotangents[*h] + cotangents[h.twin()]);
        both.fold(0.0, |sum, w| sum + w)
    };
    // A face whose corners coincide has no cotangents.
    let weights = (0..rings.graph().num_entries()).map(weight);
    let weights = weights
        .map(|w| if w.is_finite() { w } else { 0.0 })
        .collect();
    Operator::new(rings.graph().clone(), weights, Symmetry::Symmetric)
        .expect("mollified cotangents are at most 35")
}

/// Raises the masses to a tiny fraction of the mean, for components without area.
fn raise(masses: &mut [f64]) {
    let mean = masses.iter().sum::<f64>() / masses.len().max(1) as f64;
    let least = if mean > 0.0 { MIN_MASS * mean } else { 1.0 };
    masses.iter_mut().for_each(|m| *m = m.max(least));
}

/// Area vectors whose sum is smaller than this share of the areas cancel but for rounding.
const CANCELLED: f64 = 1e-9;

/// Small enough not to affect a component that is a ten-thousandth of the others in size.
const MIN_MASS: f64 = 1e-9;

/// The rows of a mesh that have no curvature: boundaries, and vertices at which pieces meet.
pub(crate) fn boundary(mesh: &HalfedgeMesh) -> Vec<bool> {
    mesh.rows().map(|v| !mesh.is_inner_vertex(v)).collect()
}
