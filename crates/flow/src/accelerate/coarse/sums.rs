//! Sums over the original shape: the system, the struts and the moments of the clusters.

use cotan_geometry::Scalar;
use cotan_halfedge::VertexMap;
use cotan_linear::{Hold, PreparedSystem};
use cotan_parallel as parallel;
use nalgebra::{Matrix4, Vector3};

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

/// The functions of the clusters around one vertex: for each what the operators make of it there.
#[derive(Default)]
struct Around {
    clusters: Vec<u32>,
    own: Vec<[f64; FUNCTIONS]>,
    laplacian: Vec<[f64; FUNCTIONS]>,
    stiffness: Vec<[f64; FUNCTIONS]>,
    strut: Vec<[f64; FUNCTIONS]>,
    moments: Vec<[Vector3<f64>; FUNCTIONS]>,
    /// The place of every cluster in the lists, or more than there are.
    places: Vec<u32>,
}

impl Around {
    fn new(num_clusters: usize) -> Self {
        Self {
            places: vec![u32::MAX; num_clusters],
            ..Self::default()
        }
    }

    fn clear(&mut self) {
        for cluster in &self.clusters {
            self.places[*cluster as usize] = u32::MAX;
        }
        self.clusters.clear();
        for list in [
            &mut self.own,
            &mut self.laplacian,
            &mut self.stiffness,
            &mut self.strut,
        ] {
            list.clear();
        }
        self.moments.clear();
    }

    /// The place of a cluster in the lists.
    fn place(&mut self, cluster: u32) -> usize {
        let place = &mut self.places[cluster as usize];
        if *place != u32::MAX {
            return *place as usize;
        }
        *place = self.clusters.len() as u32;
        self.clusters.push(cluster);
        for list in [
            &mut self.own,
            &mut self.laplacian,
            &mut self.stiffness,
            &mut self.strut,
        ] {
            list.push([0.0; FUNCTIONS]);
        }
        self.moments.push([Vector3::zeros(); FUNCTIONS]);
        self.clusters.len() - 1
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
    let len = clusters.len() * FUNCTIONS;
    let mut springs = vec![0.0; n];
    for handle in targets.handles() {
        if handle.hold != Hold::Hard {
            springs[handle.vertex.index()] = system.spring(handle.vertex);
        }
    }
    let part = |part: usize| {
        let mut sums = Sums {
            system: Blocks::zeros(clusters.len()),
            struts: Blocks::zeros(clusters.len()),
            moments: vec![Vector3::zeros(); groups.len * len],
        };
        let mut around = Around::new(clusters.len());
        for i in part * n / PARTS..(part + 1) * n / PARTS {
            look_around(rest, field, cells, clusters, i, &mut around);
            add(&mut sums, &around, cells.weight, springs[i]);
            for (g, share) in groups.at(i) {
                for (cluster, moments) in around.clusters.iter().zip(&around.moments) {
                    let at = *g as usize * len + *cluster as usize * FUNCTIONS;
                    for (sum, p) in sums.moments[at..at + FUNCTIONS].iter_mut().zip(moments) {
                        *sum += p * *share;
                    }
                }
            }
        }
        sums
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

/// Gathers what the operators make of the functions at vertex `i`.
fn look_around<T: Scalar>(
    rest: &Rest<T>,
    field: &VertexMap<T>,
    cells: &FittedCells<'_>,
    clusters: &Clusters,
    i: usize,
    around: &mut Around,
) {
    let x = rest.positions().as_slice();
    let values = |v: usize| {
        let point = as_f64(x[v].coords);
        clusters
            .at(v)
            .iter()
            .map(move |entry| (entry.0, clusters.functions(*entry, &point)))
    };
    around.clear();
    for (cluster, own) in values(i) {
        let at = around.place(cluster);
        around.own[at] = own;
    }
    let (mut weight, mut stiffness, mut gradient) = (0.0, 0.0, Vector3::zeros());
    for (j, k) in rest.graph().row(i) {
        let w = rest.operator().weights()[k];
        let s = 0.5 * rest.membrane_weights()[k];
        let g = Vector3::from(cells.gradients[k]);
        (weight, stiffness, gradient) = (weight + w, stiffness + s, gradient + g);
        for (cluster, there) in values(j.index()) {
            let at = around.place(cluster);
            for m in 0..FUNCTIONS {
                around.laplacian[at][m] += w * there[m];
                around.stiffness[at][m] -= s * there[m];
                around.moments[at][m] += g * there[m];
            }
        }
    }
    for (cluster, own) in values(i) {
        let at = around.place(cluster);
        for m in 0..FUNCTIONS {
            around.laplacian[at][m] -= weight * own[m];
            around.stiffness[at][m] += stiffness * own[m];
            around.moments[at][m] -= gradient * own[m];
        }
    }
    let wanted = cells.wanted(rest, field, i);
    for (moments, laplacian) in around.moments.iter_mut().zip(&around.laplacian) {
        for m in 0..FUNCTIONS {
            moments[m] += wanted * laplacian[m];
        }
    }
    let Some((strut, weight)) = cells.strut(i) else {
        return;
    };
    let ends = strut.ends().map(|(corner, share)| (corner, -share));
    for (v, factor) in std::iter::once((i, 1.0)).chain(ends) {
        for (cluster, there) in values(v) {
            let at = around.place(cluster);
            for m in 0..FUNCTIONS {
                around.strut[at][m] += factor * there[m];
            }
        }
    }
    let root = weight.sqrt();
    let rest_span = Vector3::from(strut.rest) * weight;
    for (moments, span) in around.moments.iter_mut().zip(&mut around.strut) {
        for m in 0..FUNCTIONS {
            moments[m] += rest_span * span[m];
            span[m] *= root;
        }
    }
}

/// Adds the products of the functions at one vertex.
fn add(sums: &mut Sums, around: &Around, membrane: f64, spring: f64) {
    for (p, &a) in around.clusters.iter().enumerate() {
        let (laplacian, own, strut) = (&around.laplacian[p], &around.own[p], &around.strut[p]);
        let is_own = *own != [0.0; FUNCTIONS];
        for (q, &b) in around.clusters.iter().enumerate() {
            // φᵀKφ of both halves, what is symmetric once.
            if q > p && !is_own {
                continue;
            }
            let block = sums.system.at_mut(a, b);
            if q <= p {
                add_product(block, laplacian, &around.laplacian[q], 1.0);
                if spring != 0.0 {
                    add_product(block, own, &around.own[q], spring);
                }
            }
            if is_own {
                let half = if q == p { membrane } else { 0.5 * membrane };
                add_product(block, own, &around.stiffness[q], half);
            }
            if q <= p && *strut != [0.0; FUNCTIONS] {
                add_product(sums.struts.at_mut(a, b), strut, &around.strut[q], 1.0);
            }
        }
    }
}

/// block += factor a bᵀ.
#[inline]
fn add_product(
    block: &mut [f64; FUNCTIONS * FUNCTIONS],
    a: &[f64; FUNCTIONS],
    b: &[f64; FUNCTIONS],
    factor: f64,
) {
    for (row, a) in block.as_chunks_mut::<FUNCTIONS>().0.iter_mut().zip(a) {
        for (entry, b) in row.iter_mut().zip(b) {
            *entry += factor * a * b;
        }
    }
}
