//! Conjugate gradients preconditioned by smoothed-aggregation multigrid, for meshes whose factor
//! would not fit into memory.
//!
//! Source: Vaněk, Mandel, Brezina, "Algebraic multigrid by smoothed aggregation", 1996;
//! smoothing by Chebyshev polynomials as in Adams, Brezina, Hu, Tuminaro, "Parallel multigrid
//! smoothing", 2003. The coarsest level is factorized.

mod aggregate;
mod level;

use cotan_parallel::{self as parallel, Chunks};
use nalgebra::Vector3;

use crate::cholesky::Cholesky;
use crate::csr::Csr;
use crate::error::SparseError;
use crate::lower::LowerTriangle;
use crate::pool::Pool;
use level::{Level, LevelWork};

/// Number of unknowns from which a level is coarsened further.
const COARSEST: usize = 6_000;
/// The ratio |residual| / |right-hand side| at which a solve ends.
const TOLERANCE: f64 = 1e-10;
/// The maximum ratio |residual| / |right-hand side| that a solve may leave after all its
/// iterations.
///
/// If rounding keeps it from [`TOLERANCE`], a refinement by the caller still gains digits.
const ACCEPTED: f64 = 1e-8;
/// Maximum number of iterations of a solve.
const MAX_ITERATIONS: usize = 400;

/// A symmetric positive definite matrix, solved iteratively.
///
/// Memory: about 300 bytes per unknown for a one-ring matrix.
pub struct Multigrid {
    levels: Vec<Level>,
    coarsest: Cholesky,
    unknowns: usize,
    pool: Pool<Work>,
}

/// The memory of a solve, allocated once.
struct Work {
    residual: Vec<Vector3<f64>>,
    preconditioned: Vec<Vector3<f64>>,
    direction: Vec<Vector3<f64>>,
    product: Vec<Vector3<f64>>,
    levels: Vec<LevelWork>,
}

impl std::fmt::Debug for Multigrid {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Multigrid")
            .field("unknowns", &self.unknowns)
            .field("levels", &self.levels.len())
            .finish_non_exhaustive()
    }
}

impl Multigrid {
    /// Builds the hierarchy.
    ///
    /// # Errors
    /// [`SparseError::NotPositiveDefinite`] if a diagonal entry is not positive, a level does not
    /// get smaller, or the coarsest cannot be factorized; [`SparseError::Inaccurate`] if a solve
    /// does not converge.
    pub fn new(matrix: &LowerTriangle) -> Result<Self, SparseError> {
        let n = matrix.offsets.len() - 1;
        let not_positive = || SparseError::NotPositiveDefinite { unknowns: n };
        matrix.check_finite()?;
        let mut levels = Vec::new();
        let mut fine = Csr::from_lower(matrix);
        while fine.num_rows() > COARSEST {
            let (level, coarse) = Level::new(fine, levels.len()).ok_or_else(not_positive)?;
            levels.push(level);
            fine = coarse;
        }
        let coarsest = Cholesky::factor(&fine.to_lower())?;
        let multigrid = Self {
            levels,
            coarsest,
            unknowns: n,
            pool: Pool::new(),
        };
        multigrid.check()?;
        Ok(multigrid)
    }

    /// Number of values in all levels and in the factor of the coarsest one.
    pub fn num_entries(&self) -> usize {
        let levels: usize = self.levels.iter().map(Level::num_entries).sum();
        levels + self.coarsest.num_entries()
    }

    /// Solves one system, which must converge to the tolerance.
    fn check(&self) -> Result<(), SparseError> {
        let n = self.unknowns;
        let mut x: Vec<Vector3<f64>> = (0..n)
            .map(|i| {
                let b = (i as f64 * 0.618_033_988_749_895).fract() - 0.5;
                Vector3::new(b, 0.0, 0.0)
            })
            .collect();
        let residual = self.iterate(&mut x);
        if residual <= TOLERANCE {
            return Ok(());
        }
        Err(SparseError::Inaccurate {
            unknowns: n,
            residual,
        })
    }

