//! The projections that keep a spherical flow from drifting.

use cotan_flow::{FlowError, Projection, Rest, nearest_rotation};
use cotan_geometry::Positions;
use cotan_halfedge::HalfedgeMesh;
use cotan_parallel as parallel;
use nalgebra::{Matrix3, Point3, Vector3};

use super::curvature::energy;
use super::round::{sphere_centre, to_sphere};
use super::sums;

/// The energy E of a conformal map to the unit sphere.
const SPHERE_ENERGY: f64 = 16.0 * std::f64::consts::PI;

/// Fixes only position and size: centred by the source areas, with E = 16π. The paper's iteration
/// needs this to stay finite.
#[derive(Debug, Default)]
pub(crate) struct KeepSize {
    weights: Vec<f64>,
}

impl Projection<f64> for KeepSize {
    fn start(&mut self, rest: &Rest<f64>, positions: &mut Positions<f64>) -> Result<(), FlowError> {
        self.weights = source_weights(rest);
        keep_size(rest, &self.weights, positions)
    }

    fn project(
        &mut self,
        rest: &Rest<f64>,
        before: &Positions<f64>,
        next: &mut Positions<f64>,
    ) -> Result<f64, FlowError> {
        keep_size(rest, &self.weights, next)?;
        let (a, b) = (before.as_slice(), next.as_slice());
        Ok(sums::max(a.len(), |i| (a[i] - b[i]).norm()))
    }
}

/// The robust variant. Free steps with ratio 0.85 at fixed size are taken until the surface is
/// nearly a sphere. From then on each step is projected back onto the unit sphere, Möbius-centred
/// by the source areas, and rotated to match the previous step. This removes the modes in which
/// the plain iteration drifts or oscillates, and full steps then contract by a third.
///
/// **Source**: paper, section 4.1, for the iteration; the projection is ours.
#[derive(Debug)]
pub(crate) struct RobustProjection {
    weights: Vec<f64>,
    /// The ratio of the largest to the smallest distance from the centre below which the surface
    /// counts as nearly a sphere.
    near: f64,
    /// The step ratio on the sphere.
    ratio: f64,
    stage: Stage,
}

#[derive(Debug)]
enum Stage {
    Free,
    OnSphere {
        /// The free shape before it was projected, restored if the map is lost.
        back: Positions<f64>,
        steps: usize,
        last: f64,
    },
}

/// The minimum enclosed volume of a map: a tenth of the unit ball.
const MIN_VOLUME: f64 = 0.1 * 4.0 / 3.0 * std::f64::consts::PI;

/// The step ratio of the free stage; the best constant ratio is 6/7.
const FREE_RATIO: f64 = 0.85;

impl RobustProjection {
    pub(crate) fn new() -> Self {
        Self {
            weights: Vec::new(),
            near: 1.6,
            ratio: 1.0,
            stage: Stage::Free,
        }
    }

    /// Switches to the sphere if the shape is close enough to one.
    fn try_sphere(&mut self, mesh: &HalfedgeMesh, positions: &mut Positions<f64>) {
        if spread(positions.as_slice()) >= self.near {
            return;
        }
        let mut on_sphere = positions.clone();
        to_sphere(on_sphere.as_mut_slice(), &self.weights);
        if volume(mesh, &on_sphere) > MIN_VOLUME {
            let back = std::mem::replace(positions, on_sphere);
            self.stage = Stage::OnSphere {
                back,
                steps: 0,
                last: f64::INFINITY,
            };
        }
    }

    /// A step on the sphere.
    fn step(
        &mut self,
        mesh: &HalfedgeMesh,
        before: &Positions<f64>,
        next: &mut Positions<f64>,
    ) -> f64 {
        if self.ratio < 1.0 {
            mix(before, next, self.ratio);
        }
        to_sphere(next.as_mut_slice(), &self.weights);
        turn_onto(before.as_slice(), next.as_mut_slice(), &self.weights);
        let (a, b) = (before.as_slice(), next.as_slice());
        let change = sums::max(a.len(), |i| (a[i] - b[i]).amax());
        let Stage::OnSphere { back, steps, last } = &mut self.stage else {
            return f64::INFINITY;
        };
        if volume(mesh, next) < MIN_VOLUME {
            // The map is lost, so the shape has to come closer to a sphere first.
            next.as_mut_slice().copy_from_slice(back.as_slice());
            self.near = 1.0 + (self.near - 1.0) / 2.0;
            self.stage = Stage::Free;
            return f64::INFINITY;
        }
        if *steps > 8 && change > 0.7 * *last {
            self.ratio = (0.9 * self.ratio).max(0.5);
        }
        *steps += 1;
        *last = change;
        change
    }
}

