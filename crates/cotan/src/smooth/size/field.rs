//! The filtered curvature.

use cotan_linear::BilaplacianSystem;
use nalgebra::Vector3;

use super::rest::RestSurface;
use crate::error::Error;

/// h = A⁻¹ (D q/m): the integrated curvature q as a filtered density, twice the mean curvature
/// without the bumps, and without the ½ of the weights.
///
/// There is no division by the area of a single vertex: A⁻¹ D has the masses in it. At fixed
/// vertices, whose curvature is unknown or to be ignored, h is the mean over the free neighbours,
/// first of q/m and then of h; where pieces of the mesh meet, it is 0.
pub(super) fn filtered_curvature(
    rest: &RestSurface,
    diagonal: &[f64],
    is_fixed: &[bool],
    system: &BilaplacianSystem,
) -> Result<Vec<f64>, Error> {
    let n = rest.masses.len();
    let column = |x: f64| Vector3::new(x, 0.0, 0.0);
    let density = |i: usize| rest.curvature[i] / rest.masses[i];
    let rhs: Vec<_> = (0..n).map(|i| column(diagonal[i] * density(i))).collect();
    let mut h = vec![Vector3::zeros(); n];
    extend(rest, is_fixed, &mut h, |i| column(density(i)));
    system.solve(&rhs, &mut h, TOLERANCE)?;
    if is_fixed.contains(&true) {
        let first = h.clone();
        extend(rest, is_fixed, &mut h, |i| first[i]);
        system.solve(&rhs, &mut h, TOLERANCE)?;
    }
    Ok(h.into_iter().map(|h| h.x).collect())
}

/// Sets the values of fixed vertices to the means over their free neighbours, by mass.
fn extend(
    rest: &RestSurface,
    is_fixed: &[bool],
    h: &mut [Vector3<f64>],
    value: impl Fn(usize) -> Vector3<f64>,
) {
    let graph = rest.operator.graph();
    for i in (0..is_fixed.len()).filter(|&i| is_fixed[i]) {
        let (mut sum, mut total) = (Vector3::zeros(), 0.0);
        for (j, _) in graph.row(i) {
            let j = j.index();
            if !is_fixed[j] && !rest.is_seam[i] {
                sum += value(j) * rest.masses[j];
                total += rest.masses[j];
            }
        }
        h[i] = if total > 0.0 {
            sum / total
        } else {
            Vector3::zeros()
        };
    }
}

/// Relative to the energy norm. 1e-3 gave visibly wrong surfaces.
const TOLERANCE: f64 = 1e-6;
