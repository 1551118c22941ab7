//! Every Laplacian coordinate turns with its one-ring.

use cotan_geometry::Scalar;
use cotan_halfedge::VertexMap;
use nalgebra::Vector3;

use super::cells::{as_f64, face_covariances, ring_covariance};
use super::{Orientation, field_scale, write_each};
use crate::error::FlowError;
use crate::polar::nearest_rotation;
use crate::state::{FlowState, Quantities};

/// ℓ_i = (d_i/|ℓ⁰_i|) R_i ℓ⁰_i with R_i the rotation that fits the triangles around i best, weighted
/// by cotangents as in as-rigid-as-possible editing ("spokes and rims", Chao et al. 2010). Boundary
/// vertices need no special rule.
///
/// Its rotations do not minimise the energy that its solve minimises, so nothing keeps it from
/// oscillating: it converges on supported shapes and not on limbs.
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
        let faces = face_covariances(rest, state.positions());
        write_each(out, |v| {
            let rotation = nearest_rotation(&ring_covariance(rest.mesh(), &faces, v));
            let scale = field_scale(field[v], rest.magnitudes()[v]);
            (rotation * as_f64(rest.laplacian()[v])).map(T::of_f64) * scale
        });
        Ok(())
    }

    fn needs(&self) -> Quantities {
        Quantities::NONE
    }
}
