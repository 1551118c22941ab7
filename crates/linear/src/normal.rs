//! The normal equations: LᵀL + μK + D on the free vertices, factorized.

use cotan_laplacian::Graph;
use cotan_parallel::{self as parallel, Chunks};
use cotan_sparse::{Cholesky, LowerTriangle};
use nalgebra::Vector3;

use crate::error::LinearError;
use crate::handles::Hold;
use crate::problem::{Problem, Sheet, Stiffness};
use crate::storage::Storage;
use crate::strategy::Strategy;
use crate::stretched::{Piece, Stretched};
use crate::weights::Weights;

/// The strategy that serves every operator and every set of handles: hard handles are eliminated,
/// soft ones are springs on the diagonal. Its matrix reaches over two rings, and is another one
/// for other handles. Rows of vertices of high valence are cut into pieces: see [`Stretched`].
pub(crate) struct NormalEquations {
    free: Vec<usize>,
    cholesky: Cholesky,
    /// A vector over the free vertices, and zeros for the links between pieces.
    unknowns: Vec<Vector3<f64>>,
}

impl NormalEquations {
    pub(crate) fn factor(problem: &Problem, storage: &Storage) -> Result<Self, LinearError> {
        check_product(problem, storage)?;
        let (free, matrix) = assemble_free(problem)?;
        Ok(Self {
            unknowns: vec![Vector3::zeros(); matrix.num_unknowns()],
            free,
            cholesky: storage.factor(&matrix)?,
        })
    }

    /// For other weights and the same handles: the analysis is shared.
    pub(crate) fn refactor(&self, problem: &Problem) -> Result<Self, LinearError> {
        let (free, matrix) = assemble_free(problem)?;
        Ok(Self {
            unknowns: vec![Vector3::zeros(); matrix.num_unknowns()],
            free,
            cholesky: self.cholesky.factor_like(&matrix)?,
        })
    }

    pub(crate) fn num_entries(&self) -> usize {
        self.cholesky.num_entries()
    }

    /// δ = (LᵀL + μK + D)⁻¹ r on the free vertices, 0 at hard handles.
    pub(crate) fn correct(
        &mut self,
        residual: impl Fn(usize) -> Vector3<f64> + Sync,
        correction: &mut [Vector3<f64>],
    ) {
        let (unknowns, links) = self.unknowns.split_at_mut(self.free.len());
        parallel::update((unknowns, &self.free[..]), |_, (x, &i)| *x = residual(i));
        links.fill(Vector3::zeros());
        self.cholesky.solve(&mut self.unknowns);
        correction.fill(Vector3::zeros());
        for (x, &i) in self.unknowns.iter().zip(&self.free) {
            correction[i] = *x;
        }
    }
}

/// Refuses a matrix that alone would take more memory than is allowed, before it is assembled.
fn check_product(problem: &Problem, storage: &Storage) -> Result<(), LinearError> {
    let Some(limit) = storage.limit else {
        return Ok(());
    };
    // The blocks of columns and the matrix that they are joined to, then the graph that is
    // ordered.
    let bytes_per_entry = 2 * (size_of::<u32>() + size_of::<f64>()) as u64 + 16;
    let bound = Stretched::new(&problem.graph).bound_of_product(&problem.graph);
    let of_ties = problem
        .ties
        .all()
        .iter()
        .map(|tie| (tie.terms.len() as u64).pow(2));
    let bound = bound + of_ties.sum::<u64>();
    let predicted = bound.saturating_mul(bytes_per_entry);
    if predicted > limit.permitted {
        return Err(LinearError::MemoryLimit {
            strategy: Strategy::Normal,
            predicted,
            permitted: limit.permitted,
        });
    }
    Ok(())
}

fn assemble_free(problem: &Problem) -> Result<(Vec<usize>, LowerTriangle), LinearError> {
    let mut is_free = vec![true; problem.num_vertices()];
    for handle in &problem.held.handles {
        if handle.hold == Hold::Hard {
            is_free[handle.vertex.index()] = false;
        }
    }
    let free: Vec<usize> = (0..is_free.len()).filter(|&i| is_free[i]).collect();
    let mut free_index = vec![None; is_free.len()];
    for (unknown, &i) in free.iter().enumerate() {
        free_index[i] = Some(unknown);
    }
    let stretched = Stretched::new(&problem.graph);
    free_index.extend((0..stretched.num_links()).map(|link| Some(free.len() + link)));
    let matrix = assemble(problem, &stretched, &free, &free_index)?;
    Ok((free, matrix))
}

