//! The system itself.

use std::sync::Arc;

use cotan_geometry::Scalar;
use cotan_halfedge::{EdgeMap, VertexId, VertexMap};
use cotan_laplacian::{OneRings, Operator, Symmetry};
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::cholesky::Cholesky;
use crate::error::LinearError;
use crate::grounded;
use crate::handles::{self, Handle, Hold};
use crate::normal::{self, Weights};

/// A term μ x·Kx beside the Laplacian one, K the graph Laplacian with a stiffness per edge.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Membrane<'a> {
    /// μ, no unit.
    pub weight: f64,
    /// The stiffness of each edge: half its cotangent weight makes K = L/2 for that scheme.
    pub stiffness: &'a EdgeMap<f64>,
}

/// A least-squares system with handles, factorized.
///
/// It answers one question, as often as it is asked: by which δ must the positions x be corrected
/// so that x + δ minimises
///
/// ```text
/// |L(x + δ) − ℓ|² + μ (membrane) + Σ_soft k²|x + δ − u|²,    δ = 0 at hard handles?
/// ```
///
/// **Source**: paper, equations 3 and 8, as a correction (see the crate's docs).
pub struct PreparedSystem {
    rings: Arc<OneRings>,
    weights: Weights,
    membrane: f64,
    /// (k · mean |L_ii|)² of soft handles, 0 elsewhere; empty if there is none.
    springs: Vec<f64>,
    free: Vec<usize>,
    matrix: Factored,
    cholesky: Cholesky,
    /// A vector over the free vertices.
    unknowns: Vec<Vector3<f64>>,
}

/// Which matrix was factorized.
enum Factored {
    /// The normal equations LᵀL + μK + D.
    Normal,
    /// The one-ring matrix itself, with the handle as ground: see [`grounded`].
    Grounded,
}

impl std::fmt::Debug for PreparedSystem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PreparedSystem")
            .field("unknowns", &self.free.len())
            .field("membrane", &self.membrane)
            .field("factor_entries", &self.cholesky.num_entries())
            .finish_non_exhaustive()
    }
}

impl PreparedSystem {
    /// Assembles and factorizes the system of `operator` with `handles`.
    ///
    /// # Errors
    /// [`LinearError`]: no handle, a component without one, a handle that does not exist or is
    /// given twice, a weight that is no positive number, a matrix that cannot be factorized.
    pub fn prepare<T: Scalar>(
        operator: &Operator<T>,
        handles: &[Handle],
        membrane: Option<Membrane<'_>>,
    ) -> Result<Self, LinearError> {
        let rings = operator.rings().clone();
        handles::check(handles, &rings)?;
        if let Some(Membrane { weight, .. }) = membrane
            && !(weight.is_finite() && weight >= 0.0)
        {
            return Err(LinearError::MembraneWeight(weight));
        }
        let n = rings.num_vertices();
        let unit = operator.mean_diagonal();
        let mut is_free = vec![true; n];
        let mut springs = vec![0.0; n];
        for handle in handles {
            match handle.hold {
                Hold::Hard => is_free[handle.vertex.index()] = false,
                Hold::Soft(k) => springs[handle.vertex.index()] = (k * unit).powi(2),
            }
        }
        let free: Vec<usize> = (0..n).filter(|&i| is_free[i]).collect();
        let mut free_index = vec![None; n];
        for (unknown, &i) in free.iter().enumerate() {
            free_index[i] = Some(unknown);
        }
        let weights = Weights::new(
            &rings,
            operator.weights(),
            operator.symmetry() == Symmetry::Symmetric,
        );
        let direct = if grounded::serves(operator, handles, membrane) {
            let matrix = grounded::assemble(&rings, &weights, &free, &free_index, None);
            match Cholesky::factor(&matrix) {
                Ok(cholesky) => Some(cholesky),
                Err(error @ LinearError::OutOfMemory { .. }) => return Err(error),
                // A matrix that is not positive definite is left to the normal equations.
                Err(_) => None,
            }
        } else {
            None
        };
        let (matrix, cholesky) = match direct {
            Some(cholesky) => (Factored::Grounded, cholesky),
            None => {
                let normal =
                    normal::assemble(&rings, &weights, &free, &free_index, membrane, &springs);
                (Factored::Normal, Cholesky::factor(&normal)?)
            }
        };
        tracing::debug!(
            unknowns = free.len(),
            is_grounded = matches!(matrix, Factored::Grounded),
            factor_entries = cholesky.num_entries(),
            "factorized"
        );
        let unknowns = vec![Vector3::zeros(); free.len()];
        if springs.iter().all(|&s| s == 0.0) {
            springs.clear();
        }
        Ok(Self {
            rings,
            weights,
            membrane: membrane.map_or(0.0, |m| m.weight),
            springs,
            free,
            matrix,
            cholesky,
            unknowns,
        })
    }

