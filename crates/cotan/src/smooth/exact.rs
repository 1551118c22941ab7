//! Recognition of exact parts, which have no noise.

use cotan_geometry::{Scalar, Surface, angle_between};
use cotan_halfedge::{EdgeId, FaceId, FaceMap};
use nalgebra::Vector3;

/// The share of the area in faces that are coplanar with a neighbour, in 0 … 1.
///
/// An edge is coplanar if its dihedral angle is one that rounding to single precision gives to a
/// plane: 4 · 3e-7 of the longest side of the mesh over the smaller height of the two triangles,
/// at least 1e-4 radians and at most 0.2°. Angles are measured between normals, so both sides of
/// a fold count as coplanar only if they are one plane.
///
/// Measured: parts from CAD programs 0.78 to 1.0, fandisk 0.62, teapot 0.85; scans and organic
/// models at most 0.05, one 0.25; with noise at most 0.01. Also high: subdivided low-poly models
/// and voxel surfaces, which are exact in the same sense.
pub(super) fn coplanar_share<T: Scalar>(surface: &Surface<'_, T>) -> f64 {
    let mesh = surface.mesh();
    let size = surface.bounding_box().longest_side().as_f64();
    let normals = surface.face_normals().map(|n| n.map(T::as_f64));
    let areas = surface.face_areas().map(|a| a.as_f64());
    let lengths = surface.edge_lengths();
    let mut is_coplanar = FaceMap::filled(mesh.num_faces(), false);
    for (e, length) in lengths.iter() {
        let [Some(a), Some(b)] = faces(surface, e) else {
            continue;
        };
        let height = 2.0 * f64::min(areas[a], areas[b]) / length.as_f64();
        let limit = (ROUNDING * size / height).clamp(MIN_ANGLE, LARGEST_ANGLE);
        // Faces without area have no normal.
        if height > 0.0
            && has_direction(&normals[a])
            && angle_between(&normals[a], &normals[b]) < limit
        {
            is_coplanar[a] = true;
            is_coplanar[b] = true;
        }
    }
    let total: f64 = areas.values().sum();
    let flat = |f: FaceId| if is_coplanar[f] { areas[f] } else { 0.0 };
    match total > 0.0 {
        true => mesh.faces().map(flat).sum::<f64>() / total,
        false => 0.0,
    }
}

fn faces<T: Scalar>(surface: &Surface<'_, T>, e: EdgeId) -> [Option<FaceId>; 2] {
    e.halfedges().map(|h| surface.mesh().face(h))
}

fn has_direction(normal: &Vector3<f64>) -> bool {
    normal.norm_squared() > 0.5
}

/// Four times the rounding error of a coordinate in a file of single precision, with six digits
/// in text.
const ROUNDING: f64 = 4.0 * 3e-7;

/// In radians; the largest is 0.2°.
const MIN_ANGLE: f64 = 1e-4;
const LARGEST_ANGLE: f64 = 0.2 * std::f64::consts::PI / 180.0;
