//! The projections that keep a flow to the sphere from drifting.

use cotan_flow::{FlowError, Projection, Rest, nearest_rotation};
use cotan_geometry::Positions;
use cotan_halfedge::HalfedgeMesh;
use cotan_parallel as parallel;
use nalgebra::{Matrix3, Point3, Vector3};

use super::curvature::energy;
use super::round::{sphere_centre, to_sphere};
use super::sums;

/// E of a conformal map to the unit sphere.
const SPHERE_ENERGY: f64 = 16.0 * std::f64::consts::PI;

/// Keeps the place and the size alone: centred by the source areas, E = 16π. What the paper's own
/// iteration needs to stay finite.
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

/// The robust variant: free steps of ratio 0.85 of fixed size until the surface is nearly a sphere;
/// from then on every step is carried back onto the unit sphere, Möbius-centred by the source
/// areas, and turned onto the one before. That removes the modes of which the plain iteration
/// drifts or oscillates, and full steps contract by a third.
///
/// **Source**: paper, section 4.1, for the iteration; the projection is ours.
#[derive(Debug)]
pub(crate) struct RobustProjection {
    weights: Vec<f64>,
    /// Ratio of the greatest to the least distance from the centre at which the surface counts as
    /// nearly a sphere.
    near: f64,
    /// Step ratio on the sphere.
    ratio: f64,
    stage: Stage,
}

#[derive(Debug)]
enum Stage {
    Free,
    OnSphere {
        /// The free shape before it was projected, to go back to if the map is lost.
        back: Positions<f64>,
        steps: usize,
        last: f64,
    },
}

/// Share of the unit ball that a map has to enclose.
const LEAST_VOLUME: f64 = 0.1 * 4.0 / 3.0 * std::f64::consts::PI;

/// Step ratio of the free stage: the best constant one is 6/7.
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

    /// Goes over to the sphere if the shape is near enough to one.
    fn try_sphere(&mut self, mesh: &HalfedgeMesh, positions: &mut Positions<f64>) {
        if spread(positions.as_slice()) >= self.near {
            return;
        }
        let mut on_sphere = positions.clone();
        to_sphere(on_sphere.as_mut_slice(), &self.weights);
        if volume(mesh, &on_sphere) > LEAST_VOLUME {
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
        if volume(mesh, next) < LEAST_VOLUME {
            // The map is lost: nearer to a sphere first.
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

/// The areas around the vertices of the original mesh, over their sum.
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
    let scale = (SPHERE_ENERGY / energy(rest.mesh(), rest.halfedge_weights(), positions)).sqrt();
    if !(scale.is_finite() && scale > 0.0) {
        return Err(FlowError::Collapsed);
    }
    for p in positions.values_mut() {
        *p = Point3::from((p.coords - mean) * scale);
    }
    Ok(())
}

/// Greatest over least distance from the least-squares centre.
fn spread(x: &[Point3<f64>]) -> f64 {
    let centre = sphere_centre(x);
    let distances = x.iter().map(|p| (p.coords - centre).norm());
    let (least, most) = distances.fold((f64::INFINITY, 0.0f64), |(a, b), d| (a.min(d), b.max(d)));
    most / least
}

/// The enclosed volume of a mesh about the origin.
fn volume(mesh: &HalfedgeMesh, positions: &Positions<f64>) -> f64 {
    let at = |f: usize| {
        let [a, b, c] = mesh
            .triangle(cotan_halfedge::FaceId::new(f))
            .map(|v| positions[v].coords);
        a.dot(&(b - a).cross(&(c - a)))
    };
    sums::sum(mesh.num_faces(), at) / 6.0
}

/// next ← (1 − s) before + s next, with `next` brought to the size and place of the unit sphere.
fn mix(before: &Positions<f64>, next: &mut Positions<f64>, ratio: f64) {
    let centre = sphere_centre(next.as_slice());
    let y = next.as_slice();
    let radius = sums::sum(y.len(), |i| (y[i].coords - centre).norm()) / y.len() as f64;
    for (y, x) in next.values_mut().zip(before.values()) {
        y.coords = x.coords * (1.0 - ratio) + (y.coords - centre) * (ratio / radius);
    }
}

/// Turns z so that Σ w |R z − x|² is least.
fn turn_onto(x: &[Point3<f64>], z: &mut [Point3<f64>], weights: &[f64]) {
    // Column by column, since a sum of vectors is at hand.
    let column = |axis: usize| {
        sums::sum(x.len(), |i| -> Vector3<f64> {
            x[i].coords * (weights[i] * z[i][axis])
        })
    };
    let covariance = Matrix3::from_columns(&[column(0), column(1), column(2)]);
    let rotation = nearest_rotation(&covariance);
    parallel::update(z, |_, p| *p = rotation * *p);
}
