//! Storage of the panel of a supernode, in the order in which a solve reads it.
//!
//! Columns are stored in blocks of four, then of two and one. A block consists of its diagonal
//! square by columns, with the inverses of the pivots on its diagonal, followed by the part below
//! in tiles of four rows, column by column within a tile, the last tile padded with zeros. A
//! solve thus reads one stream, in whole vectors.

use super::numeric::Value;

/// Number of rows in a tile.
pub(super) const TILE: usize = 4;

/// Number of values stored for a panel.
pub(super) fn len(width: usize, height: usize) -> usize {
    let (mut len, mut column) = (0, 0);
    while column < width {
        let block = block(width - column);
        len += block * block + block * (height - column - block).next_multiple_of(TILE);
        column += block;
    }
    len
}

/// Width of the next block, given the number of columns left.
#[inline(always)]
fn block(left: usize) -> usize {
    match left {
        4.. => 4,
        2.. => 2,
        _ => 1,
    }
}

/// Stores a factorized panel, given column by column.
#[inline(always)]
pub(super) fn pack<V: Value>(panel: &[f64], height: usize, width: usize, stored: &mut [V]) {
    let mut rest = stored;
    let mut column = 0;
    while column < width {
        let block = block(width - column);
        let below = column + block;
        let (square, after) = std::mem::take(&mut rest).split_at_mut(block * block);
        let (tiles, after) = after.split_at_mut(block * (height - below).next_multiple_of(TILE));
        rest = after;
        for k in 0..block {
            let values = &panel[(column + k) * height..(column + k + 1) * height];
            for i in 0..block {
                square[k * block + i] = match i.cmp(&k) {
                    std::cmp::Ordering::Less => V::default(),
                    std::cmp::Ordering::Equal => V::of(1.0 / values[column + i]),
                    std::cmp::Ordering::Greater => V::of(values[column + i]),
                };
            }
            let tile = block * TILE;
            for (target, rows) in tiles
                .chunks_exact_mut(tile)
                .zip(values[below..].chunks(TILE))
            {
                for i in 0..TILE {
                    target[k * TILE + i] = rows.get(i).map_or(V::default(), |&x| V::of(x));
                }
            }
        }
        column += block;
    }
}
