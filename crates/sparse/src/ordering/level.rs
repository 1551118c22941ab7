//! A graph with weighted vertices: one level of the hierarchy, or a part of one.

use std::sync::atomic::{AtomicU32, Ordering};

use super::Graph;

/// A symmetric graph whose vertices stand for one or more vertices of the graph to be ordered.
pub(super) struct Level {
    pub(super) offsets: Vec<u32>,
    pub(super) neighbours: Vec<u32>,
    /// The number of original vertices that each vertex stands for.
    pub(super) weights: Vec<u32>,
}

impl Level {
    pub(super) fn graph(&self) -> Graph<'_> {
        Graph {
            offsets: &self.offsets,
            neighbours: &self.neighbours,
        }
    }

    pub(super) fn num_vertices(&self) -> usize {
        self.weights.len()
    }

    pub(super) fn ring(&self, v: u32) -> &[u32] {
        let v = v as usize;
        &self.neighbours[self.offsets[v] as usize..self.offsets[v + 1] as usize]
    }

    pub(super) fn weight(&self, v: u32) -> u32 {
        self.weights[v as usize]
    }

    pub(super) fn total_weight(&self) -> u64 {
        self.weights.iter().map(|&w| u64::from(w)).sum()
    }

    /// Returns the part with these `vertices`, which are those with `label`; `slots` is memory
    /// for their indices.
    pub(super) fn part(
        &self,
        vertices: &[u32],
        label: u32,
        labels: &[AtomicU32],
        slots: &[AtomicU32],
    ) -> Self {
        for (i, &v) in vertices.iter().enumerate() {
            put(slots, v, i as u32);
        }
        let mut part = Self {
            offsets: Vec::with_capacity(vertices.len() + 1),
            neighbours: Vec::with_capacity(vertices.len() * 6),
            weights: Vec::with_capacity(vertices.len()),
        };
        part.offsets.push(0);
        for &v in vertices {
            let ring = self.ring(v).iter();
            let inside = ring.filter(|&&u| get(labels, u) == label);
            part.neighbours.extend(inside.map(|&u| get(slots, u)));
            part.offsets.push(part.neighbours.len() as u32);
            part.weights.push(self.weight(v));
        }
        part
    }
}

/// Reads an entry of an array shared by threads; each entry belongs to one thread at a time.
pub(super) fn get(array: &[AtomicU32], v: u32) -> u32 {
    array[v as usize].load(Ordering::Relaxed)
}

/// Writes an entry of an array shared by threads.
pub(super) fn put(array: &[AtomicU32], v: u32, value: u32) {
    array[v as usize].store(value, Ordering::Relaxed);
}

/// Creates an array shared by threads.
pub(super) fn shared(len: usize, value: u32) -> Vec<AtomicU32> {
    (0..len).map(|_| AtomicU32::new(value)).collect()
}

/// No vertex.
pub(super) const NONE: u32 = u32::MAX;
