//! Face normal filter: total variation that preserves creases.

use cotan_geometry::{Scalar, Surface, unit_or_zero};
use cotan_halfedge::{EdgeId, EdgeMap, FaceId, FaceMap, HalfedgeMesh};
use nalgebra::Vector3;

use super::parallel::{fill_each, filled};

/// Unit normals m of the faces that are close to those of a noisy surface and vary little across
/// its edges:
///
/// ```text
/// minimise  Σ_f ½ A_f |m_f − n_f|² + β Σ_e ω_e |e| |m_l − m_r|        |m_f| = 1
/// ```
///
/// with areas and lengths relative to their means. Total variation flattens noise and preserves
/// jumps. The weights start at 1 and are then set to ω = 1/√(1 + |m_l − m_r|²/c²) three times,
/// which releases the jumps that turn out to be creases. Solved by a primal-dual iteration
/// without a linear system; each step is one loop over edges and one over faces.
///
/// **Shapes**: one normal per face. Boundary edges are ignored; faces without area take the
/// normal of their neighbours.
///
/// **Source**: total variation of normals: Zhang, Wu, Zhang, Deng 2015; the iteration: Chambolle,
/// Pock 2011; reweighting: Candès, Wakin, Boyd 2008. The constants are ours: they were
/// chosen on models with added noise, by the distance to the original.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct NormalFilter {
    /// β, dimensionless: about three times the noise in mean edge lengths.
    pub strength: f64,
    /// c, dimensionless (a difference of unit vectors, so roughly an angle in radians). Smaller
    /// jumps are treated as noise.
    pub crease: f64,
    /// The number of times that the crease weights are updated.
    pub reweightings: usize,
    /// The number of primal-dual steps between two weight updates.
    pub steps: usize,
}

impl NormalFilter {
    /// The filter for a mesh with this noise, in mean edge lengths ([`super::NoiseEstimate`]).
    pub fn for_noise(noise: f64) -> Self {
        Self {
            strength: 3.0 * noise,
            crease: 0.35,
            reweightings: 3,
            steps: 60,
        }
    }

    /// Computes the filtered normals of a surface.
    pub fn filter<T: Scalar>(&self, surface: &Surface<'_, T>) -> FaceMap<Vector3<f64>> {
        let mesh = surface.mesh();
        let noisy = surface.face_normals().map(|n| n.map(T::as_f64));
        let fidelity = over_mean(&surface.face_areas().map(|a| a.as_f64()));
        let lengths = over_mean(&surface.edge_lengths().map(|l| l.as_f64()));
        let mut bounds = lengths.map(|l| self.strength * l);
        let mut solver = PrimalDual::new(mesh, &noisy, &fidelity);
        solver.run(&bounds, self.steps);
        for _ in 0..self.reweightings {
            fill_each(&mut bounds, |e: EdgeId| {
                let jump = jump(mesh, &solver.normals, e).norm() / self.crease;
                self.strength * lengths[e] / (1.0 + jump * jump).sqrt()
            });
            solver.run(&bounds, self.steps);
        }
        solver.normals
    }
}

/// The iteration of Chambolle and Pock, with normals m and a dual variable p per edge (its
/// tension), whose length is at most β ω |e|.
struct PrimalDual<'a> {
    mesh: &'a HalfedgeMesh,
    noisy: &'a FaceMap<Vector3<f64>>,
    fidelity: &'a FaceMap<f64>,
    normals: FaceMap<Vector3<f64>>,
    /// The extrapolated normals: 2 m minus the previous m.
    ahead: FaceMap<Vector3<f64>>,
    tensions: EdgeMap<Vector3<f64>>,
}

/// Step sizes: a face has three edges, an edge has two faces (Pock and Chambolle 2011).
const PRIMAL: f64 = 1.0 / 3.0;
const DUAL: f64 = 0.5;

impl<'a> PrimalDual<'a> {
    fn new(
        mesh: &'a HalfedgeMesh,
        noisy: &'a FaceMap<Vector3<f64>>,
        fidelity: &'a FaceMap<f64>,
    ) -> Self {
        Self {
            mesh,
            noisy,
            fidelity,
            normals: noisy.clone(),
            ahead: noisy.clone(),
            tensions: EdgeMap::filled(mesh.num_edges(), Vector3::zeros()),
        }
    }

    fn run(&mut self, bounds: &EdgeMap<f64>, steps: usize) {
        self.ahead.clone_from(&self.normals);
        for _ in 0..steps {
            self.tension_step(bounds);
            self.normal_step();
        }
    }

    /// p ← p + σ (m̄_l − m̄_r), shortened to its bound.
    fn tension_step(&mut self, bounds: &EdgeMap<f64>) {
        let (mesh, ahead, before) = (self.mesh, &self.ahead, &self.tensions);
        self.tensions = filled(mesh.num_edges(), |e: EdgeId| {
            let pulled = before[e] + jump(mesh, ahead, e) * DUAL;
            let (length, bound) = (pulled.norm(), bounds[e]);
            if length > bound {
                pulled * (bound / length)
            } else {
                pulled
            }
        });
    }

    /// m ← the unit vector along (m − τ ∇p + τ A n) / (1 + τ A).
    fn normal_step(&mut self) {
        let (mesh, before) = (self.mesh, &self.normals);
        let (tensions, noisy, fidelity) = (&self.tensions, self.noisy, self.fidelity);
        let normals: FaceMap<Vector3<f64>> = filled(mesh.num_faces(), |f: FaceId| {
            let mut pull = Vector3::zeros();
            for h in mesh.face_halfedges(f) {
                let tension = tensions[h.edge()];
                if h == h.edge().halfedge() {
                    pull += tension;
                } else {
                    pull -= tension;
                }
            }
            let toward = noisy[f] * fidelity[f] - pull;
            unit_or_zero(&(before[f] + toward * PRIMAL))
        });
        self.ahead = filled(mesh.num_faces(), |f: FaceId| normals[f] * 2.0 - before[f]);
        self.normals = normals;
    }
}

/// m_left − m_right; 0 on the boundary.
fn jump(mesh: &HalfedgeMesh, normals: &FaceMap<Vector3<f64>>, e: EdgeId) -> Vector3<f64> {
    let [h, twin] = e.halfedges();
    match (mesh.face(h), mesh.face(twin)) {
        (Some(left), Some(right)) => normals[left] - normals[right],
        _ => Vector3::zeros(),
    }
}

/// Values divided by their mean, or unchanged if the mean is 0.
fn over_mean<I: cotan_halfedge::Id>(
    values: &cotan_halfedge::DenseMap<I, f64>,
) -> cotan_halfedge::DenseMap<I, f64> {
    let mean = values.values().sum::<f64>() / values.len().max(1) as f64;
    values.map(|x| if mean > 0.0 { x / mean } else { *x })
}
