//! A coarse correction of the first guess of the inverse Hessian.
//!
//! The factorization A⁻¹ takes the rotations for fixed. Where a limb can turn as a whole they follow
//! it, and the energy hardly rises: such modes are a thousand times softer than A, and a descent
//! preconditioned by A⁻¹ alone needs hundreds of steps for them. They are nearly rigid motions of
//! large parts, so that a few clusters which move and turn span them:
//!
//! ```text
//! B = A⁻¹ + φ T (H_c⁻¹ − A_c⁻¹) Tᵀ φᵀ
//! ```
//!
//! φ are the affine functions of the clusters ([`Clusters`]), T their rigid motions (a translation
//! and an infinitesimal turn about the centre each), A_c = Tᵀ φᵀAφ T, and H_c the Hessian of the
//! energy, in which groups of cells ([`Groups`]) turn along:
//!
//! ```text
//! H_c = (1 + τ) A_c + S_c − Σ_g J_gᵀ N_g⁻¹ J_g
//! ```
//!
//! with S_c of the struts, J_g the moments that a motion of the clusters exerts on the cells of a
//! group, and N_g = tr(S) I − S their resistance, S the symmetric part of the group's covariance.
//! B is positive definite whatever the shape: it proposes directions, and the energy judges them.

mod clusters;
mod groups;

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::{VertexId, VertexMap};
use cotan_linear::{Hold, PreparedSystem};
use cotan_parallel as parallel;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix3, Matrix4, SMatrix, Vector3};

use clusters::{Clusters, FUNCTIONS};
use groups::Groups;

use crate::cells::as_f64;
use crate::energy::FittedCells;
use crate::nearest_rotation::{flat, nearest_rotation};
use crate::rest::Rest;
use crate::targets::Targets;
use crate::vectors::CHUNKS;

/// The correction for one set of handles.
#[derive(Debug)]
pub(crate) struct Coarse {
    /// The handles for which it was built.
    held: Vec<VertexId>,
    /// Whether each component has a handle that is to move.
    moved: Vec<bool>,
    clusters: Clusters,
    groups: Groups,
    /// φᵀAφ, and the same of the struts.
    system: Blocks,
    struts: Blocks,
    /// p: for every group and function the vector by which a multiple of the function changes the
    /// group's covariance.
    moments: Vec<Vector3<f64>>,
    state: State,
}

/// The correction at the shape where it was refreshed last.
#[derive(Debug)]
struct State {
    /// The blocks of T.
    motions: Vec<Motions>,
    /// The first unknown of every cluster, and the number of all.
    starts: Vec<usize>,
    hessian: Cholesky<f64, Dyn>,
    system: Cholesky<f64, Dyn>,
}

/// The displacement (three for every function) by each unknown of a cluster: translations, then
/// turns. Clusters of point handles have the turns alone, in the last three columns.
type Motions = SMatrix<f64, 12, 6>;

impl Coarse {
    /// Builds the correction; `None` where it would not help or the handles hold everything.
    pub(crate) fn new<T: Scalar>(
        rest: &Rest<T>,
        targets: &Targets<T>,
        system: &PreparedSystem,
        field: &VertexMap<T>,
        cells: &FittedCells<'_>,
        positions: &Positions<T>,
    ) -> Option<Self> {
        let held = held(targets);
        let moved = moved(rest, targets);
        let clusters = Clusters::new(rest, &held, &moved)?;
        let groups = Groups::new(rest);
        let sums = measure(rest, targets, system, field, cells, &clusters, &groups);
        let mut coarse = Self {
            held,
            moved,
            state: State {
                motions: Vec::new(),
                starts: Vec::new(),
                hessian: Cholesky::new(DMatrix::identity(1, 1))?,
                system: Cholesky::new(DMatrix::identity(1, 1))?,
            },
            clusters,
            groups,
            system: sums.system,
            struts: sums.struts,
            moments: sums.moments,
        };
        coarse
            .refresh(rest, field, cells, positions)
            .then_some(coarse)
    }

