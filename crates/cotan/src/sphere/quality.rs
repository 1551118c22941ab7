//! Measures of the angle and area distortion of a sphere map.

use cotan_geometry::{Scalar, Surface};
use cotan_halfedge::{FaceId, FaceMap};
use cotan_parallel as parallel;
use nalgebra::Vector3;

use super::map::SphereMap;
use super::spherical::unit_sized;

/// Mean, 99th percentile and maximum over the faces with positive area.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Spread {
    /// Mean over the source surface, weighted by area.
    pub mean: f64,
    /// The value that 99 % of the faces do not exceed.
    pub p99: f64,
    /// The largest value.
    pub max: f64,
}

/// The errors of the triangle angles.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct AngleErrors {
    /// Mean over the corners, in degrees.
    pub mean: f64,
    /// The largest error, in degrees.
    pub max: f64,
}

/// Measures of a sphere map. Source triangles without area have no distortion and are excluded;
/// values are 0 if that excludes all triangles.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub struct SphereQuality {
    /// The number of triangles that are flipped by the exact predicate: 0 in a checked map.
    pub flipped_triangles: usize,
    /// The largest | |v| − 1 |.
    pub sphericity_error: f64,
    /// σ1/σ2 of the affine map from each source triangle to the flat triangle between the images
    /// of its corners: 1 where angles are preserved.
    pub conformal_distortion: Spread,
    /// Differences between the angles of these two triangles.
    pub angle_error_degrees: AngleErrors,
    /// |ln (fraction of the sphere / fraction of the source area)|: 0 where areas are preserved.
    pub area_distortion: Spread,
    /// The number of times that the triangles cover the sphere: 1 in a checked map.
    pub degree: i64,
}

impl SphereQuality {
    /// Computes all measures.
    ///
    /// # Panics
    /// If the surface and the map's mesh have different numbers of vertices.
    pub fn measure<T: Scalar>(source: &Surface<'_, T>, map: &SphereMap<T>) -> Self {
        // The squares of huge or tiny coordinates would overflow or underflow.
        let positions = unit_sized(source.positions());
        let source = &Surface::assume_checked(source.mesh(), &positions);
        let areas = source.face_areas();
        let ratios = log_ratios(source, map);
        let measure = |f| Face::measure(source, map, FaceId::new(f));
        let faces = parallel::filled(areas.len(), measure);
        let is_measured = |f: &usize| areas.as_slice()[*f] > 0.0;
        let measured: Vec<usize> = (0..areas.len()).filter(is_measured).collect();
        let spread = |value: &dyn Fn(usize) -> f64| {
            spread(measured.iter().map(|&f| (value(f), areas.as_slice()[f])))
        };
        let errors = measured.iter().map(|&f| faces[f].angle_errors);
        let (sum, max) = errors.fold((0.0, 0.0f64), |(sum, max), [mean, most]| {
            (sum + mean, max.max(most))
        });
        Self {
            flipped_triangles: super::flipped_faces(map.mesh(), map.positions()).len(),
            sphericity_error: map.sphericity_error().as_f64(),
            conformal_distortion: spread(&|f| faces[f].sigma_ratio),
            angle_error_degrees: AngleErrors {
                mean: sum / measured.len().max(1) as f64,
                max,
            },
            area_distortion: spread(&|f| ratios.as_slice()[f].abs()),
            degree: map.degree().round() as i64,
        }
    }
}

/// ln (fraction of the sphere / fraction of the source area) of each face. Positive where the map
/// enlarges; 0 for faces without area.
///
/// **Shapes**: one entry per face. **Units**: dimensionless.
pub fn area_log_ratios<T: Scalar>(source: &Surface<'_, T>, map: &SphereMap<T>) -> FaceMap<f64> {
    let positions = unit_sized(source.positions());
    log_ratios(&Surface::assume_checked(source.mesh(), &positions), map)
}

fn log_ratios<T: Scalar>(source: &Surface<'_, f64>, map: &SphereMap<T>) -> FaceMap<f64> {
    let areas = source.face_areas();
    let total: f64 = areas.values().sum();
    let whole = 4.0 * std::f64::consts::PI;
    FaceMap::from_vec(parallel::filled(areas.len(), |f| {
        let area = areas.as_slice()[f];
        if area > 0.0 {
            let angle = map.solid_angle(FaceId::new(f)).max(f64::MIN_POSITIVE);
            ((angle / whole) / (area / total)).ln()
        } else {
            0.0
        }
    }))
}

/// The measures of a face.
struct Face {
    sigma_ratio: f64,
    /// Mean and largest angle error, in degrees.
    angle_errors: [f64; 2],
}

impl Face {
    fn measure<T: Scalar>(source: &Surface<'_, f64>, map: &SphereMap<T>, face: FaceId) -> Self {
        let vertices = map.mesh().triangle(face);
        let corners = vertices.map(|v| source.position(v).coords);
        let images = vertices.map(|v| map.positions()[v].coords.map(T::as_f64));
        let (before, after) = (Triangle::new(corners), Triangle::new(images));
        let errors = [0, 1, 2].map(|k| (before.angle(k) - after.angle(k)).abs().to_degrees());
        Self {
            sigma_ratio: before.sigma_ratio(&after),
            angle_errors: [
                errors.iter().sum::<f64>() / 3.0,
                errors.iter().copied().fold(0.0, f64::max),
            ],
        }
    }
}

/// The edges of a triangle (edge k is opposite corner k) and twice its area.
struct Triangle {
    edges: [Vector3<f64>; 3],
    double_area: f64,
}

impl Triangle {
    fn new([a, b, c]: [Vector3<f64>; 3]) -> Self {
        let edges = [c - b, a - c, b - a];
        Self {
            double_area: edges[2].cross(&edges[1]).norm(),
            edges,
        }
    }

    /// −(the dot product of the two edges at corner k).
    fn dot(&self, k: usize) -> f64 {
        -self.edges[(k + 1) % 3].dot(&self.edges[(k + 2) % 3])
    }

    fn angle(&self, k: usize) -> f64 {
        self.double_area.atan2(self.dot(k))
    }

    /// σ1/σ2 of the affine map to another triangle. σ1² + σ2² is the Dirichlet energy over the
    /// area, and σ1 σ2 is the ratio of the areas.
    fn sigma_ratio(&self, image: &Self) -> f64 {
        let energy: f64 = (0..3)
            .map(|k| self.dot(k) * image.edges[k].norm_squared())
            .sum();
        let trace = energy / (self.double_area * image.double_area);
        0.5 * (trace + (trace * trace - 4.0).max(0.0).sqrt())
    }
}

/// Mean (weighted), 99th percentile and maximum of values with weights.
fn spread(values: impl Iterator<Item = (f64, f64)>) -> Spread {
    let mut sorted: Vec<(f64, f64)> = values.collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = sorted.iter().map(|(_, w)| w).sum();
    let sum: f64 = sorted.iter().map(|(x, w)| x * w).sum();
    let mean = if total > 0.0 { sum / total } else { 0.0 };
    // Interpolated linearly between the two nearest ranks.
    let rank = 0.99 * sorted.len().saturating_sub(1) as f64;
    let value = |k: usize| sorted.get(k).or(sorted.last()).map_or(0.0, |(x, _)| *x);
    let (low, part) = (rank.floor() as usize, rank.fract());
    let p99 = value(low) * (1.0 - part) + value(low + 1) * part;
    Spread {
        mean,
        p99,
        max: sorted.last().map_or(0.0, |(x, _)| *x),
    }
}
