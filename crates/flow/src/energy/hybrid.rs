//! Curvature flow and as-rigid-as-possible editing in one energy, over wide cells.

use cotan_geometry::{Scalar, surface_area};
use cotan_halfedge::VertexMap;
use cotan_parallel as parallel;
use nalgebra::Vector3;

use super::bodies::Bodies;
use super::hybrid_passes::{CellsAt, Fits, Tensions, Turning, stretch, wanted};
use super::struts::Struts;
use super::tied::Tied;
use super::volume::SoftVolume;
use super::{Energy, FittedCells, LocalGlobal, NextStep, Stiffness};
use crate::cells::{Means, as_f64, cell_share};
use crate::error::FlowError;
use crate::four::{IDENTITY, Mat3, flat, turned};
use crate::gradients::Gradients;
use crate::passes::{run, run_both};
use crate::rest::Rest;
use crate::start::FirstGuess;
use crate::state::FlowState;
use crate::winding::Winding;

/// Laplacian coordinates turn with rotations that minimise, together with the positions,
///
/// ```text
/// E(x, R) = Σ_i Σ_j P_ji ( |(L⁰x)_j − k_j R_i ℓ⁰_j|²
///                          + μ/6 Σ_{T at j} Σ_{e in T} cot_e |e − R_i e⁰|² )
/// ```
///
/// The first term is the flow's; the second is that of as-rigid-as-possible editing over all edges
/// of the triangles around a vertex ("spokes and rims"). P = Ω², Ω the mean over a vertex and its
/// neighbours: every rotation serves a *wide cell*, which keeps neighbouring rotations alike and
/// the surface from creasing. R_i (by a fit) and x (by the solve, whose matrix gains μK with K =
/// L/2) lower these terms in turn; every step is judged by the whole energy.
///
/// μ = 4 (area / n) / λ², with λ the bending length: details smaller than λ are kept by the flow's
/// term, shapes larger than λ by the membrane's, whatever the resolution of the mesh.
///
/// By default a body resists like a solid ([`Stiffness`]): struts of weights ν between opposite
/// walls turn with the cells at their starts, and a soft volume is added,
///
/// ```text
/// + Σ_i Σ_j P_ji ν_j |(x_j − y_j) − R_i d_j|² + κ (V − V⁰)²
/// ```
///
/// with y_j the point of the opposite wall and d_j the original strut. The matrix does not know
/// these terms.
///
/// Parts of the mesh that are tied ([`crate::FlowBuilder::ties`]) add the terms of
/// [`crate::PointTie`], which the matrix knows.
///
/// The membrane is weighted by the cotangents of the mesh, or of the triangles that the scheme has
/// itself ([`cotan_laplacian::Operator::triangles`]), and knows the original edges: it
/// resists a scheme or a scalar field that want another shape. For
/// those, take an orientation instead.
///
/// **Units**: λ is relative to twice the greatest distance of a vertex from the centroid, which is
/// about the size of the bounding box but does not depend on how the mesh is turned.
///
/// **Deviation** from the paper: ours. The reflection of the paper does not reach a fixed point on
/// detailed meshes, and rotations per vertex crease the surface; this energy converges without a
/// fold on all reference edits.
#[derive(Debug)]
pub struct Hybrid {
    bending_length: f64,
    stiffness: Stiffness,
    /// τ.
    winding: f64,
    /// τ t, with t a third of the nuclear norm of each cell's covariance at rest; empty for τ = 0.
    draws: Vec<f64>,
    /// The rotations that the fits of a wound shape are drawn to, each times τ t; empty where
    /// nothing draws.
    drawn_to: Vec<Mat3>,
    /// 6 Σ τ t.
    winding_energy: f64,
    /// The size of the body relative to the original: 1 unless one similarity moves all handles.
    size: f64,
    /// μ, once the mesh is known.
    weight: f64,
    /// Factors that turn edges into covariances and means into tensions, row after row: μ/6 g_ji
    /// and −g_ij/6 of [`Gradients`].
    fit_gradients: Vec<[f64; 3]>,
    pull_gradients: Vec<[f64; 3]>,
    /// The same factors of a vertex's own mean.
    own_gradients: Vec<[f64; 3]>,
    /// The membrane's terms of the energy that depend on the original alone.
    rest_energy: Energy,
    /// The rotations of the last fit, from which the next one starts.
    rotations: Vec<Mat3>,
    /// R̄ = P R: the mean of the rotations that serve each vertex.
    means: Vec<Mat3>,
    scratch: Vec<Mat3>,
    struts: Option<Struts>,
    volume: Option<SoftVolume>,
    tied: Option<Tied>,
    /// `true` if the volume of the next shape counts as that of the original: handles that are
    /// scaled would fight it.
    adopts_volume: bool,
}

