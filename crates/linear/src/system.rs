//! The system itself.

use cotan_geometry::Scalar;
use cotan_halfedge::{VertexId, VertexMap};
use cotan_laplacian::Operator;
use cotan_parallel as parallel;
use nalgebra::Vector3;

use crate::columns::Columns;
use crate::defect::Defect;
use crate::error::LinearError;
use crate::handles::{Handle, Hold};
use crate::normal::NormalEquations;
use crate::plan::{Plan, Solver};
use crate::problem::{Membrane, Problem};
use crate::pseudo_inverse::Means;
use crate::storage::Storage;
use crate::strategy::{Choice, SystemOptions};
use crate::ties::Tie;

/// A least-squares system with handles, factorized.
///
/// It answers one question, as often as it is asked: by which δ must the positions x be corrected
/// so that x + δ minimises
///
/// ```text
/// |L(x + δ) − ℓ|² + μ (membrane) + Σ_soft k²|x + δ − u|²,    δ = 0 at hard handles?
/// ```
///
/// There is more than one way to that answer: see [`crate::Strategy`]. The handles may be
/// exchanged ([`Self::set_handles`]), and so may the weights ([`Self::refactor`]).
///
/// **Source**: paper, equations 3 and 8, as a correction (see the crate's docs).
pub struct PreparedSystem {
    problem: Problem,
    options: SystemOptions,
    solver: Solver,
    choice: Choice,
}

impl std::fmt::Debug for PreparedSystem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PreparedSystem")
            .field("unknowns", &self.num_unknowns())
            .field("membrane", &self.problem.membrane_weight())
            .field("choice", &self.choice)
            .field("factor_entries", &self.factor_entries())
            .finish_non_exhaustive()
    }
}

impl PreparedSystem {
    /// Assembles and factorizes the system of `operator` with `handles`, by the strategy that is
    /// predicted to be the fastest.
    ///
    /// # Errors
    /// [`LinearError`]: no handle, a component without one, a handle that does not exist or is
    /// given twice, a weight that is no positive number, a matrix that cannot be factorized.
    pub fn prepare<T: Scalar>(
        operator: &Operator<T>,
        handles: &[Handle],
        membrane: Option<Membrane<'_>>,
    ) -> Result<Self, LinearError> {
        Self::prepare_with(operator, handles, membrane, &SystemOptions::default())
    }

    /// As [`Self::prepare`], with a strategy or a limit of memory of one's own.
    ///
    /// # Errors
    /// As [`Self::prepare`]; [`LinearError::StrategyUnsuitable`] and
    /// [`LinearError::IllConditioned`] for a strategy that was asked for and cannot serve;
    /// [`LinearError::MemoryLimit`] before anything is factorized.
    pub fn prepare_with<T: Scalar>(
        operator: &Operator<T>,
        handles: &[Handle],
        membrane: Option<Membrane<'_>>,
        options: &SystemOptions,
    ) -> Result<Self, LinearError> {
        Self::prepare_tied(operator, handles, membrane, &[], options)
    }

    /// As [`Self::prepare_with`], with springs between points that no edge joins, as a part of the
    /// membrane. A component needs no handle if ties join it to one that has. Without a membrane
    /// there are no ties.
    ///
    /// # Errors
    /// As [`Self::prepare_with`], and [`LinearError::Tie`].
    pub fn prepare_tied<T: Scalar>(
        operator: &Operator<T>,
        handles: &[Handle],
        membrane: Option<Membrane<'_>>,
        ties: &[Tie],
        options: &SystemOptions,
    ) -> Result<Self, LinearError> {
        let problem = Problem::new(operator, handles, membrane, ties)?;
        let plan = Plan::new(&problem, &problem.held, options, None)?;
        let (solver, choice) = plan.carry_out(
            |means| factor_columns(&problem, means),
            |storage| factor_normal(&problem, storage),
        )?;
        let system = Self {
            problem,
            options: *options,
            solver,
            choice,
        };
        system.log("prepared");
        Ok(system)
    }

