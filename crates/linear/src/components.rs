//! The connected components of a system's graph, and sums over them.
//!
//! `cotan_halfedge::Components` are those of a mesh; a graph may join vertices that share no edge.

use cotan_laplacian::Graph;
use cotan_parallel::Chunks;
use nalgebra::Vector3;

/// The connected components.
pub(crate) struct GraphComponents {
    /// The component of every vertex; components are ordered by their lowest vertices.
    labels: Vec<u32>,
    /// All vertices, component after component, each ascending.
    members: Vec<u32>,
    /// The start of each component in `members`.
    offsets: Vec<usize>,
    /// Stretches of `members` within one component, which are summed as a whole.
    chunks: Vec<(usize, std::ops::Range<usize>)>,
}

impl GraphComponents {
    pub(crate) fn new(graph: &Graph) -> Self {
        const UNSEEN: u32 = u32::MAX;
        /// Vertices of a partial sum. Fixed, so that sums do not depend on the number of threads.
        const CHUNK: usize = 4096;
        let n = graph.num_rows();
        let mut labels = vec![UNSEEN; n];
        let (mut stack, mut sizes) = (Vec::new(), Vec::new());
        for start in 0..n {
            if labels[start] != UNSEEN {
                continue;
            }
            let label = sizes.len() as u32;
            let mut size = 1;
            labels[start] = label;
            stack.push(start);
            while let Some(i) = stack.pop() {
                for (j, _) in graph.row(i) {
                    if labels[j.index()] == UNSEEN {
                        labels[j.index()] = label;
                        size += 1;
                        stack.push(j.index());
                    }
                }
            }
            sizes.push(size);
        }
        let mut offsets = vec![0];
        for size in &sizes {
            offsets.push(offsets[offsets.len() - 1] + size);
        }
        let mut ends = offsets.clone();
        let mut members = vec![0; n];
        for (i, &label) in labels.iter().enumerate() {
            members[ends[label as usize]] = i as u32;
            ends[label as usize] += 1;
        }
        let chunks = (0..sizes.len())
            .flat_map(|c| {
                let (start, end) = (offsets[c], offsets[c + 1]);
                (start..end)
                    .step_by(CHUNK)
                    .map(move |s| (c, s..end.min(s + CHUNK)))
            })
            .collect();
        Self {
            labels,
            members,
            offsets,
            chunks,
        }
    }

    /// The number of components.
    pub(crate) fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    pub(crate) fn num_vertices(&self) -> usize {
        self.labels.len()
    }

    /// The component of vertex `i`.
    pub(crate) fn of(&self, i: usize) -> usize {
        // Most meshes have one, and need not be looked up.
        if self.len() == 1 {
            0
        } else {
            self.labels[i] as usize
        }
    }

    /// The vertices of a component, ascending.
    pub(crate) fn members(&self, component: usize) -> &[u32] {
        &self.members[self.offsets[component]..self.offsets[component + 1]]
    }

    /// Room for [`Self::sum`].
    pub(crate) fn partial_sums(&self) -> Vec<Vector3<f64>> {
        vec![Vector3::zeros(); self.chunks.len()]
    }

    /// The sum of a term over every component, in a fixed order.
    pub(crate) fn sum(
        &self,
        term: impl Fn(usize) -> Vector3<f64> + Sync,
        partial: &mut [Vector3<f64>],
        out: &mut [Vector3<f64>],
    ) {
        // One stretch a task: a chunk of stretches would be a whole mesh.
        const EACH: Chunks = Chunks::of(1);
        EACH.update((&mut *partial, &self.chunks[..]), |_, (sum, (_, range))| {
            let members = self.members[range.clone()].iter();
            *sum = members.map(|&i| term(i as usize)).sum();
        });
        out.fill(Vector3::zeros());
        for (sum, (component, _)) in partial.iter().zip(&self.chunks) {
            out[*component] += sum;
        }
    }
}
