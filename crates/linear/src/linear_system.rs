//! (D − L) x = b with fixed values: harmonic fields, Poisson's equation, implicit steps of
//! diffusion.

use std::sync::Arc;

use cotan_geometry::Scalar;
use cotan_halfedge::{VertexId, VertexMap};
use cotan_laplacian::{Graph, Operator, Symmetry};
use cotan_sparse::{Cholesky, LowerTriangle};
use nalgebra::{DMatrix, Vector3};

use crate::components::GraphComponents;
use crate::error::LinearError;
use crate::one_ring;
use crate::storage::{Limit, Storage};
use crate::strategy::Strategy;
use crate::weights::Weights;

/// A linear system on the vertices of a mesh, factorized:
///
/// ```text
/// d_i x_i − Σ_j w_ij (x_j − x_i) = b_i     at free vertices
///                            x_i = given   at fixed vertices
/// ```
///
/// with the weights w of a symmetric operator and d ≥ 0. Without d this is Poisson's equation for
/// the negative Laplacian (b = 0: a harmonic field); with masses over a time step for d it is an
/// implicit step of diffusion.
///
/// **The right-hand side**: the weights of [`Cotangent`](cotan_laplacian::Cotangent) carry no ½,
/// so they stand for twice the integrated Laplacian. For −Δu = f give b_i = 2 A_i f_i, with A_i
/// the dual area of the vertex (`Surface::dual_areas`); for c u − Δu = f also
/// d_i = 2 A_i c. Values are `f64`, also for a mesh of `f32`. On a boundary that is not fixed the
/// normal derivative is zero (Neumann's condition).
///
/// The equations of fixed vertices are left out: this is not what a
/// [`PreparedSystem`](crate::PreparedSystem) does, which minimises the squares of *all* rows and
/// so gives a biharmonic field.
///
/// Solves take `&self`. New weights, another diagonal and other fixed vertices need no new
/// analysis of the pattern, only a new factorization.
///
/// ```
/// use cotan_geometry::shapes::icosphere;
/// use cotan_halfedge::{VertexId, VertexMap};
/// use cotan_laplacian::{Cotangent, Operator};
/// use cotan_linear::LinearSystem;
///
/// let shape = icosphere::<f64>(2);
/// let operator = Operator::assemble(&Cotangent::default(), &shape.surface())?;
/// let [cold, hot] = [0, 1].map(VertexId::new);
/// let system = LinearSystem::poisson(&operator, &[cold, hot])?;
/// let mut given = VertexMap::filled(shape.positions().len(), 0.0);
/// given[hot] = 1.0;
/// let temperature = system.solve(&given);
/// assert!(temperature.values().all(|t| (0.0..=1.0).contains(t)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct LinearSystem {
    graph: Arc<Graph>,
    components: GraphComponents,
    equation: Equation,
    cholesky: Cholesky,
}

/// The parts of the matrix.
#[derive(Clone)]
struct Equation {
    weights: Arc<Weights>,
    /// d, or nothing for zeros.
    diagonal: Vec<f64>,
    fixed: Vec<VertexId>,
    is_fixed: Vec<bool>,
}

impl std::fmt::Debug for LinearSystem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LinearSystem")
            .field("vertices", &self.graph.num_rows())
            .field("fixed", &self.equation.fixed.len())
            .field("factor_entries", &self.cholesky.num_entries())
            .finish_non_exhaustive()
    }
}

impl LinearSystem {
    /// −L x = b with some vertices fixed.
    ///
    /// # Errors
    /// [`LinearError`]: an operator that is not symmetric, a vertex that does not exist or is
    /// given twice, a component without a fixed vertex ([`LinearError::Singular`]), or weights
    /// that do not make a positive definite matrix.
    pub fn poisson<T: Scalar>(
        operator: &Operator<T>,
        fixed: &[VertexId],
    ) -> Result<Self, LinearError> {
        Self::new(operator, &[], fixed, None)
    }

