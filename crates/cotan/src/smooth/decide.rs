//! Automatic choice of a smoothing method for a mesh, with its reason.

use cotan_geometry::{Readable, Scalar, Surface, angle_between};
use cotan_halfedge::FaceMap;
use nalgebra::Vector3;

use super::exact::coplanar_share;
use super::noise::NoiseEstimate;
use super::normal_filter::NormalFilter;
use super::options::Smoother;

/// The decision made for [`SmoothMethod::Auto`](super::SmoothMethod::Auto), with its reason.
///
/// A part is exact if at least half of its area is in faces that are coplanar with a neighbour.
/// It has no noise, and nothing is moved.
///
/// Otherwise the face normals are filtered. On CAD parts the remaining dihedral angles are
/// concentrated on few edges, on organic shapes they are spread out. Weighted by edge length,
///
/// ```text
/// spread = (mean |θ|)² / mean θ²
/// ```
///
/// is 0.64 for normally distributed angles and small if a few edges have all of the angle. The
/// filter is that for a noise of 0.55 times the median of |θ|. A dihedral angle is a height
/// relative to the *local* edges, so this holds where edges differ in length.
#[derive(Clone, PartialEq, Debug)]
pub struct Decision {
    /// The method.
    pub method: Smoother,
    /// The share of the area in faces that are coplanar with a neighbour.
    pub coplanar: f64,
    /// Noise and detail, in mean edge lengths.
    pub noise: NoiseEstimate,
    /// The spread, in 0 … 1; 1 for a plane.
    pub spread: f64,
    /// The reason in a sentence, and an alternative in case the decision is wrong.
    pub reason: String,
}

impl Decision {
    /// Chooses a method for a surface.
    pub fn for_surface<T: Scalar>(surface: &Surface<'_, T>) -> Self {
        let coplanar = coplanar_share(surface);
        let noise = NoiseEstimate::of(surface);
        let spread = spread(surface);
        let method = match spread < CREASED || coplanar >= EXACT {
            true => Smoother::Feature,
            false => Smoother::Curvature,
        };
        Self {
            reason: reason(method, coplanar, spread, &noise),
            method,
            coplanar,
            noise,
            spread,
        }
    }

    /// True if the part has no noise, so that nothing is to be moved.
    pub fn is_exact(&self) -> bool {
        self.coplanar >= EXACT
    }
}

fn reason(method: Smoother, coplanar: f64, spread: f64, noise: &NoiseEstimate) -> String {
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    if coplanar >= EXACT {
        return format!(
            "{} of the area is exactly flat, as on parts that were constructed, so nothing was moved; to smooth it all the same, state a method or a size",
            percent(coplanar)
        );
    }
    let noise = Readable(noise.noise);
    let (spread, limit) = (percent(spread), percent(CREASED));
    match method {
        Smoother::Feature => format!(
            "few edges carry the bends (spread {spread}, below {limit}), as on parts with creases; noise of {noise} mean edge lengths; if the shape is organic, state the method curvature"
        ),
        _ => format!(
            "the bends are spread over the surface ({spread}, at least {limit}), as on organic shapes; noise of {noise} mean edge lengths; if creases are lost, state the method feature"
        ),
    }
}

/// The share of coplanar area from which a part is exact. Parts from CAD programs have at least
/// 0.6, organic shapes and scans at most 0.25.
const EXACT: f64 = 0.5;

/// Spreads below this indicate creases: the noisy fandisk has 0.047 to 0.052, sheet metal 0.043
/// to 0.056, organic shapes at least 0.096.
const CREASED: f64 = 0.075;

/// Noise in edge lengths over the median dihedral angle, for Gaussian noise on a flat mesh.
const NOISE_PER_ANGLE: f64 = 0.55;

fn spread<T: Scalar>(surface: &Surface<'_, T>) -> f64 {
    let normals = surface.face_normals().map(|n| n.map(T::as_f64));
    let noise = NOISE_PER_ANGLE * median(angles(surface, &normals));
    let filtered = NormalFilter::for_noise(noise).filter(surface);
    let (mut total, mut first, mut second) = (0.0, 0.0, 0.0);
    for [angle, length] in angles(surface, &filtered) {
        total += length;
        first += length * angle;
        second += length * angle * angle;
    }
    // Angles at rounding level are those of a plane.
    if second > 1e-20 * total {
        first * first / (second * total)
    } else {
        1.0
    }
}

/// The dihedral angle and the length of every inner edge.
fn angles<T: Scalar>(surface: &Surface<'_, T>, normals: &FaceMap<Vector3<f64>>) -> Vec<[f64; 2]> {
    let mesh = surface.mesh();
    let lengths = surface.edge_lengths();
    let inner = lengths.iter().filter_map(|(e, length)| {
        let [a, b] = e.halfedges().map(|h| mesh.face(h));
        Some([angle_between(&normals[a?], &normals[b?]), length.as_f64()])
    });
    inner.collect()
}

/// The median of values, each with a weight; 0 if there are none.
fn median(mut values: Vec<[f64; 2]>) -> f64 {
    values.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let half = 0.5 * values.iter().map(|v| v[1]).sum::<f64>();
    let mut sum = 0.0;
    for [value, weight] in values {
        sum += weight;
        if sum >= half {
            return value;
        }
    }
    0.0
}