    /// Whether it was built for these handles.
    pub(crate) fn is_for<T: Scalar>(&self, rest: &Rest<T>, targets: &Targets<T>) -> bool {
        self.held == held(targets) && self.moved == moved(rest, targets)
    }

    /// Computes the correction anew for these positions. Returns whether that could be done.
    pub(crate) fn refresh<T: Scalar>(
        &mut self,
        rest: &Rest<T>,
        field: &VertexMap<T>,
        cells: &FittedCells<'_>,
        positions: &Positions<T>,
    ) -> bool {
        let motions = self.motions(cells);
        let mut starts = vec![0];
        for j in 0..self.clusters.len() {
            let unknowns = if j < self.clusters.num_moving { 6 } else { 3 };
            starts.push(starts[j] + unknowns);
        }
        let system = reduced(&self.system, &motions, &starts);
        let struts = reduced(&self.struts, &motions, &starts);
        let lost = self.lost(rest, field, cells, positions, &motions, &starts);
        let Some(of_system) = Cholesky::new(regular(system.clone())) else {
            return false;
        };
        let base = &system + &struts - &lost;
        let mut shift = 0.0;
        while shift < 1e3 {
            let is_definite = Cholesky::new(regular(&base + &system * shift)).is_some();
            if let Some(hessian) =
                Cholesky::new(regular(&base + &system * (shift + SOFTEST))).filter(|_| is_definite)
            {
                self.state = State {
                    motions,
                    starts,
                    hessian,
                    system: of_system,
                };
                return true;
            }
            shift = (3.0 * shift).max(SOFTEST);
        }
        false
    }

    /// φᵀr.
    pub(crate) fn restrict<T: Scalar>(&self, rest: &Rest<T>, r: &[Vector3<f64>]) -> Vec<f64> {
        self.clusters.restrict(rest, r)
    }

    /// (φq)_i.
    #[inline]
    pub(crate) fn prolong<T: Scalar>(&self, rest: &Rest<T>, q: &[f64], i: usize) -> Vector3<f64> {
        self.clusters.prolong(rest, q, i)
    }

    /// T (H_c⁻¹ − A_c⁻¹) Tᵀ u.
    pub(crate) fn apply(&self, u: &[f64]) -> Vec<f64> {
        let State {
            motions,
            starts,
            hessian,
            system,
        } = &self.state;
        let mut reduced = DVector::zeros(starts.last().copied().unwrap_or(0));
        for (j, motions) in motions.iter().enumerate() {
            let at = j * FUNCTIONS * 3;
            let own = SMatrix::<f64, 12, 1>::from_column_slice(&u[at..at + 12]);
            let moved = motions.tr_mul(&own);
            let (from, len) = (starts[j], starts[j + 1] - starts[j]);
            reduced
                .rows_mut(from, len)
                .copy_from(&moved.rows(6 - len, len));
        }
        let solved = hessian.solve(&reduced) - system.solve(&reduced);
        let mut out = vec![0.0; u.len()];
        for (j, motions) in motions.iter().enumerate() {
            let at = j * FUNCTIONS * 3;
            let (from, len) = (starts[j], starts[j + 1] - starts[j]);
            let own = motions.columns(6 - len, len) * solved.rows(from, len);
            out[at..at + 12].copy_from_slice(own.as_slice());
        }
        out
    }

