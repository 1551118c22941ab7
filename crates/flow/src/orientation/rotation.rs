//! Every Laplacian coordinate turns with its one-ring.

use cotan_geometry::Scalar;
use cotan_halfedge::VertexMap;
use nalgebra::{Matrix3, Vector3};

use super::cells::{add_outer, as_f64, edge_gradients, in_rows, turned};
use super::{Orientation, field_scale};
use crate::error::FlowError;
use crate::polar::{IDENTITY, Mat3, flat, nearest_rotation_from};
use crate::rest::Rest;
use crate::state::{FlowState, Quantities};
use crate::vectors::update_both;

/// ℓ_i = (d_i/|ℓ⁰_i|) R_i ℓ⁰_i with R_i the rotation that fits the triangles around i best, weighted
/// by cotangents as in as-rigid-as-possible editing ("spokes and rims", Chao et al. 2010). Boundary
/// vertices need no special rule.
///
/// Its rotations do not minimise the energy that its solve minimises, so nothing keeps it from
/// oscillating: it converges on supported shapes and not on limbs.
///
/// **Deviation** from the paper's section 3.2, whose rule it replaces.
#[derive(Clone, Debug, Default)]
pub struct BestRotation {
    gradients: Vec<[f64; 3]>,
    /// The rotations of the last step, from which the next fit starts.
    rotations: Vec<Mat3>,
}

impl BestRotation {
    /// The rule.
    pub fn new() -> Self {
        Self::default()
    }
}

impl<T: Scalar> Orientation<T> for BestRotation {
    fn orient(
        &mut self,
        state: &FlowState<'_, T>,
        field: &VertexMap<T>,
        out: &mut VertexMap<Vector3<T>>,
    ) -> Result<(), FlowError> {
        let rest = state.rest();
        let rings = rest.rings();
        let x = state.positions().as_slice();
        let gradients = &self.gradients;
        update_both(
            &mut self.rotations,
            out.as_mut_slice(),
            |i, rotation, ell| {
                let row = rings.range(i);
                let mut covariance = [0.0; 9];
                for (j, g) in rings.neighbours()[row.clone()].iter().zip(&gradients[row]) {
                    add_outer(&mut covariance, &as_f64(x[j.index()] - x[i]), g);
                }
                *rotation = nearest_rotation_from(&covariance, rotation);
                let scale = field_scale(field.as_slice()[i], rest.magnitudes().as_slice()[i]);
                let original = as_f64(rest.laplacian().as_slice()[i]);
                *ell = turned(rotation, &original).map(T::of_f64) * scale;
            },
        );
        Ok(())
    }

    fn needs(&self) -> Quantities {
        Quantities::NONE
    }

    fn prepare(&mut self, rest: &Rest<'_, T>) -> f64 {
        self.gradients = in_rows(rest.rings(), &edge_gradients(rest), 1.0, |h| h.twin());
        self.rotations = vec![IDENTITY; rest.positions().len()];
        0.0
    }

    fn start_from(&mut self, rotations: &VertexMap<Matrix3<f64>>) {
        self.rotations = rotations.values().map(flat).collect();
    }
}
