//! Conjugate gradients preconditioned by smoothed-aggregation multigrid: for meshes whose factor would
//! not fit into memory.
//!
//! Source: Vaněk, Mandel, Brezina, "Algebraic multigrid by smoothed aggregation", 1996; smoothing by
//! Chebyshev polynomials as in Adams, Brezina, Hu, Tuminaro, "Parallel multigrid smoothing", 2003.
//! The coarsest level is factorized.

mod aggregate;
mod level;

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::cholesky::Cholesky;
use crate::csr::Csr;
use crate::error::LinearError;
use crate::lower::LowerTriangle;
use level::Level;

/// Unknowns from which a level is coarsened further.
const COARSEST: usize = 6_000;
/// |residual| / |right-hand side| at which a solve ends.
const TOLERANCE: f64 = 1e-10;
/// Iterations after which a solve is given up.
const MOST_ITERATIONS: usize = 400;

/// A symmetric positive definite matrix, solved by iteration. Memory: about 300 bytes an unknown for a
/// one-ring matrix.
pub(crate) struct Multigrid {
    levels: Vec<Level>,
    coarsest: Cholesky,
    /// Work of the conjugate gradients.
    residual: Vec<Vector3<f64>>,
    direction: Vec<Vector3<f64>>,
    product: Vec<Vector3<f64>>,
}

impl Multigrid {
    /// Builds the hierarchy.
    ///
    /// # Errors
    /// [`LinearError::NotPositiveDefinite`] if a diagonal entry is not positive, a level does not get
    /// smaller, or the coarsest cannot be factorized; [`LinearError::Inaccurate`] if a solve does not
    /// converge.
    pub(crate) fn new(matrix: &LowerTriangle) -> Result<Self, LinearError> {
        let n = matrix.offsets.len() - 1;
        let not_positive = || LinearError::NotPositiveDefinite { unknowns: n };
        if matrix.values.iter().any(|v| !v.is_finite()) {
            return Err(not_positive());
        }
        let mut levels = Vec::new();
        let mut fine = Csr::from_lower(matrix);
        while fine.num_rows() > COARSEST {
            let (level, coarse) = Level::new(fine, levels.len()).ok_or_else(not_positive)?;
            levels.push(level);
            fine = coarse;
        }
        let coarsest = Cholesky::factor(&fine.to_lower())?;
        let zeros = vec![Vector3::zeros(); n];
        let mut multigrid = Self {
            levels,
            coarsest,
            residual: zeros.clone(),
            direction: zeros.clone(),
            product: zeros,
        };
        multigrid.check()?;
        Ok(multigrid)
    }

    /// Number of values of all levels and of the coarsest one's factor.
    pub(crate) fn num_entries(&self) -> usize {
        let levels: usize = self.levels.iter().map(Level::num_entries).sum();
        levels + self.coarsest.num_entries()
    }

    /// Solves one system and looks whether it converged.
    fn check(&mut self) -> Result<(), LinearError> {
        let n = self.residual.len();
        let mut x: Vec<Vector3<f64>> = (0..n)
            .map(|i| {
                let b = (i as f64 * 0.618_033_988_749_895).fract() - 0.5;
                Vector3::new(b, 0.0, 0.0)
            })
            .collect();
        let residual = self.solve(&mut x);
        if residual <= TOLERANCE {
            return Ok(());
        }
        Err(LinearError::Inaccurate {
            unknowns: n,
            residual,
        })
    }

