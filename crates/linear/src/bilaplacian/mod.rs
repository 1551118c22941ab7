//! (S R S + D) x = b: fourth-order equations with every vertex held, such as those of filters
//! and of anchored thin plates.

mod direct;
mod equation;
mod iterative;

use std::sync::Arc;

use cotan_geometry::Scalar;
use cotan_halfedge::VertexId;
use cotan_laplacian::{Operator, Symmetry};
use nalgebra::Vector3;

use crate::error::LinearError;
use crate::linear_system::{LinearSystem, flags};
use crate::strategy::{Choice, Method, Reason, Strategy, SystemOptions};
use direct::Direct;
use equation::Equation;

/// The parts of a fourth-order equation; see [`BilaplacianSystem`].
#[derive(Clone, Copy, Debug)]
pub struct Bilaplacian<'a, T: Scalar> {
    /// The symmetric operator L, in the paper's sign: S = −L.
    pub operator: &'a Operator<T>,
    /// m, one positive number per vertex, usually its area.
    pub masses: &'a [f64],
    /// The vertices whose rows of S are left out of the square (R = 0 there), as on a boundary,
    /// where S x is not a curvature. R = 1/m elsewhere.
    pub without_row: &'a [bool],
    /// D, one positive number per vertex.
    pub diagonal: &'a [f64],
    /// The vertices whose x is given.
    pub fixed: &'a [VertexId],
}

/// A factorized or preconditioned fourth-order system:
///
/// ```text
/// S R S x + D x = b     at free vertices
///             x = given at fixed vertices
/// ```
///
/// with S = −L positive semi-definite, R = 1/m (or 0), and D > 0. It minimises
/// Σ_i R_i (S x)_i² + Σ_i D_i x_i² − 2 bᵀx.
///
/// There are two strategies. [`Strategy::Normal`] factorizes the matrix, whose pattern is the
/// two-ring of each vertex. [`Strategy::Iterative`] factorizes only the one-ring matrix
/// S + C with C_i = √(D_i m_i), and iterates with conjugate gradients, preconditioned by
/// (S + C) m⁻¹ (S + C). For uniform D/m the condition number is at most 2, because
/// λ² + μ² ≥ ½ (λ + μ)², so each iteration gains a factor of about six, whatever the mesh.
/// [`Strategy::Auto`] takes the first for small meshes and the second for others.
///
/// Another D needs a new factorization, but no new analysis of the pattern.
///
/// ```
/// use cotan_geometry::shapes::icosphere;
/// use cotan_laplacian::{Cotangent, Operator};
/// use cotan_linear::{Bilaplacian, BilaplacianSystem, SystemOptions};
/// use nalgebra::Vector3;
///
/// // Low-pass filter of the positions of a sphere: it only shrinks.
/// let shape = icosphere::<f64>(3);
/// let operator = Operator::assemble(&Cotangent::default(), &shape.surface())?;
/// let masses: Vec<f64> = shape.surface().dual_areas().into_vec();
/// let screen: Vec<f64> = masses.iter().map(|m| 100.0 * m).collect();
/// let equation = Bilaplacian {
///     operator: &operator,
///     masses: &masses,
///     without_row: &vec![false; masses.len()],
///     diagonal: &screen,
///     fixed: &[],
/// };
/// let system = BilaplacianSystem::prepare(&equation, SystemOptions::new())?;
/// let points = shape.positions().values().zip(&screen);
/// let rhs: Vec<Vector3<f64>> = points.map(|(p, d)| p.coords * *d).collect();
/// let mut x = vec![Vector3::zeros(); rhs.len()];
/// system.solve(&rhs, &mut x, 1e-8)?;
/// // S has no factor ½, so that the eigenvalue of positions is 4: 100 / (100 + 16).
/// assert!(x.iter().all(|x| (x.norm() - 100.0 / 116.0).abs() < 0.01));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct BilaplacianSystem {
    equation: Equation,
    solver: Solver,
    reason: Reason,
}

enum Solver {
    Direct(Direct),
    /// S + C.
    Iterative(Box<LinearSystem>),
}

impl std::fmt::Debug for BilaplacianSystem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("BilaplacianSystem")
            .field("vertices", &self.equation.masses.len())
            .field("choice", &self.choice())
            .finish_non_exhaustive()
    }
}

