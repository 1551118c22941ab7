//! Curvature flow and as-rigid-as-possible editing in one energy.

use cotan_geometry::Scalar;
use cotan_halfedge::{VertexId, VertexMap};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::rotation::{as_f64, edge_covariance, edge_pair};
use super::{Orientation, field_scale};
use crate::error::FlowError;
use crate::polar::nearest_rotation;
use crate::rest::Rest;
use crate::state::{FlowState, Quantities};
use crate::vectors::sum;

/// Laplacian coordinates turn with rotations that minimise, together with the positions,
///
/// ```text
/// E(x, R) = Σ_i |(L⁰x)_i − k_i R_i ℓ⁰_i|² + μ Σ_i Σ_j ¼ w_ij |e_ij − R_i e⁰_ij|²
/// ```
///
/// The first term is the flow's, the second that of as-rigid-as-possible editing, weighted by μ.
/// R_i (from the fit of both) and x (from the solve, whose matrix gains μK) lower E in turn, so the
/// iteration cannot oscillate.
///
/// **Deviation** from the paper: ours. μ → 0 leaves the flow's term alone, μ → ∞ is
/// as-rigid-as-possible editing.
#[derive(Debug)]
pub struct Hybrid {
    weight: f64,
    rotations: VertexMap<Matrix3<f64>>,
    energies: Vec<f64>,
}

impl Hybrid {
    /// (to be decided)
    pub const DEFAULT_STIFFNESS: f64 = 0.3;

    /// Both terms, the second with weight `weight` = μ (no unit).
    pub fn new(weight: f64) -> Self {
        Self { weight, rotations: VertexMap::default(), energies: Vec::new() }
    }
}

impl Default for Hybrid {
    fn default() -> Self {
        Self::new(Self::DEFAULT_STIFFNESS)
    }
}

impl<T: Scalar> Orientation<T> for Hybrid {
    fn orient(
        &mut self,
        state: &FlowState<'_, T>,
        field: &VertexMap<T>,
        out: &mut VertexMap<Vector3<T>>,
    ) -> Result<(), FlowError> {
        let rest = state.rest();
        let n = out.len();
        if self.rotations.len() != n {
            self.rotations = VertexMap::filled(n, Matrix3::identity());
            self.energies = vec![0.0; n];
        }
        let mu = self.membrane(rest);
        out.as_mut_slice()
            .par_iter_mut()
            .zip(self.rotations.as_mut_slice())
            .zip(&mut self.energies)
            .enumerate()
            .with_min_len(1 << 9)
            .for_each(|(i, ((ell, rotation), energy))| {
                let v = VertexId::new(i);
                let scale = field_scale(field[v], rest.magnitudes()[v]);
                let wanted = as_f64(rest.laplacian()[v] * scale);
                let now = rest.apply_operator(state.positions(), i);
                let covariance = edge_covariance(rest, state.positions(), i) * (0.5 * mu)
                    + now * wanted.transpose();
                *rotation = nearest_rotation(&covariance);
                let turned = *rotation * wanted;
                *energy = (now - turned).norm_squared();
                for (k, j) in rest.ring(i) {
                    let (e, e0) = edge_pair(rest, state.positions(), i, j);
                    *energy +=
                        0.5 * mu * rest.stiffness()[k] * (e - *rotation * e0).norm_squared();
                }
                *ell = turned.map(T::of_f64);
            });
        Ok(())
    }

    fn needs(&self) -> Quantities {
        Quantities::NONE
    }

    fn membrane(&self, _rest: &Rest<'_, T>) -> f64 {
        self.weight
    }

    fn rotations(&self) -> Option<&VertexMap<Matrix3<f64>>> {
        Some(&self.rotations)
    }

    fn energy(&self) -> Option<f64> {
        Some(sum(&self.energies))
    }
}
