//! Constant curvature as the scalar field: what turns the flow into a map to the sphere.

use cotan_flow::{FlowError, FlowState, ScalarFieldUpdater};
use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::{EdgeId, HalfedgeMap, HalfedgeMesh, VertexMap};

use super::sums::sum;

/// Prescribes the same curvature everywhere: ℓ_i = −4 A_i κ n_i with n the outward normal, as the
/// mean curvature normal of a sphere of radius 1 / (3κ) has it.
///
/// To be used with [`cotan_flow::AlongNormal`], which gives the signed field its direction.
///
/// The radius is an unstable fixed point of a fixed κ, r ← 3κ r²: the surface collapses or grows
/// without bound. [`Self::keeping_scale`] takes the κ of the current shape instead.
///
/// **Source**: paper, section 4.1; what it leaves open by `docs/decisions`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ConstantCurvature {
    curvature: Curvature,
    measure: AreaMeasure,
}

/// Where κ comes from.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Curvature {
    Fixed(f64),
    /// The one for which the current shape keeps its Dirichlet energy.
    KeepScale,
}

/// What counts as the area A_i of a vertex.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum AreaMeasure {
    /// The sum of the areas of the triangles around it, as the paper has it. The prescribed vectors
    /// then do not sum to zero, and what a solve cannot fulfil ruins limbs.
    Ring,
    /// The length of the sum of their area vectors. On a closed surface the prescribed vectors then
    /// sum to zero exactly: the system can be fulfilled.
    #[default]
    Vector,
}

impl ConstantCurvature {
    /// The curvature `kappa`, positive for a convex surface.
    ///
    /// **Units**: 1 / length, in box units.
    pub fn fixed(kappa: f64, measure: AreaMeasure) -> Self {
        Self {
            curvature: Curvature::Fixed(kappa),
            measure,
        }
    }

    /// The curvature that keeps the scale of the current shape: 4κ = E / Σ A_i n_i·x_i with
    /// E = −Σ x_i·(Lx)_i.
    pub fn keeping_scale(measure: AreaMeasure) -> Self {
        Self {
            curvature: Curvature::KeepScale,
            measure,
        }
    }
}

/// E = −Σ x·Lx: four times the Dirichlet energy for cotangent weights; 16π for a conformal map to
/// the unit sphere.
pub(crate) fn energy<T: Scalar>(
    mesh: &HalfedgeMesh,
    weights: &HalfedgeMap<f64>,
    positions: &Positions<T>,
) -> f64 {
    // Edge by edge, with differences; about the first vertex where the weights are not symmetric.
    let origin = positions.as_slice()[0];
    sum(mesh.num_edges(), |e| {
        let edge = EdgeId::new(e);
        let [h, twin] = edge.halfedges().map(|h| weights[h]);
        let [a, b] = mesh
            .edge_vertices(edge)
            .map(|v| (positions[v] - origin).map(T::as_f64));
        let d = a - b;
        0.5 * ((h + twin) * d.norm_squared() + (h - twin) * (a + b).dot(&d))
    })
}

impl<T: Scalar> ScalarFieldUpdater<T> for ConstantCurvature {
    fn update(
        &mut self,
        state: &FlowState<'_, T>,
        field: &mut VertexMap<T>,
    ) -> Result<(), FlowError> {
        let (rest, positions) = (state.rest(), state.positions());
        let normals = state.normals();
        match self.measure {
            AreaMeasure::Ring => field
                .as_mut_slice()
                .copy_from_slice(state.areas().as_slice()),
            AreaMeasure::Vector => {
                for (area, vector) in field.values_mut().zip(state.area_vectors().values()) {
                    *area = vector.norm();
                }
            }
        }
        let factor = match self.curvature {
            Curvature::Fixed(kappa) => 4.0 * kappa,
            Curvature::KeepScale => {
                let (x, n, a) = (positions.as_slice(), normals.as_slice(), field.as_slice());
                let along = sum(x.len(), |i| {
                    a[i].as_f64() * n[i].dot(&(x[i] - x[0])).as_f64()
                });
                energy(rest.mesh(), rest.halfedge_weights(), positions) / along
            }
        };
        if !factor.is_finite() {
            return Err(FlowError::NoVolume);
        }
        let factor = T::of_f64(-factor);
        field.values_mut().for_each(|d| *d *= factor);
        Ok(())
    }
}
