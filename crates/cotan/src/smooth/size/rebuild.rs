//! The surface that has a given curvature.

use cotan_geometry::{Positions, Surface};
use cotan_halfedge::{HalfedgeMesh, VertexId};
use cotan_linear::BilaplacianSystem;
use cotan_parallel::{self as parallel, Chunks};
use nalgebra::Vector3;

use super::rest::RestSurface;
use crate::error::Error;

/// Finds the displacement u = x − x⁰ with
///
/// ```text
/// A u = S R (t − S x⁰)        t_i = a_i h_i n_i(x)        a_i = clamp(N⁰_i·n_i(x), 0.1 m_i, m_i)
/// ```
///
/// which is A x = S R t + D x⁰ in correction form: a surface that already has this curvature does
/// not change. t is 0 where N⁰ is. The first normals are those of the solution for t = 0.
pub(super) struct Rebuild<'a> {
    pub(super) mesh: &'a HalfedgeMesh,
    pub(super) rest: &'a RestSurface,
    pub(super) curvature: &'a [f64],
    pub(super) system: &'a BilaplacianSystem,
}

impl Rebuild<'_> {
    /// Iterates from the displacements of fixed vertices in `u` (0 elsewhere), and calls `proceed`
    /// after each solve. Returns the number of solves.
    pub(super) fn run(
        &self,
        u: &mut [Vector3<f64>],
        mut proceed: impl FnMut() -> Result<(), Error>,
    ) -> Result<usize, Error> {
        let n = u.len();
        let mut wanted = vec![Vector3::zeros(); n];
        let mut rhs = vec![Vector3::zeros(); n];
        for solve in 0..=MAX_STEPS {
            if solve > 0 {
                self.wanted(u, &mut wanted)?;
            }
            let missing = |i: usize| wanted[i] - self.rest.laplacian[i];
            let missing: Vec<_> = parallel::filled(n, missing);
            self.system.right_hand_side(&missing, &mut rhs);
            let before = u.to_vec();
            self.system.solve(&rhs, u, TOLERANCE)?;
            proceed()?;
            let change = sum_of_squares(n, |i| u[i] - before[i]);
            let motion = sum_of_squares(n, |i| u[i]);
            if solve >= MIN_STEPS && change <= STOP * STOP * motion {
                return Ok(solve + 1);
            }
        }
        Ok(MAX_STEPS + 1)
    }

    /// t at the current positions.
    fn wanted(&self, u: &[Vector3<f64>], out: &mut [Vector3<f64>]) -> Result<(), Error> {
        let rest = self.rest;
        let moved = rest.positions.iter().map(|(v, p)| p + u[v.index()]);
        let positions: Positions<f64> = self.mesh.to_vertices(moved.collect());
        let normals = Surface::new(self.mesh, &positions)?.vertex_normals();
        parallel::fill(out, |i| {
            if rest.area_vectors[i] == Vector3::zeros() {
                return Vector3::zeros();
            }
            let (normal, mass) = (normals[VertexId::new(i)], rest.masses[i]);
            let area = rest.area_vectors[i].dot(&normal);
            normal * (self.curvature[i] * area.clamp(MIN_SHARE * mass, mass))
        });
        Ok(())
    }
}

fn sum_of_squares(n: usize, value: impl Fn(usize) -> Vector3<f64> + Sync) -> f64 {
    const CHUNKS: Chunks = Chunks::of(4096);
    CHUNKS.sum(n, |i| value(i).norm_squared())
}

/// The maximum number of updates of the normals. The first two change the surface visibly.
const MIN_STEPS: usize = 3;
const MAX_STEPS: usize = 5;

/// The change of a step, relative to the motion, at which the iteration ends.
const STOP: f64 = 1e-3;

/// The smallest share of its mass with which a vertex bends the surface. The share is below 1 at
/// folds and needles of the original.
const MIN_SHARE: f64 = 0.1;

/// Of a solve, relative to the energy norm of the motion.
const TOLERANCE: f64 = 1e-6;
