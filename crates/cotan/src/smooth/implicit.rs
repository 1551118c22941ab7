//! Implicit mean-curvature flow, for comparison.
//!
//! Every step has another matrix, so a factorization would be used once. The step iterates with
//! conjugate gradients and a diagonal preconditioner instead. The iterations of `cotan-sparse` and
//! `cotan-linear` are for matrices that are prepared once.

use cotan_geometry::{Positions, Scalar, Surface};
use cotan_halfedge::{HalfedgeMesh, VertexId, VertexMap};
use cotan_laplacian::{LaplacianScheme, Operator};
use nalgebra::Vector3;

use super::parallel::filled;
use crate::error::Error;

/// Backward Euler steps of the mean-curvature flow: (A − τ/2 L) x' = A x.
///
/// A are the dual areas and L is the operator of the current mesh, which is reassembled
/// in each step, unlike in all other methods here. This method shrinks the mesh.
///
/// **Source**: Desbrun, Meyer, Schröder, Barr, "Implicit fairing of irregular meshes using
/// diffusion and curvature flow", 1999.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ImplicitFlow {
    /// The time step τ, in squared mean edge lengths.
    pub time: f64,
}

impl Default for ImplicitFlow {
    fn default() -> Self {
        Self { time: 0.5 }
    }
}

impl ImplicitFlow {
    /// Performs one step with the weights of `scheme`, which must be symmetric; vertices with
    /// `is_held` stay in place.
    pub(crate) fn run<T: Scalar>(
        &self,
        mesh: &HalfedgeMesh,
        positions: &Positions<T>,
        scheme: &dyn LaplacianScheme<T>,
        is_held: &[bool],
    ) -> Result<Positions<T>, Error> {
        // Copies of a vertex are one unknown.
        let surface = Surface::new(mesh, positions)?;
        let length = surface.mean_edge_length().as_f64();
        let step = Step {
            operator: Operator::assemble(scheme, &surface)?,
            areas: areas_of_rows(&surface),
            half_time: 0.5 * self.time * length * length,
            is_held,
        };
        let rows = mesh.to_rows(positions);
        let moves = step.moves(&rows);
        let moved = rows.iter().map(|(v, p)| p + moves[v].map(T::of_f64));
        Ok(mesh.to_vertices(moved.collect()))
    }
}

/// Dual areas: those of all copies of a vertex together.
pub(super) fn areas_of_rows<T: Scalar>(surface: &Surface<'_, T>) -> VertexMap<f64> {
    let of_vertices = surface.dual_areas().map(|a| a.as_f64());
    let mut areas = surface.mesh().to_rows(&of_vertices);
    for (copy, row) in surface.mesh().copies() {
        areas[row] += of_vertices[copy];
    }
    areas
}

/// The linear system of one step. It is symmetric positive definite because L is negative
/// semi-definite.
struct Step<'a, T: Scalar> {
    operator: Operator<T>,
    areas: VertexMap<f64>,
    half_time: f64,
    is_held: &'a [bool],
}

impl<T: Scalar> Step<'_, T> {
    /// Solves for x' − x by conjugate gradients: (A − τ/2 L)(x' − x) = τ/2 L x, 0 at held
    /// vertices.
    fn moves(&self, x: &Positions<T>) -> VertexMap<Vector3<f64>> {
        let n = x.len();
        let mut residual: VertexMap<Vector3<f64>> = filled(n, |v: VertexId| {
            self.free(v, self.operator.apply_at(x, v.index()) * self.half_time)
        });
        let mut moves = VertexMap::filled(n, Vector3::zeros());
        let mut scaled = self.precondition(&residual);
        let mut direction = scaled.clone();
        let mut power = dots(&residual, &scaled);
        let goal = power * (SOLVED * SOLVED);
        for _ in 0..MAX_STEPS {
            let product = self.product(&direction);
            let length = ratios(&power, &dots(&direction, &product));
            add(&mut moves, &direction, &length);
            add(&mut residual, &product, &-length);
            scaled = self.precondition(&residual);
            let next = dots(&residual, &scaled);
            if (0..3).all(|k| next[k] <= goal[k]) {
                break;
            }
            let keep = ratios(&next, &power);
            let old = direction;
            direction = filled(n, |v: VertexId| scaled[v] + keep.component_mul(&old[v]));
            power = next;
        }
        moves
    }

    /// (A − τ/2 L) d.
    fn product(&self, d: &VertexMap<Vector3<f64>>) -> VertexMap<Vector3<f64>> {
        let (graph, weights) = (self.operator.graph(), self.operator.weights());
        let at = d.as_slice();
        filled(d.len(), |v: VertexId| {
            let row = graph.row(v.index());
            let ell: Vector3<f64> = row.map(|(j, k)| (at[j.index()] - d[v]) * weights[k]).sum();
            self.free(v, d[v] * self.areas[v] - ell * self.half_time)
        })
    }

    /// Divides by the diagonal.
    fn precondition(&self, residual: &VertexMap<Vector3<f64>>) -> VertexMap<Vector3<f64>> {
        let (graph, weights) = (self.operator.graph(), self.operator.weights());
        filled(residual.len(), |v: VertexId| {
            let sum: f64 = weights[graph.range(v.index())].iter().sum();
            let diagonal = self.areas[v] + self.half_time * sum.abs();
            if diagonal > 0.0 {
                residual[v] / diagonal
            } else {
                residual[v]
            }
        })
    }

    fn free(&self, v: VertexId, value: Vector3<f64>) -> Vector3<f64> {
        if self.is_held[v.index()] {
            Vector3::zeros()
        } else {
            value
        }
    }
}

/// Residual at which conjugate gradients stop, relative to the initial one.
const SOLVED: f64 = 1e-10;

/// Conjugate gradients need about the square root of the condition number: a few dozen steps.
const MAX_STEPS: usize = 1000;

/// One dot product per coordinate.
fn dots(a: &VertexMap<Vector3<f64>>, b: &VertexMap<Vector3<f64>>) -> Vector3<f64> {
    a.values()
        .zip(b.values())
        .map(|(a, b)| a.component_mul(b))
        .sum()
}

/// a/b, or 0 where b is 0 because that coordinate is already solved.
fn ratios(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector3<f64> {
    a.zip_map(b, |a, b| if b > 0.0 { a / b } else { 0.0 })
}

fn add(x: &mut VertexMap<Vector3<f64>>, y: &VertexMap<Vector3<f64>>, length: &Vector3<f64>) {
    for (x, y) in x.values_mut().zip(y.values()) {
        *x += y.component_mul(length);
    }
}