    /// Holds other vertices, or the same ones otherwise. By [`crate::Strategy::Columns`] nothing
    /// is factorized: vertices that stay handles keep their columns, and three new ones cost two
    /// solves. [`crate::Strategy::Normal`] factorizes again; with [`crate::Strategy::Auto`]
    /// whatever is predicted to be the faster from here on is done.
    ///
    /// # Errors
    /// As [`Self::prepare_with`]; the system is then what it was.
    pub fn set_handles(&mut self, handles: &[Handle]) -> Result<(), LinearError> {
        let held = self.problem.hold(handles)?;
        let at_hand = Some((&self.solver, self.choice.method));
        let mut plan = Plan::new(&self.problem, &held, &self.options, at_hand)?;
        let is_same = plan.choice.method == self.choice.method;
        if let (true, Solver::Columns(columns)) = (is_same, &mut self.solver) {
            match columns.set_handles(&self.problem, &held) {
                Ok(()) => {
                    self.problem.held = held;
                    self.log("handles exchanged");
                    return Ok(());
                }
                Err(error) => plan = plan.after(error)?,
            }
        }
        let before = std::mem::replace(&mut self.problem.held, held);
        let problem = &self.problem;
        match plan.carry_out(
            |means| factor_columns(problem, means),
            |storage| factor_normal(problem, storage),
        ) {
            Ok((solver, choice)) => {
                (self.solver, self.choice) = (solver, choice);
                self.log("prepared again");
                Ok(())
            }
            Err(error) => {
                self.problem.held = before;
                Err(error)
            }
        }
    }

    /// Takes other weights on the same mesh, and another membrane: new numbers in the same
    /// pattern, which is not analysed again, and new columns.
    ///
    /// # Errors
    /// As [`Self::prepare_with`], and [`LinearError::DifferentMesh`]; the system is then what it
    /// was.
    pub fn refactor<T: Scalar>(
        &mut self,
        operator: &Operator<T>,
        membrane: Option<Membrane<'_>>,
    ) -> Result<(), LinearError> {
        let problem = self.problem.reweighted(operator, membrane)?;
        let at_hand = Some((&self.solver, self.choice.method));
        let plan = Plan::new(&problem, &problem.held, &self.options, at_hand)?;
        let is_same = plan.choice.method == self.choice.method;
        (self.solver, self.choice) = plan.carry_out(
            |means| match &self.solver {
                Solver::Columns(columns) if is_same => {
                    Ok(Solver::Columns(Box::new(columns.refactor(&problem)?)))
                }
                _ => factor_columns(&problem, means),
            },
            |storage| match &self.solver {
                Solver::Normal(normal) => Ok(Solver::Normal(Box::new(normal.refactor(&problem)?))),
                Solver::Columns(_) => factor_normal(&problem, storage),
            },
        )?;
        self.problem = problem;
        self.log("refactorized");
        Ok(())
    }

    /// The method that solves the system, and the reason for it.
    pub fn choice(&self) -> Choice {
        self.choice
    }

    /// Number of vertices that are not held exactly.
    pub fn num_unknowns(&self) -> usize {
        self.problem.num_vertices() - self.problem.held.num_hard
    }

    /// Number of values in the factors, eight bytes each.
    pub fn factor_entries(&self) -> usize {
        match &self.solver {
            Solver::Normal(normal) => normal.num_entries(),
            Solver::Columns(columns) => columns.num_entries(),
        }
    }

    /// Stiffness of the spring that holds a vertex, (k · mean |L_ii|)²: 0 for all but soft
    /// handles.
    pub fn spring(&self, vertex: VertexId) -> f64 {
        self.problem.held.spring(vertex.index())
    }

