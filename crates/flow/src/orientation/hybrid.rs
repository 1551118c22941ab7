//! Curvature flow and as-rigid-as-possible editing in one energy, over wide cells.

use cotan_geometry::{Positions, Scalar, surface_area};
use cotan_halfedge::{FaceId, VertexId, VertexMap};
use cotan_laplacian::OneRings;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::cells::{
    as_f64, average, cell_share, edge_pair, face_covariances, ring_covariance, spread,
    triangle_halfedges,
};
use super::{Orientation, field_scale};
use crate::error::FlowError;
use crate::polar::nearest_rotation_from;
use crate::rest::Rest;
use crate::state::{FlowState, Quantities};
use crate::vectors::sum;

/// Laplacian coordinates turn with rotations that minimise, together with the positions,
///
/// ```text
/// E(x, R) = Σ_i Σ_j P_ji ( |(L⁰x)_j − k_j R_i ℓ⁰_j|² + μ/6 Σ_{T at j} Σ_{e in T} cot_e |e − R_i e⁰|² )
/// ```
///
/// The first term is the flow's; the second is that of as-rigid-as-possible editing over all edges
/// of the triangles around a vertex ("spokes and rims"). P = Ω², Ω the mean over a vertex and its
/// neighbours: every rotation serves a *wide cell*, which keeps neighbouring rotations alike and the
/// surface from creasing. R_i (by a fit) and x (by the solve, whose matrix gains μK with K = L/2)
/// lower E in turn, so the iteration cannot oscillate.
///
/// μ = 4 (area / n) / λ², with λ the bending length: details smaller than λ are kept by the flow's
/// term, shapes larger than λ by the membrane's, whatever the resolution of the mesh.
///
/// The membrane is weighted by cotangents whatever the scheme, and knows the original edges: it
/// resists a scheme or a scalar field that want another shape. For those, take another orientation.
///
/// **Units**: λ is relative to twice the greatest distance of a vertex from the centroid, which is
/// about the size of the bounding box but does not depend on how the mesh is turned.
///
/// **Deviation** from the paper: ours, measured in `docs/decisions`.
#[derive(Debug)]
pub struct Hybrid {
    bending_length: f64,
    /// μ, once the mesh is known.
    weight: f64,
    /// The rotations of the last fit, from which the next one starts.
    rotations: VertexMap<Matrix3<f64>>,
    /// R̄ = P R: the mean of the rotations that serve each vertex.
    means: VertexMap<Matrix3<f64>>,
    energy: f64,
}

impl Hybrid {
    /// The bending length that was found best over the reference cases.
    pub const DEFAULT_BENDING_LENGTH: f64 = 0.0175;

    /// How often the one-ring mean is applied.
    const WIDTH: usize = 2;

    /// With bending length λ = `bending_length`, relative to the size of the mesh.
    pub fn new(bending_length: f64) -> Self {
        Self {
            bending_length,
            weight: 0.0,
            rotations: VertexMap::default(),
            means: VertexMap::default(),
            energy: 0.0,
        }
    }

    /// The rotations of the current state, and their means and variances.
    fn fit<T: Scalar>(&mut self, state: &FlowState<'_, T>, wanted: &[Vector3<f64>]) {
        let mu = self.weight;
        let (rest, rings) = (state.rest(), state.rest().rings());
        let faces = face_covariances(rest, state.positions());
        let now: Vec<Vector3<f64>> = (0..wanted.len())
            .into_par_iter()
            .with_min_len(1 << 10)
            .map(|i| rest.operator().apply_at(state.positions(), i))
            .collect();
        let covariance = |i: usize| {
            now[i] * wanted[i].transpose()
                + ring_covariance(rest.mesh(), &faces, VertexId::new(i)) * (mu / 6.0)
        };
        let covariances = per_vertex(wanted.len(), covariance);
        let covariances = spread(rings, &covariances, Self::WIDTH);
        let last = self.rotations.as_slice();
        self.rotations = per_vertex(wanted.len(), |i| {
            let guess = last.get(i).copied().unwrap_or_else(Matrix3::identity);
            nearest_rotation_from(&covariances.as_slice()[i], &guess)
        });
        let (means, variances) = means_and_variances(rings, &self.rotations);
        self.energy = energy(state, &now, wanted, &means, &variances, mu);
        self.means = means;
    }
}

