//! Laplacian coordinates along the normals of the current mesh.

use cotan_geometry::Scalar;
use cotan_halfedge::VertexMap;
use nalgebra::Vector3;

use super::{Orientation, refuse_copies, write_each};
use crate::error::FlowError;
use crate::state::FlowState;

/// ℓ = d N, or ℓ = (ℓ_c − (ℓ_c·N) N) + d N with the current tangential part kept: for scalar fields
/// that *prescribe* a curvature, sign included, rather than keep the original's.
///
/// d is the signed field, N the current unit normal, ℓ_c the Laplacian coordinate of the current
/// mesh with its current weights.
///
/// **Source**: paper, section 4.1: 4 A κ n with cotangent weights, which have no tangential part to
/// speak of; the last formula, which keeps it, with Tutte's.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum AlongNormal {
    /// ℓ = d N.
    #[default]
    NormalOnly,
    /// ℓ = (ℓ_c − (ℓ_c·N) N) + d N.
    KeepTangential,
}

impl<T: Scalar> Orientation<T> for AlongNormal {
    fn orient(
        &mut self,
        state: &FlowState<'_, T>,
        field: &VertexMap<T>,
        out: &mut VertexMap<Vector3<T>>,
    ) -> Result<(), FlowError> {
        refuse_copies(state.rest(), "a field along the normals")?;
        match self {
            Self::NormalOnly => {
                let normals = state.normals();
                write_each(out, |v| normals[v] * field[v]);
            }
            Self::KeepTangential => {
                let (laplacian, normals) = (state.laplacian()?, state.normals());
                write_each(out, |v| {
                    let (normal, current) = (normals[v], laplacian[v]);
                    current + normal * (field[v] - current.dot(&normal))
                });
            }
        }
        Ok(())
    }
}
