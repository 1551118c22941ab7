//! Parallel sweeps of single-vertex steps over a layout, with the same result for any number of
//! threads: vertices of one colour are not neighbours, so all of them may move at once.

use cotan_parallel::Chunks;
use nalgebra::Vector3;

use super::layout::Layout;

/// Vertices that may move, in classes without neighbours.
#[derive(Clone, Debug)]
pub(super) struct Sweeper {
    classes: Vec<Vec<u32>>,
    /// Per vertex: true if it or a neighbour has moved since it was last processed.
    stale: Vec<bool>,
}

impl Sweeper {
    /// Creates a sweeper for the given vertices of a layout, coloured greedily in their order.
    pub(super) fn new(layout: &Layout, vertices: &[u32]) -> Self {
        let mut colour = vec![NO_COLOUR; layout.table.num_vertices()];
        let mut stale = vec![false; layout.table.num_vertices()];
        let mut classes: Vec<Vec<u32>> = Vec::new();
        let mut taken = Vec::new();
        for &v in vertices {
            taken.clear();
            taken.resize(classes.len() + 1, false);
            for w in layout.table.ring(v) {
                if let Some(t) = taken.get_mut(colour[w as usize] as usize) {
                    *t = true;
                }
            }
            let free = taken.iter().position(|t| !t).unwrap_or(classes.len());
            if free == classes.len() {
                classes.push(Vec::new());
            }
            classes[free].push(v);
            colour[v as usize] = free as u32;
            stale[v as usize] = true;
        }
        Self { classes, stale }
    }

    /// Moves each vertex once if that lowers the energy. Returns the number of vertices that
    /// moved by more than a thousandth of their star.
    pub(super) fn sweep(&mut self, layout: &mut Layout, reach: f64) -> usize {
        let mut count = 0;
        for class in &self.classes {
            let wanted: Vec<u32> = class
                .iter()
                .copied()
                .filter(|&v| self.stale[v as usize])
                .collect();
            let moves = moves(layout, &wanted, reach);
            for (&v, to) in wanted.iter().zip(moves) {
                self.stale[v as usize] = false;
                let Some((place, far)) = to else { continue };
                layout.place[v as usize] = place;
                if far {
                    count += 1;
                    self.stale[v as usize] = true;
                    for w in layout.table.ring(v) {
                        self.stale[w as usize] = true;
                    }
                }
            }
        }
        count
    }
}

/// The steps of non-adjacent vertices, each with a flag that is set if its ring has to be
/// updated.
fn moves(layout: &Layout, vertices: &[u32], reach: f64) -> Vec<Option<(Vector3<f64>, bool)>> {
    let one = |star: &mut Vec<_>, v: u32| {
        let place = layout.better_place(v, reach, star)?;
        let from = &layout.place[v as usize];
        let far = (place - from).norm() > WORTH * Layout::size_of_star(star, from);
        Some((place, far))
    };
    let parts = CHUNKS.map_with(vertices, Vec::new, |star, _, part| {
        part.iter().map(|&v| one(star, v)).collect::<Vec<_>>()
    });
    parts.concat()
}

const NO_COLOUR: u32 = u32::MAX;
/// Vertices per task; smaller tasks would cost more than they save.
const CHUNKS: Chunks = Chunks::of(128);
/// A move below this fraction of the star's size does not wake the neighbours.
const WORTH: f64 = 1e-3;