impl Hybrid {
    /// The bending length that was found best over the reference cases.
    pub const DEFAULT_BENDING_LENGTH: f64 = 0.0175;

    /// With bending length λ = `bending_length`, relative to the size of the mesh.
    pub fn new(bending_length: f64) -> Self {
        Self {
            bending_length,
            stiffness: Stiffness::default(),
            winding: 0.0,
            draws: Vec::new(),
            drawn_to: Vec::new(),
            winding_energy: 0.0,
            size: 1.0,
            weight: 0.0,
            fit_gradients: Vec::new(),
            pull_gradients: Vec::new(),
            own_gradients: Vec::new(),
            rest_energy: Energy::default(),
            rotations: Vec::new(),
            means: Vec::new(),
            scratch: Vec::new(),
            struts: None,
            volume: None,
            tied: None,
            adopts_volume: false,
        }
    }

    /// Sets the resistance of a body beyond its surface. Default: [`Stiffness::SOLID`].
    #[must_use]
    pub fn stiffness(mut self, stiffness: Stiffness) -> Self {
        self.stiffness = stiffness;
        self
    }

    /// Draws the rotations of a shape that was wound up to those that it was wound to, by a weight
    /// τ = `weight` relative to the shape itself: turns that the energy does not hold by itself
    /// are held. At 0.3 a bar of 6 : 1 holds 540°. Default: 0, not at all.
    ///
    /// **Units**: none.
    #[must_use]
    pub fn hold_winding(mut self, weight: f64) -> Self {
        self.winding = weight;
        self
    }

    /// Predicts the bytes that the struts of a mesh take while they are found; see [`Stiffness`].
    pub fn predicted_strut_bytes(num_vertices: usize, num_triangles: usize) -> u64 {
        Struts::predicted_bytes(num_vertices, num_triangles)
    }

    /// The nuclear norms of the cells' covariances at rest: their traces, as the original is its
    /// own best fit.
    fn rest_traces<T: Scalar>(&self, rest: &Rest<T>) -> Vec<f64> {
        let (graph, x) = (rest.graph(), rest.positions().as_slice());
        let own = |i: usize| {
            let ell = as_f64(rest.laplacian().as_slice()[i]);
            let strut = self.struts.as_ref().map(|s| &s.of_vertex()[i]);
            let of_strut = strut.map_or(0.0, |s| {
                self.weight * s.weight * Vector3::from(s.rest).norm_squared()
            });
            let edges = graph.row(i).map(|(j, k)| {
                as_f64(x[j.index()] - x[i]).dot(&Vector3::from(self.fit_gradients[k]))
            });
            ell.norm_squared() + edges.sum::<f64>() + of_strut
        };
        let mut values: Vec<f64> = (0..x.len()).map(own).collect();
        for _ in 0..2 {
            let shares: Vec<f64> = (0..x.len())
                .map(|i| values[i] * cell_share(graph, i))
                .collect();
            let sum = |i: usize| {
                let row = graph.row(i).map(|(j, _)| shares[j.index()]);
                shares[i] + row.sum::<f64>()
            };
            values = (0..x.len()).map(sum).collect();
        }
        values
    }

