//! Rotations of the handle regions, as a first guess of the rotations of all vertices.

use cotan_geometry::Scalar;
use cotan_linear::Handle;
use nalgebra::{Matrix3, Point3, Rotation3, Vector3};

use crate::polar::nearest_rotation;
use crate::rest::Rest;

/// The rotation vector (axis times angle in radians) of every handle vertex: that of its connected
/// region of handle vertices, by Kabsch's method; zero for a region that does not determine one.
pub(crate) fn handle_rotations<T: Scalar>(
    rest: &Rest<'_, T>,
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
    rest: &Rest<'_, T>,
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
        for (j, _) in rest.rings().ring(vertex.index()) {
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
    rest: &Rest<'_, T>,
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