    /// T: the rigid motions of every cluster with its mean rotation.
    fn motions(&self, cells: &FittedCells<'_>) -> Vec<Motions> {
        let len = self.clusters.len();
        let partial = CHUNKS.map(cells.rotations, |first, rotations| {
            let mut sums = vec![0.0; 9 * len];
            for (k, r) in rotations.iter().enumerate() {
                for (j, w) in self.clusters.at(first + k) {
                    let at = 9 * *j as usize;
                    for (sum, r) in sums[at..at + 9].iter_mut().zip(r) {
                        *sum += w * r;
                    }
                }
            }
            sums
        });
        let sums = crate::vectors::total(partial);
        let rotations = sums.as_chunks::<9>().0.iter();
        rotations
            .map(|sum| {
                let mean = nearest_rotation(&Matrix3::from_column_slice(sum));
                let mut motions = Motions::zeros();
                for a in 0..3 {
                    motions[(a, a)] = 1.0;
                    let axis = Vector3::ith(a, 1.0);
                    for m in 0..3 {
                        let turned = axis.cross(&mean.column(m)) * self.clusters.radius;
                        motions
                            .fixed_view_mut::<3, 1>(3 * (m + 1), 3 + a)
                            .copy_from(&turned);
                    }
                }
                motions
            })
            .collect()
    }

    /// Σ_g J_gᵀ N_g⁻¹ J_g.
    fn lost<T: Scalar>(
        &self,
        rest: &Rest<T>,
        field: &VertexMap<T>,
        cells: &FittedCells<'_>,
        positions: &Positions<T>,
        motions: &[Motions],
        starts: &[usize],
    ) -> DMatrix<f64> {
        let covariances = self.covariances(rest, field, cells, positions);
        let num_unknowns = starts.last().copied().unwrap_or(0);
        let len = self.clusters.len() * FUNCTIONS;
        let mut out = DMatrix::zeros(num_unknowns, num_unknowns);
        let mut touched: Vec<(usize, SMatrix<f64, 3, 6>)> = Vec::new();
        for (g, covariance) in covariances.iter().enumerate() {
            let rotation = nearest_rotation(covariance);
            let s = covariance * rotation.transpose();
            let s = (s + s.transpose()) * 0.5;
            let resistance = Matrix3::identity() * s.trace() - s;
            let eigen = resistance.symmetric_eigen();
            let largest = eigen.eigenvalues.max();
            if !(largest > 0.0) {
                continue;
            }
            let root = eigen
                .eigenvalues
                .map(|x| x.max(1e-9 * largest).sqrt().recip());
            let root = Matrix3::from_diagonal(&root) * eigen.eigenvectors.transpose();
            let moments = &self.moments[g * len..(g + 1) * len];
            touched.clear();
            for (j, own) in moments.chunks_exact(FUNCTIONS).enumerate() {
                if own.iter().all(|p| *p == Vector3::zeros()) {
                    continue;
                }
                // (R p) × e_a for every function and coordinate.
                let mut exerted = SMatrix::<f64, 3, 12>::zeros();
                for (m, p) in own.iter().enumerate() {
                    let arm = root * (rotation * p).cross_matrix();
                    exerted.fixed_view_mut::<3, 3>(0, 3 * m).copy_from(&arm);
                }
                touched.push((j, exerted * motions[j]));
            }
            for (p, (i, of_i)) in touched.iter().enumerate() {
                for (j, of_j) in &touched[..=p] {
                    let block = of_i.tr_mul(of_j);
                    let (rows, columns) = (starts[i + 1] - starts[*i], starts[j + 1] - starts[*j]);
                    let mut sum = out.view_mut((starts[*i], starts[*j]), (rows, columns));
                    sum += block.view((6 - rows, 6 - columns), (rows, columns));
                }
            }
        }
        out.fill_upper_triangle_with_lower_triangle();
        out
    }

