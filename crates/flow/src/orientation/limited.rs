//! The smallest change to the paper's rule that converges on most meshes.

use cotan_geometry::Scalar;
use cotan_halfedge::VertexMap;
use nalgebra::Vector3;

use super::frame::BoundaryFrames;
use super::{Orientation, field_scale, refuse_copies, write_each};
use crate::error::FlowError;
use crate::per_rest::PerRest;
use crate::state::FlowState;

/// The normal part is kept with its sign; the tangential part keeps its current direction and may
/// not outgrow its original size:
///
/// ```text
/// ℓ = k (ℓ⁰·N⁰) N + t min(1, k t⁰/|t|)
/// t = ℓ_c − (ℓ_c·N) N,   t⁰ = |ℓ⁰ − (ℓ⁰·N⁰) N⁰|,   k = d/|ℓ⁰|
/// ```
///
/// A continuous map, where the paper's reflection jumps. Boundary vertices: as [`super::Reflect`].
///
/// Refuses a mesh that was cut into pieces, whose normals are those of each piece.
///
/// **Deviation** from the paper's section 3.2, whose rule it replaces.
#[derive(Debug)]
pub struct Limited<T: Scalar> {
    boundary: PerRest<BoundaryFrames<T>>,
    normal_part: NormalPart,
}

/// The length of the normal part of a Laplacian coordinate.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum NormalPart {
    /// As long as it was.
    Kept,
    /// So long that |ℓ| = d exactly, as in the paper.
    Stretched,
}

impl<T: Scalar> Limited<T> {
    /// The rule.
    pub fn new() -> Self {
        Self {
            boundary: PerRest::new(),
            normal_part: NormalPart::Kept,
        }
    }

    /// The rule with the normal part stretched so that |ℓ| = d exactly, as in the paper.
    pub fn exact_magnitude() -> Self {
        Self {
            normal_part: NormalPart::Stretched,
            ..Self::new()
        }
    }
}

impl<T: Scalar> Default for Limited<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Scalar> Orientation<T> for Limited<T> {
    fn orient(
        &mut self,
        state: &FlowState<'_, T>,
        field: &VertexMap<T>,
        out: &mut VertexMap<Vector3<T>>,
    ) -> Result<(), FlowError> {
        let rest = state.rest();
        refuse_copies(rest, "the limited orientation")?;
        let boundary = &*self.boundary.get(rest, BoundaryFrames::new);
        let normal_part = self.normal_part;
        let (laplacian, normals) = (state.laplacian()?, state.normals());
        write_each(out, |v| {
            let normal = normals[v];
            let scale = field_scale(field[v], rest.magnitudes()[v]);
            let carried = boundary.carry(rest.mesh(), state.positions(), normal, v);
            if let Some(carried) = carried {
                return carried * scale;
            }
            let original = rest.laplacian()[v];
            let along = original.dot(&rest.normals()[v]);
            let most = (original - rest.normals()[v] * along).norm() * scale;
            let current = laplacian[v];
            let mut tangential = current - normal * current.dot(&normal);
            let length = tangential.norm();
            if length > most {
                tangential *= most / length;
            }
            let along = match normal_part {
                NormalPart::Kept => along * scale,
                NormalPart::Stretched => {
                    let length = length.min(most);
                    let rest = field[v] * field[v] - length * length;
                    let size = rest.max(T::zero()).sqrt();
                    if along < T::zero() { -size } else { size }
                }
            };
            normal * along + tangential
        });
        Ok(())
    }
}
