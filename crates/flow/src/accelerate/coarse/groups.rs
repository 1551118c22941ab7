//! Groups of cells whose rotations are taken to follow as one.

use crate::cells::cell_share;
use crate::net::{Distances, Net};

/// For every vertex the groups of the cells that its terms serve, with the shares P 1_c.
#[derive(Debug)]
pub(super) struct Groups {
    pub(super) len: usize,
    of_terms: Rows,
}

/// Lists of groups with a factor each, one list per vertex.
#[derive(Debug)]
struct Rows {
    starts: Vec<u32>,
    entries: Vec<(u32, f64)>,
}

impl Rows {
    fn at(&self, i: usize) -> &[(u32, f64)] {
        &self.entries[self.starts[i] as usize..self.starts[i + 1] as usize]
    }
}

/// Adds up numbers by group.
struct Sum {
    list: Vec<(u32, f64)>,
    /// The place of every group in the list, or more than there are.
    places: Vec<u32>,
}

impl Sum {
    fn add(&mut self, group: u32, x: f64) {
        let place = &mut self.places[group as usize];
        if *place == u32::MAX {
            *place = self.list.len() as u32;
            self.list.push((group, 0.0));
        }
        self.list[*place as usize].1 += x;
    }

    fn clear(&mut self) {
        for (group, _) in self.list.drain(..) {
            self.places[group as usize] = u32::MAX;
        }
    }
}

fn gather(n: usize, num_groups: u32, each: impl Fn(usize, &mut Sum)) -> Rows {
    let mut rows = Rows {
        starts: vec![0],
        entries: Vec::new(),
    };
    let mut sum = Sum {
        list: Vec::new(),
        places: vec![u32::MAX; num_groups as usize],
    };
    for i in 0..n {
        sum.clear();
        each(i, &mut sum);
        rows.entries.extend_from_slice(&sum.list);
        rows.starts.push(rows.entries.len() as u32);
    }
    rows
}

impl Groups {
    /// Groups the cells by the nearest of some vertices, along the edges: those of the clusters
    /// and more between them. Cells that none of them reaches are one group.
    pub(super) fn new(net: &Net<'_>, seeds: &[usize]) -> Self {
        /// Groups of a mesh that is fine enough, and cells of a group where it is not.
        const MAX: usize = 256;
        const FEWEST_CELLS: usize = 4;
        let n = net.points.len();
        let mut distances = Distances::new(n);
        let mut len = 1_u32;
        let mut number_of = vec![0_u32; n];
        for &seed in seeds {
            distances.spread(net, [seed]);
            number_of[seed] = len;
            len += 1;
        }
        while (len as usize) < MAX.min(n / FEWEST_CELLS)
            && let Some((seed, _)) = distances.farthest()
        {
            distances.spread(net, [seed]);
            number_of[seed] = len;
            len += 1;
        }
        let group = |source: &u32| number_of.get(*source as usize).copied().unwrap_or(0);
        let group_of: Vec<u32> = distances.source.iter().map(group).collect();
        let graph = net.graph;
        let around = |i: usize| {
            let row = graph.neighbours()[graph.range(i)].iter().map(|j| j.index());
            std::iter::once(i).chain(row)
        };
        let of_cells = gather(n, len, |k, sum| {
            for i in around(k) {
                sum.add(group_of[i], 1.0);
            }
        });
        let of_terms = gather(n, len, |j, sum| {
            for k in around(j) {
                let share = cell_share(graph, j) * cell_share(graph, k);
                for (group, count) in of_cells.at(k) {
                    sum.add(*group, share * count);
                }
            }
        });
        Self {
            len: len as usize,
            of_terms,
        }
    }

    /// The groups of the cells that vertex `j` serves, with its shares.
    #[inline]
    pub(super) fn at(&self, j: usize) -> &[(u32, f64)] {
        self.of_terms.at(j)
    }
}