    /// (D − L) x = b with some vertices fixed, or none.
    ///
    /// **Shapes**: one entry of the diagonal D per vertex, at least 0.
    ///
    /// # Errors
    /// As [`Self::poisson`]; a component needs a fixed vertex or a positive entry of D; a diagonal
    /// of another length ([`LinearError::DiagonalLength`]).
    pub fn screened<T: Scalar>(
        operator: &Operator<T>,
        diagonal: &[f64],
        fixed: &[VertexId],
    ) -> Result<Self, LinearError> {
        Self::screened_within(operator, diagonal, fixed, None)
    }

    /// As [`Self::screened`], within so many bytes of memory.
    ///
    /// # Errors
    /// As [`Self::screened`], and [`LinearError::MemoryLimit`] before anything is factorized.
    pub fn screened_within<T: Scalar>(
        operator: &Operator<T>,
        diagonal: &[f64],
        fixed: &[VertexId],
        max_memory: Option<u64>,
    ) -> Result<Self, LinearError> {
        check_diagonal_length(operator.num_rows(), diagonal)?;
        Self::new(operator, diagonal, fixed, max_memory)
    }

    fn new<T: Scalar>(
        operator: &Operator<T>,
        diagonal: &[f64],
        fixed: &[VertexId],
        max_memory: Option<u64>,
    ) -> Result<Self, LinearError> {
        let graph = operator.graph().clone();
        let components = GraphComponents::new(&graph);
        let equation = Equation {
            weights: Arc::new(weigh(operator)?),
            diagonal: diagonal.to_vec(),
            is_fixed: flags(graph.num_rows(), fixed)?,
            fixed: fixed.to_vec(),
        };
        let storage = Storage {
            limit: max_memory.map(|permitted| Limit {
                strategy: Strategy::Normal,
                factors: 1,
                in_addition: 0,
                permitted,
            }),
            ..Storage::default()
        };
        let cholesky = storage.factor(&equation.matrix(&graph, &components)?)?;
        Ok(Self {
            graph,
            components,
            equation,
            cholesky,
        })
    }

    /// Takes the weights of another operator on the same mesh.
    ///
    /// # Errors
    /// As [`Self::screened`], and [`LinearError::DifferentMesh`]; the system is then what it was.
    pub fn set_operator<T: Scalar>(&mut self, operator: &Operator<T>) -> Result<(), LinearError> {
        self.check_mesh(operator)?;
        self.change(Equation {
            weights: Arc::new(weigh(operator)?),
            ..self.equation.clone()
        })
    }

    /// Takes the weights of another operator on the same mesh and another diagonal D at once.
    ///
    /// # Errors
    /// As [`Self::set_operator`].
    pub fn set_screened<T: Scalar>(
        &mut self,
        operator: &Operator<T>,
        diagonal: &[f64],
    ) -> Result<(), LinearError> {
        check_diagonal_length(self.graph.num_rows(), diagonal)?;
        self.check_mesh(operator)?;
        self.change(Equation {
            weights: Arc::new(weigh(operator)?),
            diagonal: diagonal.to_vec(),
            ..self.equation.clone()
        })
    }

    /// Takes another diagonal D.
    ///
    /// # Errors
    /// As [`Self::screened`]; the system is then what it was.
    pub fn set_diagonal(&mut self, diagonal: &[f64]) -> Result<(), LinearError> {
        check_diagonal_length(self.graph.num_rows(), diagonal)?;
        self.change(Equation {
            diagonal: diagonal.to_vec(),
            ..self.equation.clone()
        })
    }

    /// Fixes other vertices.
    ///
    /// # Errors
    /// As [`Self::screened`]; the system is then what it was.
    pub fn set_fixed(&mut self, fixed: &[VertexId]) -> Result<(), LinearError> {
        self.change(Equation {
            is_fixed: flags(self.graph.num_rows(), fixed)?,
            fixed: fixed.to_vec(),
            ..self.equation.clone()
        })
    }

