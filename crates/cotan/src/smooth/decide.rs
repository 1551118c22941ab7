//! Automatic choice of a smoothing method for a mesh, with its reason.

use cotan_geometry::{Readable, Scalar, Surface, angle_between};

use super::noise::NoiseEstimate;
use super::normal_filter::NormalFilter;
use super::options::Smoother;

/// The decision made for [`SmoothMethod::Auto`](super::SmoothMethod::Auto), with its reason.
///
/// The face normals are filtered for the estimated noise. On CAD parts the remaining dihedral
/// angles are concentrated on few edges, on organic shapes they are spread out. Weighted by edge
/// length,
///
/// ```text
/// spread = (mean |θ|)² / mean θ²
/// ```
///
/// is 0.64 for normally distributed angles and small if a few edges have all of the angle.
#[derive(Clone, PartialEq, Debug)]
pub struct Decision {
    /// The method.
    pub method: Smoother,
    /// Noise and detail, in mean edge lengths.
    pub noise: NoiseEstimate,
    /// The spread, in 0 … 1; 1 for a plane.
    pub spread: f64,
    /// The reason in a sentence.
    pub reason: String,
}

impl Decision {
    /// Chooses a method for a surface.
    pub fn for_surface<T: Scalar>(surface: &Surface<'_, T>) -> Self {
        let noise = NoiseEstimate::of(surface);
        let spread = spread(surface, noise.noise);
        let percent = 100.0 * spread;
        let (method, reason) = if spread < CREASED {
            (
                Smoother::Feature,
                format!(
                    "few edges carry the bends (spread {percent:.0} %, below {:.0} %), as on parts with creases",
                    100.0 * CREASED
                ),
            )
        } else {
            (
                Smoother::Curvature,
                format!(
                    "the bends are spread over the surface ({percent:.0} %, at least {:.0} %), as on organic shapes",
                    100.0 * CREASED
                ),
            )
        };
        let reason = format!(
            "{reason}; noise of {} mean edge lengths",
            Readable(noise.noise)
        );
        Self {
            method,
            noise,
            spread,
            reason,
        }
    }
}

/// Spreads below this indicate creases.
///
/// Measured with noise of 0 to 0.3 mean edge lengths: fandisk 0.045 to 0.050, a sheet-metal part
/// 0.052; organic shapes 0.17 to 0.49 without noise, and 0.07 to 0.16 with the strongest noise,
/// whose filter flattens them.
const CREASED: f64 = 0.06;

fn spread<T: Scalar>(surface: &Surface<'_, T>, noise: f64) -> f64 {
    let mesh = surface.mesh();
    let normals = NormalFilter::for_noise(noise).filter(surface);
    let (mut total, mut first, mut second) = (0.0, 0.0, 0.0);
    for (e, length) in surface.edge_lengths().iter() {
        let [a, b] = e.halfedges().map(|h| mesh.face(h));
        if let (Some(a), Some(b)) = (a, b) {
            let (angle, length) = (angle_between(&normals[a], &normals[b]), length.as_f64());
            total += length;
            first += length * angle;
            second += length * angle * angle;
        }
    }
    // Angles at rounding level are those of a plane.
    if second > 1e-20 * total {
        first * first / (second * total)
    } else {
        1.0
    }
}
