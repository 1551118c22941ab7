//! Curvature flow and as-rigid-as-possible editing in one energy, over wide cells.

use cotan_geometry::{Scalar, surface_area};
use cotan_halfedge::VertexMap;
use cotan_laplacian::OneRings;
use nalgebra::{Matrix3, Vector3};

use super::cells::{add_outer, as_f64, cell_share, cell_sum, edge_gradients, in_rows, turned};
use super::{Energy, Orientation, field_scale};
use crate::error::FlowError;
use crate::polar::{IDENTITY, Mat3, flat, nearest_rotation_from};
use crate::rest::Rest;
use crate::state::{FlowState, Quantities};
use crate::vectors::{fill, update_both, update_summing};

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
    /// What turns edges into covariances and means into tensions, row after row: μ/6 g_ji and
    /// −g_ij/6 of [`edge_gradients`].
    fit_gradients: Vec<[f64; 3]>,
    pull_gradients: Vec<[f64; 3]>,
    /// The membrane's terms of the energy that depend on the original alone.
    rest_energy: Energy,
    /// The rotations of the last fit, from which the next one starts.
    rotations: Vec<Mat3>,
    /// R̄ = P R: the mean of the rotations that serve each vertex.
    means: Vec<Mat3>,
    scratch: Vec<Mat3>,
    energy: Energy,
}

impl Hybrid {
    /// The bending length that was found best over the reference cases.
    pub const DEFAULT_BENDING_LENGTH: f64 = 0.0175;

    /// With bending length λ = `bending_length`, relative to the size of the mesh.
    pub fn new(bending_length: f64) -> Self {
        Self {
            bending_length,
            weight: 0.0,
            fit_gradients: Vec::new(),
            pull_gradients: Vec::new(),
            rest_energy: Energy::default(),
            rotations: Vec::new(),
            means: Vec::new(),
            scratch: Vec::new(),
            energy: Energy::default(),
        }
    }

    /// The rotations of the current state, and the energy with them.
    ///
    /// Multiplied out, E is the sum of the squares of what is and of what is wanted, less
    /// 2 Σ_i R_i : C_i, with C = Pᵀ (covariances) the sums that the fit is made by: P has rows of
    /// sum 1. So the energy costs no pass of its own.
    fn fit<T: Scalar>(&mut self, state: &FlowState<'_, T>, field: &VertexMap<T>) {
        let rings = state.rest().rings();
        let Self {
            weight,
            fit_gradients,
            rotations,
            means: spread,
            scratch,
            ..
        } = self;
        let cells = CellsAt {
            state,
            field,
            gradients: fit_gradients,
            membrane: 0.25 * *weight,
        };
        // Ωᵀ twice: a vertex hands a share to its neighbours, taken where its value is written. The means
        // of the last fit are no longer needed.
        let [value, size] = update_summing(scratch, |i, out| cells.covariance(i, out));
        fill(spread, |i| {
            scaled(cell_sum(rings, scratch, i), cell_share(rings, i))
        });
        let [cross] = update_summing(rotations, |i, rotation| {
            let covariance = cell_sum(rings, spread, i);
            *rotation = nearest_rotation_from(&covariance, rotation);
            [rotation.iter().zip(&covariance).map(|(r, c)| r * c).sum()]
        });
        let left = value + self.rest_energy.value - 2.0 * cross;
        self.energy = Energy {
            // Not `max`, which drops a NaN: that must not pass for a low energy.
            value: if left < 0.0 { 0.0 } else { left },
            size: size + self.rest_energy.size,
        };
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
        self.fit(state, field);
        let (rest, rings) = (state.rest(), state.rest().rings());
        let (scratch, rotations) = (&mut self.scratch, &self.rotations);
        fill(scratch, |i| mean(rings, rotations, i));
        update_both(&mut self.means, out.as_mut_slice(), |i, means, ell| {
            *means = mean(rings, scratch, i);
            *ell = turned(means, &wanted(rest, field, i)).map(T::of_f64);
        });
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
        let n = rest.positions().len();
        let vertex_area = surface_area(&rest.surface()).as_f64() / n as f64;
        // Of the size of L², whatever the scheme: 1 for cotangent weights.
        let scale = rest.operator().mean_diagonal() / rest.mean_cotangent_diagonal();
        let length = self.bending_length * rest.extent();
        self.weight = 4.0 * vertex_area * (scale / length).powi(2);
        let gradients = edge_gradients(rest);
        self.fit_gradients = in_rows(rest.rings(), &gradients, self.weight / 6.0, |h| h.twin());
        self.pull_gradients = in_rows(rest.rings(), &gradients, -1.0 / 6.0, |h| h);
        self.rotations = vec![IDENTITY; n];
        self.means = self.rotations.clone();
        self.scratch = self.rotations.clone();
        self.rest_energy = (0..n).fold(Energy::default(), |sum, i| {
            let [value, size] = stretch(rest, i).map(|s| 0.25 * self.weight * s);
            Energy {
                value: sum.value + value,
                size: sum.size + size,
            }
        });
        self.weight
    }