    /// Takes the original, scaled, for the original.
    fn resize(&mut self, scale: f64) {
        self.size *= scale;
        for gradients in [
            &mut self.fit_gradients,
            &mut self.pull_gradients,
            &mut self.own_gradients,
        ] {
            for x in gradients.iter_mut().flatten() {
                *x *= scale;
            }
        }
        self.rest_energy.value *= scale * scale;
        self.rest_energy.size *= scale * scale;
        if let Some(struts) = &mut self.struts {
            struts.resize(scale);
        }
        if let Some(volume) = &mut self.volume {
            volume.resize(scale);
        }
        if let Some(tied) = &mut self.tied {
            tied.resize(scale);
        }
    }

    /// The rotations of the current state, and the energy with them.
    ///
    /// Multiplied out, E is the sum of the squares of what is and of what is wanted, less
    /// 2 Σ_i R_i : C_i, with C = Pᵀ (covariances) the sums that the fit is made by: P has rows of
    /// sum 1. So the energy costs no pass of its own.
    fn rotate<T: Scalar>(&mut self, state: &FlowState<'_, T>, field: &VertexMap<T>) -> Energy {
        let graph = &**state.rest().graph();
        let Self {
            weight,
            fit_gradients,
            rotations,
            means: spread,
            scratch,
            struts,
            tied,
            size,
            drawn_to,
            ..
        } = self;
        let cells = CellsAt {
            rest: state.rest(),
            graph,
            positions: state.positions().as_slice(),
            field: field.as_slice(),
            gradients: fit_gradients,
            membrane: 0.25 * *weight,
            struts: struts.as_ref().map_or(&[], |s| s.of_vertex()),
            is_hard: struts.as_ref().is_some_and(Struts::is_hard),
            weight: *weight,
            size: *size,
        };
        // Ωᵀ twice: a vertex hands a share to its neighbours, taken where its value is written.
        // The means of the last fit are no longer needed.
        let [mut value, mut size] =
            state.fuse_rest_laplacian(|laplacian| run_both(&cells, scratch, laplacian));
        if let Some(tied) = tied {
            let squares = tied.gather(state.positions(), graph, *weight, scratch);
            (value, size) = (value + squares, size + squares);
        }
        let values = &*scratch;
        let [] = run(&Means { graph, values }, spread);
        let values = &*spread;
        let fits = Fits {
            means: Means { graph, values },
            drawn_to,
        };
        let [cross] = run(&fits, rotations);
        let drawn = if drawn_to.is_empty() {
            0.0
        } else {
            self.winding_energy
        };
        let left = value + self.rest_energy.value + drawn - 2.0 * cross;
        Energy {
            // Not `max`, which drops a NaN: that must not pass for a low energy.
            value: if left < 0.0 { 0.0 } else { left },
            size: size + self.rest_energy.size + drawn,
        }
    }
}

impl Default for Hybrid {
    fn default() -> Self {
        Self::new(Self::DEFAULT_BENDING_LENGTH)
    }
}

impl<T: Scalar> LocalGlobal<T> for Hybrid {
    fn begin(&mut self, rest: &Rest<T>) -> Result<f64, FlowError> {
        self.stiffness.check()?;
        if !(self.winding >= 0.0 && self.winding <= 1000.0) {
            return Err(FlowError::Setting {
                setting: "weight by which a winding is held",
                range: "between 0 and 1000",
                value: self.winding,
            });
        }
        if !(self.bending_length > 0.0) {
            return Err(FlowError::Setting {
                setting: "bending length",
                range: "above 0",
                value: self.bending_length,
            });
        }
        let n = rest.positions().len();
        let vertex_area = surface_area(&rest.surface()).as_f64() / n as f64;
        // Of the size of L², whatever the scheme: 1 for cotangent weights.
        let scale = rest.operator().mean_diagonal() / rest.mean_cotangent_diagonal();
        let length = self.bending_length * rest.extent();
        self.weight = 4.0 * vertex_area * (scale / length).powi(2);
        let gradients = Gradients::new(rest);
        self.fit_gradients = gradients.of_neighbours(self.weight / 6.0);
        self.pull_gradients = gradients.of_rows(PULL);
        self.own_gradients = gradients.of_own(rest.graph(), &self.pull_gradients, PULL);
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
        let Stiffness { struts, volume, .. } = self.stiffness;
        if struts > 0.0 || volume > 0.0 {
            let bodies = Bodies::new(rest);
            self.struts = (struts > 0.0)
                .then(|| Struts::new(rest, &bodies, struts, self.weight))
                .filter(|struts| !struts.is_empty());
            self.volume = (volume > 0.0)
                .then(|| SoftVolume::new(rest, &bodies, volume))
                .filter(|volume| !volume.is_empty());
        } else {
            (self.struts, self.volume) = (None, None);
        }
        self.tied = Tied::new(rest);
        (self.draws, self.drawn_to) = (Vec::new(), Vec::new());
        if self.winding > 0.0 {
            let third = self.winding / 3.0;
            self.draws = self.rest_traces(rest);
            self.draws.iter_mut().for_each(|t| *t *= third);
            // 2 τ t (3 − R : R̃), of which the fits take the second part.
            self.winding_energy = self.draws.iter().map(|t| 6.0 * t).sum();
        }
        let of_struts = self.struts.as_ref().map_or(0.0, |s| s.rest_energy);
        self.rest_energy.value += of_struts;
        self.rest_energy.size += of_struts;
        Ok(self.weight)
    }

