//! Sparse matrices by rows.

use cotan_parallel::{self as parallel, Chunks};
use nalgebra::Vector3;

use crate::lower::LowerTriangle;

/// A sparse matrix by rows.
pub(crate) struct Csr {
    pub(crate) offsets: Vec<usize>,
    pub(crate) columns: Vec<u32>,
    pub(crate) values: Vec<f64>,
}

impl Csr {
    /// Creates the matrix with both triangles of a symmetric matrix.
    pub(crate) fn from_lower(lower: &LowerTriangle) -> Self {
        let n = lower.offsets.len() - 1;
        let mut offsets = vec![0usize; n + 1];
        // Rows get their entries in column order, lower ones first.
        let entries =
            || (0..n).flat_map(|j| (lower.offsets[j]..lower.offsets[j + 1]).map(move |k| (j, k)));
        for (j, k) in entries() {
            offsets[lower.rows[k] as usize + 1] += 1;
            offsets[j + 1] += usize::from(lower.rows[k] as usize != j);
        }
        for i in 0..n {
            offsets[i + 1] += offsets[i];
        }
        let mut next = offsets.clone();
        let (mut columns, mut values) = (vec![0u32; offsets[n]], vec![0.0; offsets[n]]);
        let mut put = |i: usize, j: usize, value: f64| {
            columns[next[i]] = j as u32;
            values[next[i]] = value;
            next[i] += 1;
        };
        for (j, k) in entries() {
            let (i, value) = (lower.rows[k] as usize, lower.values[k]);
            put(i, j, value);
            if i != j {
                put(j, i, value);
            }
        }
        Self {
            offsets,
            columns,
            values,
        }
    }

    /// The lower triangle of a symmetric matrix, by columns.
    pub(crate) fn to_lower(&self) -> LowerTriangle {
        let mut lower = LowerTriangle {
            offsets: vec![0],
            rows: Vec::new(),
            values: Vec::new(),
        };
        for j in 0..self.num_rows() {
            // Column j of a symmetric matrix is its row j.
            let mut entries: Vec<(usize, f64)> = self.row(j).filter(|&(i, _)| i >= j).collect();
            entries.sort_unstable_by_key(|&(i, _)| i);
            for (i, value) in entries {
                lower.rows.push(i as u32);
                lower.values.push(value);
            }
            lower.offsets.push(lower.rows.len());
        }
        lower
    }

    pub(crate) fn num_rows(&self) -> usize {
        self.offsets.len() - 1
    }

    pub(crate) fn row(&self, i: usize) -> impl ExactSizeIterator<Item = (usize, f64)> + '_ {
        let range = self.offsets[i]..self.offsets[i + 1];
        let columns = self.columns[range.clone()].iter();
        columns
            .map(|&j| j as usize)
            .zip(self.values[range].iter().copied())
    }

    /// (A x)_i.
    pub(crate) fn product(&self, i: usize, x: &[Vector3<f64>]) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for (j, value) in self.row(i) {
            sum += x[j] * value;
        }
        sum
    }

    /// out = A x.
    pub(crate) fn multiply(&self, x: &[Vector3<f64>], out: &mut [Vector3<f64>]) {
        parallel::fill(out, |i| self.product(i, x));
    }

    pub(crate) fn transpose(&self, num_columns: usize) -> Self {
        let mut offsets = vec![0usize; num_columns + 1];
        for &j in &self.columns {
            offsets[j as usize + 1] += 1;
        }
        for j in 0..num_columns {
            offsets[j + 1] += offsets[j];
        }
        let mut next = offsets.clone();
        let mut columns = vec![0u32; self.columns.len()];
        let mut values = vec![0.0; self.values.len()];
        for i in 0..self.num_rows() {
            for (j, value) in self.row(i) {
                columns[next[j]] = i as u32;
                values[next[j]] = value;
                next[j] += 1;
            }
        }
        Self {
            offsets,
            columns,
            values,
        }
    }

    /// Computes A B, row by row in parallel.
    pub(crate) fn times(&self, other: &Self, num_columns: usize) -> Self {
        // Few chunks, since each needs a list of all columns.
        const CHUNKS: Chunks = Chunks::of(1 << 15);
        let blocks = CHUNKS.map(0..self.num_rows(), |_, rows| {
            // The position of each column in the current row: at least `begin` if it is present.
            let mut places = vec![usize::MAX; num_columns];
            let (mut ends, mut columns, mut values) = (Vec::new(), Vec::new(), Vec::new());
            for i in rows {
                let begin = columns.len();
                for (k, a) in self.row(i) {
                    for (j, b) in other.row(k) {
                        let place = places[j];
                        if place != usize::MAX && place >= begin {
                            values[place] += a * b;
                        } else {
                            places[j] = columns.len();
                            columns.push(j as u32);
                            values.push(a * b);
                        }
                    }
                }
                ends.push(columns.len());
            }
            (ends, columns, values)
        });
        let mut product = Self {
            offsets: vec![0],
            columns: Vec::new(),
            values: Vec::new(),
        };
        for (ends, columns, values) in blocks {
            let begin = product.columns.len();
            product.offsets.extend(ends.iter().map(|end| begin + end));
            product.columns.extend(columns);
            product.values.extend(values);
        }
        product
    }
}