    fn check_mesh<T: Scalar>(&self, operator: &Operator<T>) -> Result<(), LinearError> {
        if Arc::ptr_eq(&self.graph, operator.graph()) || *self.graph == **operator.graph() {
            return Ok(());
        }
        Err(LinearError::DifferentMesh)
    }

    fn change(&mut self, equation: Equation) -> Result<(), LinearError> {
        let matrix = equation.matrix(&self.graph, &self.components)?;
        self.cholesky = self.cholesky.factor_like(&matrix)?;
        self.equation = equation;
        Ok(())
    }

    /// The fixed vertices.
    pub fn fixed(&self) -> &[VertexId] {
        &self.equation.fixed
    }

    /// The solution for one number per vertex.
    ///
    /// **Shapes**: `given` holds b_i at free vertices and the value at fixed ones; so does the
    /// result, with x_i in the place of b_i.
    ///
    /// # Panics
    /// If `given` has not one entry per vertex.
    #[must_use]
    pub fn solve(&self, given: &VertexMap<f64>) -> VertexMap<f64> {
        let mut x = given.clone();
        self.overwrite(x.as_mut_slice(), |x| self.cholesky.solve_one(x));
        x
    }

    /// As [`Self::solve`] for one vector per vertex, in place: three systems for the price of
    /// little more than one. Allocates nothing of the size of the mesh.
    ///
    /// # Panics
    /// If `x` has not one entry per vertex.
    pub fn solve_in_place(&self, x: &mut VertexMap<Vector3<f64>>) {
        self.overwrite(x.as_mut_slice(), |x| self.cholesky.solve(x));
    }

    /// As [`Self::solve`] for any number of columns.
    ///
    /// **Shapes**: one row per vertex, one column per system.
    ///
    /// # Panics
    /// If `given` has not one row per vertex.
    #[must_use]
    pub fn solve_columns(&self, given: &DMatrix<f64>) -> DMatrix<f64> {
        let mut solution = given.clone();
        let n = given.nrows();
        for first in (0..given.ncols()).step_by(LANES) {
            let columns = first..given.ncols().min(first + LANES);
            if columns.len() == 1 {
                let x = solution.column_mut(first).data.into_slice_mut();
                self.overwrite(x, |x| self.cholesky.solve_one(x));
                continue;
            }
            let mut x = vec![Vector3::zeros(); n];
            for (lane, column) in columns.clone().enumerate() {
                for (x, value) in x.iter_mut().zip(given.column(column).iter()) {
                    x[lane] = *value;
                }
            }
            self.overwrite(&mut x, |x| self.cholesky.solve(x));
            for (lane, column) in columns.enumerate() {
                for (value, x) in solution.column_mut(column).iter_mut().zip(&x) {
                    *value = x[lane];
                }
            }
        }
        solution
    }

    /// Moves the fixed values to the right-hand sides of their neighbours, solves, and puts them
    /// back.
    fn overwrite<X>(&self, x: &mut [X], solve: impl FnOnce(&mut [X]))
    where
        X: Copy + Default + std::ops::AddAssign + std::ops::Mul<f64, Output = X>,
    {
        assert_eq!(x.len(), self.graph.num_rows(), "one entry per vertex");
        let Equation {
            weights,
            fixed,
            is_fixed,
            ..
        } = &self.equation;
        let values: Vec<X> = fixed.iter().map(|v| x[v.index()]).collect();
        for (v, &value) in fixed.iter().zip(&values) {
            for k in self.graph.range(v.index()) {
                let j = self.graph.neighbours()[k].index();
                if !is_fixed[j] {
                    x[j] += value * weights.outgoing(k);
                }
            }
        }
        fixed.iter().for_each(|v| x[v.index()] = X::default());
        solve(x);
        for (v, &value) in fixed.iter().zip(&values) {
            x[v.index()] = value;
        }
    }
}

