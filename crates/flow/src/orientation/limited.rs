//! The smallest change to the paper's rule that converges on most meshes.

use cotan_geometry::Scalar;
use cotan_halfedge::{VertexId, VertexMap};
use nalgebra::Vector3;
use rayon::prelude::*;

use super::frame::BoundaryFrames;
use super::{Orientation, field_scale};
use crate::error::FlowError;
use crate::state::{FlowState, Quantities};

/// The normal part is kept with its sign; the tangential part keeps its current direction and may
/// not outgrow its original size:
///
/// ```text
/// ℓ = k (ℓ⁰·N⁰) N + t min(1, k t⁰/|t|)      t = ℓ_c − (ℓ_c·N) N,  t⁰ = |ℓ⁰ − (ℓ⁰·N⁰) N⁰|,  k = d/|ℓ⁰|
/// ```
///
/// A continuous map, where the paper's reflection jumps. Boundary vertices: as [`super::Reflect`].
///
/// **Deviation** from the paper's section 3.2, whose rule it replaces.
#[derive(Debug)]
pub struct Limited<T: Scalar> {
    boundary: BoundaryFrames<T>,
}

/// As [`Limited`], with the normal part stretched so that |ℓ| = d exactly, as in the paper.
#[derive(Debug)]
pub struct LimitedMagnitude<T: Scalar> {
    boundary: BoundaryFrames<T>,
}

impl<T: Scalar> Default for Limited<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Scalar> Limited<T> {
    /// The rule.
    pub fn new() -> Self {
        Self {
            boundary: BoundaryFrames::new(),
        }
    }
}

impl<T: Scalar> Default for LimitedMagnitude<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Scalar> LimitedMagnitude<T> {
    /// The rule.
    pub fn new() -> Self {
        Self {
            boundary: BoundaryFrames::new(),
        }
    }
}

impl<T: Scalar> Orientation<T> for Limited<T> {
    fn orient(
        &mut self,
        state: &FlowState<'_, T>,
        field: &VertexMap<T>,
        out: &mut VertexMap<Vector3<T>>,
    ) -> Result<(), FlowError> {
        limit(
            &mut self.boundary,
            state,
            field,
            out,
            |normal_part, _, _| normal_part,
        );
        Ok(())
    }

    fn needs(&self) -> Quantities {
        Quantities {
            areas: false,
            ..Quantities::ALL
        }
    }
}

impl<T: Scalar> Orientation<T> for LimitedMagnitude<T> {
    fn orient(
        &mut self,
        state: &FlowState<'_, T>,
        field: &VertexMap<T>,
        out: &mut VertexMap<Vector3<T>>,
    ) -> Result<(), FlowError> {
        limit(
            &mut self.boundary,
            state,
            field,
            out,
            |normal_part, tangential, magnitude| {
                let rest = magnitude * magnitude - tangential * tangential;
                let size = rest.max(T::zero()).sqrt();
                if normal_part < T::zero() { -size } else { size }
            },
        );
        Ok(())
    }

    fn needs(&self) -> Quantities {
        Quantities {
            areas: false,
            ..Quantities::ALL
        }
    }
}

/// The common map; `normal_size` makes the signed normal part from k (ℓ⁰·N⁰), the length of the
/// tangential part, and d.
fn limit<T: Scalar>(
    boundary: &mut BoundaryFrames<T>,
    state: &FlowState<'_, T>,
    field: &VertexMap<T>,
    out: &mut VertexMap<Vector3<T>>,
    normal_size: impl Fn(T, T, T) -> T + Sync,
) {
    let rest = state.rest();
    boundary.prepare(rest);
    out.as_mut_slice()
        .par_iter_mut()
        .enumerate()
        .with_min_len(1 << 11)
        .for_each(|(i, ell)| {
            let v = VertexId::new(i);
            let normal = state.normals()[v];
            let scale = field_scale(field[v], rest.magnitudes()[v]);
            if let Some(carried) = boundary.carry(rest.mesh(), state.positions(), normal, v) {
                *ell = carried * scale;
                return;
            }
            let original = rest.laplacian()[v];
            let along = original.dot(&rest.normals()[v]);
            let most = (original - rest.normals()[v] * along).norm() * scale;
            let current = state.laplacian()[v];
            let mut tangential = current - normal * current.dot(&normal);
            let length = tangential.norm();
            if length > most {
                tangential *= most / length;
            }
            *ell = normal * normal_size(along * scale, length.min(most), field[v]) + tangential;
        });
}
