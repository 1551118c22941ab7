//! The normal equations: LᵀL + μK + D on the free vertices, lower triangle, compressed columns.

use cotan_halfedge::HalfedgeMap;
use cotan_laplacian::OneRings;
use rayon::prelude::*;

use crate::system::Membrane;

/// The weights in ring order, and products with L and Lᵀ in difference form.
pub(crate) struct Weights {
    /// w_ij for every neighbour j of every i, in the order of the rings.
    outgoing: Vec<f64>,
    /// w_ji in the same order; empty if the scheme is symmetric.
    incoming: Vec<f64>,
}

impl Weights {
    pub(crate) fn new(rings: &OneRings, weights: &HalfedgeMap<f64>, symmetric: bool) -> Self {
        let outgoing = rings.halfedges().iter().map(|&h| weights[h]).collect();
        let incoming = if symmetric {
            Vec::new()
        } else {
            rings
                .halfedges()
                .iter()
                .map(|h| weights[h.twin()])
                .collect()
        };
        Self { outgoing, incoming }
    }

    fn outgoing(&self, k: usize) -> f64 {
        self.outgoing[k]
    }

    /// Weight of the same edge in the other direction.
    pub(crate) fn incoming(&self, k: usize) -> f64 {
        if self.incoming.is_empty() {
            self.outgoing[k]
        } else {
            self.incoming[k]
        }
    }

    /// (Lᵀ y)_i = Σ_j (w_ji y_j − w_ij y_i), with L the operator as the paper signs it.
    pub(crate) fn transpose_product(
        &self,
        rings: &OneRings,
        i: usize,
        y: &[nalgebra::Vector3<f64>],
    ) -> nalgebra::Vector3<f64> {
        let mut sum = nalgebra::Vector3::zeros();
        for k in rings.range(i) {
            let j = rings.neighbours()[k].index();
            sum += y[j] * self.incoming(k) - y[i] * self.outgoing(k);
        }
        sum
    }

    /// Row i of L with its diagonal: pairs (column, entry), diagonal first.
    pub(crate) fn row<'a>(
        &'a self,
        rings: &'a OneRings,
        i: usize,
    ) -> impl Iterator<Item = (usize, f64)> + 'a {
        let range = rings.range(i);
        let diagonal = -self.outgoing[range.clone()].iter().sum::<f64>();
        std::iter::once((i, diagonal))
            .chain(range.map(|k| (rings.neighbours()[k].index(), self.outgoing[k])))
    }
}

/// A symmetric sparse matrix: its lower triangle by columns, rows ascending.
pub(crate) struct LowerTriangle {
    pub(crate) offsets: Vec<usize>,
    pub(crate) rows: Vec<usize>,
    pub(crate) values: Vec<f64>,
}

impl LowerTriangle {
    /// out = M x for one vector.
    pub(crate) fn multiply(&self, x: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for j in 0..x.len() {
            for k in self.offsets[j]..self.offsets[j + 1] {
                let i = self.rows[k];
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
                let i = self.rows[k];
                sums[i] += self.values[k].abs();
                if i != j {
                    sums[j] += self.values[k].abs();
                }
            }
        }
        sums.into_iter().fold(0.0, f64::max)
    }
}

/// Assembles LᵀL + μK + diag(d) restricted to the free vertices.
///
/// `free_index[i]` is the unknown of vertex i or `None`; `free` is its inverse. Column by column
/// in parallel: column i of LᵀL gathers the rows k of L that have an entry in column i, that is i
/// itself and its neighbours. The order of the sums depends on the mesh alone.
pub(crate) fn assemble(
    rings: &OneRings,
    weights: &Weights,
    free: &[usize],
    free_index: &[Option<usize>],
    membrane: Option<Membrane<'_>>,
    diagonal: &[f64],
) -> LowerTriangle {
    const CHUNK: usize = 2048;
    let blocks: Vec<(Vec<usize>, Vec<usize>, Vec<f64>)> = free
        .par_chunks(CHUNK)
        .map_init(
            || Column::new(free_index.len()),
            |column, vertices| {
                let (mut lengths, mut rows, mut values) = (Vec::new(), Vec::new(), Vec::new());
                for &i in vertices {
                    column.gather(rings, weights, i, membrane);
                    column.values[i] += diagonal[i];
                    column.emit(
                        free_index,
                        free_index[i],
                        &mut lengths,
                        &mut rows,
                        &mut values,
                    );
                }
                (lengths, rows, values)
            },
        )
        .collect();
    let mut matrix = LowerTriangle {
        offsets: Vec::with_capacity(free.len() + 1),
        rows: Vec::with_capacity(blocks.iter().map(|b| b.1.len()).sum()),
        values: Vec::with_capacity(blocks.iter().map(|b| b.2.len()).sum()),
    };
    matrix.offsets.push(0);
    let mut end = 0;
    for (lengths, rows, values) in blocks {
        for length in lengths {
            end += length;
            matrix.offsets.push(end);
        }
        matrix.rows.extend(rows);
        matrix.values.extend(values);
    }
    matrix
}

/// A dense accumulator for one column at a time.
struct Column {
    values: Vec<f64>,
    touched: Vec<usize>,
    is_touched: Vec<bool>,
}

impl Column {
    fn new(n: usize) -> Self {
        Self {
            values: vec![0.0; n],
            touched: Vec::new(),
            is_touched: vec![false; n],
        }
    }

    fn add(&mut self, row: usize, value: f64) {
        if !self.is_touched[row] {
            self.is_touched[row] = true;
            self.touched.push(row);
        }
        self.values[row] += value;
    }

    fn gather(
        &mut self,
        rings: &OneRings,
        weights: &Weights,
        i: usize,
        membrane: Option<Membrane<'_>>,
    ) {
        let diagonal = weights.row(rings, i).next().map_or(0.0, |(_, d)| d);
        for (j, entry) in weights.row(rings, i) {
            self.add(j, diagonal * entry);
        }
        for k in rings.range(i) {
            let row = rings.neighbours()[k].index();
            let entry_in_column = weights.incoming(k);
            for (j, entry) in weights.row(rings, row) {
                self.add(j, entry_in_column * entry);
            }
        }
        if let Some(Membrane { weight, stiffness }) = membrane {
            for (j, h) in rings.ring(i) {
                let s = weight * stiffness[h.edge()];
                self.add(i, s);
                self.add(j.index(), -s);
            }
        }
    }

    /// Moves the free rows from the diagonal down into the output and clears the accumulator.
    fn emit(
        &mut self,
        free_index: &[Option<usize>],
        column: Option<usize>,
        lengths: &mut Vec<usize>,
        rows: &mut Vec<usize>,
        values: &mut Vec<f64>,
    ) {
        let start = rows.len();
        // The unknowns ascend with the vertices, so sorting vertices sorts rows.
        self.touched.sort_unstable();
        for &vertex in &self.touched {
            let value = std::mem::replace(&mut self.values[vertex], 0.0);
            self.is_touched[vertex] = false;
            if let Some(row) = free_index[vertex]
                && Some(row) >= column
            {
                rows.push(row);
                values.push(value);
            }
        }
        self.touched.clear();
        lengths.push(rows.len() - start);
    }
}
