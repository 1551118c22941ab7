//! Coarsening: clusters of neighbouring vertices become the vertices of the next level.

use cotan_parallel::Chunks;

use super::level::{Level, NONE};
use super::relabel::join_blocks;

/// A coarser level, and the coarse vertex of every vertex of the finer one.
pub(super) struct Coarsening {
    pub(super) level: Level,
    pub(super) cluster_of: Vec<u32>,
}

/// The parameters of clustering.
#[derive(Clone, Copy)]
pub(super) struct Clustering {
    /// A vertex starts a cluster if it has this many free neighbours.
    pub(super) enough: usize,
    /// Clusters take free neighbours up to this many times the mean weight.
    pub(super) full: f64,
}

/// Clusters a level; `None` if that would not make it much smaller.
pub(super) fn coarsen(level: &Level, clustering: Clustering) -> Option<Coarsening> {
    let (cluster_of, num_clusters) = clusters(level, clustering);
    if num_clusters as f64 > WORST_RATIO * level.num_vertices() as f64 {
        return None;
    }
    let level = contract(level, &cluster_of, num_clusters);
    Some(Coarsening { level, cluster_of })
}

/// Clusters the vertices. Each vertex with enough free neighbours takes them, in order. The
/// remaining vertices join the cluster that contains most of their neighbours.
fn clusters(level: &Level, clustering: Clustering) -> (Vec<u32>, usize) {
    let n = level.num_vertices();
    let mean = level.total_weight() as f64 / n.max(1) as f64;
    let full = (clustering.full * mean) as u32;
    let mut clusters = Clusters {
        of: vec![NONE; n],
        weights: Vec::with_capacity(n / 3),
    };
    for v in 0..n as u32 {
        if clusters.is_free(v) {
            let free = level.ring(v).iter().filter(|&&u| clusters.is_free(u));
            if free.count() >= clustering.enough {
                clusters.open(level, v, full);
            }
        }
    }
    let crowded = (CROWDED * clustering.full * mean) as u32;
    let mut lonely = None;
    for v in 0..n as u32 {
        if !clusters.is_free(v) {
            continue;
        }
        if let Some(cluster) = clusters.nearest(level, v, crowded) {
            clusters.add(level, v, cluster);
        } else if level.ring(v).is_empty() {
            // Vertices without neighbours are interchangeable.
            match lonely {
                Some(c) if clusters.weights[c as usize] < full => clusters.add(level, v, c),
                _ => lonely = Some(clusters.open(level, v, full)),
            }
        } else {
            clusters.open(level, v, full);
        }
    }
    (clusters.of, clusters.weights.len())
}

struct Clusters {
    of: Vec<u32>,
    weights: Vec<u32>,
}

impl Clusters {
    fn is_free(&self, v: u32) -> bool {
        self.of[v as usize] == NONE
    }

    fn add(&mut self, level: &Level, v: u32, cluster: u32) {
        self.of[v as usize] = cluster;
        self.weights[cluster as usize] += level.weight(v);
    }

    /// Opens a cluster around v, with free neighbours until it is full.
    fn open(&mut self, level: &Level, v: u32, full: u32) -> u32 {
        let cluster = self.weights.len() as u32;
        self.weights.push(0);
        self.add(level, v, cluster);
        for &u in level.ring(v) {
            if self.is_free(u) && self.weights[cluster as usize] + level.weight(u) <= full {
                self.add(level, u, cluster);
            }
        }
        cluster
    }

    /// The cluster with the most neighbours of v that has room for it; the first of equals.
    fn nearest(&self, level: &Level, v: u32, crowded: u32) -> Option<u32> {
        // For a vertex of high degree, the first few neighbours are enough.
        let ring = &level.ring(v)[..level.ring(v).len().min(32)];
        let votes = |cluster: u32| {
            ring.iter()
                .filter(move |&&u| self.of[u as usize] == cluster)
        };
        let mut best = (0, None);
        for &u in ring {
            let cluster = self.of[u as usize];
            if cluster == NONE
                || best.1 == Some(cluster)
                || self.weights[cluster as usize] + level.weight(v) > crowded
            {
                continue;
            }
            let votes = votes(cluster).count();
            if votes > best.0 {
                best = (votes, Some(cluster));
            }
        }
        best.1
    }
}

