//! Partial Cholesky factorizations of dense fronts.

use cotan_parallel as parallel;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{
    LltRegularization, cholesky_in_place, cholesky_in_place_scratch,
};
use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{BlockStructure, matmul as triangular_matmul};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, MatMut, MatRef, Par, Spec};

/// A pivot that is not positive.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct NotPositive;

/// Number of columns eliminated at once in a large front.
const BLOCK: usize = 96;
/// Side length of the tiles in which large fronts are updated: faer's product is slower on larger
/// ones.
const TILE: usize = 192;
/// Number of multiplications below which plain loops are faster than calls.
const SMALL: usize = 24_000;
/// Number of multiplications from which a front is worth more than one thread.
const LARGE: usize = 8_000_000;

/// Eliminates the columns of a front.
///
/// `panel` holds the front's first `width` columns, of `height` rows each, column-major; they
/// become those of the factor. Their products are subtracted from `update`, the lower triangle of
/// the square below (side `height − width`). Entries above the diagonals are not read.
#[inline(always)]
pub(super) fn eliminate(
    panel: &mut [f64],
    height: usize,
    width: usize,
    update: &mut [f64],
) -> Result<(), NotPositive> {
    let work = width * height * height;
    if work < SMALL {
        return eliminate_small(panel, height, width, update);
    }
    eliminate_blocked(panel, height, width, update, work >= LARGE)
}

#[inline(always)]
fn eliminate_small(
    panel: &mut [f64],
    height: usize,
    width: usize,
    update: &mut [f64],
) -> Result<(), NotPositive> {
    for j in 0..width {
        let (done, rest) = panel[j * height..].split_at_mut(height);
        let pivot = done[j];
        if !(pivot > 0.0 && pivot.is_finite()) {
            return Err(NotPositive);
        }
        let inverse = 1.0 / pivot.sqrt();
        for x in &mut done[j..] {
            *x *= inverse;
        }
        for (column, k) in rest.chunks_exact_mut(height).zip(j + 1..width) {
            let factor = done[k];
            for (x, l) in column[k..].iter_mut().zip(&done[k..]) {
                *x -= factor * l;
            }
        }
    }
    let below = height - width;
    if below == 0 {
        return Ok(());
    }
    for (b, column) in update.chunks_exact_mut(below).enumerate() {
        let target = &mut column[b..];
        let mut columns = panel.chunks_exact(4 * height);
        for four in &mut columns {
            let l = |k: usize| &four[k * height + width + b..(k + 1) * height];
            let (l0, l1, l2, l3) = (l(0), l(1), l(2), l(3));
            let (f0, f1, f2, f3) = (l0[0], l1[0], l2[0], l3[0]);
            for ((((x, a), b), c), d) in target.iter_mut().zip(l0).zip(l1).zip(l2).zip(l3) {
                *x -= (f0 * a + f1 * b) + (f2 * c + f3 * d);
            }
        }
        for one in columns.remainder().chunks_exact(height) {
            let l = &one[width + b..];
            let factor = l[0];
            for (x, l) in target.iter_mut().zip(l) {
                *x -= factor * l;
            }
        }
    }
    Ok(())
}

#[inline(never)]
fn eliminate_blocked(
    panel: &mut [f64],
    height: usize,
    width: usize,
    update: &mut [f64],
    is_large: bool,
) -> Result<(), NotPositive> {
    let request = cholesky_in_place_scratch::<f64>(BLOCK, Par::Seq, Spec::default());
    let mut memory = MemBuffer::new(request);
    let mut rest = MatMut::from_column_major_slice_mut(&mut *panel, height, width);
    while rest.ncols() > 0 {
        let block = BLOCK.min(rest.ncols());
        let (left, right) = rest.split_at_col_mut(block);
        let (mut diagonal, mut below) = left.split_at_row_mut(block);
        cholesky_in_place(
            diagonal.rb_mut(),
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut memory),
            Spec::default(),
        )
        .map_err(|_| NotPositive)?;
        let diagonal = diagonal.rb();
        each(strips(below.rb_mut()), is_large, |strip| {
            solve_lower_triangular_in_place(diagonal, strip.transpose_mut(), Par::Seq);
        });
        let (_, mut right) = right.split_at_row_mut(block);
        subtract_product(right.rb_mut(), below.rb(), is_large);
        rest = right;
    }
    let below = height - width;
    if below > 0 {
        let left = MatRef::from_column_major_slice(&*panel, height, width);
        let update = MatMut::from_column_major_slice_mut(update, below, below);
        subtract_product(update, left.subrows(width, below), is_large);
    }
    Ok(())
}

/// Computes target −= left leftᵀ on the lower trapezoid: row i and column j of the target belong
/// to the rows i and j of `left`.
fn subtract_product(target: MatMut<'_, f64>, left: MatRef<'_, f64>, is_large: bool) {
    let tiles = tiles(target);
    each(tiles, is_large, |(row, column, mut tile)| {
        let (rows, columns) = (tile.nrows(), tile.ncols());
        for k in (0..left.ncols()).step_by(TILE) {
            let depth = TILE.min(left.ncols() - k);
            let a = left.submatrix(row, k, rows, depth);
            let b = left.submatrix(column, k, columns, depth).transpose();
            if row == column {
                triangular_matmul(
                    tile.rb_mut(),
                    BlockStructure::TriangularLower,
                    Accum::Add,
                    a,
                    BlockStructure::Rectangular,
                    b,
                    BlockStructure::Rectangular,
                    -1.0,
                    Par::Seq,
                );
            } else {
                matmul(tile.rb_mut(), Accum::Add, a, b, -1.0, Par::Seq);
            }
        }
    });
}

/// A part of a matrix with its first row and column.
type Tile<'a> = (usize, usize, MatMut<'a, f64>);

/// Divides the lower trapezoid into tiles; those on the diagonal are square.
fn tiles(mut rest: MatMut<'_, f64>) -> Vec<Tile<'_>> {
    let mut tiles = Vec::new();
    let mut column = 0;
    while rest.ncols() > 0 {
        let width = TILE.min(rest.ncols());
        let (mut strip, right) = rest.split_at_col_mut(width);
        let (mut row, mut height) = (column, width);
        while strip.nrows() > 0 {
            let end = height.min(strip.nrows());
            let (tile, below) = strip.split_at_row_mut(end);
            tiles.push((row, column, tile));
            strip = below;
            row += height;
            height = TILE;
        }
        rest = right.split_at_row_mut(width).1;
        column += width;
    }
    tiles
}

/// Divides a matrix into strips of rows.
fn strips(mut rest: MatMut<'_, f64>) -> Vec<MatMut<'_, f64>> {
    let mut strips = Vec::new();
    while rest.nrows() > 0 {
        let height = TILE.min(rest.nrows());
        let (strip, below) = rest.split_at_row_mut(height);
        strips.push(strip);
        rest = below;
    }
    strips
}

/// Applies `work` to all items, in parallel if that is worthwhile. Each item is processed as a
/// whole, so the results do not depend on the threads.
fn each<A: Send>(items: Vec<A>, is_large: bool, work: impl Fn(A) + Sync + Send) {
    if is_large {
        parallel::tasks(items, work);
    } else {
        items.into_iter().for_each(work);
    }
}
