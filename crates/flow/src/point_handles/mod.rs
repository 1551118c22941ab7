//! Handles of a single vertex, which pull at a small disc around it.
//!
//! A force on one vertex draws the surface to a cone as wide as the bending length. The force λ of
//! such a handle h is therefore spread over the vertices of a disc by weights ω with Σω = 1, and
//! the vertex itself is free. The mean Σ ω_j x_j is held by a spring,
//!
//! ```text
//! E += |gap|² / c,      gap = u − o − Σ ω_j x_j,      λ = gap / c
//! ```
//!
//! with u the target and o the way from the mean to the vertex in the original shape, turned as
//! the handles tell. The spring has the compliance that the disc lacks compared with the vertex,
//!
//! ```text
//! c = 1 / (force on h that moves h by 1) − 1 / (force on the disc that does so)
//! ```
//!
//! so that the handle pulls the body as far as it would without a disc. The rest of the way to
//! the target is added to the positions that the flow returns, as a bump around the vertex.
//!
//! The system holds h itself. With A its inverse, ω restricted to the free vertices, and two
//! columns per handle,
//!
//! ```text
//! V = the shape with V_h = 1, 0 at all other handles, free elsewhere        W = A ω
//! ```
//!
//! the correction is Ar + Vδ + Wλ with the forces on h balanced:
//!
//! ```text
//! [ Σ   −G   ] [δ]   [ Vᵀr        ]
//! [ Gᵀ  D + c] [λ] = [ gap − ωᵀAr ]      Σ = VᵀMV,   G = Vᵀω,   D = ωᵀW
//! ```

mod disc;

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::{HalfedgeMesh, VertexId, VertexMap};
use cotan_linear::{Defect, PreparedSystem};
use cotan_parallel as parallel;
use nalgebra::{DMatrix, Dyn, FullPivLU, MatrixXx3, Vector3};

use self::disc::discs;
pub(crate) use self::disc::{Disc, MAX_POINTS};
use crate::error::FlowError;
use crate::rest::Rest;
use crate::start::{handle_rotations, spread};
use crate::targets::Targets;
use crate::ties::add_pull;
use crate::vectors::{CHUNKS, total};
use crate::workspace::Workspace;

/// The point handles of one set of handles.
#[derive(Debug)]
pub(crate) struct PointHandles {
    discs: Vec<Disc>,
    /// V and W: for every vertex the entries of all columns V, then those of all W.
    columns: Vec<f64>,
    /// Of the small system, with λ in units of `unit`.
    small: FullPivLU<f64, Dyn, Dyn>,
    unit: f64,
}

/// The least compliance of a spring, over that of its disc.
const STIFFEST: f64 = 1e-3;

/// Predicts the bytes that the handles of single vertices among `held` take: two columns each, and
/// three fields while they are solved for. 0 if there are none, or too many to pull at discs.
pub fn predicted_point_handle_bytes(
    mesh: &HalfedgeMesh,
    held: impl IntoIterator<Item = VertexId>,
) -> u64 {
    let mut is_held = VertexMap::filled(mesh.num_vertices(), false);
    let mut vertices = Vec::new();
    for v in held {
        if let Some(flag) = is_held.get_mut(v)
            && !std::mem::replace(flag, true)
        {
            vertices.push(v);
        }
    }
    let is_point = |v: &&VertexId| mesh.one_ring(**v).all(|j| !is_held[j]);
    let num_points = vertices.iter().filter(is_point).count();
    match num_points {
        1..=MAX_POINTS => column_bytes(mesh.num_vertices(), num_points),
        _ => 0,
    }
}

/// The bytes of the columns of so many point handles, and of the fields from which they are made.
fn column_bytes(num_vertices: usize, num_points: usize) -> u64 {
    let columns = 2 * num_points * size_of::<f64>();
    let fields = 3 * size_of::<Vector3<f64>>();
    num_vertices as u64 * (columns + fields) as u64
}

