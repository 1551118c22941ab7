//! What a deformation did to a mesh.

use cotan_flow::nearest_rotation;
use cotan_geometry::{Scalar, Surface, area_distortion, edge_distortion_rms, folded_faces, scalar};
use cotan_halfedge::HalfedgeMap;
use cotan_laplacian::{Cotangent, LaplacianScheme};
use nalgebra::Matrix3;

use crate::comparison::ShapeComparison;
use crate::error::Error;

/// The paper's two errors.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ShapeErrors {
    /// E_p = √((1/n) Σ_i Σ_j (w⁰_ij − w_ij)²), both directions of an edge counted. No unit.
    pub parameterization: f64,
    /// E_g = √(Σ_i (|ℓ⁰_i| − |ℓ_i|)²), with the original mesh scaled to a box of longest side 1.
    pub geometry: f64,
    /// Root mean square of | |ℓ⁰_i| − |ℓ_i| |: E_g / √n.
    pub geometry_rms: f64,
}

impl ShapeErrors {
    /// Compares two embeddings of one mesh by cotangent weights.
    ///
    /// # Errors
    /// [`Error`] if the two are not embeddings of the same mesh.
    ///
    /// **Source**: paper, section 3.5.
    pub fn measure<T: Scalar>(
        original: &Surface<'_, T>,
        deformed: &Surface<'_, T>,
    ) -> Result<Self, Error> {
        check_same_mesh(original, deformed)?;
        ShapeComparison::new(original)?.errors(deformed.positions())
    }
}

/// Measures of a deformation, original against deformed.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub struct Quality {
    /// E_p and E_g of the paper.
    pub errors: ShapeErrors,
    /// Root mean square over the edges of |e|/|e⁰| − 1.
    pub edge_distortion_rms: f64,
    /// Root mean square over the faces of area/area⁰ − 1.
    pub area_distortion_rms: f64,
    /// Enclosed volume over the original one; `None` for an open mesh.
    pub volume_ratio: Option<f64>,
    /// Faces that point against their neighbours and did not before
    /// (see [`cotan_geometry::folded_faces`]).
    pub flipped_faces: usize,
    /// Edges whose two faces include less than 60° and did not before: sharp folds.
    pub folded_edges: usize,
    /// Faces without area in the deformed mesh.
    pub degenerate_faces: usize,
    /// As-rigid-as-possible energy Σ_i Σ_j ⅛ w_ij |e_ij − R_i e⁰_ij|² over the original area, by
    /// single edges with signed weights as libigl and the reference figures have it; 0 for a mesh
    /// without area.
    pub arap_energy: f64,
}

impl Quality {
    /// Measures everything.
    ///
    /// # Errors
    /// [`Error`] if the two are not embeddings of the same mesh.
    pub fn measure<T: Scalar>(
        original: &Surface<'_, T>,
        deformed: &Surface<'_, T>,
    ) -> Result<Self, Error> {
        let errors = ShapeErrors::measure(original, deformed)?;
        let deformed = &original.with_positions(deformed.positions());
        let is_closed = original.mesh().is_closed();
        let moved = deformed.positions();
        let volumes = [original, deformed].map(|s| s.volume().as_f64());
        Ok(Self {
            errors,
            edge_distortion_rms: edge_distortion_rms(original, moved)?.as_f64(),
            area_distortion_rms: area_distortion(original, moved)?.rms.as_f64(),
            volume_ratio: (is_closed && volumes[0] != 0.0).then(|| volumes[1] / volumes[0]),
            flipped_faces: folded_faces(original, moved)?.len(),
            folded_edges: folded_edges(original, deformed),
            degenerate_faces: deformed.degenerate_faces(scalar(1e-9)).len(),
            arap_energy: arap_energy(original, deformed)?,
        })
    }
}

fn check_same_mesh<T: Scalar>(a: &Surface<'_, T>, b: &Surface<'_, T>) -> Result<(), Error> {
    let (a, b) = (a.mesh(), b.mesh());
    if std::ptr::eq(a, b) {
        return Ok(());
    }
    let counts = |m: &cotan_halfedge::HalfedgeMesh| (m.num_vertices(), m.num_faces());
    if counts(a) != counts(b) {
        let ((va, fa), (vb, fb)) = (counts(a), counts(b));
        return Err(Error::DifferentMeshes(format!(
            "{va} vertices and {fa} faces against {vb} vertices and {fb} faces"
        )));
    }
    match a.faces().find(|&f| a.triangle(f) != b.triangle(f)) {
        Some(face) => Err(Error::DifferentMeshes(format!(
            "face {face} has other corners"
        ))),
        None => Ok(()),
    }
}

/// Edges at which the surface turns back on itself (normals more than 120° apart) and did not.
fn folded_edges<T: Scalar>(original: &Surface<'_, T>, deformed: &Surface<'_, T>) -> usize {
    let mesh = original.mesh();
    let (before, after) = (original.face_normals(), deformed.face_normals());
    let threshold = scalar::<T>(-0.5);
    mesh.edges()
        .filter(|e| {
            let [a, b] = e.halfedges().map(|h| mesh.face(h));
            let (Some(a), Some(b)) = (a, b) else {
                return false;
            };
            after[a].dot(&after[b]) < threshold && before[a].dot(&before[b]) >= threshold
        })
        .count()
}

fn arap_energy<T: Scalar>(
    original: &Surface<'_, T>,
    deformed: &Surface<'_, T>,
) -> Result<f64, Error> {
    let mesh = original.mesh();
    let mut weights = HalfedgeMap::filled(mesh.num_halfedges(), T::zero());
    Cotangent::default().weights(original, &mut weights)?;
    let edge = |surface: &Surface<'_, T>, h| surface.halfedge_vector(h).map(T::as_f64);
    let mut energy = 0.0;
    for v in mesh.vertices() {
        let mut covariance = Matrix3::zeros();
        for h in mesh.outgoing_halfedges(v) {
            covariance += edge(deformed, h) * edge(original, h).transpose() * weights[h].as_f64();
        }
        let rotation = nearest_rotation(&covariance);
        for h in mesh.outgoing_halfedges(v) {
            let strain = edge(deformed, h) - rotation * edge(original, h);
            energy += 0.125 * weights[h].as_f64() * strain.norm_squared();
        }
    }
    let area = original.area().as_f64();
    Ok(if area > 0.0 { energy / area } else { 0.0 })
}
