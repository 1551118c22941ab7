//! The paper's rule.

use cotan_geometry::Scalar;
use cotan_halfedge::VertexMap;
use nalgebra::Vector3;

use super::frame::BoundaryFrames;
use super::limited::Limited;
use super::{Orientation, field_scale, refuse_copies, write_each};
use crate::error::FlowError;
use crate::per_rest::PerRest;
use crate::state::FlowState;

/// The paper's orientation, to the letter: ℓ of the current mesh, reflected about the tangent plane
/// where it points to the other side of the surface than ℓ⁰ did, then given the size d.
///
/// ```text
/// Orient(ℓ) = n sign(ℓ⁰·n⁰)         if ℓ = 0
///             ℓ                     if (ℓ·n)(ℓ⁰·n⁰) > 0
///             ℓ − 2 (ℓ·n) n         otherwise
/// ```
///
/// Where ℓ = 0 and ℓ⁰·n⁰ = 0 too there is no direction, and ℓ stays 0. The paper makes boundary
/// vertices handles; here they may be free, their ℓ⁰ carried by a frame (which is what converges).
///
/// **It does not converge** on most detailed meshes: where |ℓ| is small against the one-ring the
/// direction is nearly arbitrary and flips for ever, at 1e-3 … 5e-3 of the box.
///
/// **Source**: section 3.2, step 2.
#[derive(Debug)]
pub struct Reflect<T: Scalar> {
    boundary: PerRest<BoundaryFrames<T>>,
}

impl<T: Scalar> Default for Reflect<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Scalar> Reflect<T> {
    /// The rule.
    pub fn new() -> Self {
        Self {
            boundary: PerRest::new(),
        }
    }
}

impl<T: Scalar> Orientation<T> for Reflect<T> {
    fn orient(
        &mut self,
        state: &FlowState<'_, T>,
        field: &VertexMap<T>,
        out: &mut VertexMap<Vector3<T>>,
    ) -> Result<(), FlowError> {
        let rest = state.rest();
        refuse_copies(rest, "the paper's reflection")?;
        let boundary = &*self.boundary.get(rest, BoundaryFrames::new);
        let (laplacian, normals) = (state.laplacian()?, state.normals());
        write_each(out, |v| {
            let normal = normals[v];
            let carried = boundary.carry(rest.mesh(), state.positions(), normal, v);
            if let Some(carried) = carried {
                return carried * field_scale(field[v], rest.magnitudes()[v]);
            }
            let side = rest.laplacian()[v].dot(&rest.normals()[v]);
            let turned = orient(laplacian[v], normal, side);
            let length = turned.norm();
            if length > T::zero() {
                turned * (field[v] / length)
            } else {
                turned
            }
        });
        Ok(())
    }
}

/// The case distinction of the paper; `side` is ℓ⁰·n⁰.
fn orient<T: Scalar>(ell: Vector3<T>, normal: Vector3<T>, side: T) -> Vector3<T> {
    let along = ell.dot(&normal);
    if ell.norm_squared() == T::zero() {
        let sign = if side > T::zero() {
            T::one()
        } else if side < T::zero() {
            -T::one()
        } else {
            T::zero()
        };
        normal * sign
    } else if along * side > T::zero() {
        ell
    } else {
        ell - normal * (along + along)
    }
}

/// [`Reflect`] for the first iterations, [`Limited`] from then on: for reconstructions, whose
/// collapsed start `Limited` alone leaves more slowly.
#[derive(Debug)]
pub struct ReflectFirst<T: Scalar> {
    first: Reflect<T>,
    then: Limited<T>,
    steps: usize,
}

impl<T: Scalar> ReflectFirst<T> {
    /// Reflects in the first `steps` iterations. Ten serve well.
    pub fn new(steps: usize) -> Self {
        Self {
            first: Reflect::new(),
            then: Limited::new(),
            steps,
        }
    }
}

impl<T: Scalar> Orientation<T> for ReflectFirst<T> {
    fn orient(
        &mut self,
        state: &FlowState<'_, T>,
        field: &VertexMap<T>,
        out: &mut VertexMap<Vector3<T>>,
    ) -> Result<(), FlowError> {
        if state.iteration() <= self.steps {
            self.first.orient(state, field, out)
        } else {
            self.then.orient(state, field, out)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn follows_the_papers_cases() {
        let n = Vector3::z();
        let ell = Vector3::new(1.0, 2.0, 3.0);
        assert_eq!(orient(ell, n, 0.5), ell, "same side");
        assert_eq!(
            orient(ell, n, -0.5),
            Vector3::new(1.0, 2.0, -3.0),
            "other side"
        );
        assert_eq!(
            orient(ell, n, 0.0),
            Vector3::new(1.0, 2.0, -3.0),
            "no side: otherwise"
        );
        assert_eq!(
            orient(Vector3::zeros(), n, -0.5),
            -n,
            "zero takes the normal"
        );
        assert_eq!(
            orient(Vector3::zeros(), n, 0.0),
            Vector3::zeros(),
            "zero without a side"
        );
    }
}
