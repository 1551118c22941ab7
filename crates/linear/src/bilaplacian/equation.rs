//! The numbers of a fourth-order equation, and products with its matrix.

use super::*;
use cotan_halfedge::VertexMap;
use cotan_laplacian::Graph;
use cotan_parallel as parallel;

/// S R S + D with some vertices fixed.
#[derive(Clone)]
pub(super) struct Equation {
    pub(super) graph: Arc<Graph>,
    /// w_ij in the order of the graph.
    pub(super) weights: Arc<[f64]>,
    pub(super) masses: Arc<[f64]>,
    /// R: 1/m, or 0.
    pub(super) row_factors: Arc<[f64]>,
    pub(super) diagonal: Vec<f64>,
    pub(super) is_fixed: Arc<[bool]>,
}

impl Equation {
    pub(super) fn new<T: Scalar>(parts: &Bilaplacian<'_, T>) -> Result<Self, LinearError> {
        if parts.operator.symmetry() != Symmetry::Symmetric {
            return Err(LinearError::NotSymmetric);
        }
        let expected = parts.operator.num_rows();
        for found in [parts.masses.len(), parts.without_row.len()] {
            if found != expected {
                return Err(LinearError::DiagonalLength { expected, found });
            }
        }
        check_positive(parts.masses)?;
        let rows = parts.masses.iter().zip(parts.without_row);
        let row_factors: Arc<[f64]> = rows
            .map(|(m, is_out)| if *is_out { 0.0 } else { 1.0 / m })
            .collect();
        check_finite(&row_factors)?;
        let empty = Self {
            graph: parts.operator.graph().clone(),
            weights: parts.operator.weights().into(),
            masses: parts.masses.into(),
            row_factors,
            diagonal: Vec::new(),
            is_fixed: flags(expected, parts.fixed)?.into(),
        };
        empty.with_diagonal(parts.diagonal)
    }

    /// The same equation with another D.
    pub(super) fn with_diagonal(&self, diagonal: &[f64]) -> Result<Self, LinearError> {
        let (expected, found) = (self.masses.len(), diagonal.len());
        if found != expected {
            return Err(LinearError::DiagonalLength { expected, found });
        }
        check_positive(diagonal)?;
        Ok(Self {
            diagonal: diagonal.to_vec(),
            ..self.clone()
        })
    }

    /// C_i = √(D_i m_i).
    pub(super) fn roots(&self) -> Vec<f64> {
        let pairs = self.diagonal.iter().zip(self.masses.iter());
        pairs.map(|(d, m)| (d * m).sqrt()).collect()
    }

    /// S_ii = Σ_j w_ij.
    pub(super) fn row_sum(&self, i: usize) -> f64 {
        self.weights[self.graph.range(i)].iter().sum()
    }

    /// out = S x.
    pub(super) fn laplacian(&self, x: &[Vector3<f64>], out: &mut [Vector3<f64>]) {
        assert_eq!(x.len(), self.masses.len(), "one entry per vertex");
        parallel::fill(out, |i| self.laplacian_at(x, i));
    }

    fn laplacian_at(&self, x: &[Vector3<f64>], i: usize) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for (j, k) in self.graph.row(i) {
            sum += (x[i] - x[j.index()]) * self.weights[k];
        }
        sum
    }

    /// out = S R y.
    pub(super) fn scaled_laplacian(&self, y: &[Vector3<f64>], out: &mut [Vector3<f64>]) {
        assert_eq!(y.len(), self.masses.len(), "one entry per vertex");
        parallel::fill(out, |i| {
            let mut sum = Vector3::zeros();
            let own = y[i] * self.row_factors[i];
            for (j, k) in self.graph.row(i) {
                sum += (own - y[j.index()] * self.row_factors[j.index()]) * self.weights[k];
            }
            sum
        });
    }

    /// out = (S R S + D) x at free vertices, and 0 at fixed ones. `between` is overwritten.
    pub(super) fn product(
        &self,
        x: &[Vector3<f64>],
        between: &mut [Vector3<f64>],
        out: &mut [Vector3<f64>],
    ) {
        parallel::fill(between, |i| self.laplacian_at(x, i) * self.row_factors[i]);
        let between = &*between;
        parallel::fill(out, |i| match self.is_fixed[i] {
            true => Vector3::zeros(),
            false => self.laplacian_at(between, i) + x[i] * self.diagonal[i],
        });
    }

    /// out = b − (S R S + D) x at free vertices, and 0 at fixed ones.
    pub(super) fn residual(
        &self,
        rhs: &[Vector3<f64>],
        x: &[Vector3<f64>],
        between: &mut [Vector3<f64>],
        out: &mut [Vector3<f64>],
    ) {
        self.product(x, between, out);
        parallel::update((out, rhs), |i, (out, b)| {
            *out = if self.is_fixed[i] {
                Vector3::zeros()
            } else {
                b - *out
            };
        });
    }
}

fn check_positive(values: &[f64]) -> Result<(), LinearError> {
    refuse_where(values, |d| !(d.is_finite() && d > 0.0))
}

fn check_finite(values: &[f64]) -> Result<(), LinearError> {
    refuse_where(values, |d| !d.is_finite())
}

fn refuse_where(values: &[f64], is_refused: impl Fn(f64) -> bool) -> Result<(), LinearError> {
    match values.iter().position(|d| is_refused(*d)) {
        None => Ok(()),
        Some(i) => Err(LinearError::Diagonal {
            vertex: VertexId::new(i),
            value: values[i],
        }),
    }
}

/// Vectors as a map over vertices.
pub(super) fn as_map(values: Vec<Vector3<f64>>) -> VertexMap<Vector3<f64>> {
    VertexMap::from_vec(values)
}
