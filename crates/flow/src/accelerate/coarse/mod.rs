//! A coarse correction of the first guess of the inverse Hessian.
//!
//! The factorization A⁻¹ takes the rotations for fixed. Where a limb can turn as a whole they
//! follow it, and the energy hardly rises: such modes are a thousand times softer than A, and a
//! descent preconditioned by A⁻¹ alone needs hundreds of steps for them. They are nearly rigid
//! motions of large parts, so that a few clusters which move and turn span them:
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
mod sums;

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::{Components, VertexId, VertexMap};
use cotan_linear::Hold;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix3, SMatrix, Vector3};

use clusters::{Clusters, FUNCTIONS};
use groups::Groups;
use sums::{Blocks, measure};

use crate::energy::FittedCells;
use crate::four::flat;
use crate::nearest_rotation::nearest_rotation;
use crate::net::Net;
use crate::rest::Rest;
use crate::targets::Targets;
use crate::vectors::CHUNKS;
use crate::workspace::Workspace;

/// The correction for one set of handles.
#[derive(Debug)]
pub(crate) struct Coarse {
    model: Model,
    state: State,
}

/// The part of it that the original shape and the handles determine.
#[derive(Debug)]
struct Model {
    components: Components,
    /// The handles for which it was built.
    held: Vec<VertexId>,
    /// For each component, `true` if it has a handle that is to move.
    moved: Vec<bool>,
    clusters: Clusters,
    groups: Groups,
    /// φᵀAφ, and the same of the struts.
    system: Blocks,
    struts: Blocks,
    /// p: for every group and function the vector by which a multiple of the function changes the
    /// group's covariance.
    moments: Vec<Vector3<f64>>,
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
        work: &Workspace<T>,
        field: &VertexMap<T>,
        cells: &FittedCells<'_>,
        positions: &Positions<T>,
    ) -> Option<Self> {
        let (rest, targets, system) = (&*work.rest, &work.targets, &work.system);
        let components = rest.mesh().components();
        let held = held(targets);
        let moved = moved(rest, targets, &components);
        let is_active = |v: &VertexId| moved[components.of(*v)];
        let active: Vec<VertexId> = held.iter().copied().filter(is_active).collect();
        let discs = work.point_handles.as_ref().map_or(&[][..], |p| p.discs());
        let net = Net::new(rest);
        let clusters = Clusters::new(&net, &active, discs)?;
        let groups = Groups::new(&net, &clusters.seeds);
        let sums = measure(rest, targets, system, field, cells, &clusters, &groups);
        let model = Model {
            components,
            held,
            moved,
            clusters,
            groups,
            system: sums.system,
            struts: sums.struts,
            moments: sums.moments,
        };
        let state = model.state(rest, field, cells, positions)?;
        Some(Self { model, state })
    }

    /// Returns `true` if it was built for these handles.
    pub(crate) fn is_for<T: Scalar>(&self, rest: &Rest<T>, targets: &Targets<T>) -> bool {
        let Model {
            components,
            held: of,
            moved: as_moved,
            ..
        } = &self.model;
        *of == held(targets) && *as_moved == moved(rest, targets, components)
    }

    /// Computes the correction anew for these positions. Returns whether that could be done.
    pub(crate) fn refresh<T: Scalar>(
        &mut self,
        rest: &Rest<T>,
        field: &VertexMap<T>,
        cells: &FittedCells<'_>,
        positions: &Positions<T>,
    ) -> bool {
        let state = self.model.state(rest, field, cells, positions);
        let is_there = state.is_some();
        if let Some(state) = state {
            self.state = state;
        }
        is_there
    }

    /// φᵀr.
    pub(crate) fn restrict<T: Scalar>(&self, rest: &Rest<T>, r: &[Vector3<f64>]) -> Vec<f64> {
        self.model.clusters.restrict(rest, r)
    }

    /// (φq)_i.
    #[inline]
    pub(crate) fn prolong<T: Scalar>(&self, rest: &Rest<T>, q: &[f64], i: usize) -> Vector3<f64> {
        self.model.clusters.prolong(rest, q, i)
    }

    /// T (H_c⁻¹ − A_c⁻¹) Tᵀ u.
    pub(crate) fn apply(&self, u: &[f64]) -> Vec<f64> {
        let State {
            hessian, system, ..
        } = &self.state;
        self.among_motions(u, |reduced| hessian.solve(reduced) - system.solve(reduced))
    }

    /// T H_c⁻¹ Tᵀ u: the step of Newton's method among the motions of the clusters.
    pub(crate) fn newton_step(&self, u: &[f64]) -> Vec<f64> {
        self.among_motions(u, |reduced| self.state.hessian.solve(reduced))
    }

    /// T f(Tᵀ u).
    fn among_motions(&self, u: &[f64], f: impl FnOnce(&DVector<f64>) -> DVector<f64>) -> Vec<f64> {
        let State {
            motions, starts, ..
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
        let solved = f(&reduced);
        let mut out = vec![0.0; u.len()];
        for (j, motions) in motions.iter().enumerate() {
            let at = j * FUNCTIONS * 3;
            let (from, len) = (starts[j], starts[j + 1] - starts[j]);
            let own = motions.columns(6 - len, len) * solved.rows(from, len);
            out[at..at + 12].copy_from_slice(own.as_slice());
        }
        out
    }
}

impl Model {
    /// The correction at these positions; `None` where a matrix cannot be made definite.
    fn state<T: Scalar>(
        &self,
        rest: &Rest<T>,
        field: &VertexMap<T>,
        cells: &FittedCells<'_>,
        positions: &Positions<T>,
    ) -> Option<State> {
        let motions = self.motions(cells);
        let mut starts = vec![0];
        for j in 0..self.clusters.len() {
            let unknowns = if j < self.clusters.num_moving { 6 } else { 3 };
            starts.push(starts[j] + unknowns);
        }
        let system = reduced(&self.system, &motions, &starts);
        let struts = reduced(&self.struts, &motions, &starts);
        let lost = self.lost(rest, field, cells, positions, &motions, &starts);
        let base = &system + &struts - &lost;
        let shifted = |shift: f64| Cholesky::new(regular(&base + &system * shift));
        let mut shift = 0.0;
        while shifted(shift).is_none() {
            shift = (3.0 * shift).max(SOFTEST);
            if !(shift < 1e3) {
                return None;
            }
        }
        Some(State {
            hessian: shifted(shift + SOFTEST)?,
            system: Cholesky::new(regular(system))?,
            motions,
            starts,
        })
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
                .map(|x| x.max(MIN_RESISTANCE * largest).sqrt().recip());
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

/// The least resistance of a turn of a group, over that of its most resisted one: a turn that the
/// covariance hardly determines is rounding.
const MIN_RESISTANCE: f64 = 1e-4;

/// No motion counts as softer than this, of A: the model of the rotations is not exact.
const SOFTEST: f64 = 1e-3;

fn held<T: Scalar>(targets: &Targets<T>) -> Vec<VertexId> {
    let held = targets.held();
    let hard = held.iter().filter(|h| h.hold == Hold::Hard);
    hard.map(|h| h.vertex).collect()
}

/// For each component, `true` if it has a handle that is to move. The others are at rest: nothing
/// pulls there but rounding, which soft modes would make large.
fn moved<T: Scalar>(rest: &Rest<T>, targets: &Targets<T>, components: &Components) -> Vec<bool> {
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