    /// Number of vertices that are solved for.
    pub fn num_unknowns(&self) -> usize {
        self.free.len()
    }

    /// Number of values in the factor, eight bytes each.
    pub fn factor_entries(&self) -> usize {
        self.cholesky.num_entries()
    }

    /// Stiffness of the spring that holds a vertex, (k · mean |L_ii|)²: 0 for all but soft handles.
    pub fn spring(&self, vertex: VertexId) -> f64 {
        self.springs.get(vertex.index()).copied().unwrap_or(0.0)
    }

    /// The right-hand side of a correction: half the negative gradient of the energy,
    ///
    /// ```text
    /// r = Lᵀ mismatch + μ tension + k² pull       (0 at hard handles)
    /// ```
    ///
    /// **Shapes**: n entries each. `mismatch` is ℓ − Lx; `tension` is half the negative gradient of
    /// the membrane's energy, without μ: the sum over the neighbours of the stiffness times the edge
    /// vector x_j − x_i less the wanted one; `pull` is u − x at
    /// the soft handles (other entries are ignored).
    ///
    /// # Panics
    /// If a map has not one entry a vertex.
    pub fn residual(
        &self,
        mismatch: &VertexMap<Vector3<f64>>,
        tension: Option<&VertexMap<Vector3<f64>>>,
        pull: &VertexMap<Vector3<f64>>,
        out: &mut VertexMap<Vector3<f64>>,
    ) {
        let n = self.rings.num_vertices();
        assert!(
            [
                mismatch.len(),
                pull.len(),
                out.len(),
                tension.map_or(n, VertexMap::len)
            ]
            .iter()
            .all(|&len| len == n),
            "one entry a vertex"
        );
        out.values_mut().for_each(|r| *r = Vector3::zeros());
        let y = mismatch.as_slice();
        let row = |i: usize| {
            let mut r = self.weights.transpose_product(&self.rings, i, y);
            if let Some(tension) = tension {
                r += tension.as_slice()[i] * self.membrane;
            }
            if let Some(&spring) = self.springs.get(i) {
                r += pull.as_slice()[i] * spring;
            }
            r
        };
        // Hard handles are few or in large blocks: rows are computed for all, then cleared.
        out.as_mut_slice()
            .par_iter_mut()
            .enumerate()
            .with_min_len(1 << 11)
            .for_each(|(i, r)| *r = row(i));
        self.clear_hard(out);
    }

    /// The correction δ from the terms that the shape at hand does not fulfil, and its right-hand
    /// side: one solve, 0 at hard handles. Allocates nothing.
    ///
    /// **Shapes**: as [`Self::residual`], which fills `residual`.
    ///
    /// # Panics
    /// If a map has not one entry a vertex.
    pub fn correct(
        &mut self,
        mismatch: &VertexMap<Vector3<f64>>,
        tension: Option<&VertexMap<Vector3<f64>>>,
        pull: &VertexMap<Vector3<f64>>,
        residual: &mut VertexMap<Vector3<f64>>,
        correction: &mut VertexMap<Vector3<f64>>,
    ) {
        self.residual(mismatch, tension, pull, residual);
        match self.matrix {
            Factored::Normal => self.solve(residual, correction),
            Factored::Grounded => {
                // What no shape can fulfil, the mean, is left; the matrix is −L.
                let mean = grounded::mean(mismatch.as_slice());
                correction
                    .as_mut_slice()
                    .par_iter_mut()
                    .with_min_len(1 << 12)
                    .zip(mismatch.as_slice())
                    .for_each(|(out, y)| *out = mean - y);
                self.solve_in_place(correction);
            }
        }
    }

    /// δ = (LᵀL + μK + D)⁻¹ r on the free vertices, 0 at hard handles.
    fn solve(
        &mut self,
        residual: &VertexMap<Vector3<f64>>,
        correction: &mut VertexMap<Vector3<f64>>,
    ) {
        correction
            .as_mut_slice()
            .copy_from_slice(residual.as_slice());
        self.solve_in_place(correction);
    }

