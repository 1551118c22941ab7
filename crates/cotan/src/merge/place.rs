//! The motion that brings the second surface to the first.

use cotan_flow::nearest_rotation;
use nalgebra::{Matrix3, Point3, Rotation3, Unit, UnitQuaternion, Vector3};

/// x ↦ scale · rotation · x + translation.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Similarity {
    /// Above 0.
    pub scale: f64,
    /// The rotation.
    pub rotation: Rotation3<f64>,
    /// The translation, in the units of the mesh.
    pub translation: Vector3<f64>,
}

impl Similarity {
    /// Leaves every point where it is.
    pub fn identity() -> Self {
        Self {
            scale: 1.0,
            rotation: Rotation3::identity(),
            translation: Vector3::zeros(),
        }
    }

    /// The image of a point.
    #[must_use]
    pub fn apply(&self, point: &Point3<f64>) -> Point3<f64> {
        self.rotation * point * self.scale + self.translation
    }

    /// The similarity that best maps points to others in the least-squares sense. Three pairs that
    /// are not on a line determine it.
    ///
    /// **Source**: S. Umeyama, "Least-squares estimation of transformation parameters between two
    /// point patterns", PAMI 1991.
    pub fn between(pairs: &[[Point3<f64>; 2]]) -> Self {
        let center = |k: usize| {
            let sum: Vector3<f64> = pairs.iter().map(|pair| pair[k].coords).sum();
            sum / pairs.len().max(1) as f64
        };
        let centers = [center(0), center(1)];
        let mut covariance = Matrix3::zeros();
        let mut spread = 0.0;
        for pair in pairs {
            let [from, to] = [0, 1].map(|k| pair[k].coords - centers[k]);
            covariance += to * from.transpose();
            spread += from.norm_squared();
        }
        let rotation = nearest_rotation(&covariance);
        let scale = (rotation.transpose() * covariance).trace() / spread;
        let scale = if scale > 0.0 && scale.is_finite() {
            scale
        } else {
            1.0
        };
        Self {
            scale,
            rotation: Rotation3::from_matrix_unchecked(rotation),
            translation: centers[1] - rotation * centers[0] * scale,
        }
    }

    /// The similarity that brings `moving`, a loop that runs against `still`, to it: equal areas,
    /// planes on each other, the best phase of [`SAMPLES`], and `gap` between them along the
    /// direction in which the still surface would continue.
    pub(super) fn between_loops(still: &[Point3<f64>], moving: &[Point3<f64>], gap: f64) -> Self {
        let reversed: Vec<Point3<f64>> = moving.iter().rev().copied().collect();
        let [p, q] = [still, &reversed].map(Ring::sample);
        let scale = (p.area.norm() / q.area.norm()).sqrt();
        let scale = if scale > 0.0 && scale.is_finite() {
            scale
        } else {
            1.0
        };
        let axis = p.area.try_normalize(0.0).unwrap_or_else(Vector3::z);
        let from = q.area.try_normalize(0.0).unwrap_or_else(Vector3::z);
        let level = Rotation3::rotation_between(&from, &axis).unwrap_or_else(|| {
            // Opposite directions: half a turn about anything perpendicular.
            let across = axis.cross(&least_along(&axis));
            Rotation3::from_axis_angle(&Unit::new_normalize(across), std::f64::consts::PI)
        });
        let q: Vec<Vector3<f64>> = q.points.iter().map(|x| level * x * scale).collect();
        // For each phase the best angle is known in closed form.
        let mut best = (f64::NEG_INFINITY, 0.0);
        for phase in 0..SAMPLES {
            let (mut sine, mut cosine) = (0.0, 0.0);
            for (k, p) in p.points.iter().enumerate() {
                let q = &q[(k + phase) % SAMPLES];
                sine += axis.dot(&q.cross(p));
                cosine += q.dot(p) - q.dot(&axis) * p.dot(&axis);
            }
            let fit = sine.hypot(cosine);
            if fit > best.0 {
                best = (fit, sine.atan2(cosine));
            }
        }
        let turn = UnitQuaternion::from_axis_angle(&Unit::new_unchecked(axis), best.1);
        let rotation = turn.to_rotation_matrix() * level;
        let [to, from] = [still, &reversed].map(|points| Ring::sample(points).center);
        Self {
            scale,
            rotation,
            translation: to - axis * gap - rotation * from * scale,
        }
    }
}

/// A unit vector along the axis to which `direction` is least parallel.
fn least_along(direction: &Vector3<f64>) -> Vector3<f64> {
    let mut unit = Vector3::zeros();
    unit[direction.iamin()] = 1.0;
    unit
}

/// A polygon sampled evenly by arc length, relative to its centre.
struct Ring {
    points: Vec<Vector3<f64>>,
    center: Vector3<f64>,
    /// ½ Σ p × q over the edges. Kept faces run along their cut, so for the outer boundary of a
    /// disc this points along its normals; the surface continues against it.
    area: Vector3<f64>,
}

impl Ring {
    fn sample(polygon: &[Point3<f64>]) -> Self {
        let points = evenly(polygon, SAMPLES);
        let sum: Vector3<f64> = points.iter().map(|p| p.coords).sum();
        let center = sum / points.len() as f64;
        let points: Vec<Vector3<f64>> = points.iter().map(|p| p.coords - center).collect();
        let area = (0..points.len())
            .map(|k| points[k].cross(&points[(k + 1) % points.len()]) * 0.5)
            .sum();
        Self {
            points,
            center,
            area,
        }
    }
}

/// Points at equal distances along a closed polygon, the first at its first vertex.
pub(super) fn evenly(polygon: &[Point3<f64>], count: usize) -> Vec<Point3<f64>> {
    let n = polygon.len();
    let length = perimeter(polygon);
    let (mut edge, mut before) = (0, 0.0);
    (0..count)
        .map(|k| {
            let wanted = length * k as f64 / count as f64;
            loop {
                let (from, to) = (polygon[edge], polygon[(edge + 1) % n]);
                let size = (to - from).norm();
                if before + size >= wanted || edge + 1 == n {
                    let share = if size > 0.0 {
                        (wanted - before) / size
                    } else {
                        0.0
                    };
                    return from + (to - from) * share.clamp(0.0, 1.0);
                }
                before += size;
                edge += 1;
            }
        })
        .collect()
}

/// The length of a closed polygon.
pub(super) fn perimeter(polygon: &[Point3<f64>]) -> f64 {
    (0..polygon.len())
        .map(|k| (polygon[(k + 1) % polygon.len()] - polygon[k]).norm())
        .sum()
}

/// Number of phases that are tried.
pub(super) const SAMPLES: usize = 72;
