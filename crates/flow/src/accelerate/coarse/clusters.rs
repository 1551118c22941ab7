//! Overlapping clusters of vertices that can move and turn as rigid bodies.

use cotan_geometry::Scalar;
use cotan_halfedge::VertexId;
use nalgebra::Vector3;

use crate::net::{Distances, Net};
use crate::point_handles::{Disc, MAX_POINTS};
use crate::rest::Rest;
use crate::vectors::CHUNKS;

/// The scalar functions w_j [1, (X − c_j)/ρ] of clusters j: smooth weights w_j times the affine
/// functions of the original positions. They vanish at the handles; away from them the weights add
/// up to 1.
#[derive(Debug)]
pub(super) struct Clusters {
    /// c.
    pub(super) centers: Vec<Vector3<f64>>,
    /// The vertices around which the moving clusters were built, the first one farthest from the
    /// handles.
    pub(super) seeds: Vec<usize>,
    /// The first so many clusters move and turn; the others turn about a point handle.
    pub(super) num_moving: usize,
    /// ρ.
    pub(super) radius: f64,
    /// Clusters and weights at each vertex: those of vertex i from `starts[i]` on.
    starts: Vec<u32>,
    entries: Vec<(u32, f64)>,
}

/// Functions of one cluster.
pub(super) const FUNCTIONS: usize = 4;

impl Clusters {
    /// Spreads clusters over the vertices between those that are held; `None` if all are held.
    /// `discs` are those of the point handles among them, which move as rigid parts.
    pub(super) fn new(net: &Net<'_>, held: &[VertexId], discs: &[Disc]) -> Option<Self> {
        let points = &net.points;
        let n = points.len();
        let (single, regions) = net.points_and_regions(held, discs);
        let mut distances = Distances::new(n);
        distances.spread(net, regions);
        let nearest_of_regions = distances.source.clone();
        distances.spread(net, single.iter().map(|one| one.vertex));
        let mut seeds = Vec::new();
        let wanted = (n / VERTICES_EACH).clamp(FEWEST, MAX).min(n / MIN_VERTICES);
        if wanted == 0 {
            return None;
        }
        while seeds.len() < wanted
            && let Some((seed, _)) = distances.farthest()
        {
            seeds.push(seed);
            distances.spread(net, [seed]);
        }
        let (_, covering) = distances.farthest()?;
        let radius = OVERLAP * covering;
        let of_regions = |i: usize| match nearest_of_regions[i] {
            u32::MAX => 0.0,
            source => kernel(net.length(i, source as usize) / radius),
        };
        let around = single.iter().map(|one| (one.vertex, one.radius));
        let of_singles = Kernels::around(net, around, radius);
        let kernels = Kernels::around(net, seeds.iter().map(|&seed| (seed, 0.0)), radius);
        let num_moving = seeds.len();
        let mut is_held = vec![false; n];
        held.iter().for_each(|v| is_held[v.index()] = true);
        discs.iter().for_each(|d| is_held[d.vertex.index()] = false);
        let (mut starts, mut entries) = (vec![0], Vec::new());
        for (i, is_held) in is_held.iter().enumerate() {
            let own = kernels.at(i);
            let of_handles = of_singles.at(i);
            let region = of_regions(i);
            let largest = of_handles.iter().map(|(_, k)| *k).fold(region, f64::max);
            let sum: f64 = own.iter().map(|(_, k)| k).sum::<f64>().max(MIN_SUM);
            let weighted = own.iter().map(|(j, k)| (*j, (1.0 - largest) * k / sum));
            entries.extend(weighted.filter(|(_, w)| *w > 0.0));
            // Of a handle nothing is left at the others.
            let all: f64 = of_handles.iter().map(|(_, k)| 1.0 - k).product();
            let alone = |at: usize, k: f64| {
                let others = of_handles
                    .iter()
                    .enumerate()
                    .filter(|(other, _)| *other != at);
                k * (1.0 - region) * others.map(|(_, (_, k))| 1.0 - k).product::<f64>()
            };
            let own: Vec<f64> = of_handles
                .iter()
                .enumerate()
                .map(|(at, (_, k))| alone(at, *k))
                .collect();
            let sum = own.iter().sum::<f64>() + region * all;
            if !is_held && sum > 0.0 {
                let weighted = of_handles
                    .iter()
                    .zip(&own)
                    .map(|((h, _), k)| (num_moving as u32 + h, largest * k / sum));
                entries.extend(weighted.filter(|(_, w)| *w > 0.0));
            }
            starts.push(entries.len() as u32);
        }
        let mut clusters = Self {
            centers: vec![Vector3::zeros(); num_moving],
            seeds,
            num_moving,
            radius,
            starts,
            entries,
        };
        let mut weights = vec![0.0; num_moving];
        for (i, point) in points.iter().enumerate() {
            for &(j, w) in clusters.at(i) {
                if let Some(weight) = weights.get_mut(j as usize) {
                    *weight += w;
                }
            }
            for k in clusters.starts[i]..clusters.starts[i + 1] {
                let (j, w) = clusters.entries[k as usize];
                if let Some(center) = clusters.centers.get_mut(j as usize) {
                    *center += point * w;
                }
            }
        }
        for (j, weight) in weights.iter().enumerate() {
            clusters.centers[j] = if *weight > 0.0 {
                clusters.centers[j] / *weight
            } else {
                points[clusters.seeds[j]]
            };
        }
        for (h, single) in single.iter().enumerate() {
            let cluster = (num_moving + h) as u32;
            let own = |i: usize| clusters.at(i).iter().find(|(j, _)| *j == cluster);
            let (mut center, mut sum) = (Vector3::zeros(), 0.0);
            for (i, share) in single.weights {
                let weight = own(*i as usize).map_or(0.0, |(_, w)| w * share);
                center += points[*i as usize] * weight;
                sum += weight;
            }
            // The turn keeps the mean that the handle holds where it is.
            clusters.centers.push(match sum > 0.0 {
                true => center / sum,
                false => points[single.vertex],
            });
        }
        Some(clusters)
    }

