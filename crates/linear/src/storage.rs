//! The storage of factors, and the limit of their memory.

use std::sync::Arc;

use cotan_sparse::{Cholesky, LowerTriangle, Precision, Symbolic};

use crate::error::LinearError;
use crate::strategy::Strategy;

/// The storage of a factor, and its limit.
#[derive(Clone, Default)]
pub(crate) struct Storage {
    pub(crate) precision: Precision,
    /// The analysis of the pattern, if it is known.
    pub(crate) analysis: Option<Arc<Symbolic>>,
    /// The most bytes that factors of this pattern may take together, with the memory that the
    /// strategy takes in addition: known exactly once the pattern is analysed.
    pub(crate) limit: Option<Limit>,
}

/// A limit of memory.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limit {
    pub(crate) strategy: Strategy,
    /// The number of factors to come, and the bytes that are taken in addition.
    pub(crate) factors: u64,
    pub(crate) in_addition: u64,
    pub(crate) permitted: u64,
}

impl Storage {
    /// Factorizes a matrix within the limit.
    pub(crate) fn factor(&self, matrix: &LowerTriangle) -> Result<Cholesky, LinearError> {
        let symbolic = self.analysed(matrix)?;
        if let Some(limit) = self.limit {
            limit.check(symbolic.bytes(self.precision))?;
        }
        Ok(Cholesky::with_analysis(symbolic, matrix, self.precision)?)
    }

    /// The analysis of a matrix, unless it is known already.
    pub(crate) fn analysed(&self, matrix: &LowerTriangle) -> Result<Arc<Symbolic>, LinearError> {
        match &self.analysis {
            Some(analysis) => Ok(analysis.clone()),
            None => Ok(Arc::new(Symbolic::of(matrix)?)),
        }
    }
}

impl Limit {
    /// Refuses factors of this size each.
    fn check(&self, each: u64) -> Result<(), LinearError> {
        let predicted = self.factors * each + self.in_addition;
        if predicted <= self.permitted {
            return Ok(());
        }
        Err(LinearError::MemoryLimit {
            strategy: self.strategy,
            predicted,
            permitted: self.permitted,
        })
    }
}