impl Default for Hybrid {
    fn default() -> Self {
        Self::new(Self::DEFAULT_BENDING_LENGTH)
    }
}

impl<T: Scalar> Orientation<T> for Hybrid {
    fn orient(
        &mut self,
        state: &FlowState<'_, T>,
        field: &VertexMap<T>,
        out: &mut VertexMap<Vector3<T>>,
    ) -> Result<(), FlowError> {
        let rest = state.rest();
        let wanted: Vec<Vector3<f64>> = rest
            .laplacian()
            .iter()
            .map(|(v, ell)| as_f64(*ell * field_scale(field[v], rest.magnitudes()[v])))
            .collect();
        self.fit(state, &wanted);
        for ((ell, wanted), mean) in out.values_mut().zip(&wanted).zip(self.means.values()) {
            *ell = (mean * wanted).map(T::of_f64);
        }
        Ok(())
    }

    fn check(&self) -> Result<(), FlowError> {
        if self.bending_length > 0.0 {
            return Ok(());
        }
        Err(FlowError::Setting {
            setting: "bending length",
            range: "above 0",
            value: self.bending_length,
        })
    }

    fn needs(&self) -> Quantities {
        Quantities::NONE
    }

    fn prepare(&mut self, rest: &Rest<'_, T>) -> f64 {
        let vertex_area = surface_area(&rest.surface()).as_f64() / rest.positions().len() as f64;
        // Of the size of L², whatever the scheme: 1 for cotangent weights.
        let scale = rest.operator().mean_diagonal() / rest.mean_cotangent_diagonal();
        let length = self.bending_length * rest.extent();
        self.rotations = VertexMap::filled(rest.positions().len(), Matrix3::identity());
        self.means = self.rotations.clone();
        self.weight = 4.0 * vertex_area * (scale / length).powi(2);
        self.weight
    }

    fn tension(
        &self,
        rest: &Rest<'_, T>,
        positions: &Positions<T>,
        out: &mut VertexMap<Vector3<f64>>,
    ) {
        let mesh = rest.mesh();
        // Per triangle and edge: ½ cot_e (e − R̄_T e⁰), R̄_T the mean of its corners' means.
        let pulls: Vec<[Vector3<f64>; 3]> = (0..mesh.num_faces())
            .into_par_iter()
            .with_min_len(1 << 10)
            .map(|f| {
                let face = FaceId::new(f);
                let mean = mesh
                    .triangle(face)
                    .map(|v| self.means[v])
                    .iter()
                    .sum::<Matrix3<f64>>()
                    / 3.0;
                triangle_halfedges(mesh, face).map(|h| {
                    let (e, e0) = edge_pair(rest, positions, h);
                    (e - mean * e0) * (0.5 * rest.cotangents()[h])
                })
            })
            .collect();
        out.as_mut_slice()
            .par_iter_mut()
            .enumerate()
            .with_min_len(1 << 10)
            .for_each(|(i, t)| {
                *t = Vector3::zeros();
                for h in mesh.outgoing_halfedges(VertexId::new(i)) {
                    let Some(face) = mesh.face(h) else { continue };
                    let first = triangle_halfedges(mesh, face)
                        .iter()
                        .position(|&other| other == h)
                        .unwrap_or(0);
                    // The edge that leaves the vertex pulls it forward, the one that arrives back.
                    *t += pulls[face.index()][first] - pulls[face.index()][(first + 2) % 3];
                }
            });
    }

    fn start_from(&mut self, rotations: &VertexMap<Matrix3<f64>>) {
        self.rotations = rotations.clone();
        self.means = rotations.clone();
    }

    fn energy(&self) -> Option<f64> {
        Some(self.energy)
    }
}

fn per_vertex<A: Send>(n: usize, value: impl Fn(usize) -> A + Sync + Send) -> VertexMap<A> {
    VertexMap::from_vec(
        (0..n)
            .into_par_iter()
            .with_min_len(1 << 9)
            .map(value)
            .collect(),
    )
}