impl PointHandles {
    /// Finds the handles of a single vertex and the discs of `radius` around them. `None` if there
    /// is none, if no disc has another vertex, or if the system cannot be solved.
    pub(crate) fn new<T: Scalar>(work: &mut Workspace<T>, radius: f64) -> Option<Self> {
        if !(radius > 0.0) || work.membrane_weight == 0.0 {
            return None;
        }
        let mut discs = discs(&work.rest, &work.targets, radius);
        if discs.is_empty() {
            return None;
        }
        let n = work.rest.positions().len();
        let k = discs.len();
        let mut columns = Vec::new();
        columns.try_reserve_exact(2 * k * n).ok()?;
        columns.resize(2 * k * n, 0.0);
        let mut stiffness = DMatrix::zeros(k, k);
        for (first, some) in discs.chunks(3).enumerate().map(|(c, some)| (3 * c, some)) {
            let mut field = VertexMap::filled(n, Vector3::zeros());
            for (lane, disc) in some.iter().enumerate() {
                field[disc.vertex][lane] = 1.0;
            }
            let lifted = spread(work, field).ok()?;
            // The residual at the handles is the force on them.
            let defect = defect_of_shape(work, &lifted);
            let defect = Defect::of_laplacian(&work.terms.mismatch).with_tension(&defect);
            for (h, disc) in discs.iter().enumerate() {
                let force = work.system.residual_at(&defect, disc.vertex);
                for lane in 0..some.len() {
                    stiffness[(h, first + lane)] = -force[lane];
                }
            }
            let pushed = push(work, some).ok()?;
            let (lifted, pushed) = (lifted.as_slice(), pushed.as_slice());
            for (i, row) in columns.chunks_exact_mut(2 * k).enumerate() {
                for lane in 0..some.len() {
                    row[first + lane] = lifted[i][lane];
                    row[k + first + lane] = pushed[i][lane];
                }
            }
        }
        if columns.iter().chain(&stiffness).any(|x| !x.is_finite()) {
            return None;
        }
        let stiffness = (&stiffness + stiffness.transpose()) * 0.5;
        let mean = |column: usize, disc: &Disc| -> f64 {
            let entries = disc.weights.iter();
            entries
                .map(|(j, w)| w * columns[2 * k * *j as usize + column])
                .sum()
        };
        let lift = DMatrix::from_fn(k, k, |h, m| mean(h, &discs[m]));
        let mut give = DMatrix::from_fn(k, k, |m, l| mean(k + l, &discs[m]));
        let forces = lift.clone().full_piv_lu().solve(&stiffness)?;
        for (h, disc) in discs.iter_mut().enumerate() {
            let (at_vertex, at_disc) = (stiffness[(h, h)], forces[(h, h)]);
            let is_held = at_vertex > 1e-12 * at_disc && at_disc > 0.0;
            let lacking = if is_held {
                1.0 / at_vertex - 1.0 / at_disc
            } else {
                0.0
            };
            disc.compliance = lacking.max(STIFFEST * give[(h, h)]);
            // On degenerate meshes rounding may leave nothing.
            if !(disc.compliance > 0.0 && disc.compliance.is_finite()) {
                return None;
            }
            give[(h, h)] += disc.compliance;
        }
        let trace = stiffness.trace() / k as f64;
        let unit = if trace > 0.0 { trace } else { 1.0 };
        let mut small = DMatrix::zeros(2 * k, 2 * k);
        small
            .view_mut((0, 0), (k, k))
            .copy_from(&(stiffness / unit));
        small.view_mut((0, k), (k, k)).copy_from(&-&lift);
        small.view_mut((k, 0), (k, k)).copy_from(&lift.transpose());
        small.view_mut((k, k), (k, k)).copy_from(&(give * unit));
        let small = small.full_piv_lu();
        small.is_invertible().then_some(Self {
            discs,
            columns,
            small,
            unit,
        })
    }

    pub(crate) fn discs(&self) -> &[Disc] {
        &self.discs
    }

    /// Returns `true` if a vertex is one of these handles.
    pub(crate) fn contains(&self, vertex: VertexId) -> bool {
        self.discs.iter().any(|disc| disc.vertex == vertex)
    }

    /// Half the negative gradient at the handles' own vertices, which the system takes for held.
    pub(crate) fn complete(
        &self,
        system: &PreparedSystem,
        defect: &Defect<'_>,
        residual: &mut VertexMap<Vector3<f64>>,
    ) {
        for disc in &self.discs {
            residual[disc.vertex] = system.residual_at(defect, disc.vertex);
        }
    }

    /// Adds the forces of the springs.
    pub(crate) fn add_forces<T: Scalar>(
        &self,
        targets: &Targets<T>,
        positions: &Positions<T>,
        residual: &mut VertexMap<Vector3<f64>>,
    ) {
        for disc in &self.discs {
            let force = disc.gap(targets, positions) / disc.compliance;
            for (i, w) in &disc.weights {
                residual.as_mut_slice()[*i as usize] += force * *w;
            }
        }
    }

    /// The energy of the springs.
    pub(crate) fn energy<T: Scalar>(&self, targets: &Targets<T>, positions: &Positions<T>) -> f64 {
        let of_disc = |d: &Disc| d.gap(targets, positions).norm_squared() / d.compliance;
        self.discs.iter().map(of_disc).sum()
    }