    fn point_radius(&self, rest: &Rest<T>) -> f64 {
        self.stiffness.point_radius * self.bending_length * rest.extent()
    }

    fn start_from(&mut self, guess: &FirstGuess) {
        self.rotations = guess.rotations.values().map(flat).collect();
        self.means.clone_from(&self.rotations);
        if guess.scale != 1.0 {
            self.resize(guess.scale);
        }
        if let Some(tied) = &mut self.tied {
            tied.pull_at_rest(&self.means);
        }
        if let Some(swelling) = &guess.swelling {
            for (mean, scale) in self.means.iter_mut().zip(swelling.values()) {
                *mean = mean.map(|x| x * scale);
            }
            self.adopts_volume = true;
        }
    }

    fn wind(&mut self, winding: Option<&Winding>) {
        if let Some(struts) = &mut self.struts {
            match winding {
                Some(_) => struts.harden(),
                None => struts.soften(),
            }
        }
        self.drawn_to.clear();
        if let Some(winding) = winding {
            let rotations = winding.rotations.values();
            let drawn = self.draws.iter().zip(rotations);
            self.drawn_to
                .extend(drawn.map(|(t, rotation)| flat(rotation).map(|x| x * t)));
        }
    }

    fn fit(
        &mut self,
        state: &FlowState<'_, T>,
        field: &VertexMap<T>,
        out: &mut VertexMap<Vector3<T>>,
    ) -> Result<Energy, FlowError> {
        let mut energy = self.rotate(state, field);
        let (rest, graph) = (state.rest(), &**state.rest().graph());
        let values = &self.rotations;
        let [] = run(&Means { graph, values }, &mut self.scratch);
        let turning = Turning {
            means: Means {
                graph,
                values: &self.scratch,
            },
            rest,
            field: field.as_slice(),
            size: self.size,
        };
        let [] = run_both(&turning, &mut self.means, out.as_mut_slice());
        if let Some(tied) = &mut self.tied {
            let size = self.size;
            tied.mix(&mut self.means, |i, mean| {
                let [x, y, z] = turned(mean, &wanted(rest, field.as_slice(), i, size)).vector();
                out.as_mut_slice()[i] = Vector3::new(T::of_f64(x), T::of_f64(y), T::of_f64(z));
            });
            tied.pull(state.positions(), &self.means);
        }
        if let Some(struts) = &mut self.struts {
            struts.pull(state.positions(), &self.means);
        }
        if let Some(volume) = &mut self.volume {
            let mut of_volume = volume.measure(rest, state.positions());
            if std::mem::take(&mut self.adopts_volume) && volume.adopt() {
                of_volume = volume.measure(rest, state.positions());
            }
            energy.value += self.weight * of_volume.value;
            energy.size += self.weight * of_volume.size;
        }
        Ok(energy)
    }