    pub(super) fn len(&self) -> usize {
        self.centers.len()
    }

    /// The clusters at vertex `i` and their weights.
    #[inline]
    pub(super) fn at(&self, i: usize) -> &[(u32, f64)] {
        &self.entries[self.starts[i] as usize..self.starts[i + 1] as usize]
    }

    /// The functions of a cluster where its weight is `weight`.
    #[inline(always)]
    pub(super) fn functions(
        &self,
        (j, weight): (u32, f64),
        point: &Vector3<f64>,
    ) -> [f64; FUNCTIONS] {
        let [x, y, z] = ((point - self.centers[j as usize]) * (weight / self.radius)).into();
        [weight, x, y, z]
    }

    /// φᵀv: for every cluster and function a vector, one after another.
    pub(super) fn restrict<T: Scalar>(&self, rest: &Rest<T>, v: &[Vector3<f64>]) -> Vec<f64> {
        let x = rest.positions().as_slice();
        let len = self.len() * FUNCTIONS * 3;
        let partial = CHUNKS.map(v, |first, chunk| {
            let mut sums = vec![0.0; len];
            for (k, v) in chunk.iter().enumerate() {
                let point = x[first + k].map(T::as_f64).coords;
                for entry in self.at(first + k) {
                    let at = entry.0 as usize * FUNCTIONS * 3;
                    let functions = self.functions(*entry, &point);
                    for (m, f) in functions.iter().enumerate() {
                        for a in 0..3 {
                            sums[at + 3 * m + a] += f * v[a];
                        }
                    }
                }
            }
            sums
        });
        crate::vectors::total(partial)
    }

    /// (φq)_i.
    #[inline]
    pub(super) fn prolong<T: Scalar>(&self, rest: &Rest<T>, q: &[f64], i: usize) -> Vector3<f64> {
        let point = rest.positions().as_slice()[i].map(T::as_f64).coords;
        let mut sum = Vector3::zeros();
        for entry in self.at(i) {
            let at = entry.0 as usize * FUNCTIONS * 3;
            let functions = self.functions(*entry, &point);
            for (m, f) in functions.iter().enumerate() {
                sum += Vector3::from_column_slice(&q[at + 3 * m..at + 3 * m + 3]) * *f;
            }
        }
        sum
    }
}