    /// Turns and scales the original offsets as the handles' targets tell.
    pub(crate) fn aim<T: Scalar>(&mut self, rest: &Rest<T>, targets: &Targets<T>, scale: f64) {
        let rotations = handle_rotations(rest, targets);
        for disc in &mut self.discs {
            let original = disc.offset_in(rest.positions());
            disc.offset = rotations[disc.handle] * original * scale;
        }
    }

    /// Turns the correction that holds the vertices into the one that the springs hold.
    ///
    /// **Shapes**: one entry per vertex; the residual is [complete](Self::complete) but for the
    /// springs.
    pub(crate) fn correct<T: Scalar>(
        &self,
        targets: &Targets<T>,
        positions: &Positions<T>,
        residual: &VertexMap<Vector3<f64>>,
        correction: &mut VertexMap<Vector3<f64>>,
    ) {
        let k = self.discs.len();
        let partial = CHUNKS.map(residual.as_slice(), |first, chunk| {
            let mut sums = vec![0.0; 3 * k];
            for (r, row) in chunk.iter().zip(self.rows(first)) {
                for (sum, v) in sums.chunks_exact_mut(3).zip(&row[..k]) {
                    for a in 0..3 {
                        sum[a] += v * r[a];
                    }
                }
            }
            sums
        });
        let sums = total(partial);
        let mut right = MatrixXx3::zeros(2 * k);
        for (h, disc) in self.discs.iter().enumerate() {
            let held = correction.as_slice();
            let mean = disc.weights.iter().map(|(j, w)| held[*j as usize] * *w);
            let mean: Vector3<f64> = mean.sum();
            let gap = disc.gap(targets, positions);
            for a in 0..3 {
                right[(h, a)] = sums[3 * h + a] / self.unit;
                right[(k + h, a)] = gap[a] - mean[a];
            }
        }
        self.small.solve_mut(&mut right);
        let factors = (0..2 * k).map(|c| {
            let unit = if c < k { 1.0 } else { self.unit };
            right.row(c).transpose() * unit
        });
        let factors: Vec<Vector3<f64>> = factors.collect();
        parallel::update(correction.as_mut_slice(), |i, step| {
            *step += self.combine(&factors, i);
        });
    }

    /// Calls `each` with the vertices around every handle and the displacements that bring the
    /// handle to its target.
    pub(crate) fn bump<T: Scalar>(
        &self,
        targets: &Targets<T>,
        positions: &Positions<T>,
        mut each: impl FnMut(u32, Vector3<T>),
    ) {
        for disc in &self.discs {
            let way = targets.in_box()[disc.handle] - positions[disc.vertex];
            if way != Vector3::zeros() {
                let displaced = disc.bump.iter().map(|(i, b)| (*i, way * T::of_f64(*b)));
                displaced.for_each(|(i, by)| each(i, by));
            }
        }
    }

    /// A correction with these factors, at one vertex.
    #[inline]
    fn combine(&self, factors: &[Vector3<f64>], i: usize) -> Vector3<f64> {
        let row = &self.columns[i * factors.len()..][..factors.len()];
        let terms = row.iter().zip(factors);
        terms.fold(Vector3::zeros(), |sum, (c, f)| sum + f * *c)
    }

    fn rows(&self, first: usize) -> impl Iterator<Item = &[f64]> {
        let width = 2 * self.discs.len();
        self.columns[first * width..].chunks_exact(width)
    }
}

/// Writes the mismatch of a shape that should have no Laplacian coordinates, and returns its
/// tension.
fn defect_of_shape<T: Scalar>(
    work: &mut Workspace<T>,
    shape: &VertexMap<Vector3<f64>>,
) -> VertexMap<Vector3<f64>> {
    let (rest, x) = (&*work.rest, shape.as_slice());
    let mut tension = VertexMap::filled(x.len(), Vector3::zeros());
    parallel::update(
        (work.terms.mismatch.as_mut_slice(), tension.as_mut_slice()),
        |i, (mismatch, tension)| {
            (*mismatch, *tension) = (Vector3::zeros(), Vector3::zeros());
            for (j, k) in rest.graph().row(i) {
                let step = x[j.index()] - x[i];
                *mismatch -= step * rest.operator().weights()[k];
                *tension += step * (0.5 * rest.membrane_weights()[k]);
            }
        },
    );
    add_pull(rest, x, &mut tension);
    tension
}

/// W of up to three discs, one in each coordinate.
fn push<T: Scalar>(
    work: &mut Workspace<T>,
    discs: &[Disc],
) -> Result<VertexMap<Vector3<f64>>, FlowError> {
    let n = work.rest.positions().len();
    work.terms.mismatch.as_mut_slice().fill(Vector3::zeros());
    let mut tension = VertexMap::filled(n, Vector3::zeros());
    let per_membrane = 1.0 / work.membrane_weight;
    for (lane, disc) in discs.iter().enumerate() {
        for (i, w) in &disc.weights {
            tension.as_mut_slice()[*i as usize][lane] += w * per_membrane;
        }
        // The sum over a component is to vanish; the handle's own vertex is held.
        tension[disc.vertex][lane] -= per_membrane;
    }
    let defect = Defect::of_laplacian(&work.terms.mismatch).with_tension(&tension);
    let mut pushed = VertexMap::filled(n, Vector3::zeros());
    work.system.correct(&defect, &mut pushed)?;
    Ok(pushed)
}

