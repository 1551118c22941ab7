//! Positions and sizes of the creature's parts.

use nalgebra::Point3;

use super::field::RoundCone;

/// Centre and radius.
pub(super) type Ball = ([f64; 3], f64);

/// All parts, large ones first. Each is joined to the earlier ones.
pub(super) fn cones() -> Vec<RoundCone> {
    let mut parts = Parts::default();
    parts.chain(&BODY, 0.14);
    parts.chain(&NECK, 0.12);
    parts.chain(&HEAD, 0.08);
    parts.chain(&TAIL, 0.10);
    parts.chain(&TAIL_TIP, 0.05);
    for leg in [&FRONT_LEG, &HIND_LEG] {
        parts.both_sides(leg, 0.10);
    }
    parts.both_sides(&HORN, 0.05);
    parts.both_sides(&EAR, 0.05);
    parts.both_sides(&CHEEK, 0.06);
    parts.both_sides(&EYE, 0.015);
    parts.both_sides(&NOSTRIL, 0.03);
    for toe in TOES {
        parts.both_sides(&[toe], 0.03);
    }
    for bump in BUMPS {
        parts.both_sides(&[bump], 0.04);
    }
    for plate in PLATES {
        parts.chain(&plate, 0.04);
    }
    parts.cones
}

#[derive(Default)]
struct Parts {
    cones: Vec<RoundCone>,
}

impl Parts {
    /// Adds round cones from ball to ball, or a single ball.
    fn chain(&mut self, balls: &[Ball], blend: f64) {
        let ball = |k: usize| (Point3::from(balls[k].0), balls[k].1);
        if balls.len() == 1 {
            self.cones.push(RoundCone::new(ball(0), ball(0), blend));
        }
        for k in 1..balls.len() {
            let (start, end) = (ball(k - 1), ball(k));
            let blend = if k == 1 { blend } else { LINK_BLEND * start.1 };
            self.cones.push(RoundCone::new(start, end, blend));
        }
    }

    /// Adds a chain and its mirror image.
    fn both_sides<const N: usize>(&mut self, balls: &[Ball; N], blend: f64) {
        self.chain(balls, blend);
        self.chain(
            &balls.map(|([x, y, z], radius)| ([x, y, -z], radius)),
            blend,
        );
    }
}

/// The softness with which the links of a chain are joined, in units of the radius. Wider joints
/// would bulge.
const LINK_BLEND: f64 = 0.45;

// x is forward, y is up, z is to the right of the creature. Paired parts are mirrored from z > 0.

const BODY: [Ball; 3] = [
    ([0.28, 0.84, 0.0], 0.30),
    ([-0.02, 0.77, 0.0], 0.32),
    ([-0.36, 0.80, 0.0], 0.27),
];

const NECK: [Ball; 3] = [
    ([0.36, 0.98, 0.0], 0.21),
    ([0.58, 1.26, 0.0], 0.15),
    ([0.70, 1.46, 0.0], 0.14),
];

const HEAD: [Ball; 3] = [
    ([0.70, 1.54, 0.0], 0.20),
    ([0.82, 1.52, 0.0], 0.19),
    ([1.08, 1.42, 0.0], 0.125),
];

const TAIL: [Ball; 5] = [
    ([-0.50, 0.82, 0.0], 0.20),
    ([-0.82, 0.68, 0.03], 0.135),
    ([-1.10, 0.62, 0.10], 0.095),
    ([-1.32, 0.72, 0.17], 0.070),
    ([-1.42, 0.92, 0.20], 0.055),
];

const TAIL_TIP: [Ball; 2] = [([-1.43, 1.04, 0.20], 0.105), ([-1.46, 1.24, 0.19], 0.035)];

const FRONT_LEG: [Ball; 4] = [
    ([0.33, 0.74, 0.19], 0.16),
    ([0.37, 0.42, 0.24], 0.115),
    ([0.34, 0.16, 0.24], 0.095),
    ([0.40, 0.10, 0.24], 0.10),
];

const HIND_LEG: [Ball; 4] = [
    ([-0.38, 0.74, 0.19], 0.20),
    ([-0.28, 0.44, 0.26], 0.125),
    ([-0.42, 0.18, 0.26], 0.095),
    ([-0.36, 0.10, 0.26], 0.10),
];

const TOES: [Ball; 6] = [
    ([0.48, 0.055, 0.17], 0.055),
    ([0.51, 0.055, 0.24], 0.055),
    ([0.48, 0.055, 0.31], 0.055),
    ([-0.28, 0.055, 0.19], 0.055),
    ([-0.25, 0.055, 0.26], 0.055),
    ([-0.28, 0.055, 0.33], 0.055),
];

const HORN: [Ball; 4] = [
    ([0.67, 1.68, 0.09], 0.070),
    ([0.59, 1.80, 0.14], 0.058),
    ([0.52, 1.92, 0.16], 0.046),
    ([0.49, 2.02, 0.15], 0.036),
];

const EAR: [Ball; 3] = [
    ([0.66, 1.56, 0.17], 0.055),
    ([0.58, 1.60, 0.32], 0.065),
    ([0.52, 1.60, 0.42], 0.030),
];

const CHEEK: [Ball; 1] = [([0.82, 1.44, 0.11], 0.11)];

const EYE: [Ball; 1] = [([0.90, 1.60, 0.145], 0.080)];

const NOSTRIL: [Ball; 1] = [([1.15, 1.50, 0.055], 0.038)];

/// Warts on the flanks, shoulders and thighs.
const BUMPS: [Ball; 8] = [
    ([0.10, 0.98, 0.245], 0.055),
    ([-0.05, 0.92, 0.29], 0.045),
    ([-0.12, 1.02, 0.21], 0.040),
    ([-0.20, 0.90, 0.26], 0.050),
    ([0.22, 0.90, 0.28], 0.040),
    ([-0.44, 0.84, 0.30], 0.060),
    ([0.36, 0.84, 0.29], 0.045),
    ([-0.66, 0.80, 0.155], 0.040),
];

/// Each plate from root to tip, along the neck, the back and the tail.
const PLATES: [[Ball; 2]; 10] = [
    [([0.52, 1.52, 0.00], 0.050), ([0.43, 1.57, 0.00], 0.036)],
    [([0.44, 1.33, 0.00], 0.055), ([0.33, 1.39, 0.00], 0.038)],
    [([0.33, 1.19, 0.00], 0.060), ([0.22, 1.28, 0.00], 0.040)],
    [([0.16, 1.11, 0.00], 0.066), ([0.07, 1.23, 0.00], 0.042)],
    [([-0.04, 1.08, 0.00], 0.068), ([-0.12, 1.21, 0.00], 0.042)],
    [([-0.25, 1.06, 0.00], 0.066), ([-0.33, 1.18, 0.00], 0.042)],
    [([-0.45, 1.02, 0.00], 0.062), ([-0.53, 1.12, 0.00], 0.040)],
    [([-0.63, 0.92, 0.01], 0.056), ([-0.71, 1.01, 0.01], 0.038)],
    [([-0.81, 0.82, 0.03], 0.050), ([-0.88, 0.90, 0.03], 0.035)],
    [([-0.99, 0.73, 0.07], 0.044), ([-1.04, 0.81, 0.07], 0.033)],
];