    /// The covariance of every group at these positions.
    fn covariances<T: Scalar>(
        &self,
        rest: &Rest<T>,
        field: &VertexMap<T>,
        cells: &FittedCells<'_>,
        positions: &Positions<T>,
    ) -> Vec<Matrix3<f64>> {
        let x = positions.as_slice();
        let at = |i: usize| x[i].map(T::as_f64).coords;
        let partial = CHUNKS.map(0..x.len(), |_, vertices| {
            let mut sums = vec![0.0; 9 * self.groups.len];
            for i in vertices {
                let mut covariance = Matrix3::zeros();
                let mut ell = Vector3::zeros();
                for (j, k) in rest.graph().row(i) {
                    let edge = at(j.index()) - at(i);
                    covariance += edge * Vector3::from(cells.gradients[k]).transpose();
                    ell += edge * rest.operator().weights()[k];
                }
                covariance += ell * cells.wanted(rest, field, i).transpose();
                if let Some((strut, weight)) = cells.strut(i) {
                    let mut span = at(i);
                    for (corner, share) in strut.ends() {
                        span -= at(corner) * share;
                    }
                    covariance += span * Vector3::from(strut.rest).transpose() * weight;
                }
                for (g, share) in self.groups.at(i) {
                    let sums = &mut sums[9 * *g as usize..][..9];
                    for (sum, c) in sums.iter_mut().zip(flat(&covariance)) {
                        *sum += share * c;
                    }
                }
            }
            sums
        });
        let sums = crate::vectors::total(partial);
        let sums = sums.as_chunks::<9>().0.iter();
        sums.map(|c| Matrix3::from_column_slice(c)).collect()
    }
}

/// No motion counts as softer than this, of A: the model of the rotations is not exact.
const SOFTEST: f64 = 1e-3;

fn held<T: Scalar>(targets: &Targets<T>) -> Vec<VertexId> {
    let held = targets.held();
    let hard = held.iter().filter(|h| h.hold == Hold::Hard);
    hard.map(|h| h.vertex).collect()
}

/// Whether each component has a handle that is to move. The others are at rest: nothing pulls there
/// but rounding, which soft modes would make large.
fn moved<T: Scalar>(rest: &Rest<T>, targets: &Targets<T>) -> Vec<bool> {
    let components = rest.mesh().components();
    let mut moved = vec![false; components.count()];
    for (handle, target) in targets.handles().iter().zip(targets.in_box()) {
        moved[components.of(handle.vertex)] |= *target != rest.positions()[handle.vertex];
    }
    moved
}

/// The matrix with a diagonal that no empty cluster leaves at zero.
fn regular(mut matrix: DMatrix<f64>) -> DMatrix<f64> {
    let largest = matrix.diagonal().amax();
    for i in 0..matrix.nrows() {
        matrix[(i, i)] += 1e-12 * largest;
    }
    matrix
}

/// Tᵀ (a ⊗ I₃) T.
fn reduced(a: &Blocks, motions: &[Motions], starts: &[usize]) -> DMatrix<f64> {
    let num_unknowns = starts.last().copied().unwrap_or(0);
    let mut out = DMatrix::zeros(num_unknowns, num_unknowns);
    for i in 0..motions.len() {
        for j in 0..=i {
            // Of the two halves only one is summed up.
            let block = a.at(i, j) + a.at(j, i).transpose();
            let block = if i == j { block * 0.5 } else { block };
            if block.iter().all(|x| *x == 0.0) {
                continue;
            }
            let block = block.kronecker(&Matrix3::<f64>::identity());
            let block = motions[i].tr_mul(&(block * motions[j]));
            let (rows, columns) = (starts[i + 1] - starts[i], starts[j + 1] - starts[j]);
            let block = block.view((6 - rows, 6 - columns), (rows, columns));
            out.view_mut((starts[i], starts[j]), (rows, columns))
                .copy_from(&block);
            out.view_mut((starts[j], starts[i]), (columns, rows))
                .copy_from(&block.transpose());
        }
    }
    out
}

/// A matrix of the functions of all clusters, in blocks of one cluster each; of the blocks (i, j)
/// and (j, i) either holds the sum, or both hold a part.
#[derive(Clone, Debug)]
struct Blocks {
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

    fn at(&self, i: usize, j: usize) -> Matrix4<f64> {
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
struct Sums {
    system: Blocks,
    struts: Blocks,
    moments: Vec<Vector3<f64>>,
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

fn measure<T: Scalar>(
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
