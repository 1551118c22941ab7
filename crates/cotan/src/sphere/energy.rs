//! The distortion of a sphere map, blended between angles and areas by a parameter λ.
//!
//! For a face with the fraction w of the source's area, mapped with singular values σ1 ≥ σ2 to a
//! spherical triangle with solid angle Ω:
//!
//! ```text
//! e = w · ( (1 − λ) · ½ (σ1/σ2 + σ2/σ1)  +  λ · ½ (r + 1/r) ),    r = Ω / (4π w)
//! ```
//!
//! Both terms are at least 1 and tend to infinity at a flip. The first is D / A, where D is the
//! Dirichlet energy of the flat triangle and A = ½ det(a, b, c), which vanishes exactly where the
//! spherical triangle flips. As functions of one corner both are convex on a flat patch (a square
//! over a linear function; r + 1/r of a linear function), so a Newton step with the Hessian of
//! the flat patch goes downhill.
//!
//! **Source**: MIPS (Hormann, Greiner 2000); the area term of Degener, Meseth, Klein 2003.

use nalgebra::{Vector2, Vector3};

use super::error::SphereError;

/// The weights of the two terms.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Blend {
    /// The weight of the angles: 1 − λ, but always positive, because this term is the barrier
    /// against flips.
    conformal: f64,
    /// The weight of the areas: λ, but always positive, so that no face shrinks below the range
    /// of numbers.
    areal: f64,
}

impl Blend {
    /// The blend for `balance` λ, from 0 (angles) to 1 (areas).
    pub(super) fn new(balance: f64) -> Self {
        Self {
            conformal: (1.0 - balance).max(MIN_CONFORMAL),
            areal: balance.max(MIN_AREAL),
        }
    }

    /// Like [`Blend::new`], but checks the range.
    ///
    /// # Errors
    /// If `balance` is not in 0 … 1.
    pub(super) fn checked(balance: f64) -> Result<Self, SphereError> {
        if (0.0..=1.0).contains(&balance) {
            return Ok(Self::new(balance));
        }
        Err(SphereError::Setting {
            setting: "balance between angles and areas",
            range: "between 0 (angles) and 1 (areas)",
            value: balance,
        })
    }

    /// The energy per source area of a face with distortion measures `angles` = D / A and `r`.
    #[inline]
    fn mix(self, angles: f64, r: f64) -> f64 {
        self.conformal * angles + self.areal * 0.5 * (r + 1.0 / r)
    }
}

/// The size and shape of a face before mapping.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Rest {
    /// Its fraction of the source's area.
    pub(super) weight: f64,
    /// The cotangents of its angles.
    pub(super) cot: [f64; 3],
}

impl Rest {
    /// Creates the rest state of a face with the given area fraction and shape.
    pub(super) fn new(weight: f64, corners: [&Vector3<f64>; 3]) -> Self {
        Self {
            weight,
            cot: cotangents(corners),
        }
    }
}

/// The cotangents of a triangle's angles. Slivers are widened slightly (the same amount is added
/// to the square of each side), and a triangle without extent is treated as equilateral.
fn cotangents([a, b, c]: [&Vector3<f64>; 3]) -> [f64; 3] {
    let squares = [
        (c - b).norm_squared(),
        (a - c).norm_squared(),
        (b - a).norm_squared(),
    ];
    let sum: f64 = squares.iter().sum();
    if !(sum > 0.0) || !sum.is_finite() {
        return [1.0 / 3.0_f64.sqrt(); 3];
    }
    let [p, q, r] = squares.map(|s| s / sum + WIDENING);
    // Twice the dot products of the sides at each corner, and four times the area (Heron).
    let dots = [q + r - p, r + p - q, p + q - r];
    let area = (dots[0] * dots[1] + dots[1] * dots[2] + dots[2] * dots[0])
        .max(0.0)
        .sqrt();
    dots.map(|dot| dot / area)
}

/// The fixed data of a face at a vertex that may move.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wedge {
    /// The other two corners, counter-clockwise from the vertex.
    pub(super) b: Vector3<f64>,
    pub(super) c: Vector3<f64>,
    /// Shape and size before mapping, starting at the vertex.
    pub(super) rest: Rest,
}