    fn cells(&self) -> Option<FittedCells<'_>> {
        Some(FittedCells {
            rotations: &self.rotations,
            gradients: &self.fit_gradients,
            weight: self.weight,
            size: self.size,
            struts: self.struts.as_ref().map_or(&[], Struts::of_vertex),
        })
    }

    fn wanted_tension(&self, rest: &Rest<T>, next: NextStep, out: &mut VertexMap<Vector3<f64>>) {
        // Every triangle wants its original edges turned by the mean of its corners' means.
        // Gathered at a vertex: a third of each neighbour's for the two triangles at their edge,
        // and of its own for all triangles, each of which lies at two edges.
        let tensions = Tensions {
            graph: rest.graph(),
            gradients: &self.pull_gradients,
            own: &self.own_gradients,
            means: &self.means,
        };
        let [] = run(&tensions, out.as_mut_slice());
        if let Some(tied) = &self.tied {
            tied.add_forces(out);
        }
        if self.struts.is_some() || self.volume.is_some() {
            let of_volume = match next {
                NextStep::Searched => 1.0,
                NextStep::Taken => 1.0 / (1.0 + BREATHING * self.stiffness.volume),
            };
            parallel::update(out.as_mut_slice(), |i, tension| {
                if let Some(struts) = &self.struts {
                    *tension += struts.force_at(i);
                }
                if let Some(volume) = &self.volume {
                    *tension += volume.force_at(rest.fans(), i) * of_volume;
                }
            });
        }
    }
}

/// The factor of g_ij: each of three corners turns half of the gradient of a triangle's energy.
const PULL: f64 = -1.0 / 6.0;

/// κ gᵀA⁻¹g over γ, with g the gradient of the volume: by so much more than the membrane a volume
/// of weight 1 resists that a body breathes. It is 4.5 for a ball and 4 for a long rod. A step
/// that is taken as it is would go too far by this.
const BREATHING: f64 = 4.5;

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::torus;
    use cotan_laplacian::{Cotangent, Tutte};

    use nalgebra::Matrix3;

    use super::*;
    use crate::current::Current;

    /// The energy as it is defined, P = Ω² written out, whatever the scheme.
    #[test]
    fn the_energy_is_that_of_the_wide_cells() {
        let shape = torus::<f64>(1.0, 0.4, 12, 7);
        let n = shape.positions().len();
        let rests = [
            Rest::new(
                shape.connectivity(),
                shape.positions(),
                Cotangent::default(),
            ),
            Rest::new(shape.connectivity(), shape.positions(), Tutte),
        ];
        for rest in rests.map(Result::unwrap) {
            let mut hybrid = Hybrid::new(0.3).stiffness(Stiffness::THIN);
            let mu = hybrid.begin(&rest).unwrap();
            let bend = |p: &nalgebra::Point3<f64>| {
                nalgebra::Point3::new(p.x + p.y * p.z, p.y - 0.3 * p.x * p.x, 1.2 * p.z)
            };
            let positions = rest.positions().map(bend);
            let current = Current::new(positions.clone());
            let state = FlowState::new(&rest, &current, 1, None);
            let mut out = rest.laplacian().clone();
            let field = rest.magnitudes().map(|d| 1.1 * d);
            let energy = hybrid.fit(&state, &field, &mut out).unwrap();

            let rotation = |i: usize| Matrix3::from_column_slice(&hybrid.rotations[i]);
            let graph = &**rest.graph();
            let omega = |j: usize, i: usize| {
                let is_near = i == j || graph.row(j).any(|(k, _)| k.index() == i);
                if is_near { cell_share(graph, j) } else { 0.0 }
            };
            let mesh = shape.connectivity();
            let of_vertex = |j: usize, r: Matrix3<f64>| {
                let now = rest.operator().apply_at(&positions, j);
                let mut sum = (now - r * Vector3::from(wanted(&rest, field.as_slice(), j, 1.0)))
                    .norm_squared();
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
            assert!((energy.value - expected).abs() < 1e-12 * energy.size);
            let mean: Matrix3<f64> = (0..n)
                .map(|i| rotation(i) * (0..n).map(|m| omega(5, m) * omega(m, i)).sum::<f64>())
                .sum();
            assert!((mean - Matrix3::from_column_slice(&hybrid.means[5])).norm() < 1e-13);
        }
    }
}
