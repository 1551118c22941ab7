//! Fitting to the unit sphere: the least-squares centre, and projection of points.

use cotan_parallel as parallel;
use nalgebra::{Matrix4, Point3, Vector3, Vector4};

use super::moebius;
use super::sums::sum;

/// The centre of the best-fitting sphere: least squares of |x|² = 2 x·c + const.
///
/// The mean of the points if they do not determine a sphere.
pub(crate) fn sphere_centre(x: &[Point3<f64>]) -> Vector3<f64> {
    let n = x.len();
    let mean = sum(n, |i| x[i].coords) / n.max(1) as f64;
    // Four unknowns; the columns are [2(x − mean), 1].
    let matrix: Matrix4<f64> = sum(n, |i| {
        let row = row(x[i].coords - mean);
        row * row.transpose()
    });
    let right: Vector4<f64> = sum(n, |i| {
        let p = x[i].coords - mean;
        row(p) * p.norm_squared()
    });
    let solution = matrix.lu().solve(&right);
    mean + solution.map_or_else(Vector3::zeros, |s| s.xyz())
}

fn row(p: Vector3<f64>) -> Vector4<f64> {
    (p * 2.0).push(1.0)
}

/// Subtracts the least-squares centre, normalizes, and applies the Möbius map after which the
/// weighted mean of the points is zero.
///
/// **Shapes**: one weight per point, with sum 1.
pub(crate) fn to_sphere(x: &mut [Point3<f64>], weights: &[f64]) {
    let centre = sphere_centre(x);
    let mut u = parallel::filled(x.len(), |i| normalized(x[i].coords - centre));
    moebius::center(&mut u, weights);
    for (p, u) in x.iter_mut().zip(u) {
        p.coords = normalized(u);
    }
}

/// Normalizes the vector twice, so that it lies on the sphere within a unit in the last place.
/// Returns some unit vector for zero.
pub(crate) fn normalized(v: Vector3<f64>) -> Vector3<f64> {
    let once = v.try_normalize(0.0).unwrap_or_else(Vector3::z);
    once / once.norm()
}