    fn wanted_tension(&self, rest: &Rest<'_, T>, out: &mut VertexMap<Vector3<f64>>) {
        // Every triangle wants its original edges turned by the mean of its corners' means. Gathered
        // at a vertex: a third of each neighbour's for the two triangles at their edge, and of its
        // own for all triangles, each of which lies at two edges.
        let rings = rest.rings();
        fill(out.as_mut_slice(), |i| {
            let row = rings.range(i);
            let (mut tension, mut own) = (Vector3::zeros(), Vector3::zeros());
            for (j, g) in rings.neighbours()[row.clone()]
                .iter()
                .zip(&self.pull_gradients[row])
            {
                let g = Vector3::from(*g);
                tension += turned(&self.means[j.index()], &g);
                own += g;
            }
            tension + turned(&self.means[i], &own) * 0.5
        });
    }

    fn start_from(&mut self, rotations: &VertexMap<Matrix3<f64>>) {
        self.rotations = rotations.values().map(flat).collect();
        self.means.clone_from(&self.rotations);
    }

    fn energy(&self) -> Option<Energy> {
        Some(self.energy)
    }
}

/// What the first pass of a fit reads.
struct CellsAt<'a, T: Scalar> {
    state: &'a FlowState<'a, T>,
    field: &'a VertexMap<T>,
    gradients: &'a [[f64; 3]],
    /// μ/4, the weight of both halves of every edge.
    membrane: f64,
}

impl<T: Scalar> CellsAt<'_, T> {
    /// Writes the covariance of the triangles around vertex `i` times its share.
    /// Returns the squares that belong to the vertex: as they enter the energy, and their sizes.
    #[inline]
    fn covariance(&self, i: usize, out: &mut Mat3) -> [f64; 2] {
        let rest = self.state.rest();
        let rings = rest.rings();
        let row = rings.range(i);
        let x = self.state.positions().as_slice();
        let mut sum = [0.0; 9];
        let mut now = Vector3::zeros();
        let [mut stretch, mut size] = [0.0; 2];
        let weights = &rest.operator().row_weights()[row.clone()];
        let cotangents = &rest.row_cotangents()[row.clone()];
        for (((j, g), w), c) in rings.neighbours()[row.clone()]
            .iter()
            .zip(&self.gradients[row])
            .zip(weights)
            .zip(cotangents)
        {
            let edge = as_f64(x[j.index()] - x[i]);
            add_outer(&mut sum, &edge, g);
            now += edge * *w;
            let term = c * edge.norm_squared();
            stretch += term;
            size += term.abs();
        }
        let wanted = wanted(rest, self.field, i);
        add_outer(&mut sum, &now, &wanted.into());
        *out = scaled(sum, cell_share(rings, i));
        let flow = now.norm_squared() + wanted.norm_squared();
        [flow + self.membrane * stretch, flow + self.membrane * size]
    }
}

/// ℓ⁰ of vertex `i`, of the size that the field prescribes.
#[inline]
fn wanted<T: Scalar>(rest: &Rest<'_, T>, field: &VertexMap<T>, i: usize) -> Vector3<f64> {
    let scale = field_scale(field.as_slice()[i], rest.magnitudes().as_slice()[i]);
    as_f64(rest.laplacian().as_slice()[i] * scale)
}