    /// Overwrites right-hand sides with their solutions.
    ///
    /// Allocates nothing of the size of the matrix.
    ///
    /// # Errors
    /// [`SparseError::NotConverged`]; the contents of `rhs` are then meaningless.
    pub fn solve(&self, rhs: &mut [Vector3<f64>]) -> Result<(), SparseError> {
        let residual = self.iterate(rhs);
        if residual <= ACCEPTED {
            return Ok(());
        }
        Err(SparseError::NotConverged {
            unknowns: rhs.len(),
            residual,
        })
    }

    /// Iterates with conjugate gradients; returns the largest relative residual of the three
    /// systems.
    fn iterate(&self, rhs: &mut [Vector3<f64>]) -> f64 {
        assert_eq!(rhs.len(), self.unknowns, "one entry per unknown");
        match self.levels.first() {
            Some(fine) => self
                .pool
                .with(|| self.work(), |work| self.iterate_with(fine, work, rhs)),
            None => {
                self.coarsest.solve(rhs);
                0.0
            }
        }
    }

    fn work(&self) -> Work {
        let zeros = || vec![Vector3::zeros(); self.unknowns];
        Work {
            residual: zeros(),
            preconditioned: zeros(),
            direction: zeros(),
            product: zeros(),
            levels: self.levels.iter().map(Level::work).collect(),
        }
    }

    fn iterate_with(&self, fine: &Level, work: &mut Work, rhs: &mut [Vector3<f64>]) -> f64 {
        let Self {
            levels, coarsest, ..
        } = self;
        let Work {
            residual,
            preconditioned,
            direction,
            product,
            levels: of_levels,
        } = work;
        residual.copy_from_slice(rhs);
        let x = rhs;
        x.fill(Vector3::zeros());
        direction.fill(Vector3::zeros());
        let first = norms(residual);
        let target = first * TOLERANCE;
        let mut rho = Vector3::repeat(0.0);
        let mut left = first;
        for _ in 0..MAX_ITERATIONS {
            if (0..3).all(|axis| left[axis] <= target[axis]) {
                break;
            }
            preconditioned.fill(Vector3::zeros());
            cycle(levels, of_levels, coarsest, residual, preconditioned);
            let new_rho = products(residual, preconditioned);
            let beta = quotient(new_rho, rho);
            rho = new_rho;
            combine(direction, preconditioned, |p, z| z + p.component_mul(&beta));
            fine.matrix().multiply(direction, product);
            let alpha = quotient(rho, products(direction, product));
            combine(x, direction, |x, p| x + p.component_mul(&alpha));
            combine(residual, product, |r, q| r - q.component_mul(&alpha));
            left = norms(residual);
            if !left.iter().all(|x| x.is_finite()) {
                return f64::INFINITY;
            }
        }
        quotient(left, first).amax()
    }
}

/// Computes x = one V-cycle for A x = b, from x = 0.
fn cycle(
    levels: &[Level],
    work: &mut [LevelWork],
    coarsest: &Cholesky,
    b: &[Vector3<f64>],
    x: &mut [Vector3<f64>],
) {
    let (Some((level, coarser)), Some((work, works))) =
        (levels.split_first(), work.split_first_mut())
    else {
        x.copy_from_slice(b);
        coarsest.solve(x);
        return;
    };
    level.smooth(b, x, &mut work.step);
    level.restrict(b, x, work);
    work.correction.fill(Vector3::zeros());
    cycle(coarser, works, coarsest, &work.rhs, &mut work.correction);
    level.prolong(&work.correction, x);
    level.smooth(b, x, &mut work.step);
}

