//! The small dense system of the handles.
//!
//! ```text
//! [ S + diag(1/k²)  −C ] [λ]   [b]
//! [ Cᵀ               0 ] [c] = [0]
//! ```
//!
//! S holds M⁺ at the handles, C says which component each is of, λ are the forces at the handles
//! (1/k² is 0 for hard ones) and c one constant a component.
//!
//! S is positive definite on λ that sum to zero over every component; adding a multiple of CCᵀ to
//! it, which changes nothing as Cᵀλ = 0, makes it so everywhere. Then Cholesky, c from the Schur
//! complement, and one refinement.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, MatrixXx3, RowVector3, Vector3};

use crate::error::LinearError;

pub(crate) struct Multipliers {
    /// S + diag(1/k²).
    matrix: DMatrix<f64>,
    /// Of the matrix plus the multiple of CCᵀ.
    factor: Cholesky<f64, Dyn>,
    /// The component of each handle, counted from 0 among those that have one here.
    groups: Vec<usize>,
    /// The solution for the right-hand side C, all groups in one vector: the factor mixes none.
    response: DVector<f64>,
    /// The sum of the response over each group: the Schur complement.
    complement: Vec<f64>,
    forces: MatrixXx3<f64>,
    constants: Vec<RowVector3<f64>>,
    left: MatrixXx3<f64>,
    step: Vec<RowVector3<f64>>,
}

impl Multipliers {
    /// **Shapes**: `matrix` is S + diag(1/k²), m × m; `groups` has m entries below `num_groups`.
    pub(crate) fn factor(
        matrix: DMatrix<f64>,
        groups: Vec<usize>,
        num_groups: usize,
    ) -> Result<Self, LinearError> {
        let m = groups.len();
        let ill_conditioned = LinearError::IllConditioned { handles: m };
        let (mut traces, mut counts) = (vec![0.0; num_groups], vec![0.0; num_groups]);
        for (i, &g) in groups.iter().enumerate() {
            traces[g] += matrix[(i, i)];
            counts[g] += 1.0;
        }
        let definite = DMatrix::from_fn(m, m, |i, j| {
            let g = groups[i];
            let is_same = g == groups[j];
            matrix[(i, j)]
                + if is_same {
                    traces[g] / (counts[g] * counts[g])
                } else {
                    0.0
                }
        });
        if definite.iter().any(|v| !v.is_finite()) {
            return Err(ill_conditioned);
        }
        let Some(factor) = definite.cholesky() else {
            return Err(ill_conditioned);
        };
        let response = factor.solve(&DVector::repeat(m, 1.0));
        let mut complement = vec![0.0; num_groups];
        for (y, &g) in response.iter().zip(&groups) {
            complement[g] += y;
        }
        let mut multipliers = Self {
            matrix,
            factor,
            groups,
            response,
            complement,
            forces: MatrixXx3::zeros(m),
            constants: vec![RowVector3::zeros(); num_groups],
            left: MatrixXx3::zeros(m),
            step: vec![RowVector3::zeros(); num_groups],
        };
        if multipliers.is_accurate() {
            Ok(multipliers)
        } else {
            Err(ill_conditioned)
        }
    }

    /// Solves for the forces and the constants.
    ///
    /// **Shapes**: a right-hand side a handle.
    pub(crate) fn solve(&mut self, rhs: impl Fn(usize) -> Vector3<f64>) {
        self.forces.fill(0.0);
        self.constants.fill(RowVector3::zeros());
        for _ in 0..2 {
            self.refine(&rhs);
        }
    }

    /// λ of a handle.
    pub(crate) fn force(&self, i: usize) -> Vector3<f64> {
        self.forces.row(i).transpose()
    }

    /// c of a group.
    pub(crate) fn constant(&self, group: usize) -> Vector3<f64> {
        self.constants[group].transpose()
    }

    /// The remainder of the right-hand side: b − (S + diag(1/k²)) λ + C c.
    fn remainder(&mut self, rhs: impl Fn(usize) -> Vector3<f64>) {
        self.left.gemm(-1.0, &self.matrix, &self.forces, 0.0);
        for (i, &g) in self.groups.iter().enumerate() {
            let sum = self.left.row(i) + rhs(i).transpose() + self.constants[g];
            self.left.set_row(i, &sum);
        }
    }

    fn refine(&mut self, rhs: impl Fn(usize) -> Vector3<f64>) {
        self.remainder(rhs);
        self.factor.solve_mut(&mut self.left);
        self.step.fill(RowVector3::zeros());
        for (i, &g) in self.groups.iter().enumerate() {
            // This also removes the current sum of the forces.
            self.step[g] -= self.left.row(i) + self.forces.row(i);
        }
        for (step, complement) in self.step.iter_mut().zip(&self.complement) {
            *step /= *complement;
        }
        for (i, &g) in self.groups.iter().enumerate() {
            let sum = self.forces.row(i) + self.left.row(i) + self.step[g] * self.response[i];
            self.forces.set_row(i, &sum);
        }
        for (constant, step) in self.constants.iter_mut().zip(&self.step) {
            *constant += step;
        }
    }

    /// Returns `true` if a right-hand side without structure is reproduced. It is not if the
    /// handles are so close together that their columns are almost the same.
    fn is_accurate(&mut self) -> bool {
        const WORST: f64 = 1e-7;
        let rhs = |i: usize| {
            // Multiples of the golden ratio, mod 1.
            let b = (i as f64 * 0.618_033_988_749_895).fract() - 0.5;
            Vector3::new(b, 0.0, 0.0)
        };
        self.solve(rhs);
        self.remainder(rhs);
        self.left.iter().all(|r| r.abs() <= WORST)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_sum_to_zero_and_fulfil_the_equations() {
        // Two groups, interleaved; the second has a soft handle.
        let groups = vec![0, 1, 0, 1, 0];
        let matrix = DMatrix::from_fn(5, 5, |i, j| {
            let is_same = groups[i] == groups[j];
            let distance = (i as f64 - j as f64).abs();
            if is_same {
                (-distance).exp() * 3.0
            } else {
                0.0
            }
        });
        let rhs = |i: usize| Vector3::new(1.0, i as f64, (i as f64).sin());
        let mut small = Multipliers::factor(matrix.clone(), groups.clone(), 2).unwrap();
        small.solve(rhs);
        for (i, &g) in groups.iter().enumerate() {
            let product: Vector3<f64> = (0..5).map(|j| small.force(j) * matrix[(i, j)]).sum();
            assert!((product - small.constant(g) - rhs(i)).norm() < 1e-12);
        }
        for g in 0..2 {
            let of_group = (0..5).filter(|&i| groups[i] == g);
            assert!(
                of_group
                    .map(|i| small.force(i))
                    .sum::<Vector3<f64>>()
                    .norm()
                    < 1e-12
            );
        }
    }

    #[test]
    fn columns_that_are_the_same_are_refused() {
        let matrix = DMatrix::repeat(3, 3, 2.0);
        let refused = Multipliers::factor(matrix, vec![0; 3], 1).map(|_| ());
        assert_eq!(
            refused.unwrap_err(),
            LinearError::IllConditioned { handles: 3 }
        );
    }
}