    /// The right-hand side of a correction: half the negative gradient of the energy,
    ///
    /// ```text
    /// r = Lᵀ (ℓ − Lx) + μ tension + k² (u − x)       (0 at hard handles)
    /// ```
    ///
    /// # Panics
    /// If a map has not one entry per vertex.
    pub fn residual(&self, defect: &Defect<'_>, out: &mut VertexMap<Vector3<f64>>) {
        defect.check(self.problem.num_vertices());
        assert_eq!(
            out.len(),
            self.problem.num_vertices(),
            "one entry per vertex"
        );
        parallel::fill(out.as_mut_slice(), |i| self.problem.residual_at(defect, i));
        for handle in &self.problem.held.handles {
            if handle.hold == Hold::Hard {
                out[handle.vertex] = Vector3::zeros();
            }
        }
    }

    /// As [`Self::residual`] at one vertex, also where it is a hard handle: less the force by
    /// which the handle is held.
    ///
    /// # Panics
    /// If a map has not one entry per vertex, or the vertex does not exist.
    pub fn residual_at(&self, defect: &Defect<'_>, vertex: VertexId) -> Vector3<f64> {
        defect.check(self.problem.num_vertices());
        self.problem.residual_at(defect, vertex.index())
    }

    /// The correction δ, the solution for [`Self::residual`]; 0 at hard handles. Allocates nothing
    /// of the size of the mesh.
    ///
    /// # Errors
    /// [`SparseError::NotConverged`](crate::SparseError) by [`crate::Strategy::Iterative`]; the
    /// correction is then of no use.
    ///
    /// # Panics
    /// If a map has not one entry per vertex.
    pub fn correct(
        &mut self,
        defect: &Defect<'_>,
        correction: &mut VertexMap<Vector3<f64>>,
    ) -> Result<(), LinearError> {
        let n = self.problem.num_vertices();
        defect.check(n);
        assert_eq!(correction.len(), n, "one entry per vertex");
        let correction = correction.as_mut_slice();
        match &mut self.solver {
            Solver::Normal(normal) => {
                normal.correct(|i| self.problem.residual_at(defect, i), correction);
                Ok(())
            }
            Solver::Columns(columns) => columns.correct(defect, &self.problem, correction),
        }
    }

    /// As [`Self::correct`], if the [`Self::residual`] of the same defect is known already.
    ///
    /// # Errors
    /// As [`Self::correct`].
    ///
    /// # Panics
    /// If a map has not one entry per vertex.
    pub fn correct_residual(
        &mut self,
        defect: &Defect<'_>,
        residual: &VertexMap<Vector3<f64>>,
        correction: &mut VertexMap<Vector3<f64>>,
    ) -> Result<(), LinearError> {
        let n = self.problem.num_vertices();
        assert_eq!(residual.len(), n, "one entry per vertex");
        match &mut self.solver {
            Solver::Normal(normal) => {
                assert_eq!(correction.len(), n, "one entry per vertex");
                let residual = residual.as_slice();
                normal.correct(|i| residual[i], correction.as_mut_slice());
                Ok(())
            }
            Solver::Columns(_) => self.correct(defect, correction),
        }
    }

    fn log(&self, event: &str) {
        tracing::debug!(
            unknowns = self.num_unknowns(),
            strategy = self.choice.method.name(),
            reason = self.choice.reason.as_str(),
            factor_entries = self.factor_entries(),
            "{event}"
        );
    }
}

fn factor_columns(problem: &Problem, means: &Means) -> Result<Solver, LinearError> {
    Ok(Solver::Columns(Box::new(Columns::factor(problem, means)?)))
}

fn factor_normal(problem: &Problem, storage: &Storage) -> Result<Solver, LinearError> {
    let normal = NormalEquations::factor(problem, storage)?;
    Ok(Solver::Normal(Box::new(normal)))
}

#[cfg(test)]
mod tests {
    use cotan_geometry::testing::surfaces;
    use cotan_laplacian::{Cotangent, LaplacianScheme, Tutte};
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    use super::*;
    use crate::Method;