impl BilaplacianSystem {
    /// Prepares the system of an equation.
    ///
    /// Of the options, the strategy and the memory limit are used. With a limit that the matrix
    /// or its factor would exceed, [`Strategy::Auto`] iterates.
    ///
    /// # Errors
    /// [`LinearError`]: an operator that is not symmetric, arrays of another length than the
    /// operator, masses or a diagonal that are not positive, fixed vertices that do not exist or
    /// occur twice, a matrix that is not positive definite, more memory than is allowed, and
    /// [`LinearError::StrategyUnsuitable`] for [`Strategy::Columns`].
    pub fn prepare<T: Scalar>(
        equation: &Bilaplacian<'_, T>,
        options: SystemOptions,
    ) -> Result<Self, LinearError> {
        let own = Equation::new(equation)?;
        let direct = || Direct::prepare(&own, options.max_memory);
        let (solver, reason) = match options.strategy {
            Strategy::Normal => (Solver::Direct(direct()?), Reason::Requested),
            Strategy::Auto if direct::is_small(&own) => match direct() {
                Ok(direct) => (Solver::Direct(direct), Reason::Fastest),
                Err(LinearError::MemoryLimit { .. }) => (
                    iterative(equation, &own, options.max_memory)?,
                    Reason::Memory,
                ),
                Err(error) => return Err(error),
            },
            Strategy::Auto => (
                iterative(equation, &own, options.max_memory)?,
                Reason::Fastest,
            ),
            Strategy::Iterative => (
                iterative(equation, &own, options.max_memory)?,
                Reason::Requested,
            ),
            strategy @ Strategy::Columns => {
                return Err(LinearError::StrategyUnsuitable {
                    strategy,
                    reason: Reason::OtherMembrane,
                });
            }
        };
        Ok(Self {
            equation: own,
            solver,
            reason,
        })
    }

    /// Replaces D.
    ///
    /// # Errors
    /// As [`Self::prepare`]; the system is then unchanged.
    pub fn set_diagonal(&mut self, diagonal: &[f64]) -> Result<(), LinearError> {
        let equation = self.equation.with_diagonal(diagonal)?;
        match &mut self.solver {
            Solver::Direct(direct) => direct.refactor(&equation)?,
            Solver::Iterative(system) => system.set_diagonal(&equation.roots())?,
        }
        self.equation = equation;
        Ok(())
    }

    /// The strategy, and the reason for it.
    pub fn choice(&self) -> Choice {
        let method = match self.solver {
            Solver::Direct(_) => Method::Normal,
            Solver::Iterative(_) => Method::Iterative,
        };
        Choice {
            method,
            reason: self.reason,
        }
    }

    /// (S x)_i at every vertex, including those whose row is left out of the square.
    ///
    /// # Panics
    /// If `x` or `out` does not have one entry per vertex.
    pub fn laplacian(&self, x: &[Vector3<f64>], out: &mut [Vector3<f64>]) {
        self.equation.laplacian(x, out);
    }

    /// (S R y)_i: the right-hand side for which S x = y is wanted in the square.
    ///
    /// # Panics
    /// If `y` or `out` does not have one entry per vertex.
    pub fn right_hand_side(&self, y: &[Vector3<f64>], out: &mut [Vector3<f64>]) {
        self.equation.scaled_laplacian(y, out);
    }

    /// Solves for three columns at once, starting from `x`, which holds the given values of
    /// fixed vertices. Returns the number of iterations; 1 for a factorization.
    ///
    /// The iteration ends when the energy norm of the error is below `tolerance` times that of
    /// the solution, up to the condition number. A factorization ignores `tolerance`.
    ///
    /// # Errors
    /// [`LinearError::Sparse`] if the iteration does not converge, which happens where the
    /// entries of D/m differ by many orders of magnitude between neighbours.
    ///
    /// # Panics
    /// If `rhs` or `x` does not have one entry per vertex.
    pub fn solve(
        &self,
        rhs: &[Vector3<f64>],
        x: &mut [Vector3<f64>],
        tolerance: f64,
    ) -> Result<usize, LinearError> {
        let n = self.equation.masses.len();
        assert!(rhs.len() == n && x.len() == n, "one entry per vertex");
        match &self.solver {
            Solver::Direct(direct) => {
                direct.solve(&self.equation, rhs, x);
                Ok(1)
            }
            Solver::Iterative(system) => {
                iterative::solve(&self.equation, system, rhs, x, tolerance)
            }
        }
    }
}

fn iterative<T: Scalar>(
    equation: &Bilaplacian<'_, T>,
    own: &Equation,
    max_memory: Option<u64>,
) -> Result<Solver, LinearError> {
    let vectors = iterative::VECTORS * size_of::<Vector3<f64>>() as u64 * own.masses.len() as u64;
    let left = max_memory.map(|bytes| bytes.saturating_sub(vectors));
    let system =
        LinearSystem::screened_within(equation.operator, &own.roots(), equation.fixed, left)?;
    Ok(Solver::Iterative(Box::new(system)))
}