/// Σ_j c_ij |x⁰_j − x⁰_i|² with c the cotangent weights, and the same of their sizes.
fn stretch<T: Scalar>(rest: &Rest<'_, T>, i: usize) -> [f64; 2] {
    let x = rest.positions().as_slice();
    let row = rest.rings().range(i);
    let neighbours = rest.rings().neighbours()[row.clone()].iter();
    neighbours
        .zip(&rest.row_cotangents()[row])
        .fold([0.0; 2], |[value, size], (j, c)| {
            let term = c * as_f64(x[j.index()] - x[i]).norm_squared();
            [value + term, size + term.abs()]
        })
}

/// (Ω a)_i.
#[inline]
fn mean(rings: &OneRings, values: &[Mat3], i: usize) -> Mat3 {
    scaled(cell_sum(rings, values, i), cell_share(rings, i))
}

#[inline]
fn scaled(m: Mat3, factor: f64) -> Mat3 {
    m.map(|x| x * factor)
}

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::torus;
    use cotan_laplacian::{Cotangent, LaplacianScheme, Operator, Tutte};

    use super::*;
    use crate::state::Measured;

    /// The energy as it is defined, P = Ω² written out, whatever the scheme.
    #[test]
    fn the_energy_is_that_of_the_wide_cells() {
        let shape = torus::<f64>(1.0, 0.4, 12, 7);
        let n = shape.positions.len();
        let schemes: [&dyn LaplacianScheme<f64>; 2] = [&Cotangent::default(), &Tutte];
        for scheme in schemes {
            let operator = Operator::assemble(scheme, &shape.surface()).unwrap();
            let rest = Rest::new(&shape.mesh, shape.positions.clone(), operator, 1.0).unwrap();
            let mut hybrid = Hybrid::new(0.3);
            let mu = hybrid.prepare(&rest);
            let bend = |p: &nalgebra::Point3<f64>| {
                nalgebra::Point3::new(p.x + p.y * p.z, p.y - 0.3 * p.x * p.x, 1.2 * p.z)
            };
            let positions = shape.positions.map(bend);
            let measured = Measured::new(&rest);
            let state = FlowState::new(&rest, &positions, &measured, 1);
            let mut out = rest.laplacian().clone();
            let field = rest.magnitudes().map(|d| 1.1 * d);
            hybrid.orient(&state, &field, &mut out).unwrap();

            let rotation = |i: usize| Matrix3::from_column_slice(&hybrid.rotations[i]);
            let rings = rest.rings();
            let omega = |j: usize, i: usize| {
                let is_near = i == j || rings.ring(j).any(|(k, _)| k.index() == i);
                if is_near { cell_share(rings, j) } else { 0.0 }
            };
            let mesh = &shape.mesh;
            let of_vertex = |j: usize, r: Matrix3<f64>| {
                let now = rest.operator().apply_at(&positions, j);
                let mut sum = (now - r * wanted(&rest, &field, j)).norm_squared();
                for face in mesh.vertex_faces(cotan_halfedge::VertexId::new(j)) {
                    for h in mesh.face_halfedges(face) {
                        let [from, to] = [mesh.origin(h), mesh.target(h)];
                        let edge = positions[to] - positions[from];
                        let original = rest.positions()[to] - rest.positions()[from];
                        let miss = (edge - r * original).norm_squared();
                        sum += mu / 6.0 * rest.cotangents()[h] * miss;
                    }
                }
                sum
            };
            let mut expected = 0.0;
            for j in 0..n {
                for i in 0..n {
                    let share: f64 = (0..n).map(|m| omega(j, m) * omega(m, i)).sum();
                    if share > 0.0 {
                        expected += share * of_vertex(j, rotation(i));
                    }
                }
            }
            assert!((hybrid.energy.value - expected).abs() < 1e-12 * hybrid.energy.size);
            let mean: Matrix3<f64> = (0..n)
                .map(|i| rotation(i) * (0..n).map(|m| omega(5, m) * omega(m, i)).sum::<f64>())
                .sum();
            assert!((mean - Matrix3::from_column_slice(&hybrid.means[5])).norm() < 1e-13);
        }
    }
}
