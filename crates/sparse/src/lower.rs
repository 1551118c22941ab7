//! Symmetric sparse matrices.

use crate::error::SparseError;

/// A symmetric sparse matrix: its lower triangle by columns, rows ascending.
#[derive(Clone, PartialEq, Debug)]
pub struct LowerTriangle {
    pub(crate) offsets: Vec<usize>,
    pub(crate) rows: Vec<u32>,
    pub(crate) values: Vec<f64>,
}

impl LowerTriangle {
    /// Creates the matrix whose column j has the entries `offsets[j]..offsets[j + 1]` of `rows`
    /// and `values`.
    ///
    /// **Shapes**: one offset more than there are columns; as many rows as values. The rows of a
    /// column ascend, and the first is not above the diagonal.
    ///
    /// # Errors
    /// [`SparseError::Malformed`]. Non-finite values are only detected by a factorization.
    pub fn new(offsets: Vec<usize>, rows: Vec<u32>, values: Vec<f64>) -> Result<Self, SparseError> {
        let n = offsets.len().saturating_sub(1);
        let is_whole = offsets.first() == Some(&0)
            && offsets.last() == Some(&rows.len())
            && rows.len() == values.len()
            && u32::try_from(n).is_ok();
        let is_column = |j: &usize| {
            let range = offsets[*j]..offsets[j + 1];
            rows.get(range).is_some_and(|rows| {
                let is_within = |rows: &[u32]| match (rows.first(), rows.last()) {
                    (Some(&first), Some(&last)) => first as usize >= *j && (last as usize) < n,
                    _ => true,
                };
                is_within(rows) && rows.is_sorted_by(|a, b| a < b)
            })
        };
        if !is_whole {
            return Err(SparseError::Malformed { column: 0 });
        }
        if let Some(column) = (0..n).find(|j| !is_column(j)) {
            return Err(SparseError::Malformed { column });
        }
        Ok(Self {
            offsets,
            rows,
            values,
        })
    }

    /// Number of unknowns, that is, of rows and of columns.
    pub fn num_unknowns(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Number of stored entries.
    pub fn num_entries(&self) -> usize {
        self.rows.len()
    }

    /// Computes out = M x for one vector.
    ///
    /// # Panics
    /// If a vector has fewer entries than there are unknowns.
    pub fn multiply(&self, x: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for j in 0..self.num_unknowns() {
            for k in self.offsets[j]..self.offsets[j + 1] {
                let i = self.rows[k] as usize;
                out[i] += self.values[k] * x[j];
                if i != j {
                    out[j] += self.values[k] * x[i];
                }
            }
        }
    }

    /// The maximum absolute row sum.
    pub(crate) fn norm(&self) -> f64 {
        let mut sums = vec![0.0; self.offsets.len() - 1];
        for j in 0..sums.len() {
            for k in self.offsets[j]..self.offsets[j + 1] {
                let i = self.rows[k] as usize;
                sums[i] += self.values[k].abs();
                if i != j {
                    sums[j] += self.values[k].abs();
                }
            }
        }
        sums.into_iter().fold(0.0, f64::max)
    }

    /// Checks that all values are finite.
    ///
    /// # Errors
    /// [`SparseError::NotPositiveDefinite`] if a value is not finite.
    pub(crate) fn check_finite(&self) -> Result<(), SparseError> {
        if self.values.iter().all(|v| v.is_finite()) {
            return Ok(());
        }
        Err(SparseError::NotPositiveDefinite {
            unknowns: self.num_unknowns(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_that_are_no_lower_triangle_are_refused() {
        let refused = |offsets: &[usize], rows: &[u32]| {
            let values = vec![1.0; rows.len()];
            LowerTriangle::new(offsets.to_vec(), rows.to_vec(), values).unwrap_err()
        };
        let malformed = |column| SparseError::Malformed { column };
        assert_eq!(refused(&[], &[]), malformed(0));
        assert_eq!(refused(&[0, 1], &[0, 0]), malformed(0));
        // Above the diagonal, out of range, descending rows, descending offsets.
        assert_eq!(refused(&[0, 1, 2], &[0, 0]), malformed(1));
        assert_eq!(refused(&[0, 2, 3], &[0, 2, 1]), malformed(0));
        assert_eq!(refused(&[0, 3, 3, 3], &[0, 2, 1]), malformed(0));
        assert_eq!(refused(&[0, 3, 1, 3], &[0, 1, 2]), malformed(1));
        assert!(LowerTriangle::new(vec![0], vec![], vec![]).is_ok());
    }
}
