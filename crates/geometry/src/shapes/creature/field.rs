//! The implicit function of the creature: a smooth union of round cones.
//!
//! A round cone is the hull of two balls. The gradient of its signed distance has length 1
//! everywhere, and the smooth union preserves this as an upper bound: if |f| > r, the surface is
//! farther away than r. Only sums, products and square roots are used, so every platform computes
//! the same bytes.

use nalgebra::{Point3, Vector3};

/// A smooth union of round cones; negative inside.
pub(super) struct Field {
    cones: Vec<RoundCone>,
}

impl Field {
    pub(super) fn new(cones: Vec<RoundCone>) -> Self {
        Self { cones }
    }

    /// The corners of a bounding box of the surface.
    pub(super) fn bounds(&self) -> (Point3<f64>, Point3<f64>) {
        let far = f64::INFINITY;
        let mut bounds = (Point3::new(far, far, far), Point3::new(-far, -far, -far));
        for cone in &self.cones {
            for (center, radius) in cone.balls() {
                // A smooth union bulges by up to a quarter of its blending width.
                let reach = Vector3::repeat(radius + 0.25 * cone.blend);
                bounds.0 = bounds.0.inf(&(center - reach));
                bounds.1 = bounds.1.sup(&(center + reach));
            }
        }
        bounds
    }

    /// Value and gradient at `p`.
    pub(super) fn value_and_gradient(&self, p: &Point3<f64>) -> (f64, Vector3<f64>) {
        let mut union = (f64::INFINITY, Vector3::zeros());
        for cone in &self.cones {
            // Beyond its blending zone a part has no effect, and most parts are far away.
            let reach = union.0 + cone.blend + cone.radius;
            if reach > 0.0 && (p - cone.center).norm_squared() < reach * reach {
                union = smooth_union(union, cone.distance_and_gradient(p), cone.blend);
            }
        }
        union
    }

    /// Value at `p`.
    pub(super) fn value(&self, p: &Point3<f64>) -> f64 {
        self.value_and_gradient(p).0
    }

    /// A Newton step from `p` towards the surface, and the unit normal at `p`.
    ///
    /// Both are zero where the gradient vanishes, which happens only far from the surface.
    pub(super) fn step_to_surface(&self, p: &Point3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        let (value, gradient) = self.value_and_gradient(p);
        let slope = gradient.norm();
        if slope < MIN_SLOPE {
            return (Vector3::zeros(), Vector3::zeros());
        }
        let normal = gradient / slope;
        (normal * (-value / slope), normal)
    }
}

/// The hull of two balls, and the softness with which it is joined to the earlier parts.
#[derive(Clone, Copy)]
pub(super) struct RoundCone {
    start: Point3<f64>,
    /// Unit vector from the first centre to the second; zero for a ball.
    axis: Vector3<f64>,
    length: f64,
    radii: [f64; 2],
    /// Sine and tangent of half the opening angle.
    sin: f64,
    tan: f64,
    /// The centre of a bounding ball.
    center: Point3<f64>,
    radius: f64,
    /// Width of the zone in which the union is rounded.
    blend: f64,
}

impl RoundCone {
    /// Creates the hull of two balls. Neither may contain the other unless they are equal.
    pub(super) fn new(
        (start, first): (Point3<f64>, f64),
        (end, second): (Point3<f64>, f64),
        blend: f64,
    ) -> Self {
        let length = (end - start).norm();
        let (axis, sin) = if length > 0.0 {
            ((end - start) / length, (first - second) / length)
        } else {
            (Vector3::zeros(), 0.0)
        };
        Self {
            start,
            axis,
            length,
            radii: [first, second],
            sin,
            tan: sin / (1.0 - sin * sin).sqrt(),
            center: nalgebra::center(&start, &end),
            radius: 0.5 * length + first.max(second),
            blend,
        }
    }

    fn balls(&self) -> [(Point3<f64>, f64); 2] {
        [
            (self.start, self.radii[0]),
            (self.start + self.axis * self.length, self.radii[1]),
        ]
    }