    /// The correction by dense normal equations, for one coordinate.
    fn dense(
        operator: &Operator<f64>,
        handles: &[Handle],
        membrane: Option<Membrane<'_>>,
        right: &DVector<f64>,
    ) -> DVector<f64> {
        let l = DMatrix::from(&operator.matrix());
        let n = l.nrows();
        let mut m = l.transpose() * &l;
        if let Some(Membrane { weight, weights }) = membrane {
            for i in 0..n {
                for (j, k) in operator.graph().row(i) {
                    m[(i, i)] += weight * (0.5 * weights[k]);
                    m[(i, j.index())] -= weight * (0.5 * weights[k]);
                }
            }
        }
        let mut right = right.clone();
        for handle in handles {
            let i = handle.vertex.index();
            match handle.hold {
                Hold::Soft(k) => m[(i, i)] += (k * operator.mean_diagonal()).powi(2),
                Hold::Hard => {
                    m.row_mut(i).fill(0.0);
                    m.column_mut(i).fill(0.0);
                    m[(i, i)] = 1.0;
                    right[i] = 0.0;
                }
            }
        }
        m.lu().solve(&right).unwrap()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        #[test]
        fn agrees_with_dense_normal_equations(
            shape in surfaces(), symmetric in any::<bool>(), soft in any::<bool>(),
            weight in 0.0f64..2.0, seed in 0u32..1000,
        ) {
            prop_assume!(shape.positions().len() <= 150);
            let n = shape.positions().len();
            let scheme: Box<dyn LaplacianScheme<f64>> =
                if symmetric { Box::new(Cotangent::default()) } else { Box::new(Tutte) };
            let operator = Operator::assemble(&*scheme, &shape.surface())?;
            let mut handles = vec![Handle::hard(VertexId::new(0))];
            if soft {
                handles.push(Handle::soft(VertexId::new(n - 1), 3.0));
            }
            let weights = vec![1.4; operator.graph().num_entries()];
            let membrane = Some(Membrane { weight, weights: &weights });
            let mut system = PreparedSystem::prepare(&operator, &handles, membrane)?;

            let vector = |i: usize, phase: f64| {
                let t = f64::from(seed) + i as f64;
                Vector3::new((t + phase).sin(), (2.0 * t - phase).cos(), (3.0 * t * phase).sin())
            };
            let map = |phase: f64| VertexMap::from_vec((0..n).map(|i| vector(i, phase)).collect());
            let (mismatch, pull) = (map(0.3), map(2.7));
            // As any that comes of an energy: without a sum over a component.
            let components = shape.connectivity().components();
            let mut sums = vec![(Vector3::zeros(), 0.0); components.count()];
            for (v, t) in map(1.1).iter() {
                let (sum, count) = &mut sums[components.of(v)];
                *sum += t;
                *count += 1.0;
            }
            let tension = VertexMap::from_fn(n, |v: VertexId| {
                let (sum, count) = sums[components.of(v)];
                vector(v.index(), 1.1) - sum / count
            });
            let mut correction = VertexMap::filled(n, Vector3::zeros());
            let defect = Defect::of_laplacian(&mismatch).with_tension(&tension).with_pull(&pull);
            system.correct(&defect, &mut correction)?;

            let l = DMatrix::from(&operator.matrix());
            for axis in 0..3 {
                let column = |map: &VertexMap<Vector3<f64>>| {
                    DVector::from_iterator(n, map.values().map(|v| v[axis]))
                };
                // The operator is the negative of the matrix.
                let mut right = -(l.transpose() * column(&mismatch)) + column(&tension) * weight;
                if soft {
                    let k = 3.0 * operator.mean_diagonal();
                    right[n - 1] += k * k * pull.as_slice()[n - 1][axis];
                }
                let expected = dense(&operator, &handles, membrane, &right);
                let scale = expected.amax().max(1.0);
                for (i, x) in expected.iter().enumerate() {
                    let ours = correction.as_slice()[i][axis];
                    prop_assert!((ours - x).abs() <= 1e-5 * scale, "{} {} {}", i, ours, x);
                }
            }
            prop_assert_eq!(correction.as_slice()[0], Vector3::zeros());
        }
    }