/// R̄ = P R and V_j = Σ_i P_ji (R_i − R̄_j)ᵀ(R_i − R̄_j), from differences only so that nothing
/// cancels: the variance about a mean of means is the mean variance plus the variance of the means.
fn means_and_variances(
    rings: &OneRings,
    rotations: &VertexMap<Matrix3<f64>>,
) -> (VertexMap<Matrix3<f64>>, VertexMap<Matrix3<f64>>) {
    let n = rotations.len();
    let mut values = rotations.clone();
    let mut variances = VertexMap::filled(n, Matrix3::zeros());
    for _ in 0..Hybrid::WIDTH {
        let means = average(rings, &values, 1);
        variances = per_vertex(n, |j| {
            let about = |i: usize| {
                let difference = values.as_slice()[i] - means.as_slice()[j];
                variances.as_slice()[i] + difference.transpose() * difference
            };
            let mut sum = about(j);
            for (i, _) in rings.ring(j) {
                sum += about(i.index());
            }
            sum * cell_share(rings, j)
        });
        values = means;
    }
    (values, variances)
}

/// E at its minimum over the rotations, given their means and variances:
/// Σ_i P_ji |a − R_i b|² = |a − R̄_j b|² + b·V_j b.
fn energy<T: Scalar>(
    state: &FlowState<'_, T>,
    now: &[Vector3<f64>],
    wanted: &[Vector3<f64>],
    means: &VertexMap<Matrix3<f64>>,
    variances: &VertexMap<Matrix3<f64>>,
    mu: f64,
) -> f64 {
    let rest = state.rest();
    let mesh = rest.mesh();
    let misfit = |v: VertexId, a: &Vector3<f64>, b: &Vector3<f64>| {
        (a - means[v] * b).norm_squared() + b.dot(&(variances[v] * b))
    };
    let of_vertices: Vec<f64> = (0..now.len())
        .into_par_iter()
        .with_min_len(1 << 10)
        .map(|i| misfit(VertexId::new(i), &now[i], &wanted[i]))
        .collect();
    let of_faces: Vec<f64> = (0..mesh.num_faces())
        .into_par_iter()
        .with_min_len(1 << 10)
        .map(|f| {
            let face = FaceId::new(f);
            let mut sum = 0.0;
            for h in triangle_halfedges(mesh, face) {
                let (e, e0) = edge_pair(rest, state.positions(), h);
                let misfits: f64 = mesh.triangle(face).map(|v| misfit(v, &e, &e0)).iter().sum();
                sum += rest.cotangents()[h] * misfits;
            }
            sum
        })
        .collect();
    sum(&of_vertices) + mu / 6.0 * sum(&of_faces)
}

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::torus;
    use nalgebra::Rotation3;

    use super::*;

    /// P = Ω² written out: mean and variance of the rotations that serve a vertex.
    #[test]
    fn means_and_variances_are_those_of_the_wide_cells() {
        let shape = torus::<f64>(1.0, 0.4, 12, 7);
        let rings = OneRings::new(&shape.mesh);
        let n = shape.positions.len();
        let turn = |i: usize| Rotation3::new(Vector3::new((i as f64).sin(), 0.3, 0.1 * i as f64));
        let rotations = per_vertex(n, |i| turn(i).into_inner());
        let omega = |j: usize, i: usize| {
            let is_near = i == j || rings.ring(j).any(|(k, _)| k.index() == i);
            if is_near { cell_share(&rings, j) } else { 0.0 }
        };
        let (means, variances) = means_and_variances(&rings, &rotations);
        for j in [0, 17, n - 1] {
            let share = |i: usize| (0..n).map(|m| omega(j, m) * omega(m, i)).sum::<f64>();
            let mean: Matrix3<f64> = (0..n).map(|i| rotations.as_slice()[i] * share(i)).sum();
            let variance: Matrix3<f64> = (0..n)
                .map(|i| rotations.as_slice()[i] - mean)
                .enumerate()
                .map(|(i, d)| d.transpose() * d * share(i))
                .sum();
            assert!((means.as_slice()[j] - mean).norm() < 1e-13);
            assert!((variances.as_slice()[j] - variance).norm() < 1e-13);
        }
    }
}
