//! Conformalized mean-curvature flow, for comparison.

use std::ops::ControlFlow;

use cotan_flow::{Report, StepReport, StopReason};
use cotan_geometry::{Positions, Surface};
use cotan_halfedge::{HalfedgeMesh, VertexMap};
use cotan_laplacian::Operator;
use cotan_linear::LinearSystem;
use nalgebra::{Point3, Vector3};

use super::error::SphereError;
use super::iterate::{Iterated, Observer};
use super::options::SphereOptions;
use super::round::{normalized, sphere_centre};
use super::sums;

/// Time step on a surface of area 1.
const TIME_STEP: f64 = 0.1;

/// A mass below this fraction of the mean would be lost next to the stiffness.
const MIN_MASS: f64 = 1e-14;

/// Implicit mean-curvature flow in which the stiffness remains that of the original mesh while
/// the masses follow the surface:
///
/// ```text
/// (D_t − δ L⁰/2) X_{t+1} = D_t X_t,    D_t lumped masses of X_t, area 1 after every step
/// ```
///
/// Each step factorizes new values in a pattern that is analysed once. The flow stops when no
/// vertex moves by more than the tolerance (in radii), which is ten times that of the other
/// methods because the flow keeps shrinking existing features. The result is projected radially.
///
/// **Source**: Kazhdan, Solomon, Ben-Chen, "Can Mean-Curvature Flow Be Made Non-Singular?", 2012.
pub(crate) fn cmcf(
    mesh: &HalfedgeMesh,
    source: &Positions<f64>,
    options: &SphereOptions,
    observer: Observer<'_>,
) -> Result<Iterated, SphereError> {
    let scheme = options.scheme.symmetric_scheme();
    let size = Surface::new(mesh, source)?.bounding_box().longest_side();
    let mut x = source.map(|p| p / size);
    normalise(mesh, &mut x);
    let operator = Operator::assemble(&*scheme, &Surface::assume_checked(mesh, &x))?;
    let mut system: Option<LinearSystem> = None;
    let mut report = Report::default();
    let tolerance = 10.0 * options.tolerance;
    while report.iterations < options.iteration_limit {
        let masses = masses(mesh, &x);
        match &mut system {
            None => {
                let within = options.max_memory;
                let screened = LinearSystem::screened_within(&operator, &masses, &[], within)?;
                system = Some(screened);
            }
            Some(system) => system.set_diagonal(&masses)?,
        }
        let mut next = VertexMap::from_fn(x.len(), |v| x[v].coords * masses[v.index()]);
        if let Some(system) = &system {
            system.solve_in_place(&mut next);
        }
        let mut next = next.map(|p| Point3::from(*p));
        normalise(mesh, &mut next);
        // Radius of a sphere of area 1.
        let radius = (0.25 / std::f64::consts::PI).sqrt();
        report.change =
            sums::max(x.len(), |i| (x.as_slice()[i] - next.as_slice()[i]).norm()) / radius;
        report.residual = report.change;
        report.iterations += 1;
        x = next;
        let step = StepReport::new(report.iterations, report.change);
        if !report.change.is_finite() {
            report.stop = StopReason::Diverged;
            break;
        }
        if report.change < tolerance {
            report.stop = StopReason::Converged;
            break;
        }
        if observer(&step) == ControlFlow::Break(()) {
            report.stop = StopReason::Cancelled;
            break;
        }
    }
    let centre = sphere_centre(x.as_slice());
    let positions = x.map(|p| Point3::from(normalized(p.coords - centre)));
    let factorizations = report.iterations;
    Ok(Iterated {
        positions,
        report,
        factorizations,
    })
}

/// 2 D / δ, which matches the scale of L: the paper's weights lack the factor ½.
fn masses(mesh: &HalfedgeMesh, x: &Positions<f64>) -> Vec<f64> {
    let areas = Surface::assume_checked(mesh, x).one_ring_areas();
    let least = MIN_MASS / areas.len() as f64;
    areas
        .values()
        .map(|a| 2.0 * (a / 3.0).max(least) / TIME_STEP)
        .collect()
}

/// Centres the positions by area and scales the surface to area 1.
fn normalise(mesh: &HalfedgeMesh, x: &mut Positions<f64>) {
    let areas = Surface::assume_checked(mesh, x).one_ring_areas();
    let (a, p) = (areas.as_slice(), x.as_slice());
    let total = sums::sum(p.len(), |i| a[i]);
    let mean: Vector3<f64> = sums::sum(p.len(), |i| p[i].coords * a[i]) / total;
    let scale = (3.0 / total).sqrt();
    x.values_mut()
        .for_each(|p| p.coords = (p.coords - mean) * scale);
}