    /// One hard handle on a closed mesh: the one-ring matrix gives what the normal equations give.
    #[test]
    fn a_grounded_solve_minimises_the_same_sum() {
        let shape = cotan_geometry::shapes::creature::<f64>(40);
        let n = shape.positions().len();
        let operator = Operator::assemble(&Cotangent::default(), &shape.surface()).unwrap();
        let handle = Handle::hard(VertexId::new(7));
        let mut system = PreparedSystem::prepare(&operator, &[handle], None).unwrap();
        assert_eq!(system.choice().method, Method::Columns);
        let mismatch = VertexMap::from_fn(n, |v: VertexId| {
            let t = v.index() as f64;
            Vector3::new(t.sin(), (1.3 * t).cos(), (0.7 * t).sin())
        });
        let zeros = VertexMap::filled(n, Vector3::zeros());
        let (mut residual, mut correction) = (zeros.clone(), zeros);
        let defect = Defect::of_laplacian(&mismatch);
        system.residual(&defect, &mut residual);
        system.correct(&defect, &mut correction).unwrap();
        // At the minimum the residual of what is left vanishes.
        let moved = correction.map(|d| nalgebra::Point3::from(*d));
        let left = VertexMap::from_fn(n, |v: VertexId| {
            mismatch[v] - operator.apply_at(&moved, v.index())
        });
        let size = residual.values().map(|r| r.norm()).fold(0.0, f64::max);
        system.residual(&Defect::of_laplacian(&left), &mut residual);
        assert!(residual.values().all(|r| r.norm() < 1e-9 * size));
        assert_eq!(correction.as_slice()[7], Vector3::zeros());
    }

    #[test]
    fn refuses_what_cannot_hold_the_mesh() {
        let shape = cotan_geometry::shapes::icosphere::<f64>(1);
        let operator = Operator::assemble(&Cotangent::default(), &shape.surface()).unwrap();
        let v = VertexId::new(3);
        let refused = |handles: &[Handle]| {
            PreparedSystem::prepare(&operator, handles, None)
                .map(|_| ())
                .unwrap_err()
        };
        assert_eq!(refused(&[]), LinearError::NoHandles);
        assert_eq!(
            refused(&[Handle::hard(v), Handle::soft(v, 1.0)]),
            LinearError::DuplicateHandle { vertex: v }
        );
        assert_eq!(
            refused(&[Handle::soft(v, -2.0)]),
            LinearError::HandleWeight {
                vertex: v,
                weight: -2.0
            }
        );
        assert_eq!(
            refused(&[Handle::hard(VertexId::new(42))]),
            LinearError::HandleOutOfRange {
                vertex: VertexId::new(42),
                num_vertices: 42
            }
        );
        let weights = vec![2.0; operator.graph().num_entries()];
        let membrane = Some(Membrane {
            weight: -1.0,
            weights: &weights,
        });
        assert_eq!(
            PreparedSystem::prepare(&operator, &[Handle::hard(v)], membrane)
                .map(|_| ())
                .unwrap_err(),
            LinearError::MembraneWeight(-1.0)
        );
    }

    #[test]
    fn all_vertices_may_be_handles() {
        let shape = cotan_geometry::shapes::tetrahedron::<f64>();
        let operator = Operator::assemble(&Cotangent::default(), &shape.surface()).unwrap();
        let handles: Vec<Handle> = shape.connectivity().vertices().map(Handle::hard).collect();
        let mut system = PreparedSystem::prepare(&operator, &handles, None).unwrap();
        assert_eq!(system.num_unknowns(), 0);
        let zeros = VertexMap::filled(4, Vector3::zeros());
        let mut correction = VertexMap::filled(4, Vector3::x());
        let defect = Defect::of_laplacian(&zeros);
        system.correct(&defect, &mut correction).unwrap();
        assert!(correction.values().all(|d| *d == Vector3::zeros()));
    }
}