/// An energy with its gradient and Hessian in a tangent plane.
#[derive(Clone, Copy, Default, Debug)]
pub(super) struct Local {
    pub(super) value: f64,
    pub(super) gradient: Vector2<f64>,
    /// Entries xx, xy and yy.
    pub(super) hessian: [f64; 3],
}

impl Wedge {
    /// The energy with the vertex at `x`; infinite if the face is flipped or degenerate.
    #[inline]
    pub(super) fn value(&self, x: &Vector3<f64>, blend: Blend) -> f64 {
        let (det, denominator, dirichlet) = self.measures(x);
        if !(det > 0.0) {
            return f64::INFINITY;
        }
        let r = 2.0 * det.atan2(denominator) / self.target();
        self.rest.weight * blend.mix(2.0 * dirichlet / det, r)
    }

    /// Adds the energy with the vertex at `x` and its derivatives along the tangents `frame`.
    #[inline]
    pub(super) fn accumulate(
        &self,
        x: &Vector3<f64>,
        frame: &[Vector3<f64>; 2],
        blend: Blend,
        to: &mut Local,
    ) {
        let (det, denominator, dirichlet) = self.measures(x);
        let flat = |v: Vector3<f64>| Vector2::new(frame[0].dot(&v), frame[1].dot(&v));
        let Rest { weight, cot } = self.rest;
        let area = 0.5 * det;
        // The gradient of the area; b × (c − b) suffers less from cancellation than b × c.
        let n = flat(self.b.cross(&(self.c - self.b))) * 0.5;
        let d = flat((x - self.c) * cot[1] + (x - self.b) * cot[2]) * 0.5;
        let stiffness = 0.5 * (cot[1] + cot[2]);
        let angles = dirichlet / area;

        let r = 2.0 * det.atan2(denominator) / self.target();
        let turn = n * 2.0 * denominator - flat(self.b + self.c) * det;
        let dr = turn * (2.0 / ((det * det + denominator * denominator) * self.target()));

        let (mu, lambda) = (weight * blend.conformal, weight * blend.areal);
        to.value += weight * blend.mix(angles, r);
        to.gradient += (d - n * angles) * (mu / area) + dr * (lambda * 0.5 * (1.0 - 1.0 / (r * r)));
        let outer = |u: &Vector2<f64>, v: &Vector2<f64>| {
            [u.x * v.x, 0.5 * (u.x * v.y + u.y * v.x), u.y * v.y]
        };
        let (dn, nn, rr) = (outer(&d, &n), outer(&n, &n), outer(&dr, &dr));
        let eye = [1.0, 0.0, 1.0];
        for k in 0..3 {
            let bend = stiffness * eye[k] - 2.0 * (dn[k] - angles * nn[k]) / area;
            to.hessian[k] += mu * bend / area + lambda * rr[k] / (r * r * r);
        }
    }

    /// det(x, b, c), the denominator of the solid angle's tangent, and the Dirichlet energy.
    #[inline]
    fn measures(&self, x: &Vector3<f64>) -> (f64, f64, f64) {
        let (to_b, to_c, across) = (self.b - x, self.c - x, self.c - self.b);
        let det = x.dot(&to_b.cross(&to_c));
        let (bb, cc, aa) = (
            to_b.norm_squared(),
            to_c.norm_squared(),
            across.norm_squared(),
        );
        // For unit vectors, x · b = 1 − |b − x|² / 2.
        let denominator = 4.0 - 0.5 * (aa + bb + cc);
        let [cot_x, cot_b, cot_c] = self.rest.cot;
        (
            det,
            denominator,
            0.25 * (cot_x * aa + cot_b * cc + cot_c * bb),
        )
    }

    /// The target solid angle of the face.
    #[inline]
    fn target(&self) -> f64 {
        4.0 * std::f64::consts::PI * self.rest.weight
    }
}

/// Fractions of the surface's area with sum 1. Each face gets at least a small fraction of the
/// mean.
pub(super) fn shares(areas: &[f64]) -> Vec<f64> {
    let total: f64 = areas.iter().filter(|a| a.is_finite()).sum();
    let least = MIN_AREA * if total > 0.0 { total } else { 1.0 } / areas.len() as f64;
    let floored = |&a: &f64| if a > least { a } else { least };
    let sum: f64 = areas.iter().map(floored).sum();
    areas.iter().map(|a| floored(a) / sum).collect()
}