/// Builds the graph of the clusters.
fn contract(level: &Level, cluster_of: &[u32], num_clusters: usize) -> Level {
    const CHUNKS: Chunks = Chunks::of(1 << 12);
    let (starts, members) = members(cluster_of, num_clusters);
    let members_of = |c: usize| &members[starts[c] as usize..starts[c + 1] as usize];
    let blocks = CHUNKS.map(0..num_clusters, |_, clusters| {
        let mut ends = Vec::with_capacity(clusters.len());
        let mut neighbours = Vec::with_capacity(clusters.len() * 7);
        for c in clusters {
            let rings = members_of(c).iter().flat_map(|&v| level.ring(v));
            let outside = rings.map(|&u| cluster_of[u as usize]);
            extend_distinct(&mut neighbours, outside.filter(|&d| d as usize != c));
            ends.push(neighbours.len() as u32);
        }
        (ends, neighbours)
    });
    let (offsets, neighbours) = join_blocks(blocks);
    let weigh = |c| members_of(c).iter().map(|&v| level.weight(v)).sum();
    Level {
        offsets,
        neighbours,
        weights: (0..num_clusters).map(weigh).collect(),
    }
}

/// The vertices of each cluster, as compressed rows.
fn members(cluster_of: &[u32], num_clusters: usize) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0u32; num_clusters + 1];
    for &c in cluster_of {
        starts[c as usize + 1] += 1;
    }
    for c in 0..num_clusters {
        starts[c + 1] += starts[c];
    }
    let mut next = starts.clone();
    let mut members = vec![0; cluster_of.len()];
    for (v, &c) in cluster_of.iter().enumerate() {
        members[next[c as usize] as usize] = v as u32;
        next[c as usize] += 1;
    }
    (starts, members)
}

/// Appends every distinct item once, in an arbitrary but deterministic order.
fn extend_distinct(list: &mut Vec<u32>, items: impl Iterator<Item = u32>) {
    // Searching a short list is faster than sorting.
    const FEW: usize = 32;
    let start = list.len();
    let mut many = false;
    for item in items {
        if many || !list[start..].contains(&item) {
            list.push(item);
            many |= list.len() - start > FEW;
        }
    }
    if many {
        list[start..].sort_unstable();
        let mut end = start + 1;
        for k in start + 1..list.len() {
            if list[k] != list[k - 1] {
                list[end] = list[k];
                end += 1;
            }
        }
        list.truncate(end);
    }
}

/// A level that keeps more than this fraction of its vertices is not worthwhile.
const WORST_RATIO: f64 = 0.8;
/// Left-over vertices join clusters up to this many times the full weight.
const CROWDED: f64 = 1.4;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ordering::relabel::Relabelled;
    use crate::ordering::tests::irregular_sphere;

    #[test]
    fn clusters_keep_weight_and_edges() {
        let sphere = irregular_sphere(4);
        let fine = Relabelled::new(&sphere.graph()).level;
        let clustering = Clustering {
            enough: 5,
            full: 5.0,
        };
        let Coarsening { level, cluster_of } = coarsen(&fine, clustering).unwrap();
        assert_eq!(level.total_weight(), fine.total_weight());
        assert!(level.num_vertices() * 3 < fine.num_vertices());
        for v in 0..fine.num_vertices() as u32 {
            let own = cluster_of[v as usize];
            for &u in fine.ring(v) {
                let other = cluster_of[u as usize];
                let joined = level.ring(own).iter().filter(|&&c| c == other).count();
                assert_eq!(joined, usize::from(own != other));
            }
        }
    }
}