    /// Signed distance and its gradient.
    ///
    /// The distance is the minimum of |p − c| − r over all balls between the two. It is convex in
    /// the position τ along the axis, so it is minimized without bounds and then clamped.
    fn distance_and_gradient(&self, p: &Point3<f64>) -> (f64, Vector3<f64>) {
        let offset = p - self.start;
        let along = offset.dot(&self.axis);
        let across = (offset.norm_squared() - along * along).max(0.0).sqrt();
        let tau = (along - across * self.tan).clamp(0.0, self.length);
        let from_axis = offset - self.axis * tau;
        let distance = from_axis.norm();
        let gradient = if distance > 0.0 {
            from_axis / distance
        } else {
            Vector3::zeros()
        };
        (distance - (self.radii[0] - tau * self.sin), gradient)
    }
}

/// The minimum of two values, rounded by a parabola where they differ by less than `width`.
fn smooth_union(
    (a, da): (f64, Vector3<f64>),
    (b, db): (f64, Vector3<f64>),
    width: f64,
) -> (f64, Vector3<f64>) {
    let overlap = (width - (a - b).abs()).max(0.0) / width;
    let value = a.min(b) - 0.25 * width * overlap * overlap;
    // The gradients have equal weights where a = b; at the ends only the smaller one counts.
    let share = 0.5 * overlap;
    let gradient = if a < b {
        da * (1.0 - share) + db * share
    } else {
        db * (1.0 - share) + da * share
    };
    (value, gradient)
}

/// Halfway between two parts the slopes cancel, and the direction of a step from there would be
/// arbitrary.
const MIN_SLOPE: f64 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Field {
        let ball = |x, y, z, r| (Point3::new(x, y, z), r);
        Field::new(vec![
            RoundCone::new(ball(0.0, 0.0, 0.0, 0.5), ball(1.0, 0.2, 0.0, 0.2), 0.1),
            RoundCone::new(ball(1.0, 0.2, 0.0, 0.2), ball(1.2, 0.8, 0.3, 0.1), 0.2),
            RoundCone::new(ball(0.0, 0.6, 0.0, 0.2), ball(0.0, 0.6, 0.0, 0.2), 0.1),
        ])
    }

    fn lattice() -> impl Iterator<Item = Point3<f64>> {
        (0..1000).map(|i| {
            let digit = |k: usize| (i / 10_usize.pow(k as u32) % 10) as f64 * 0.27 - 0.913;
            Point3::new(digit(0), digit(1), digit(2))
        })
    }

    #[test]
    fn gradients_are_those_of_the_values() {
        let field = sample();
        for p in lattice() {
            let (_, gradient) = field.value_and_gradient(&p);
            for k in 0..3 {
                let mut step = Vector3::zeros();
                step[k] = 1e-6;
                let slope = (field.value(&(p + step)) - field.value(&(p - step))) / 2e-6;
                assert!(
                    (slope - gradient[k]).abs() < 1e-4,
                    "{p}: {slope} {}",
                    gradient[k]
                );
            }
            assert!(gradient.norm() < 1.0 + 1e-12);
        }
    }

    #[test]
    fn cones_measure_distance_to_their_balls() {
        let cone = RoundCone::new(
            (Point3::origin(), 0.5),
            (Point3::new(0.0, 0.0, 2.0), 0.5),
            0.1,
        );
        let distance = |x, z| cone.distance_and_gradient(&Point3::new(x, 0.0, z)).0;
        assert_eq!(
            [distance(1.0, 1.0), distance(0.0, 3.0), distance(0.0, -1.0)],
            [0.5; 3]
        );
        assert_eq!(distance(0.0, 1.0), -0.5);
    }

    #[test]
    fn projection_lands_on_the_surface() {
        let field = sample();
        let mut p = Point3::new(0.5, 0.6, 0.1);
        for _ in 0..6 {
            p += field.step_to_surface(&p).0;
        }
        assert!(field.value(&p).abs() < 1e-9);
    }
}