/// Large enough to keep triangles from becoming thin if only areas count. With 0.01 the area
/// error is halved, but long limbs are sheared by a third more.
const MIN_CONFORMAL: f64 = 0.03;
/// Large enough to keep the faces of a long limb from shrinking exponentially, also in `f32`.
const MIN_AREAL: f64 = 1e-3;
/// The minimum area of a face, as a fraction of the mean face area.
const MIN_AREA: f64 = 1e-4;
/// The fraction of the sum of squared sides that is added to each of them: slivers are treated as
/// triangles of about 1 : 60.
const WIDENING: f64 = 1e-4;

#[cfg(test)]
mod tests {
    use super::*;

    fn wedge() -> Wedge {
        let unit = |x, y| Vector3::new(x, y, 1.0).normalize();
        let corners = [
            Vector3::zeros(),
            Vector3::new(2.0, 0.1, 0.3),
            Vector3::new(0.5, 1.0, 0.0),
        ];
        let [a, b, c] = &corners;
        Wedge {
            b: unit(0.02, 0.001),
            c: unit(0.004, 0.03),
            rest: Rest::new(3e-5, [a, b, c]),
        }
    }

    #[test]
    fn derivatives_are_those_of_the_value() {
        let (wedge, blend) = (wedge(), Blend::new(0.4));
        let frame = [Vector3::x(), Vector3::y()];
        let at = |x: f64, y: f64| Vector3::new(x, y, 1.0).normalize();
        let mut local = Local::default();
        wedge.accumulate(&at(0.0, 0.0), &frame, blend, &mut local);
        let value = |x, y| wedge.value(&at(x, y), blend);
        let (h, e) = (1e-5, local.value);
        let gx = (value(h, 0.0) - value(-h, 0.0)) / (2.0 * h);
        let gy = (value(0.0, h) - value(0.0, -h)) / (2.0 * h);
        assert!((Vector2::new(gx, gy) - local.gradient).norm() < 1e-3 * local.gradient.norm());
        let hxx = (value(h, 0.0) - 2.0 * e + value(-h, 0.0)) / (h * h);
        assert!(
            (hxx / local.hessian[0] - 1.0).abs() < 1e-2,
            "{hxx} {:?}",
            local.hessian
        );
        let mixed = value(h, h) - value(h, -h) - value(-h, h) + value(-h, -h);
        let hxy = mixed / (4.0 * h * h);
        assert!(
            (hxy - local.hessian[1]).abs() < 1e-2 * local.hessian[0],
            "{hxy}"
        );
    }

    #[test]
    fn an_isometry_has_the_least_energy_and_a_flip_an_infinite_one() {
        let corners = [[0.0, 0.0], [0.01, 0.0], [0.003, 0.008]]
            .map(|[x, y]: [f64; 2]| Vector3::new(x, y, 1.0).normalize());
        let [a, b, c] = &corners;
        let weight = super::super::map::solid_angle(a, b, c) / (4.0 * std::f64::consts::PI);
        let rest = Rest::new(weight, [a, b, c]);
        let wedge = Wedge { b: *b, c: *c, rest };
        let blend = Blend::new(0.5);
        // Slivers are widened slightly, so the result is not exactly 1.
        assert!((wedge.value(a, blend) / weight - 1.0).abs() < 1e-3);
        let flipped = Wedge { b: *c, c: *b, rest };
        assert_eq!(flipped.value(a, blend), f64::INFINITY);
    }

    #[test]
    fn slivers_and_points_have_finite_shapes() {
        let (o, x) = (Vector3::zeros(), Vector3::new(1.0, 0.0, 0.0));
        for corners in [[&o, &o, &o], [&o, &o, &x], [&o, &x, &(x * 0.5)]] {
            let cot = cotangents(corners);
            assert!(
                cot.iter().all(|c| c.is_finite() && c.abs() < 300.0),
                "{cot:?}"
            );
            assert!((cot[0] * cot[1] + cot[1] * cot[2] + cot[2] * cot[0] - 1.0).abs() < 1e-9);
        }
        let shares = shares(&[0.0, 1.0, f64::NAN, 3.0]);
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-15 && shares[0] > 0.0);
    }
}
