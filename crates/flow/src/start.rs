//! Rotations of the handle regions, spread over the mesh: a first guess of all rotations.

use cotan_geometry::Scalar;
use cotan_halfedge::VertexMap;
use cotan_linear::{Defect, Handle};
use nalgebra::{Matrix3, Point3, Rotation3, Vector3};

use crate::error::FlowError;
use crate::nearest_rotation::nearest_rotation;
use crate::rest::Rest;
use crate::vectors::add_scaled;
use crate::workspace::Workspace;

/// The rotation vectors of the handle regions, spread over the mesh by the system itself; `None`
/// if no region is turned.
pub(crate) fn interpolated_rotations<T: Scalar>(
    work: &mut Workspace<T>,
) -> Result<Option<VertexMap<Matrix3<f64>>>, FlowError> {
    let (rest, targets) = (&*work.rest, &work.targets);
    let at_handles = handle_rotations(rest, targets.handles(), targets.in_box());
    if at_handles.iter().all(|w| w.norm() < 1e-12) {
        return Ok(None);
    }
    let n = rest.positions().len();
    let mut turn = VertexMap::filled(n, Vector3::zeros());
    for (handle, w) in targets.handles().iter().zip(at_handles) {
        turn[handle.vertex] = w;
    }
    // The smoothest field with these values: mismatch 0 − Lω, tension Σ s (ω_j − ω_i).
    let terms = &mut work.terms;
    let mut membrane = VertexMap::filled(n, Vector3::zeros());
    for i in 0..n {
        let (mut ell, mut tension) = (Vector3::zeros(), Vector3::zeros());
        let at = turn.as_slice();
        for (j, k) in rest.graph().row(i) {
            let step = at[j.index()] - at[i];
            ell -= step * rest.operator().weights()[k];
            tension += step * (0.5 * rest.membrane_weights()[k]);
        }
        terms.mismatch.as_mut_slice()[i] = ell;
        membrane.as_mut_slice()[i] = tension;
    }
    let defect = Defect::of_laplacian(&terms.mismatch).with_tension(&membrane);
    work.system.correct(&defect, &mut terms.correction)?;
    add_scaled(turn.as_mut_slice(), 1.0, terms.correction.as_slice());
    Ok(Some(turn.map(|w| Rotation3::new(*w).into_inner())))
}

/// The rotation vector (axis times angle in radians) of every handle vertex: that of its connected
/// region of handle vertices, by Kabsch's method; zero for a region that does not determine one.
fn handle_rotations<T: Scalar>(
    rest: &Rest<T>,
    handles: &[Handle],
    targets: &[Point3<T>],
) -> Vec<Vector3<f64>> {
    let mut handle_of = vec![None; rest.positions().len()];
    for (index, handle) in handles.iter().enumerate() {
        handle_of[handle.vertex.index()] = Some(index);
    }
    let mut rotations = vec![Vector3::zeros(); handles.len()];
    let mut is_done = vec![false; handles.len()];
    for start in 0..handles.len() {
        if is_done[start] {
            continue;
        }
        let region = region(rest, handles, &handle_of, start, &mut is_done);
        let rotation = fit(rest, handles, targets, &region);
        for index in region {
            rotations[index] = rotation;
        }
    }
    rotations
}

/// The handles that are connected to handle `start` through handles.
fn region<T: Scalar>(
    rest: &Rest<T>,
    handles: &[Handle],
    handle_of: &[Option<usize>],
    start: usize,
    is_done: &mut [bool],
) -> Vec<usize> {
    let mut region = vec![start];
    is_done[start] = true;
    let mut next = 0;
    while next < region.len() {
        let vertex = handles[region[next]].vertex;
        next += 1;
        for (j, _) in rest.graph().row(vertex.index()) {
            if let Some(index) = handle_of[j.index()]
                && !std::mem::replace(&mut is_done[index], true)
            {
                region.push(index);
            }
        }
    }
    region
}

/// The rotation that carries the region's original positions onto its targets best.
fn fit<T: Scalar>(
    rest: &Rest<T>,
    handles: &[Handle],
    targets: &[Point3<T>],
    region: &[usize],
) -> Vector3<f64> {
    let before = |k: usize| rest.positions()[handles[k].vertex].map(T::as_f64).coords;
    let after = |k: usize| targets[k].map(T::as_f64).coords;
    let mean = |f: &dyn Fn(usize) -> Vector3<f64>| {
        region.iter().map(|&k| f(k)).sum::<Vector3<f64>>() / region.len() as f64
    };
    let (center_before, center_after) = (mean(&before), mean(&after));
    let mut covariance = Matrix3::zeros();
    let mut spread = Matrix3::zeros();
    for &k in region {
        let (a, b) = (before(k) - center_before, after(k) - center_after);
        covariance += b * a.transpose();
        spread += a * a.transpose();
    }
    // Points on a line (or one point) leave the turn about it open.
    let mut sizes = covariance.singular_values();
    sizes.as_mut_slice().sort_by(|a, b| b.total_cmp(a));
    if region.len() < 3 || !(sizes[1] > 1e-6 * spread.trace()) {
        return Vector3::zeros();
    }
    Rotation3::from_matrix_unchecked(nearest_rotation(&covariance)).scaled_axis()
}
