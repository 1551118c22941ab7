//! Conjugate gradients, preconditioned by the square of a screened one-ring matrix.
//!
//! The three columns are one system, and the iteration ends by the energy norm. The iteration of
//! `cotan_sparse::Multigrid` differs in both: three systems, which end by their residuals.

use super::equation::{Equation, as_map};
use crate::error::LinearError;
use crate::linear_system::LinearSystem;
use cotan_parallel::{self as parallel, Chunks};
use cotan_sparse::SparseError;
use nalgebra::Vector3;

/// The vectors of one solve, of one `Vector3` per vertex each.
pub(super) const VECTORS: u64 = 8;

/// Iterates until the energy norm of the error is small. The three columns are one system of
/// three times the size, so that the iterates turn with the right-hand side.
pub(super) fn solve(
    equation: &Equation,
    screened: &LinearSystem,
    rhs: &[Vector3<f64>],
    x: &mut [Vector3<f64>],
    tolerance: f64,
) -> Result<usize, LinearError> {
    let n = x.len();
    let zeros = || vec![Vector3::zeros(); n];
    let (mut residual, mut between, mut product) = (zeros(), zeros(), zeros());
    equation.residual(rhs, x, &mut between, &mut residual);
    // xᵀ A x of the start; fixed values are constants and do not count.
    let start = CHUNKS.sum(n, |i| x[i].dot(&(rhs[i] - residual[i])) * free(equation, i));
    let mut z = precondition(equation, screened, &residual);
    let mut rho = dot(&residual, &z);
    let mut direction = z.clone();
    let target = tolerance * tolerance * f64::max(rho, start.abs());
    for iteration in 0..MAX_ITERATIONS {
        if rho <= target {
            return Ok(iteration);
        }
        equation.product(&direction, &mut between, &mut product);
        let alpha = rho / dot(&direction, &product);
        if !alpha.is_finite() {
            break;
        }
        parallel::update(
            (&mut *x, &mut residual[..], &direction[..], &product[..]),
            |_, (x, r, p, q)| {
                *x += p * alpha;
                *r -= q * alpha;
            },
        );
        z = precondition(equation, screened, &residual);
        let next = dot(&residual, &z);
        let beta = next / rho;
        rho = next;
        parallel::update((&mut direction[..], &z[..]), |_, (p, z)| {
            *p = z + *p * beta;
        });
    }
    let residual = (rho / f64::max(target, f64::MIN_POSITIVE)).sqrt() * tolerance;
    // Rounding may end the descent a little above a very small tolerance.
    if residual <= ACCEPTED {
        return Ok(MAX_ITERATIONS);
    }
    let unknowns = n;
    Err(SparseError::NotConverged { unknowns, residual }.into())
}

/// (S + C)⁻¹ m (S + C)⁻¹ r, with zeros at fixed vertices.
fn precondition(
    equation: &Equation,
    screened: &LinearSystem,
    residual: &[Vector3<f64>],
) -> Vec<Vector3<f64>> {
    let mut z = as_map(residual.to_vec());
    screened.solve_in_place(&mut z);
    parallel::update((z.as_mut_slice(), &equation.masses[..]), |_, (z, m)| {
        *z *= *m
    });
    screened.solve_in_place(&mut z);
    z.into_vec()
}

fn free(equation: &Equation, i: usize) -> f64 {
    if equation.is_fixed[i] { 0.0 } else { 1.0 }
}

fn dot(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    CHUNKS.sum(a.len(), |i| a[i].dot(&b[i]))
}

const CHUNKS: Chunks = Chunks::of(4096);

/// With a condition number of 2, twenty iterations reach the rounding error. Sharp steps of D/m
/// and rows that are left out need more.
const MAX_ITERATIONS: usize = 500;

/// The relative error that is still accepted.
const ACCEPTED: f64 = 1e-4;
