//! Sums over the original shape: the system, the struts and the moments of the clusters.

use std::ops::Range;

use cotan_geometry::Scalar;
use cotan_halfedge::VertexMap;
use cotan_linear::{Hold, PreparedSystem};
use cotan_parallel as parallel;
use nalgebra::{Matrix4, Vector3};
use pulp::{Simd, WithSimd};

use super::clusters::{Clusters, FUNCTIONS};
use super::groups::Groups;
use crate::cells::as_f64;
use crate::energy::FittedCells;
use crate::rest::Rest;
use crate::targets::Targets;

/// A matrix of the functions of all clusters, in blocks of one cluster each; of the blocks (i, j)
/// and (j, i) either holds the sum, or both hold a part.
#[derive(Clone, Debug)]
pub(super) struct Blocks {
    num_clusters: usize,
    entries: Vec<[f64; FUNCTIONS * FUNCTIONS]>,
}

impl Blocks {
    fn zeros(num_clusters: usize) -> Self {
        Self {
            num_clusters,
            entries: vec![[0.0; FUNCTIONS * FUNCTIONS]; num_clusters * num_clusters],
        }
    }

    pub(super) fn at(&self, i: usize, j: usize) -> Matrix4<f64> {
        Matrix4::from_row_slice(&self.entries[i * self.num_clusters + j])
    }

    #[inline(always)]
    fn at_mut(&mut self, i: u32, j: u32) -> &mut [f64; FUNCTIONS * FUNCTIONS] {
        &mut self.entries[i as usize * self.num_clusters + j as usize]
    }

    fn add(&mut self, other: &Self) {
        for (sum, part) in self.entries.iter_mut().zip(&other.entries) {
            for (sum, x) in sum.iter_mut().zip(part) {
                *sum += x;
            }
        }
    }
}

/// Sums over the original shape.
pub(super) struct Sums {
    pub(super) system: Blocks,
    pub(super) struts: Blocks,
    pub(super) moments: Vec<Vector3<f64>>,
}

/// The four functions of a cluster at a vertex, or what an operator makes of them there.
type Functions = [f64; FUNCTIONS];

/// What the operators make of the functions of one cluster at a vertex.
#[derive(Clone, Copy, Default)]
struct Seen {
    own: Functions,
    laplacian: Functions,
    stiffness: Functions,
    strut: Functions,
    /// The coordinates of the moments.
    moments: [Functions; 3],
}

/// The functions of the clusters around one vertex.
struct Around {
    clusters: Vec<u32>,
    /// One for each of these clusters.
    seen: Vec<Seen>,
    /// The first so many clusters are at the vertex or at a neighbour, the others at the far end of
    /// its strut alone.
    num_near: usize,
    /// The place of every cluster in the lists, or more than there are.
    places: Vec<u32>,
}

impl Around {
    fn new(num_clusters: usize) -> Self {
        Self {
            clusters: Vec::new(),
            seen: Vec::new(),
            num_near: 0,
            places: vec![u32::MAX; num_clusters],
        }
    }

    #[inline(always)]
    fn clear(&mut self) {
        for cluster in self.clusters.drain(..) {
            self.places[cluster as usize] = u32::MAX;
        }
        self.seen.clear();
    }

    /// What is seen of a cluster.
    #[inline(always)]
    fn of(&mut self, cluster: u32) -> &mut Seen {
        let place = &mut self.places[cluster as usize];
        if *place == u32::MAX {
            *place = self.clusters.len() as u32;
            self.clusters.push(cluster);
            self.seen.push(Seen::default());
        }
        &mut self.seen[*place as usize]
    }
}

/// sum += factor f.
#[inline(always)]
fn add_scaled(sum: &mut Functions, factor: f64, f: &Functions) {
    for (sum, f) in sum.iter_mut().zip(f) {
        *sum += factor * f;
    }
}

pub(super) fn measure<T: Scalar>(
    rest: &Rest<T>,
    targets: &Targets<T>,
    system: &PreparedSystem,
    field: &VertexMap<T>,
    cells: &FittedCells<'_>,
    clusters: &Clusters,
    groups: &Groups,
) -> Sums {
    /// Parts of the sums, whatever the number of threads.
    const PARTS: usize = 8;
    let n = rest.positions().len();
    let mut springs = vec![0.0; n];
    for handle in targets.handles() {
        if handle.hold != Hold::Hard {
            springs[handle.vertex.index()] = system.spring(handle.vertex);
        }
    }
    let part = |part: usize| {
        pulp::Arch::new().dispatch(Part {
            rest,
            field,
            cells,
            clusters,
            groups,
            springs: &springs,
            vertices: part * n / PARTS..(part + 1) * n / PARTS,
        })
    };
    let parts = parallel::Chunks::of(1).filled(PARTS, part);
    let sums = parts.into_iter().reduce(|mut all, part| {
        all.system.add(&part.system);
        all.struts.add(&part.struts);
        for (sum, p) in all.moments.iter_mut().zip(part.moments) {
            *sum += p;
        }
        all
    });
    sums.unwrap_or_else(|| Sums {
        system: Blocks::zeros(clusters.len()),
        struts: Blocks::zeros(clusters.len()),
        moments: Vec::new(),
    })
}

/// The sums over some of the vertices, compiled for the widest vectors that the processor has.
struct Part<'a, T: Scalar> {
    rest: &'a Rest<T>,
    field: &'a VertexMap<T>,
    cells: &'a FittedCells<'a>,
    clusters: &'a Clusters,
    groups: &'a Groups,
    springs: &'a [f64],
    vertices: Range<usize>,
}