impl Equation {
    /// D − L; fixed vertices are cut off, with a diagonal of the usual size and entries that stay
    /// in the pattern.
    fn matrix(
        &self,
        graph: &Graph,
        components: &GraphComponents,
    ) -> Result<LowerTriangle, LinearError> {
        self.check_diagonal()?;
        self.check_components(components)?;
        let usual = |sum: f64| if sum > 0.0 { sum } else { 1.0 };
        one_ring::assemble(
            graph,
            &self.weights,
            |i| self.is_fixed[i],
            |i, sum| match self.is_fixed[i] {
                true => usual(sum),
                false => sum + self.diagonal_at(i),
            },
        )
    }

    fn diagonal_at(&self, i: usize) -> f64 {
        self.diagonal.get(i).copied().unwrap_or(0.0)
    }

    fn check_diagonal(&self) -> Result<(), LinearError> {
        let is_refused = |d: &f64| !(d.is_finite() && *d >= 0.0);
        match self.diagonal.iter().position(is_refused) {
            None => Ok(()),
            Some(i) => Err(LinearError::Diagonal {
                vertex: VertexId::new(i),
                value: self.diagonal[i],
            }),
        }
    }

    /// Every component needs a vertex that is fixed or has a positive diagonal: without one,
    /// constants are in the null space, which rounding may hide from the factorization.
    fn check_components(&self, components: &GraphComponents) -> Result<(), LinearError> {
        let holds = |&i: &u32| self.is_fixed[i as usize] || self.diagonal_at(i as usize) > 0.0;
        for component in 0..components.len() {
            let members = components.members(component);
            if !members.iter().any(holds) {
                return Err(LinearError::Singular {
                    vertex: VertexId::new(members[0] as usize),
                    num_vertices: members.len(),
                });
            }
        }
        Ok(())
    }
}

fn weigh<T: Scalar>(operator: &Operator<T>) -> Result<Weights, LinearError> {
    match operator.symmetry() {
        Symmetry::Symmetric => Ok(Weights::new(operator)),
        Symmetry::General => Err(LinearError::NotSymmetric),
    }
}

/// Which of `n` vertices are in a list.
pub(crate) fn flags(n: usize, vertices: &[VertexId]) -> Result<Vec<bool>, LinearError> {
    let mut is_in = vec![false; n];
    for &vertex in vertices {
        match is_in.get_mut(vertex.index()) {
            None => {
                return Err(LinearError::HandleOutOfRange {
                    vertex,
                    num_vertices: n,
                });
            }
            Some(true) => return Err(LinearError::DuplicateHandle { vertex }),
            Some(flag) => *flag = true,
        }
    }
    Ok(is_in)
}

fn check_diagonal_length(expected: usize, diagonal: &[f64]) -> Result<(), LinearError> {
    let found = diagonal.len();
    (found == expected)
        .then_some(())
        .ok_or(LinearError::DiagonalLength { expected, found })
}