/// Vertices for each cluster, and bounds of the number of clusters.
const VERTICES_EACH: usize = 250;
const FEWEST: usize = 12;
const MAX: usize = 48;

/// A cluster has four functions. On fewer vertices they would hardly be independent, and
/// rounding would be a part of the correction.
const MIN_VERTICES: usize = 40;

/// ρ over the radius at which the clusters cover the mesh. At 1.3 the descent is slower, at 2 a
/// step costs twice as much.
const OVERLAP: f64 = 1.5;

/// The weights fade away from all seeds, where the kernels add up to less than this.
const MIN_SUM: f64 = 0.02;

/// (1 − t)⁴ (4t + 1): Wendland's kernel of smoothness 2, zero from t = 1 on.
fn kernel(t: f64) -> f64 {
    let rest = (1.0 - t).max(0.0);
    rest.powi(4) * (4.0 * t + 1.0)
}

/// A vertex that is a handle by itself, and what it pulls at.
struct Single<'a> {
    vertex: usize,
    /// Of the disc around it; 0 where it holds the vertex alone.
    radius: f64,
    /// Those of the disc; empty where it holds the vertex alone.
    weights: &'a [(u32, f64)],
}

impl Net<'_> {
    /// Handles that are vertices by themselves, and the vertices of all others.
    fn points_and_regions<'a>(
        &self,
        held: &[VertexId],
        discs: &'a [Disc],
    ) -> (Vec<Single<'a>>, Vec<usize>) {
        let mut is_held = vec![false; self.points.len()];
        held.iter().for_each(|v| is_held[v.index()] = true);
        let is_single = |v: usize| self.neighbours(v).all(|j| !is_held[j]);
        let (single, regions): (Vec<usize>, Vec<usize>) =
            held.iter().map(|v| v.index()).partition(|&v| is_single(v));
        if single.len() > MAX_POINTS {
            return (Vec::new(), [single, regions].concat());
        }
        let single = single.into_iter().map(|vertex| {
            let disc = discs.iter().find(|d| d.vertex.index() == vertex);
            Single {
                vertex,
                radius: disc.map_or(0.0, |d| d.radius),
                weights: disc.map_or(&[], |d| &d.weights),
            }
        });
        (single.collect(), regions)
    }
}

/// The kernels around some vertices, at every vertex that is connected to their centre inside of
/// their ball.
struct Kernels {
    /// The kernels at vertex i are those from `starts[i]` on.
    starts: Vec<u32>,
    /// The centre's index, and the kernel.
    entries: Vec<(u32, f64)>,
}

impl Kernels {
    /// Each kernel is 1 within the radius that is given with its centre, and fades away over
    /// `radius`.
    fn around(net: &Net<'_>, centers: impl IntoIterator<Item = (usize, f64)>, radius: f64) -> Self {
        let n = net.points.len();
        let mut starts = vec![0_u32; n + 1];
        let mut all = Vec::new();
        // The centre for which each vertex was looked at last.
        let mut seen = vec![u32::MAX; n];
        let mut open = Vec::new();
        for (index, (center, inner)) in centers.into_iter().enumerate() {
            let index = index as u32;
            seen[center] = index;
            open.push((center, 0.0));
            while let Some((i, distance)) = open.pop() {
                all.push((
                    i as u32,
                    index,
                    kernel((distance - inner).max(0.0) / radius),
                ));
                starts[i + 1] += 1;
                for j in net.neighbours(i) {
                    if seen[j] != index {
                        seen[j] = index;
                        let distance = net.length(center, j);
                        if distance < inner + radius {
                            open.push((j, distance));
                        }
                    }
                }
            }
        }
        for i in 0..n {
            starts[i + 1] += starts[i];
        }
        let mut places = starts.clone();
        let mut entries = vec![(0, 0.0); all.len()];
        for (i, index, k) in all {
            let place = &mut places[i as usize];
            entries[*place as usize] = (index, k);
            *place += 1;
        }
        Self { starts, entries }
    }

    fn at(&self, i: usize) -> &[(u32, f64)] {
        &self.entries[self.starts[i] as usize..self.starts[i + 1] as usize]
    }
}
