//! (D − L) x = b: implicit steps of diffusion.

use std::sync::Arc;

use cotan_geometry::Scalar;
use cotan_halfedge::VertexMap;
use cotan_laplacian::{OneRings, Operator, Symmetry};
use nalgebra::Vector3;

use crate::cholesky::{Cholesky, Limit, Storage};
use crate::error::LinearError;
use crate::lower::LowerTriangle;
use crate::one_ring;
use crate::strategy::Strategy;
use crate::weights::Weights;

/// The matrix D − L, factorized: L a symmetric operator, D a positive diagonal (masses over a time
/// step). What implicit flows solve; its numbers can be renewed without analysing it again.
pub struct ScreenedSystem {
    rings: Arc<OneRings>,
    weights: Weights,
    cholesky: Cholesky,
}

impl std::fmt::Debug for ScreenedSystem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ScreenedSystem")
            .field("unknowns", &self.rings.num_vertices())
            .field("factor_entries", &self.cholesky.num_entries())
            .finish_non_exhaustive()
    }
}

impl ScreenedSystem {
    /// Assembles and factorizes D − L.
    ///
    /// **Shapes**: one entry of the diagonal a vertex.
    ///
    /// # Errors
    /// [`LinearError::NotPositiveDefinite`] for weights or a diagonal that do not allow it, among
    /// them those of an operator that is not symmetric.
    ///
    /// # Panics
    /// If `diagonal` has not one entry a vertex.
    pub fn factor<T: Scalar>(
        operator: &Operator<T>,
        diagonal: &[f64],
    ) -> Result<Self, LinearError> {
        Self::factor_within(operator, diagonal, None)
    }

    /// As [`Self::factor`], within this many bytes of memory.
    ///
    /// # Errors
    /// As [`Self::factor`], and [`LinearError::MemoryLimit`] before anything is factorized.
    ///
    /// # Panics
    /// If `diagonal` has not one entry a vertex.
    pub fn factor_within<T: Scalar>(
        operator: &Operator<T>,
        diagonal: &[f64],
        max_memory: Option<u64>,
    ) -> Result<Self, LinearError> {
        let rings = operator.rings().clone();
        let n = rings.num_vertices();
        if operator.symmetry() != Symmetry::Symmetric {
            return Err(LinearError::NotPositiveDefinite { unknowns: n });
        }
        assert_eq!(diagonal.len(), n, "one entry of the diagonal a vertex");
        let weights = Weights::new(operator);
        let matrix = screen(&rings, &weights, diagonal);
        let storage = Storage {
            limit: max_memory.map(|permitted| Limit {
                strategy: Strategy::Normal,
                factors: 1,
                beside: 0,
                permitted,
            }),
            ..Storage::default()
        };
        let cholesky = Cholesky::factor_with(&matrix, &storage)?;
        Ok(Self {
            rings,
            weights,
            cholesky,
        })
    }

    /// Takes another diagonal: new numbers in the same pattern.
    ///
    /// # Errors
    /// As [`Self::factor`].
    ///
    /// # Panics
    /// If `diagonal` has not one entry a vertex.
    pub fn refactor(&mut self, diagonal: &[f64]) -> Result<(), LinearError> {
        assert_eq!(
            diagonal.len(),
            self.rings.num_vertices(),
            "one entry of the diagonal a vertex"
        );
        let matrix = screen(&self.rings, &self.weights, diagonal);
        self.cholesky.refactor(&matrix)
    }

    /// Overwrites a right-hand side by the solution.
    ///
    /// # Panics
    /// If `rhs` has not one entry a vertex.
    pub fn solve(&mut self, rhs: &mut VertexMap<Vector3<f64>>) {
        assert_eq!(rhs.len(), self.rings.num_vertices(), "one entry a vertex");
        self.cholesky.solve(rhs.as_mut_slice());
    }
}

/// D − L.
fn screen(rings: &OneRings, weights: &Weights, diagonal: &[f64]) -> LowerTriangle {
    one_ring::assemble(rings, weights, |_| false, |i, sum| sum + diagonal[i])
}

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::icosphere;
    use cotan_laplacian::Cotangent;
    use nalgebra::Point3;

    use super::*;

    #[test]
    fn the_solution_fulfils_the_equation_before_and_after_new_numbers() {
        let shape = icosphere::<f64>(3);
        let n = shape.positions().len();
        let operator = Operator::assemble(&Cotangent::default(), &shape.surface()).unwrap();
        let mut diagonal: Vec<f64> = (0..n).map(|i| 1.0 + (i % 7) as f64).collect();
        let mut system = ScreenedSystem::factor(&operator, &diagonal).unwrap();
        for _ in 0..2 {
            let rhs = shape.positions().map(|p| p.coords);
            let mut x = rhs.clone();
            system.solve(&mut x);
            let points = x.map(|x| Point3::from(*x));
            for (i, b) in rhs.values().enumerate() {
                let left = x.as_slice()[i] * diagonal[i] - operator.apply_at(&points, i);
                assert!((left - b).norm() < 1e-12);
            }
            diagonal.iter_mut().for_each(|d| *d *= 3.0);
            system.refactor(&diagonal).unwrap();
        }
    }
}