/// Systems that are solved together.
const LANES: usize = 3;

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::{icosphere, tetrahedron, torus};
    use cotan_laplacian::{Cotangent, Tutte, Uniform};
    use nalgebra::Point3;

    use super::*;

    fn operator(shape: &cotan_geometry::Mesh<f64>) -> Operator<f64> {
        Operator::assemble(&Cotangent::default(), &shape.surface()).unwrap()
    }

    #[test]
    fn the_solution_fulfils_the_equation_before_and_after_new_numbers() {
        let shape = icosphere::<f64>(3);
        let n = shape.positions().len();
        let operator = operator(&shape);
        let mut diagonal: Vec<f64> = (0..n).map(|i| 1.0 + (i % 7) as f64).collect();
        let mut system = LinearSystem::screened(&operator, &diagonal, &[]).unwrap();
        for _ in 0..2 {
            let rhs = shape.positions().map(|p| p.coords);
            let mut x = rhs.clone();
            system.solve_in_place(&mut x);
            let points = x.map(|x| Point3::from(*x));
            for (i, b) in rhs.values().enumerate() {
                let left = x.as_slice()[i] * diagonal[i] - operator.apply_at(&points, i);
                assert!((left - b).norm() < 1e-12);
            }
            diagonal.iter_mut().for_each(|d| *d *= 3.0);
            system.set_diagonal(&diagonal).unwrap();
        }
    }

    /// Free rows are fulfilled, fixed values kept, by scalars, vectors and columns alike; also for
    /// other weights and other fixed vertices without a new analysis.
    #[test]
    fn fixed_values_stay_and_all_ways_of_solving_agree() {
        let shape = torus::<f64>(1.0, 0.3, 20, 12);
        let n = shape.positions().len();
        let uniform = Operator::assemble(&Uniform, &shape.surface()).unwrap();
        let cotangent = operator(&shape);
        let mut fixed: Vec<VertexId> = [3, 77, 150].map(VertexId::new).to_vec();
        let mut system = LinearSystem::poisson(&uniform, &fixed).unwrap();
        for (operator, new_fixed) in [(&uniform, None), (&cotangent, Some([9, 10]))] {
            if let Some(vertices) = new_fixed {
                fixed = vertices.map(VertexId::new).to_vec();
                system.set_operator(operator).unwrap();
                system.set_fixed(&fixed).unwrap();
            }
            let given = DMatrix::from_fn(n, 5, |i, k| (i as f64 * 0.1 + k as f64).sin());
            let columns = system.solve_columns(&given);
            for k in 0..5 {
                let number = VertexMap::from_vec(given.column(k).iter().copied().collect());
                let x = system.solve(&number);
                let at = |i: usize| Point3::new(x.as_slice()[i], 0.0, 0.0);
                let points = VertexMap::from_fn(n, |v: VertexId| at(v.index()));
                for i in 0..n {
                    assert!((x.as_slice()[i] - columns[(i, k)]).abs() < 1e-9);
                    if fixed.contains(&VertexId::new(i)) {
                        assert_eq!(x.as_slice()[i], given[(i, k)]);
                    } else {
                        let left = -operator.apply_at(&points, i).x;
                        assert!((left - given[(i, k)]).abs() < 1e-9);
                    }
                }
            }
        }
    }

    #[test]
    fn an_unsolvable_problem_is_refused_and_leaves_the_system_unchanged() {
        let shape = tetrahedron::<f64>();
        let operator = operator(&shape);
        let refused = |diagonal: &[f64], fixed: &[VertexId]| {
            LinearSystem::screened(&operator, diagonal, fixed).unwrap_err()
        };
        let vertex = VertexId::new(0);
        let singular = LinearError::Singular {
            vertex,
            num_vertices: 4,
        };
        assert_eq!(LinearSystem::poisson(&operator, &[]).unwrap_err(), singular);
        assert_eq!(refused(&[0.0; 4], &[]), singular);
        let short = LinearError::DiagonalLength {
            expected: 4,
            found: 3,
        };
        assert_eq!(refused(&[1.0; 3], &[]), short);
        let mut system = LinearSystem::poisson(&operator, &[vertex]).unwrap();
        assert_eq!(system.set_diagonal(&[1.0; 3]), Err(short.clone()));
        assert_eq!(system.set_screened(&operator, &[1.0; 3]), Err(short));
        assert_eq!(
            refused(&[-1.0, 0.0, 0.0, 0.0], &[]),
            LinearError::Diagonal {
                vertex,
                value: -1.0
            }
        );
        assert_eq!(
            refused(&[1.0; 4], &[vertex, vertex]),
            LinearError::DuplicateHandle { vertex }
        );
        let tutte = Operator::assemble(&Tutte, &shape.surface()).unwrap();
        assert_eq!(
            LinearSystem::poisson(&tutte, &[vertex]).unwrap_err(),
            LinearError::NotSymmetric
        );
        let mut system = LinearSystem::poisson(&operator, &[vertex]).unwrap();
        let given = VertexMap::filled(4, 1.0);
        let before = system.solve(&given);
        assert_eq!(system.set_fixed(&[]).unwrap_err(), singular);
        assert_eq!(system.solve(&given), before);
    }
}