/// The quotients per axis, 0 if the divisor is not positive because the axis is already solved.
fn quotient(a: Vector3<f64>, b: Vector3<f64>) -> Vector3<f64> {
    a.zip_map(&b, |a, b| if b > 0.0 { a / b } else { 0.0 })
}

const CHUNKS: Chunks = Chunks::of(4096);

/// Σ a_i b_i per axis, by partial sums in a fixed order.
fn products(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> Vector3<f64> {
    CHUNKS.sum(a.len(), |i| a[i].component_mul(&b[i]))
}

fn norms(a: &[Vector3<f64>]) -> Vector3<f64> {
    products(a, a).map(f64::sqrt)
}

fn combine(
    a: &mut [Vector3<f64>],
    b: &[Vector3<f64>],
    value: impl Fn(&Vector3<f64>, &Vector3<f64>) -> Vector3<f64> + Sync,
) {
    parallel::update((a, b), |_, (a, b)| *a = value(a, b));
}

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::{creature, icosphere};
    use cotan_geometry::{Mesh, Surface};
    use cotan_laplacian::{Cotangent, Operator};

    use super::*;

    fn one_ring(shape: &Mesh<f64>, shift: f64) -> LowerTriangle {
        let surface = Surface::new(shape.connectivity(), shape.positions()).unwrap();
        let operator = Operator::assemble(&Cotangent::default(), &surface).unwrap();
        let graph = operator.graph();
        let mut matrix = LowerTriangle {
            offsets: vec![0],
            rows: vec![],
            values: vec![],
        };
        // Vertex 0 is grounded.
        for i in 1..graph.num_rows() {
            let weights = || graph.row(i).map(|(j, k)| (j, operator.weights()[k]));
            matrix.rows.push(i as u32 - 1);
            matrix
                .values
                .push(shift + weights().map(|(_, w)| w).sum::<f64>());
            for (j, w) in weights().filter(|(j, _)| j.index() > i) {
                matrix.rows.push(j.index() as u32 - 1);
                matrix.values.push(-w);
            }
            matrix.offsets.push(matrix.rows.len());
        }
        matrix
    }

    /// On a round and on a limbed mesh, with and without a shift, the solution matches that of
    /// the factorization, after far fewer iterations than the limit.
    #[test]
    fn agrees_with_the_factorization() {
        for shape in [icosphere(6), creature(110)] {
            for shift in [0.0, 0.1] {
                let matrix = one_ring(&shape, shift);
                let n = matrix.offsets.len() - 1;
                assert!(n > COARSEST);
                let rhs: Vec<Vector3<f64>> = (0..n)
                    .map(|i| Vector3::new((i as f64).sin(), (0.1 * i as f64).cos(), 0.0))
                    .collect();
                let (mut ours, mut theirs) = (rhs.clone(), rhs);
                let residual = Multigrid::new(&matrix).unwrap().iterate(&mut ours);
                Cholesky::factor(&matrix).unwrap().solve(&mut theirs);
                assert!(residual <= TOLERANCE, "{residual:e}");
                let size = theirs.iter().map(|x| x.amax()).fold(0.0, f64::max);
                for (a, b) in ours.iter().zip(&theirs) {
                    assert!((a - b).amax() < 1e-7 * size);
                }
            }
        }
    }

    /// For a right-hand side that is not finite there is no solution to converge to.
    #[test]
    fn a_solve_that_does_not_converge_is_an_error() {
        let matrix = one_ring(&icosphere(6), 0.0);
        let n = matrix.offsets.len() - 1;
        let multigrid = Multigrid::new(&matrix).unwrap();
        let mut x = vec![Vector3::repeat(1.0); n];
        x[n / 2].y = f64::NAN;
        let error = multigrid.solve(&mut x).unwrap_err();
        assert!(matches!(error, SparseError::NotConverged { .. }));
        // The failure has no lasting effect.
        let mut x = vec![Vector3::repeat(1.0); n];
        multigrid.solve(&mut x).unwrap();
    }
}