impl Projection<f64> for RobustProjection {
    fn start(&mut self, rest: &Rest<f64>, positions: &mut Positions<f64>) -> Result<(), FlowError> {
        self.weights = source_weights(rest);
        keep_size(rest, &self.weights, positions)?;
        self.try_sphere(rest.mesh(), positions);
        Ok(())
    }

    fn project(
        &mut self,
        rest: &Rest<f64>,
        before: &Positions<f64>,
        next: &mut Positions<f64>,
    ) -> Result<f64, FlowError> {
        if let Stage::OnSphere { .. } = self.stage {
            return Ok(self.step(rest.mesh(), before, next));
        }
        for (y, x) in next.values_mut().zip(before.values()) {
            *y = x + (*y - x) * FREE_RATIO;
        }
        keep_size(rest, &self.weights, next)?;
        self.try_sphere(rest.mesh(), next);
        Ok(f64::INFINITY)
    }
}

/// The areas around the vertices of the original mesh, normalized to sum 1.
fn source_weights(rest: &Rest<f64>) -> Vec<f64> {
    let areas = rest.areas().as_slice();
    let total = sums::sum(areas.len(), |i| areas[i]);
    areas.iter().map(|a| a / total).collect()
}

/// Centres by the weights and scales to E = 16π.
fn keep_size(
    rest: &Rest<f64>,
    weights: &[f64],
    positions: &mut Positions<f64>,
) -> Result<(), FlowError> {
    let x = positions.as_slice();
    let mean = sums::sum(x.len(), |i| x[i].coords * weights[i]);
    let scale = (SPHERE_ENERGY / energy(rest.operator(), positions)).sqrt();
    if !(scale.is_finite() && scale > 0.0) {
        return Err(FlowError::Collapsed);
    }
    for p in positions.values_mut() {
        *p = Point3::from((p.coords - mean) * scale);
    }
    Ok(())
}

/// Ratio of the largest to the smallest distance from the least-squares centre.
fn spread(x: &[Point3<f64>]) -> f64 {
    let centre = sphere_centre(x);
    let distances = x.iter().map(|p| (p.coords - centre).norm());
    let (least, most) = distances.fold((f64::INFINITY, 0.0f64), |(a, b), d| (a.min(d), b.max(d)));
    most / least
}

/// The enclosed volume of a mesh, relative to the origin.
fn volume(mesh: &HalfedgeMesh, positions: &Positions<f64>) -> f64 {
    let at = |f: usize| {
        let [a, b, c] = mesh
            .triangle(cotan_halfedge::FaceId::new(f))
            .map(|v| positions[v].coords);
        a.dot(&(b - a).cross(&(c - a)))
    };
    sums::sum(mesh.num_faces(), at) / 6.0
}

/// next ← (1 − s) before + s next, where `next` is first moved and scaled to the unit sphere.
fn mix(before: &Positions<f64>, next: &mut Positions<f64>, ratio: f64) {
    let centre = sphere_centre(next.as_slice());
    let y = next.as_slice();
    let radius = sums::sum(y.len(), |i| (y[i].coords - centre).norm()) / y.len() as f64;
    for (y, x) in next.values_mut().zip(before.values()) {
        y.coords = x.coords * (1.0 - ratio) + (y.coords - centre) * (ratio / radius);
    }
}

/// Rotates z so that Σ w |R z − x|² is minimal.
fn turn_onto(x: &[Point3<f64>], z: &mut [Point3<f64>], weights: &[f64]) {
    // Computed column by column, because a sum of vectors is available.
    let column = |axis: usize| {
        sums::sum(x.len(), |i| -> Vector3<f64> {
            x[i].coords * (weights[i] * z[i][axis])
        })
    };
    let covariance = Matrix3::from_columns(&[column(0), column(1), column(2)]);
    let rotation = nearest_rotation(&covariance);
    parallel::update(z, |_, p| *p = rotation * *p);
}