    /// Replaces a right-hand side by the solution with the factor at hand.
    fn solve_in_place(&mut self, correction: &mut VertexMap<Vector3<f64>>) {
        for (x, &i) in self.unknowns.iter_mut().zip(&self.free) {
            *x = correction.as_slice()[i];
        }
        self.cholesky.solve(&mut self.unknowns);
        correction.values_mut().for_each(|d| *d = Vector3::zeros());
        for (x, &i) in self.unknowns.iter().zip(&self.free) {
            correction.as_mut_slice()[i] = *x;
        }
    }

    fn clear_hard(&self, out: &mut VertexMap<Vector3<f64>>) {
        let mut next = self.free.iter().copied().peekable();
        for (i, r) in out.values_mut().enumerate() {
            if next.peek() == Some(&i) {
                next.next();
            } else {
                *r = Vector3::zeros();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use cotan_geometry::testing::surfaces;
    use cotan_laplacian::{Cotangent, LaplacianScheme, Tutte};
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    use super::*;

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
        if let Some(Membrane { weight, stiffness }) = membrane {
            for i in 0..n {
                for (j, h) in operator.rings().ring(i) {
                    m[(i, i)] += weight * stiffness[h.edge()];
                    m[(i, j.index())] -= weight * stiffness[h.edge()];
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
            prop_assume!(shape.positions.len() <= 150);
            let n = shape.positions.len();
            let scheme: Box<dyn LaplacianScheme<f64>> =
                if symmetric { Box::new(Cotangent::default()) } else { Box::new(Tutte) };
            let operator = Operator::assemble(&*scheme, &shape.surface())?;
            let mut handles = vec![Handle::hard(VertexId::new(0))];
            if soft {
                handles.push(Handle::soft(VertexId::new(n - 1), 3.0));
            }
            let stiffness = EdgeMap::filled(shape.mesh.num_edges(), 0.7);
            let membrane = Some(Membrane { weight, stiffness: &stiffness });
            let mut system = PreparedSystem::prepare(&operator, &handles, membrane)?;

            let vector = |i: usize, phase: f64| {
                let t = f64::from(seed) + i as f64;
                Vector3::new((t + phase).sin(), (2.0 * t - phase).cos(), (3.0 * t * phase).sin())
            };
            let map = |phase: f64| VertexMap::from_vec((0..n).map(|i| vector(i, phase)).collect());
            let (mismatch, tension, pull) = (map(0.3), map(1.1), map(2.7));
            let mut residual = VertexMap::filled(n, Vector3::zeros());
            let mut correction = residual.clone();
            system.correct(&mismatch, Some(&tension), &pull, &mut residual, &mut correction);

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
        let n = shape.positions.len();
        let operator = Operator::assemble(&Cotangent::default(), &shape.surface()).unwrap();
        let handle = Handle::hard(VertexId::new(7));
        let mut system = PreparedSystem::prepare(&operator, &[handle], None).unwrap();
        assert!(matches!(system.matrix, Factored::Grounded));
        let mismatch = VertexMap::from_fn(n, |v: VertexId| {
            let t = v.index() as f64;
            Vector3::new(t.sin(), (1.3 * t).cos(), (0.7 * t).sin())
        });
        let zeros = VertexMap::filled(n, Vector3::zeros());
        let (mut residual, mut correction) = (zeros.clone(), zeros.clone());
        system.correct(&mismatch, None, &zeros, &mut residual, &mut correction);
        // At the minimum the residual of what is left vanishes.
        let moved = correction.map(|d| nalgebra::Point3::from(*d));
        let left = VertexMap::from_fn(n, |v: VertexId| {
            mismatch[v] - operator.apply_at(&moved, v.index())
        });
        let size = residual.values().map(|r| r.norm()).fold(0.0, f64::max);
        system.residual(&left, None, &zeros, &mut residual);
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
        let stiffness = EdgeMap::filled(shape.mesh.num_edges(), 1.0);
        let membrane = Some(Membrane {
            weight: -1.0,
            stiffness: &stiffness,
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
        let handles: Vec<Handle> = shape.mesh.vertices().map(Handle::hard).collect();
        let mut system = PreparedSystem::prepare(&operator, &handles, None).unwrap();
        assert_eq!(system.num_unknowns(), 0);
        let zeros = VertexMap::filled(4, Vector3::zeros());
        let mut correction = VertexMap::filled(4, Vector3::x());
        system.correct(&zeros, None, &zeros, &mut zeros.clone(), &mut correction);
        assert!(correction.values().all(|d| *d == Vector3::zeros()));
    }
}
