//! faer's own Cholesky of the one-ring matrix with one vertex grounded: AMD, supernodal, one
//! thread.

use cotan::prelude::Vector3;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};
use nalgebra_sparse::CsrMatrix;

use crate::measured::Phases;
use crate::ours::repeat;

/// Measures the phases "faer prepare" and "faer solve".
///
/// Measures nothing if faer refuses the matrix.
pub(crate) fn measure(matrix: &CsrMatrix<f64>, phases: &mut Phases) {
    let n = matrix.nrows() - 1;
    let (mut offsets, mut rows, mut values) = (vec![0], vec![], vec![]);
    // The matrix is symmetric: row i right of the diagonal is column i below it.
    for (i, row) in matrix.row_iter().enumerate().skip(1) {
        for (&j, &value) in row.col_indices().iter().zip(row.values()) {
            if j >= i {
                rows.push(j - 1);
                values.push(value);
            }
        }
        offsets.push(rows.len());
    }
    let pattern = SymbolicSparseColMatRef::new_checked(n, n, &offsets, None, &rows);
    let params = CholeskySymbolicParams {
        supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
        ..Default::default()
    };
    let factor = || {
        let symbolic =
            factorize_symbolic_cholesky(pattern, Side::Lower, SymmetricOrdering::Amd, params)
                .ok()?;
        let mut factor = vec![0.0; symbolic.len_val()];
        let request = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default());
        symbolic
            .factorize_numeric_llt(
                &mut factor,
                SparseColMatRef::new(pattern, &values),
                Side::Lower,
                LltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut MemBuffer::new(request)),
                Spec::default(),
            )
            .ok()?;
        Some((symbolic, factor))
    };
    let mut made = None;
    repeat(|| made = phases.time("faer prepare", factor));
    let Some((symbolic, factor)) = made else {
        return;
    };
    let column = Vector3::new(1.0, -0.5, 0.25);
    let mut right: Vec<f64> = (0..3 * n).map(|i| column[i % 3]).collect();
    let mut scratch = MemBuffer::new(symbolic.solve_in_place_scratch::<f64>(3, Par::Seq));
    repeat(|| {
        phases.time("faer solve", || {
            LltRef::new(&symbolic, &factor).solve_in_place_with_conj(
                Conj::No,
                MatMut::from_column_major_slice_mut(&mut right, n, 3),
                Par::Seq,
                MemStack::new(&mut scratch),
            );
        });
        // Start from the same right-hand side: repeated solves of solutions would become
        // subnormal.
        right
            .iter_mut()
            .enumerate()
            .for_each(|(i, x)| *x = column[i % 3]);
    });
    phases.number("faer factor_bytes", 8.0 * factor.len() as f64);
}
