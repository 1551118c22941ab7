//! Symmetric sparse matrices.

/// A symmetric sparse matrix: its lower triangle by columns, rows ascending.
pub(crate) struct LowerTriangle {
    pub(crate) offsets: Vec<usize>,
    pub(crate) rows: Vec<u32>,
    pub(crate) values: Vec<f64>,
}

impl LowerTriangle {
    /// out = M x for one vector.
    pub(crate) fn multiply(&self, x: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for j in 0..x.len() {
            for k in self.offsets[j]..self.offsets[j + 1] {
                let i = self.rows[k] as usize;
                out[i] += self.values[k] * x[j];
                if i != j {
                    out[j] += self.values[k] * x[i];
                }
            }
        }
    }

    /// Greatest sum of the absolute entries of a row.
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
}
