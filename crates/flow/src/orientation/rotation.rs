//! Every Laplacian coordinate turns with its one-ring.

use cotan_geometry::Scalar;
use cotan_halfedge::VertexMap;
use cotan_laplacian::Graph;
use nalgebra::{Point3, Vector3};

use super::{Orientation, field_scale};
use crate::cells::{as_f64, four_of};
use crate::error::FlowError;
use crate::four::{Columns, Four, IDENTITY, Mat3, flat, turned};
use crate::gradients::Gradients;
use crate::nearest_rotation::nearest_rotations_from;
use crate::passes::{PassOfThree, run_three};
use crate::per_rest::PerRest;
use crate::rest::Rest;
use crate::state::FlowState;

/// ℓ_i = (d_i/|ℓ⁰_i|) R_i ℓ⁰_i with R_i the rotation that fits the triangles around i best,
/// weighted by cotangents as in as-rigid-as-possible editing ("spokes and rims", Chao et al. 2010).
/// Boundary vertices need no special rule.
///
/// Its rotations do not minimise the energy that its solve minimises, so nothing keeps it from
/// oscillating: it converges on supported shapes and not on limbs.
///
/// **Deviation** from the paper's section 3.2, whose rule it replaces.
#[derive(Clone, Debug, Default)]
pub struct BestRotation {
    fit: PerRest<Fit>,
}

/// Measures of one rest shape.
#[derive(Clone, Debug)]
struct Fit {
    gradients: Vec<[f64; 3]>,
    /// The rotations of the last step, from which the next fit starts.
    rotations: Vec<Mat3>,
}

impl Fit {
    fn new<T: Scalar>(rest: &Rest<T>) -> Self {
        Self {
            gradients: Gradients::new(rest).of_neighbours(1.0),
            rotations: vec![IDENTITY; rest.positions().len()],
        }
    }
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
        let Fit {
            gradients,
            rotations,
        } = self.fit.get(rest, Fit::new);
        if let Some(guess) = state.first_rotations() {
            *rotations = guess.values().map(flat).collect();
        }
        let turning = Turning {
            graph: rest.graph(),
            positions: state.positions().as_slice(),
            gradients,
            rest,
            field: field.as_slice(),
        };
        let ell = out.as_mut_slice();
        state.fuse_rest_laplacian(|laplacian| run_three(&turning, rotations, laplacian, ell));
        Ok(())
    }
}

/// The fits, and the turned Laplacian coordinates.
struct Turning<'a, T: Scalar> {
    graph: &'a Graph,
    positions: &'a [Point3<T>],
    gradients: &'a [[f64; 3]],
    rest: &'a Rest<T>,
    field: &'a [T],
}

impl<T: Scalar> Turning<'_, T> {
    /// The covariance of the triangles around a vertex, and L⁰x there.
    #[inline(always)]
    fn covariance(&self, i: usize) -> (Mat3, Four) {
        let row = self.graph.range(i);
        let own = Four::of_point(&self.positions[i]);
        let (mut sum, mut now) = (Columns::ZERO, Four::ZERO);
        for ((j, g), w) in self.graph.neighbours()[row.clone()]
            .iter()
            .zip(&self.gradients[row.clone()])
            .zip(&self.rest.operator().weights()[row])
        {
            let edge = Four::of_point(&self.positions[j.index()]) - own;
            sum.add_outer(edge, g);
            now += edge * Four::all(*w);
        }
        (sum.times(1.0), now)
    }
}

impl<T: Scalar> PassOfThree<Mat3, Vector3<f64>, Vector3<T>> for Turning<'_, T> {
    #[inline(always)]
    fn on(
        &self,
        first: usize,
        rotations: &mut [Mat3],
        laplacian: &mut [Vector3<f64>],
        ell: &mut [Vector3<T>],
    ) {
        let magnitudes = self.rest.magnitudes().as_slice();
        let original = self.rest.laplacian().as_slice();
        let n = rotations.len();
        for at in (0..n).step_by(4) {
            let mut covariances = [IDENTITY; 4];
            for lane in 0..4 {
                let k = (at + lane).min(n - 1);
                let (covariance, now) = self.covariance(first + k);
                covariances[lane] = covariance;
                laplacian[k] = now.vector().into();
            }
            let mut found = four_of(rotations, at);
            nearest_rotations_from(&covariances, &mut found);
            for lane in 0..4.min(n - at) {
                let i = first + at + lane;
                rotations[at + lane] = found[lane];
                let scale = field_scale(self.field[i], magnitudes[i]);
                let [x, y, z] = turned(&found[lane], &as_f64(original[i]).into()).vector();
                ell[at + lane] = Vector3::new(T::of_f64(x), T::of_f64(y), T::of_f64(z)) * scale;
            }
        }
    }
}
