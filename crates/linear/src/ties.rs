//! Ties: springs between points of a mesh that no edge joins.

use cotan_halfedge::{DisjointSets, VertexId};

use crate::components::GraphComponents;

/// A term κ |Σ_k c_k x_k|² of the membrane's energy K: it adds κ c cᵀ to K.
///
/// A point of a triangle tied to one of another has the shares of both as c, those of the other
/// negative. The shares are to add up to zero, so that K·1 = 0.
#[derive(Clone, PartialEq, Debug)]
pub struct Tie {
    /// κ, in units of the stiffness of edges.
    pub weight: f64,
    /// c: the vertices that count, each once.
    pub terms: Vec<(VertexId, f64)>,
}

/// The ties of a system, by vertex.
#[derive(Default)]
pub(crate) struct Ties {
    all: Vec<Tie>,
    /// Those of vertex i are `of_vertex[starts[i]..starts[i + 1]]`; empty without ties.
    starts: Vec<u32>,
    of_vertex: Vec<u32>,
}

impl Ties {
    pub(crate) fn new(num_vertices: usize, ties: &[Tie]) -> Self {
        if ties.is_empty() {
            return Self::default();
        }
        let mut starts = vec![0_u32; num_vertices + 1];
        for (vertex, _) in ties.iter().flat_map(|tie| &tie.terms) {
            starts[vertex.index() + 1] += 1;
        }
        for i in 0..num_vertices {
            starts[i + 1] += starts[i];
        }
        let mut cursor = starts.clone();
        let mut of_vertex = vec![0; starts[num_vertices] as usize];
        for (k, tie) in ties.iter().enumerate() {
            for (vertex, _) in &tie.terms {
                let slot = &mut cursor[vertex.index()];
                of_vertex[*slot as usize] = k as u32;
                *slot += 1;
            }
        }
        Self {
            all: ties.to_vec(),
            starts,
            of_vertex,
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    pub(crate) fn all(&self) -> &[Tie] {
        &self.all
    }

    /// The entries κ c_i c_j of row `i` of the ties' part of K.
    pub(crate) fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = match self.starts.get(i..i + 2) {
            Some(&[start, end]) => start as usize..end as usize,
            _ => 0..0,
        };
        self.of_vertex[range].iter().flat_map(move |&k| {
            let tie = &self.all[k as usize];
            let own = tie.terms.iter().find(|(v, _)| v.index() == i);
            let factor = tie.weight * own.map_or(0.0, |(_, c)| *c);
            tie.terms.iter().map(move |(j, c)| (j.index(), factor * c))
        })
    }

    /// The lowest of the components that ties join to each component, for every component.
    pub(crate) fn join(&self, components: &GraphComponents) -> Vec<usize> {
        let mut sets = DisjointSets::new(components.len());
        for tie in &self.all {
            let mut tied = tie.terms.iter().map(|(v, _)| components.of(v.index()));
            let Some(first) = tied.next() else { continue };
            for other in tied {
                sets.join(first as u32, other as u32);
            }
        }
        (0..components.len() as u32)
            .map(|c| sets.root(c) as usize)
            .collect()
    }
}