/// Assembles LᵀL + μK + D restricted to the free vertices, and behind them the links of
/// `stretched`.
///
/// `free_index[i]` is the unknown of vertex i or `None`; `free` is its inverse. Column by column
/// in parallel: column i of LᵀL gathers the rows k of L that have an entry in column i, that is i
/// itself and its neighbours. The order of the sums depends on the mesh alone.
fn assemble(
    problem: &Problem,
    stretched: &Stretched,
    free: &[usize],
    free_index: &[Option<usize>],
) -> Result<LowerTriangle, LinearError> {
    let Problem {
        graph,
        weights,
        membrane,
        ties,
        held,
        ..
    } = problem;
    const CHUNKS: Chunks = Chunks::of(2048);
    let blocks: Vec<(Vec<usize>, Vec<u32>, Vec<f64>)> = CHUNKS.map_with(
        free,
        || Column::new(free_index.len()),
        |column, _, vertices| {
            let (mut lengths, mut rows, mut values) = (Vec::new(), Vec::new(), Vec::new());
            for &i in vertices {
                column.gather(graph, weights, stretched, i);
                column.add_membrane(graph, weights, i, membrane.as_ref());
                if let Some(sheet) = membrane {
                    for (j, entry) in ties.row(i) {
                        column.add(j, sheet.weight * entry);
                    }
                }
                column.values[i] += held.spring(i);
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
    );
    let mut offsets = Vec::with_capacity(free.len() + 1);
    let mut rows = Vec::with_capacity(blocks.iter().map(|b| b.1.len()).sum());
    let mut values = Vec::with_capacity(blocks.iter().map(|b| b.2.len()).sum());
    offsets.push(0);
    let mut end = 0;
    for (lengths, block_rows, block_values) in blocks {
        for length in lengths {
            end += length;
            offsets.push(end);
        }
        rows.extend(block_rows);
        values.extend(block_values);
    }
    for (link, (diagonal, below)) in stretched.link_columns(weights).enumerate() {
        let row = (free.len() + link) as u32;
        rows.push(row);
        values.push(diagonal);
        if let Some(value) = below {
            rows.push(row + 1);
            values.push(value);
        }
        offsets.push(rows.len());
    }
    Ok(LowerTriangle::new(offsets, rows, values)?)
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

    /// Adds column `i` of LᵀL.
    fn gather(&mut self, graph: &Graph, weights: &Weights, stretched: &Stretched, i: usize) {
        if stretched.is_cut(i) {
            for piece in stretched.pieces(weights, i) {
                self.add_piece(graph, weights, &piece, piece.own);
            }
        } else {
            let diagonal = weights.row(graph, i).next().map_or(0.0, |(_, d)| d);
            for (j, entry) in weights.row(graph, i) {
                self.add(j, diagonal * entry);
            }
        }
        for k in graph.range(i) {
            let row = graph.neighbours()[k].index();
            let entry_in_column = weights.incoming(k);
            if stretched.is_cut(row) {
                if let Some(piece) = stretched.piece_with(graph, weights, row, i) {
                    self.add_piece(graph, weights, &piece, entry_in_column);
                }
                continue;
            }
            for (j, entry) in weights.row(graph, row) {
                self.add(j, entry_in_column * entry);
            }
        }
    }

    /// Adds a piece of a row, times its weight and its entry in the current column. Links come
    /// after the vertices.
    fn add_piece(&mut self, graph: &Graph, weights: &Weights, piece: &Piece<'_>, entry: f64) {
        let factor = piece.weight * entry;
        let num_rows = graph.num_rows();
        self.add(piece.hub, factor * piece.own);
        for &k in piece.entries {
            let k = k as usize;
            self.add(graph.neighbours()[k].index(), factor * weights.outgoing(k));
        }
        for (link, coefficient) in piece.links.into_iter().flatten() {
            self.add(num_rows + link, factor * coefficient);
        }
    }

    /// Adds column `i` of μK.
    fn add_membrane(
        &mut self,
        graph: &Graph,
        weights: &Weights,
        i: usize,
        membrane: Option<&Sheet>,
    ) {
        if let Some(Sheet { weight, stiffness }) = membrane {
            for k in graph.range(i) {
                let s = weight
                    * match stiffness {
                        Stiffness::OfWeights(c) => c * weights.outgoing(k),
                        Stiffness::PerEntry(each) => each[k],
                    };
                self.add(i, s);
                self.add(graph.neighbours()[k].index(), -s);
            }
        }
    }

    /// Moves the free rows from the diagonal down into the output and clears the accumulator.
    fn emit(
        &mut self,
        free_index: &[Option<usize>],
        column: Option<usize>,
        lengths: &mut Vec<usize>,
        rows: &mut Vec<u32>,
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
                rows.push(row as u32);
                values.push(value);
            }
        }
        self.touched.clear();
        lengths.push(rows.len() - start);
    }
}
