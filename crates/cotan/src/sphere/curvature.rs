//! Constant curvature as the scalar field, which turns the flow into a map to the sphere.

use cotan_flow::{FlowError, FlowState, ScalarFieldUpdater};
use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::VertexMap;
use cotan_laplacian::Operator;

use super::sums::sum;

/// Prescribes the same curvature everywhere: ℓ_i = −4 A_i κ n_i with the outward normal n, as for
/// the mean curvature normal of a sphere of radius 1 / (3κ).
///
/// Use it with [`cotan_flow::AlongNormal`], which turns the signed field into vectors.
///
/// With a fixed κ, the radius is an unstable fixed point of r ← 3κ r²: the surface collapses or
/// grows without bound. [`Self::keeping_scale`] uses the κ of the current shape instead.
///
/// **Source**: paper, section 4.1, which leaves κ and the areas open: see [`Self::keeping_scale`]
/// and [`AreaMeasure`].
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ConstantCurvature {
    curvature: Curvature,
    measure: AreaMeasure,
}

/// The source of κ.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Curvature {
    Fixed(f64),
    /// The curvature for which the current shape keeps its Dirichlet energy.
    KeepScale,
}

/// The definition of the area A_i of a vertex.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum AreaMeasure {
    /// The sum of the areas of the triangles around the vertex, as in the paper. The prescribed
    /// vectors then do not sum to zero, and the part that a solve cannot satisfy damages limbs.
    Ring,
    /// The length of the sum of the area vectors of these triangles. On a closed surface the
    /// prescribed vectors then sum to exactly zero, so the system can be satisfied.
    #[default]
    Vector,
}

impl ConstantCurvature {
    /// A fixed curvature `kappa`, positive for a convex surface.
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
pub(crate) fn energy<T: Scalar>(operator: &Operator<T>, positions: &Positions<T>) -> f64 {
    // Summed per pair of neighbours from differences, relative to the first vertex in case the
    // weights are not symmetric.
    let (graph, weights, x) = (operator.graph(), operator.weights(), positions.as_slice());
    let reverse = graph.reverse();
    let at = |v: usize| (x[v] - x[0]).map(T::as_f64);
    sum(x.len(), |i| {
        let a = at(i);
        let later = graph.row(i).filter(|(j, _)| j.index() > i);
        let terms = later.map(|(j, k)| {
            let (there, back) = (weights[k], weights[reverse[k] as usize]);
            let b = at(j.index());
            let d = a - b;
            0.5 * ((there + back) * d.norm_squared() + (there - back) * (a + b).dot(&d))
        });
        terms.sum::<f64>()
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
                energy(rest.operator(), positions) / along
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
