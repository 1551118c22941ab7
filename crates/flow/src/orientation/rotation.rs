//! Every Laplacian coordinate turns with its one-ring.

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::{VertexId, VertexMap};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::{Orientation, field_scale};
use crate::error::FlowError;
use crate::polar::nearest_rotation;
use crate::rest::Rest;
use crate::state::{FlowState, Quantities};

/// ℓ_i = (d_i/|ℓ⁰_i|) R_i ℓ⁰_i with R_i the rotation that fits the one-ring best, weighted as in
/// as-rigid-as-possible editing (Sorkine, Alexa 2007). Boundary vertices need no special rule.
///
/// **Deviation** from the paper's section 3.2, whose rule it replaces.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct BestRotation;

impl<T: Scalar> Orientation<T> for BestRotation {
    fn orient(
        &mut self,
        state: &FlowState<'_, T>,
        field: &VertexMap<T>,
        out: &mut VertexMap<Vector3<T>>,
    ) -> Result<(), FlowError> {
        let rest = state.rest();
        out.as_mut_slice().par_iter_mut().enumerate().with_min_len(1 << 9).for_each(|(i, ell)| {
            let v = VertexId::new(i);
            let rotation = nearest_rotation(&edge_covariance(rest, state.positions(), i));
            let scale = field_scale(field[v], rest.magnitudes()[v]);
            *ell = (rotation * as_f64(rest.laplacian()[v])).map(T::of_f64) * scale;
        });
        Ok(())
    }

    fn needs(&self) -> Quantities {
        Quantities::NONE
    }
}

/// Σ_j w_ij/2 e_ij e⁰_ijᵀ.
pub(crate) fn edge_covariance<T: Scalar>(
    rest: &Rest<'_, T>,
    positions: &Positions<T>,
    i: usize,
) -> Matrix3<f64> {
    let mut sum = Matrix3::zeros();
    for (k, j) in rest.ring(i) {
        let (e, e0) = edge_pair(rest, positions, i, j);
        sum += e * (e0 * rest.stiffness()[k]).transpose();
    }
    sum
}

/// Current and original edge vector from i to j.
pub(crate) fn edge_pair<T: Scalar>(
    rest: &Rest<'_, T>,
    positions: &Positions<T>,
    i: usize,
    j: usize,
) -> (Vector3<f64>, Vector3<f64>) {
    let (x, x0) = (positions.as_slice(), rest.positions().as_slice());
    (as_f64(x[j] - x[i]), as_f64(x0[j] - x0[i]))
}

pub(crate) fn as_f64<T: Scalar>(v: Vector3<T>) -> Vector3<f64> {
    v.map(T::as_f64)
}