    /// Overwrites right-hand sides by their solutions; returns the greatest relative residual of the
    /// three.
    pub(crate) fn solve(&mut self, rhs: &mut [Vector3<f64>]) -> f64 {
        let Some(fine) = self.levels.first() else {
            self.coarsest.solve(rhs);
            return 0.0;
        };
        let n = fine.matrix().num_rows();
        self.residual.copy_from_slice(rhs);
        let x = rhs;
        x.fill(Vector3::zeros());
        let target = norms(&self.residual) * TOLERANCE;
        let first = norms(&self.residual);
        self.direction.fill(Vector3::zeros());
        let mut rho = Vector3::repeat(0.0);
        let mut left = norms(&self.residual);
        for _ in 0..MOST_ITERATIONS {
            if (0..3).all(|axis| left[axis] <= target[axis]) {
                break;
            }
            let mut z = vec![Vector3::zeros(); n];
            self.precondition(&mut z);
            let new_rho = products(&self.residual, &z);
            let beta = quotient(new_rho, rho);
            rho = new_rho;
            combine(&mut self.direction, &z, |p, z| z + p.component_mul(&beta));
            self.levels[0]
                .matrix()
                .multiply(&self.direction, &mut self.product);
            let alpha = quotient(rho, products(&self.direction, &self.product));
            combine(x, &self.direction, |x, p| x + p.component_mul(&alpha));
            combine(&mut self.residual, &self.product, |r, q| {
                r - q.component_mul(&alpha)
            });
            left = norms(&self.residual);
            if !left.iter().all(|x| x.is_finite()) {
                break;
            }
        }
        quotient(left, first).amax()
    }

    /// z = one V-cycle on the residual.
    fn precondition(&mut self, z: &mut [Vector3<f64>]) {
        cycle(&mut self.levels, &mut self.coarsest, &self.residual, z);
    }
}

/// x = one V-cycle for A x = b, from x = 0.
fn cycle(
    levels: &mut [Level],
    coarsest: &mut Cholesky,
    b: &[Vector3<f64>],
    x: &mut [Vector3<f64>],
) {
    let Some((level, rest)) = levels.split_first_mut() else {
        x.copy_from_slice(b);
        coarsest.solve(x);
        return;
    };
    level.smooth(b, x);
    let restricted = level.restrict(b, x);
    let mut correction = vec![Vector3::zeros(); restricted.len()];
    cycle(rest, coarsest, &restricted, &mut correction);
    level.prolong(&correction, x);
    level.smooth(b, x);
}

/// Quotients axis by axis, 0 where the divisor is not positive: an axis that is solved already.
fn quotient(a: Vector3<f64>, b: Vector3<f64>) -> Vector3<f64> {
    a.zip_map(&b, |a, b| if b > 0.0 { a / b } else { 0.0 })
}

const CHUNK: usize = 4096;

/// Σ a_i b_i axis by axis, by partial sums in a fixed order.
fn products(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> Vector3<f64> {
    let sums: Vec<Vector3<f64>> = a
        .par_chunks(CHUNK)
        .zip(b.par_chunks(CHUNK))
        .map(|(a, b)| a.iter().zip(b).map(|(a, b)| a.component_mul(b)).sum())
        .collect();
    sums.into_iter().sum()
}

fn norms(a: &[Vector3<f64>]) -> Vector3<f64> {
    products(a, a).map(f64::sqrt)
}

fn combine(
    a: &mut [Vector3<f64>],
    b: &[Vector3<f64>],
    value: impl Fn(&Vector3<f64>, &Vector3<f64>) -> Vector3<f64> + Sync,
) {
    a.par_iter_mut()
        .zip(b)
        .with_min_len(CHUNK)
        .for_each(|(a, b)| *a = value(a, b));
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
        let rings = operator.rings();
        let mut matrix = LowerTriangle {
            offsets: vec![0],
            rows: vec![],
            values: vec![],
        };
        // Vertex 0 is the ground.
        for i in 1..rings.num_vertices() {
            let weights = || rings.ring(i).map(|(j, h)| (j, operator.weights()[h]));
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

    /// On a round and on a limbed mesh, with and without a shift: the factor's solution, in a number
    /// of iterations that is far from the limit.
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
                let residual = Multigrid::new(&matrix).unwrap().solve(&mut ours);
                Cholesky::factor(&matrix).unwrap().solve(&mut theirs);
                assert!(residual <= TOLERANCE, "{residual:e}");
                let size = theirs.iter().map(|x| x.amax()).fold(0.0, f64::max);
                for (a, b) in ours.iter().zip(&theirs) {
                    assert!((a - b).amax() < 1e-7 * size);
                }
            }
        }
    }
}
