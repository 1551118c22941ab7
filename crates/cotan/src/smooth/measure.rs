//! Measures of the error and of the curvature of a smoothed mesh.

use cotan_geometry::{Scalar, Surface, angle_between};
use cotan_halfedge::{HalfedgeMap, VertexId, VertexMap};
use cotan_laplacian::Cotangent;
use nalgebra::Vector3;

use super::mollified::{mollified_cotangents, with_floor};
use super::parallel::filled;

/// Mean over the faces of the angle between the normals of two embeddings of one mesh.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct NormalError {
    /// Each face counts equally, as usual in the literature on denoising. In degrees.
    pub mean: f64,
    /// Faces are weighted by their area in the first embedding. In degrees.
    pub area_weighted: f64,
}

impl NormalError {
    /// Compares `other` with `truth`. Faces without area in either one count as 0.
    ///
    /// # Panics
    /// If the two do not have the same number of faces.
    pub fn measure<T: Scalar>(truth: &Surface<'_, T>, other: &Surface<'_, T>) -> Self {
        let (a, b) = (truth.face_normals(), other.face_normals());
        assert_eq!(a.len(), b.len(), "two embeddings of one mesh");
        let (mut sum, mut weighted, mut total) = (0.0, 0.0, 0.0);
        for ((a, b), area) in a.values().zip(b.values()).zip(truth.face_areas().values()) {
            let angle = angle_between(&a.map(T::as_f64), &b.map(T::as_f64));
            sum += angle;
            weighted += area.as_f64() * angle;
            total += area.as_f64();
        }
        let total = if total > 0.0 { total } else { 1.0 };
        Self {
            mean: (sum / a.len().max(1) as f64).to_degrees(),
            area_weighted: (weighted / total).to_degrees(),
        }
    }
}

/// Root mean square and maximum distance between the vertices of two embeddings of one mesh.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Displacement {
    /// The root mean square. A length.
    pub rms: f64,
    /// The maximum. A length.
    pub max: f64,
}

impl Displacement {
    /// Compares two embeddings vertex by vertex.
    pub fn measure<T: Scalar>(a: &Surface<'_, T>, b: &Surface<'_, T>) -> Self {
        let pairs = a.positions().values().zip(b.positions().values());
        let lengths = pairs.map(|(a, b)| (a - b).map(T::as_f64).norm());
        let (sum, max) = lengths.fold((0.0, 0.0_f64), |(s, m), l| (s + l * l, m.max(l)));
        Self {
            rms: (sum / a.positions().len().max(1) as f64).sqrt(),
            max,
        }
    }
}

/// Root mean square over the surface of the mean curvature H = ½ (κ₁ + κ₂).
///
/// **Units**: inverse length. Computed from dihedral angles and barycentric dual areas; vertices
/// without area are excluded.
pub fn mean_curvature_rms<T: Scalar>(surface: &Surface<'_, T>) -> f64 {
    let areas = surface.dual_areas();
    let integrals = surface.integrated_mean_curvatures();
    let (mut sum, mut total) = (0.0, 0.0);
    for (h, area) in integrals.values().zip(areas.values()) {
        let (h, area) = (h.as_f64(), area.as_f64());
        if area > 0.0 {
            sum += h * h / area;
            total += area;
        }
    }
    if total > 0.0 {
        (sum / total).sqrt()
    } else {
        0.0
    }
}

/// H = ½ (κ₁ + κ₂) of each vertex from the cotangent Laplacian: ℓ·n = −4 A H with A = ⅛ Σ_j w_ij
/// |e_ij|².
///
/// Positive where convex. For a mesh inscribed in a sphere it is exactly 1/r, up to the error of
/// the normals. 0 at boundary vertices and where there is no area.
///
/// This is the field that detail edits change and [`TargetCurvature`](super::TargetCurvature)
/// prescribes. `cotan::surface::mean_curvatures` divides by mixed Voronoi areas instead, which
/// differ from A at obtuse triangles.
///
/// **Shapes**: one value per vertex. **Units**: inverse length.
pub fn curvature_field<T: Scalar>(surface: &Surface<'_, T>) -> VertexMap<f64> {
    let mut cotangents = HalfedgeMap::filled(surface.mesh().num_halfedges(), T::zero());
    Cotangent::default().opposite_cotangents(surface, &mut cotangents);
    let (sizes, areas) = sizes_and_areas(surface, &cotangents);
    over_areas(&sizes, &areas)
}

/// [`curvature_field`] as used by detail edits: computed with mollified cotangents and with a
/// lower bound on the areas.
pub(crate) fn mollified_curvature_field<T: Scalar>(surface: &Surface<'_, T>) -> VertexMap<f64> {
    let mut cotangents = HalfedgeMap::default();
    mollified_cotangents(surface, &mut cotangents);
    let (sizes, areas) = sizes_and_areas(surface, &cotangents);
    over_areas(&sizes, &with_floor(surface.mesh(), &areas))
}

/// ℓ·n, which is 0 at boundary vertices and vertices with copies, and A.
fn sizes_and_areas<T: Scalar>(
    surface: &Surface<'_, T>,
    cotangents: &HalfedgeMap<T>,
) -> (VertexMap<f64>, VertexMap<f64>) {
    let mesh = surface.mesh();
    let normals = surface.vertex_normals();
    let both = filled(mesh.num_vertices(), |v: VertexId| {
        let (mut ell, mut sum, mut size) = (Vector3::zeros(), 0.0, 0.0);
        for h in mesh.outgoing_halfedges(v) {
            let weight = (cotangents[h] + cotangents[h.twin()]).as_f64();
            let edge = surface.halfedge_vector(h).map(T::as_f64);
            ell += edge * weight;
            sum += weight * edge.norm_squared();
            size += (weight * edge.norm_squared()).abs();
        }
        let along = match mesh.is_inner_vertex(v) {
            false => 0.0,
            true => ell.dot(&normals[v].map(T::as_f64)),
        };
        (along, 0.125 * f64::max(sum, 0.5 * size))
    });
    (both.map(|b| b.0), both.map(|b| b.1))
}

/// −ℓ·n / 4A, or 0 where there is no area.
fn over_areas(sizes: &VertexMap<f64>, areas: &VertexMap<f64>) -> VertexMap<f64> {
    let pairs = sizes.values().zip(areas.values());
    pairs
        .map(|(size, area)| match *area > 0.0 {
            true => -size / (4.0 * area),
            false => 0.0,
        })
        .collect()
}