#[cfg(test)]
pub(super) mod tests {
    use cotan_geometry::shapes::icosphere;
    use cotan_linear::Handle;
    use nalgebra::Point3;

    use super::*;
    use crate::flow::Flow;
    use crate::vectors::add_scaled;

    /// A sphere with a region held below and two points above, and their discs.
    pub(super) fn work() -> Workspace<f64> {
        let shape = icosphere::<f64>(4);
        let surface = shape.surface();
        let low = surface.vertices_where(|p| p.z < -0.7);
        let top = surface.vertices_where(|p| p.z > 1.0 - 1e-9);
        let side = surface.vertices_where(|p| p.x > 1.0 - 1e-9);
        let all = low.iter().chain(&top).chain(&side);
        let target =
            |v: &VertexId| -> (Handle, Point3<f64>) { (Handle::hard(*v), shape.positions()[*v]) };
        let flow = Flow::builder(shape.connectivity(), shape.positions())
            .handles(all.map(target))
            .build()
            .unwrap();
        flow.into_parts().0
    }

    /// The residual of a shape, at the handles' own vertices as well.
    fn residual(
        work: &mut Workspace<f64>,
        points: &PointHandles,
        shape: &VertexMap<Vector3<f64>>,
    ) -> VertexMap<Vector3<f64>> {
        let tension = defect_of_shape(work, shape);
        let defect = Defect::of_laplacian(&work.terms.mismatch).with_tension(&tension);
        let mut residual = VertexMap::filled(shape.len(), Vector3::zeros());
        work.system.residual(&defect, &mut residual);
        points.complete(&work.system, &defect, &mut residual);
        residual
    }

    /// One correction brings any shape into equilibrium with the springs.
    #[test]
    fn one_correction_reaches_equilibrium_with_the_springs() {
        let mut work = work();
        let points = work.point_handles.take().unwrap();
        assert_eq!(points.discs.len(), 2);
        let n = work.rest.positions().len();
        let mut shape = VertexMap::from_fn(n, |v: VertexId| {
            let t = v.index() as f64;
            Vector3::new(t.sin(), (1.7 * t).cos(), (0.3 * t).sin())
        });
        let held: Vec<Handle> = work.targets.handles().to_vec();
        for handle in held.iter().filter(|h| !points.contains(h.vertex)) {
            shape[handle.vertex] = Vector3::zeros();
        }
        let before = residual(&mut work, &points, &shape);
        let tension = defect_of_shape(&mut work, &shape);
        let defect = Defect::of_laplacian(&work.terms.mismatch).with_tension(&tension);
        let mut correction = VertexMap::filled(n, Vector3::zeros());
        work.system.correct(&defect, &mut correction).unwrap();
        let at = |shape: &VertexMap<Vector3<f64>>| shape.map(|x| Point3::from(*x));
        points.correct(&work.targets, &at(&shape), &before, &mut correction);
        add_scaled(shape.as_mut_slice(), 1.0, correction.as_slice());
        let mut after = residual(&mut work, &points, &shape);
        points.add_forces(&work.targets, &at(&shape), &mut after);
        let size = before.values().map(|r| r.norm()).fold(0.0, f64::max);
        for (i, r) in after.iter() {
            assert!(r.norm() < 1e-8 * size, "{i:?}: {r:?}");
        }
        let pulled: f64 = points.energy(&work.targets, &at(&shape));
        assert!(pulled > 0.0);
    }

    #[test]
    fn the_predicted_bytes_are_those_of_the_columns() {
        let work = work();
        let points = work.point_handles.as_ref().unwrap();
        let n = work.rest.positions().len();
        let held = work.targets.handles().iter().map(|h| h.vertex);
        let predicted = predicted_point_handle_bytes(work.rest.mesh(), held.clone());
        let fields = 3 * size_of::<Vector3<f64>>() * n;
        let taken = points.columns.capacity() * size_of::<f64>();
        assert_eq!(predicted, (taken + fields) as u64);
        // A region has none, and neither has a crowd of points.
        let region = held.filter(|v| !points.contains(*v));
        assert_eq!(predicted_point_handle_bytes(work.rest.mesh(), region), 0);
        assert_eq!(column_bytes(1, MAX_POINTS), 384 + 72);
    }
}