impl<T: Scalar> WithSimd for Part<'_, T> {
    type Output = Sums;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Sums {
        let (clusters, groups) = (self.clusters, self.groups);
        let len = clusters.len() * FUNCTIONS;
        let mut sums = Sums {
            system: Blocks::zeros(clusters.len()),
            struts: Blocks::zeros(clusters.len()),
            moments: vec![Vector3::zeros(); groups.len * len],
        };
        let mut around = Around::new(clusters.len());
        for i in self.vertices.clone() {
            self.look_around(i, &mut around);
            add(&mut sums, &around, self.cells.weight, self.springs[i]);
            for (g, share) in groups.at(i) {
                for (cluster, seen) in around.clusters.iter().zip(&around.seen) {
                    let at = *g as usize * len + *cluster as usize * FUNCTIONS;
                    let [x, y, z] = &seen.moments;
                    for (m, sum) in sums.moments[at..at + FUNCTIONS].iter_mut().enumerate() {
                        *sum += Vector3::new(x[m], y[m], z[m]) * *share;
                    }
                }
            }
        }
        sums
    }
}

impl<T: Scalar> Part<'_, T> {
    /// The clusters at a vertex with the values of their functions.
    #[inline(always)]
    fn values(&self, v: usize) -> impl Iterator<Item = (u32, Functions)> {
        let point = as_f64(self.rest.positions().as_slice()[v].coords);
        let entries = self.clusters.at(v).iter();
        entries.map(move |entry| (entry.0, self.clusters.functions(*entry, &point)))
    }

    /// Gathers what the operators make of the functions at vertex `i`.
    #[inline(always)]
    fn look_around(&self, i: usize, around: &mut Around) {
        let (rest, cells) = (self.rest, self.cells);
        around.clear();
        for (cluster, own) in self.values(i) {
            around.of(cluster).own = own;
        }
        let (mut weight, mut stiffness, mut gradient) = (0.0, 0.0, Vector3::zeros());
        for (j, k) in rest.graph().row(i) {
            let w = rest.operator().weights()[k];
            let s = 0.5 * rest.membrane_weights()[k];
            let g = Vector3::from(cells.gradients[k]);
            (weight, stiffness, gradient) = (weight + w, stiffness + s, gradient + g);
            for (cluster, there) in self.values(j.index()) {
                let seen = around.of(cluster);
                add_scaled(&mut seen.laplacian, w, &there);
                add_scaled(&mut seen.stiffness, -s, &there);
                for (moments, g) in seen.moments.iter_mut().zip(&g) {
                    add_scaled(moments, *g, &there);
                }
            }
        }
        let wanted = cells.wanted(rest, self.field, i);
        for (cluster, own) in self.values(i) {
            let seen = around.of(cluster);
            add_scaled(&mut seen.laplacian, -weight, &own);
            add_scaled(&mut seen.stiffness, stiffness, &own);
            for (moments, g) in seen.moments.iter_mut().zip(&gradient) {
                add_scaled(moments, -g, &own);
            }
        }
        for seen in &mut around.seen {
            for (moments, wanted) in seen.moments.iter_mut().zip(&wanted) {
                add_scaled(moments, *wanted, &seen.laplacian);
            }
        }
        around.num_near = around.seen.len();
        let Some((strut, weight)) = cells.strut(i) else {
            return;
        };
        let ends = strut.ends().map(|(corner, share)| (corner, -share));
        for (v, factor) in std::iter::once((i, 1.0)).chain(ends) {
            for (cluster, there) in self.values(v) {
                add_scaled(&mut around.of(cluster).strut, factor, &there);
            }
        }
        let root = weight.sqrt();
        let rest_span = Vector3::from(strut.rest) * weight;
        for seen in &mut around.seen {
            for (moments, span) in seen.moments.iter_mut().zip(&rest_span) {
                add_scaled(moments, *span, &seen.strut);
            }
            seen.strut.iter_mut().for_each(|span| *span *= root);
        }
    }
}

/// Adds the products of the functions at one vertex.
#[inline(always)]
fn add(sums: &mut Sums, around: &Around, membrane: f64, spring: f64) {
    let all = around.clusters.iter().zip(&around.seen);
    let near = all.clone().take(around.num_near);
    for (p, (&a, of_a)) in near.clone().enumerate() {
        let is_own = of_a.own != [0.0; FUNCTIONS];
        for (q, (&b, of_b)) in near.clone().enumerate() {
            // φᵀKφ of both halves, what is symmetric once.
            if q > p && !is_own {
                break;
            }
            let block = sums.system.at_mut(a, b);
            if q <= p {
                add_product(block, &of_a.laplacian, &of_b.laplacian, 1.0);
                if spring != 0.0 {
                    add_product(block, &of_a.own, &of_b.own, spring);
                }
            }
            if is_own {
                let half = if q == p { membrane } else { 0.5 * membrane };
                add_product(block, &of_a.own, &of_b.stiffness, half);
            }
        }
    }
    let spanned = all.filter(|(_, seen)| seen.strut != [0.0; FUNCTIONS]);
    for (p, (&a, of_a)) in spanned.clone().enumerate() {
        for (&b, of_b) in spanned.clone().take(p + 1) {
            add_product(sums.struts.at_mut(a, b), &of_a.strut, &of_b.strut, 1.0);
        }
    }
}

/// block += factor a bᵀ.
#[inline(always)]
fn add_product(
    block: &mut [f64; FUNCTIONS * FUNCTIONS],
    a: &Functions,
    b: &Functions,
    factor: f64,
) {
    for (row, a) in block.as_chunks_mut::<FUNCTIONS>().0.iter_mut().zip(a) {
        for (entry, b) in row.iter_mut().zip(b) {
            *entry += factor * a * b;
        }
    }
}
