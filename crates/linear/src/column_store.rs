//! The columns of M⁺ at the handles, stored to be streamed.

use cotan_parallel::Chunks;
use nalgebra::{Matrix3, Vector3};

/// Columns that one solve gives.
pub(crate) const LANES: usize = 3;

/// The place of a column: block and coordinate.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Slot {
    block: usize,
    lane: usize,
}

/// Columns in blocks of three, each block an array of vectors with one coordinate a column: a pass
/// over the vertices reads every block once, from front to back.
#[derive(Default)]
pub(crate) struct ColumnStore {
    blocks: Vec<Block>,
    /// λ of the columns of each block, a column each.
    forces: Vec<Matrix3<f64>>,
}

struct Block {
    values: Vec<Vector3<f64>>,
    is_used: [bool; LANES],
}

impl ColumnStore {
    /// Takes up the first `count` coordinates of `columns`.
    pub(crate) fn insert(&mut self, columns: &[Vector3<f64>], count: usize) -> Vec<Slot> {
        let slots = self.vacant(count, columns.len());
        let is_block = count == LANES
            && slots
                .iter()
                .enumerate()
                .all(|(lane, s)| *s == Slot { lane, ..slots[0] });
        if is_block {
            self.blocks[slots[0].block].values.copy_from_slice(columns);
            return slots;
        }
        for (from, slot) in slots.iter().enumerate() {
            let values = &mut self.blocks[slot.block].values;
            for (value, column) in values.iter_mut().zip(columns) {
                value[slot.lane] = column[from];
            }
        }
        slots
    }

    /// Takes up one column.
    pub(crate) fn insert_one(&mut self, column: &[f64]) -> Slot {
        let slot = self.vacant(1, column.len())[0];
        let values = &mut self.blocks[slot.block].values;
        for (value, entry) in values.iter_mut().zip(column) {
            value[slot.lane] = *entry;
        }
        slot
    }

    /// Gives up columns; blocks at the end that hold none are dropped.
    pub(crate) fn remove(&mut self, slots: impl IntoIterator<Item = Slot>) {
        for slot in slots {
            self.blocks[slot.block].is_used[slot.lane] = false;
        }
        while self
            .blocks
            .last()
            .is_some_and(|block| block.is_used == [false; LANES])
        {
            self.blocks.pop();
            self.forces.pop();
        }
    }

    /// The entry of a column at vertex `i`.
    pub(crate) fn entry(&self, slot: Slot, i: usize) -> f64 {
        self.blocks[slot.block].values[i][slot.lane]
    }

    /// Sets λ of the column in `slot`.
    pub(crate) fn set_force(&mut self, slot: Slot, force: Vector3<f64>) {
        self.forces[slot.block].set_column(slot.lane, &force);
    }

    /// Sets the λ of all columns to zero.
    pub(crate) fn clear_forces(&mut self) {
        self.forces.fill(Matrix3::zeros());
    }

    /// x ← x − Qλ + the shift of each vertex.
    pub(crate) fn subtract_from(
        &self,
        x: &mut [Vector3<f64>],
        shift: impl Fn(usize) -> Vector3<f64> + Sync,
    ) {
        /// Vertices whose sums stay in the first-level cache while the blocks pass.
        const CHUNKS: Chunks = Chunks::of(512);
        CHUNKS.for_each(x, |start, x| {
            for (k, x) in x.iter_mut().enumerate() {
                *x += shift(start + k);
            }
            for (block, force) in self.blocks.iter().zip(&self.forces) {
                let rows = &block.values[start..start + x.len()];
                for (x, row) in x.iter_mut().zip(rows) {
                    *x -= force * row;
                }
            }
        });
    }

    /// Free slots: first those of existing blocks, then those of new ones.
    fn vacant(&mut self, count: usize, num_vertices: usize) -> Vec<Slot> {
        let mut slots = Vec::with_capacity(count);
        let mut block = 0;
        while slots.len() < count {
            if block == self.blocks.len() {
                self.blocks.push(Block {
                    values: vec![Vector3::zeros(); num_vertices],
                    is_used: [false; LANES],
                });
                self.forces.push(Matrix3::zeros());
            }
            for (lane, is_used) in self.blocks[block].is_used.iter_mut().enumerate() {
                if !*is_used && slots.len() < count {
                    *is_used = true;
                    slots.push(Slot { block, lane });
                }
            }
            block += 1;
        }
        slots
    }
}
