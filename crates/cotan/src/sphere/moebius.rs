//! Möbius centring: the conformal map of the sphere to itself that moves a weighted mean of
//! points to the centre.
//!
//! The maps used are u ↦ c ⊕ u = u + 2 ((1 + u·c) c − (u·c + |c|²) u) / |u + c|² for |c| < 1, the
//! Möbius maps without rotation. They preserve all angles between curves on the sphere, so they
//! flip no spherical triangle. The remaining unknown is c with m(c) = Σ w_i (c ⊕ u_i) = 0; the
//! Newton step at c = 0 is −(2 (I − Σ w u uᵀ))⁻¹ m.
//!
//! **Source**: Douady and Earle 1986 (the conformal barycentre is unique); Cantarella and
//! Schumacher 2022 (computing it). Steps are not applied one after the other but accumulated in a
//! single c by b ⊕ a (Ungar's Möbius addition, which leaves out a rotation that does not affect
//! the centring). Each point is therefore rounded only once, with a displacement that is small
//! where c is small, so a triangle of a few units in the last place moves as a whole.

use cotan_geometry::{Scalar, scalar};
use cotan_halfedge::VertexMap;
use cotan_parallel::Chunks;
use nalgebra::{Matrix3, Point3, Vector3};

use super::error::SphereError;
use super::map::SphereMap;

impl<T: Scalar> SphereMap<T> {
    /// Returns the map followed by the Möbius map without rotation that moves Σ w_i v_i to the
    /// centre.
    ///
    /// Use the areas around the vertices on the *source* mesh
    /// ([`cotan_geometry::one_ring_areas`]). Areas on the sphere would centre nothing, because
    /// with them every one-to-one map of a fine mesh covers the sphere evenly. Angles of
    /// infinitesimal figures are preserved exactly; those of triangles, which are measured
    /// between chords, nearly so.
    ///
    /// **Shapes**: one weight per vertex; only their ratios matter.
    ///
    /// # Errors
    /// [`SphereError::Mismatch`] if there is not one finite, non-negative weight per vertex or
    /// all are zero; [`SphereError::Flipped`] if rounding to `T` flips a triangle.
    pub fn centered(&self, vertex_weights: &VertexMap<T>) -> Result<Self, SphereError> {
        let weights = check_weights(vertex_weights, self.positions().len())?;
        let directions = self.positions().values();
        let mut points: Vec<Vector3<f64>> = directions
            .map(|p| p.coords.map(T::as_f64).normalize())
            .collect();
        center(&mut points, &weights);
        let positions = points.iter().map(|p| Point3::from(p.map(T::of_f64)));
        self.with_positions(positions.collect())
    }
}

/// Moves unit vectors by the Möbius map after which |Σ w u| / Σ w < 1e-12, and returns that norm.
///
/// If the weights are not all finite, or their sum is not positive, nothing moves. If no centre
/// exists (one point has half of the weight), the points come as close to it as 50 iterations
/// allow.
///
/// The result does not depend on the number of threads.
pub(crate) fn center(positions: &mut [Vector3<f64>], weights: &[f64]) -> f64 {
    let Some(mut moments) = Moments::measure(positions, weights, &Vector3::zeros()) else {
        return 0.0;
    };
    let mut c = Vector3::zeros();
    for _ in 0..MAX_ROUNDS {
        if moments.mean.norm() < TOLERANCE {
            break;
        }
        let Some((next, better)) = moments.improve(positions, weights, &c) else {
            break;
        };
        (c, moments) = (next, better);
        // 1 − |c|² must not lose digits.
        if c.norm() > MAX_GATHERED {
            apply(positions, &c);
            c = Vector3::zeros();
        }
    }
    apply(positions, &c);
    moments.mean.norm()
}

/// The first two moments of the moved points: Σ w u and Σ w u uᵀ, divided by Σ w.
struct Moments {
    mean: Vector3<f64>,
    second: Matrix3<f64>,
}

impl Moments {
    /// The moments of the points c ⊕ u, or `None` if a sum is not finite or the total weight is
    /// not positive.
    fn measure(positions: &[Vector3<f64>], weights: &[f64], c: &Vector3<f64>) -> Option<Self> {
        let partial = Chunks::of(CHUNK).map(0..positions.len(), |_, range| {
            moments_of(&positions[range.clone()], &weights[range], c)
        });
        let mut total = [0.0; 10];
        for sums in &partial {
            for (sum, term) in total.iter_mut().zip(sums) {
                *sum += term;
            }
        }
        let [w, x, y, z, xx, xy, xz, yy, yz, zz] = total;
        (w > 0.0 && total.iter().all(|sum| sum.is_finite())).then(|| Self {
            mean: Vector3::new(x, y, z) / w,
            second: Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) / w,
        })
    }

    /// The Newton step from `c`, halved until the mean comes closer to the centre.
    fn improve(
        &self,
        positions: &[Vector3<f64>],
        weights: &[f64],
        c: &Vector3<f64>,
    ) -> Option<(Vector3<f64>, Self)> {
        let hessian = (Matrix3::identity() - self.second) * 2.0;
        let mut step = hessian
            .cholesky()
            .map_or(self.mean * -0.5, |factor| -factor.solve(&self.mean));
        step *= (LONGEST_STEP / step.norm()).min(1.0);
        for _ in 0..MAX_HALVINGS {
            let next = add(c, &step);
            let moments = Self::measure(positions, weights, &next)?;
            if moments.mean.norm() < self.mean.norm() {
                return Some((next, moments));
            }
            step *= 0.5;
        }
        None
    }
}

/// Σ w, Σ w u and the upper triangle of Σ w u uᵀ over the points c ⊕ u.
fn moments_of(positions: &[Vector3<f64>], weights: &[f64], c: &Vector3<f64>) -> [f64; 10] {
    let mut sums = [0.0; 10];
    for (u, &w) in positions.iter().zip(weights) {
        let [x, y, z]: [f64; 3] = (u + displacement(u, c)).into();
        let (wx, wy, wz) = (w * x, w * y, w * z);
        let terms = [
            w,
            wx,
            wy,
            wz,
            wx * x,
            wx * y,
            wx * z,
            wy * y,
            wy * z,
            wz * z,
        ];
        for (sum, term) in sums.iter_mut().zip(terms) {
            *sum += term;
        }
    }
    sums
}

/// Replaces each point u by c ⊕ u, normalized.
pub(crate) fn apply(positions: &mut [Vector3<f64>], c: &Vector3<f64>) {
    if *c == Vector3::zeros() {
        return;
    }
    Chunks::of(CHUNK).update(positions, |_, u| {
        let step = displacement(u, c);
        let moved = *u + step;
        let length = moved.norm();
        // 1 / length − 1, without cancellation.
        let stretch = (1.0 - moved.norm_squared()) / (length * (1.0 + length));
        *u += step + moved * stretch;
    });
}

/// (c ⊕ u) − u for |u| = 1.
#[inline]
fn displacement(u: &Vector3<f64>, c: &Vector3<f64>) -> Vector3<f64> {
    let uc = u.dot(c);
    (c * (1.0 + uc) - u * (uc + c.norm_squared())) * (2.0 / (u + c).norm_squared())
}

/// b ⊕ a in the ball: moving by b and then by a equals moving by b ⊕ a, up to a rotation.
fn add(b: &Vector3<f64>, a: &Vector3<f64>) -> Vector3<f64> {
    let (aa, bb, ab) = (a.norm_squared(), b.norm_squared(), a.dot(b));
    (b * (1.0 + 2.0 * ab + aa) + a * (1.0 - bb)) / (1.0 + 2.0 * ab + aa * bb)
}

/// Checks that there is one finite, non-negative weight per vertex, and not all zero. Returns
/// them in `f64`.
fn check_weights<T: Scalar>(
    weights: &VertexMap<T>,
    num_vertices: usize,
) -> Result<Vec<f64>, SphereError> {
    if weights.len() != num_vertices {
        return Err(SphereError::Mismatch(format!(
            "there are {} weights for {num_vertices} vertices; give one weight a vertex",
            weights.len()
        )));
    }
    let good = |w: &T| w.is_finite() && *w >= scalar(0.0);
    if let Some((vertex, w)) = weights.iter().find(|(_, w)| !good(w)) {
        return Err(SphereError::Mismatch(format!(
            "the weight of vertex {vertex} is {w}, and must be finite and not negative"
        )));
    }
    let weights: Vec<f64> = weights.values().map(|w| w.as_f64()).collect();
    let largest = weights.iter().copied().fold(0.0, f64::max);
    if largest == 0.0 {
        let message = "all weights are zero, so that there is nothing to centre";
        return Err(SphereError::Mismatch(message.into()));
    }
    // Relative to the largest, so that sums do not overflow.
    Ok(weights.iter().map(|w| w / largest).collect())
}

/// Points per task, fixed so that the sums are deterministic.
const CHUNK: usize = 2048;
/// Half of the documented 1e-12; the rest is left for the rounding of the moved points.
const TOLERANCE: f64 = 5e-13;
const MAX_ROUNDS: usize = 50;
/// The Newton step is a tangent vector; longer steps leave the ball.
const LONGEST_STEP: f64 = 0.8;
/// 2⁻⁴⁰ of a step changes the mean by less than the rounding error.
const MAX_HALVINGS: usize = 40;
/// Beyond this the accumulated map is applied and a new one is started, because 1 − |c|² has lost
/// a digit.
const MAX_GATHERED: f64 = 0.95;

#[cfg(test)]
mod tests {
    use cotan_geometry::icosphere;
    use cotan_geometry::testing::directions;
    use proptest::prelude::*;

    use super::*;

    fn unit_sphere(level: u32) -> Vec<Vector3<f64>> {
        let shape = icosphere::<f64>(level);
        shape.positions().values().map(|p| p.coords).collect()
    }

    fn mean(points: &[Vector3<f64>], weights: &[f64]) -> f64 {
        let sum: Vector3<f64> = points.iter().zip(weights).map(|(p, w)| p * *w).sum();
        sum.norm() / weights.iter().sum::<f64>()
    }

    /// 1 + (axis · u) depth …: weights that are concentrated around an axis.
    fn lopsided(points: &[Vector3<f64>], axis: &Vector3<f64>, sharpness: f64) -> Vec<f64> {
        let weigh = |u: &Vector3<f64>| (sharpness * axis.dot(u)).exp();
        points.iter().map(weigh).collect()
    }

    proptest! {
        #[test]
        fn the_weighted_mean_is_the_centre_afterwards(
            axis in directions(), sharpness in 0.0..40.0_f64,
        ) {
            let mut points = unit_sphere(4);
            let weights = lopsided(&points, &axis, sharpness);
            let norm = center(&mut points, &weights);
            prop_assert!(norm < 1e-12, "{}", norm);
            prop_assert!(mean(&points, &weights) < 1e-12);
            prop_assert!(points.iter().all(|p| (p.norm() - 1.0).abs() < 4.0 * f64::EPSILON));
        }

        #[test]
        fn a_squeezed_sphere_is_spread_again(axis in directions(), exponent in 0.0..6.0_f64) {
            let shape = icosphere::<f64>(3);
            let before = unit_sphere(3);
            let rest = 10.0_f64.powf(-exponent);
            let mut points = before.clone();
            apply(&mut points, &(axis * (1.0 - rest)));
            prop_assert!(center(&mut points, &vec![1.0; before.len()]) < 1e-12);
            // Unchanged up to a rotation.
            for e in shape.connectivity().edges() {
                let [a, b] = shape.connectivity().edge_vertices(e).map(|v| v.index());
                let change = (points[a] - points[b]).norm() - (before[a] - before[b]).norm();
                prop_assert!(change.abs() < 4e-12 / rest, "{}", change);
            }
        }

        #[test]
        fn adding_gathers_two_maps_but_for_a_rotation(
            a in directions(), b in directions(), [r, s] in [0.0..0.9_f64, 0.0..0.9],
            u in directions(), v in directions(),
        ) {
            let (a, b) = (a * r, b * s);
            let both = |u: Vector3<f64>| {
                let u = u + displacement(&u, &b);
                u + displacement(&u, &a)
            };
            let gathered = add(&b, &a);
            let at_once = |u: Vector3<f64>| u + displacement(&u, &gathered);
            let dot = |f: &dyn Fn(Vector3<f64>) -> Vector3<f64>| f(u).dot(&f(v));
            prop_assert!((dot(&both) - dot(&at_once)).abs() < 1e-11);
        }

        #[test]
        fn a_moebius_map_keeps_angles(u in directions(), c in directions(), r in 0.0..0.8_f64) {
            // The derivative of the displacement is a multiple of a rotation in the tangent
            // plane.
            let c = c * r;
            let side = Vector3::from_fn(|k, _| if k == u.iamin() { 1.0 } else { 0.0 });
            let e = u.cross(&side).normalize();
            let f = u.cross(&e);
            let at = |direction: Vector3<f64>, h: f64| {
                let p = u * h.cos() + direction * h.sin();
                p + displacement(&p, &c)
            };
            let h = 1e-5;
            let [de, df] = [e, f].map(|d| (at(d, h) - at(d, -h)) / (2.0 * h));
            let scale = de.norm() * df.norm();
            prop_assert!((de.dot(&df) / scale).abs() < 1e-8);
            prop_assert!((de.norm() / df.norm() - 1.0).abs() < 1e-8);
            prop_assert!(at(e, 0.0).dot(&de.cross(&df)) > 0.0);
        }

        #[test]
        fn a_centred_map_has_no_flip(axis in directions(), sharpness in 0.0..8.0_f64) {
            let shape = icosphere::<f64>(3);
            let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
            let points = unit_sphere(3);
            let weights = VertexMap::from_vec(lopsided(&points, &axis, sharpness));
            prop_assert!(map.centered(&weights).is_ok());
            let single = icosphere::<f32>(3);
            let map = SphereMap::new(single.connectivity(), single.positions().clone()).unwrap();
            prop_assert!(map.centered(&weights.map(|&w| w as f32)).is_ok());
        }
    }

    #[test]
    fn a_centred_sphere_stays_to_the_bit() {
        let shape = icosphere::<f64>(3);
        let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
        let mut points = unit_sphere(3);
        let weights = shape.surface().one_ring_areas();
        let norm = center(&mut points, weights.as_slice());
        assert!(norm < 1e-14);
        assert_eq!(points, unit_sphere(3));
        let centred = map.centered(&weights).unwrap();
        for (v, p) in centred.positions().iter() {
            assert!((p - map.positions()[v]).norm() < 1e-15);
        }
    }

    #[test]
    fn a_tiny_triangle_moves_as_a_whole() {
        // Corners about a hundred units in the last place apart, with heavy points elsewhere.
        let a = Vector3::new(0.6_f64, 0.0, 0.8);
        let far = |x: f64, y: f64| (a + Vector3::new(x, y, 0.0) * 1e-14).normalize();
        let corners = [a, far(1.0, 0.0), far(0.0, 1.0)];
        let upright = |t: &[Vector3<f64>]| {
            let [a, b, c] = [0, 1, 2].map(|k| Point3::from(t[k]));
            super::super::is_upright(&a, &b, &c)
        };
        assert!(upright(&corners));
        let mut points = corners.to_vec();
        points.extend(unit_sphere(2));
        let mut weights = vec![0.0; 3];
        weights.extend(lopsided(&points[3..], &Vector3::x(), 1.0));
        center(&mut points, &weights);
        assert!(upright(&points));
    }

    #[test]
    fn threads_change_no_bit_and_nonsense_moves_nothing() {
        let run = |threads| {
            let mut points = unit_sphere(5);
            let weights = lopsided(&points, &Vector3::y(), 3.0);
            cotan_parallel::on_threads(threads, || center(&mut points, &weights)).unwrap();
            points
        };
        assert_eq!(run(1), run(3));
        for weight in [0.0, f64::NAN, f64::INFINITY, -1.0] {
            let mut points = unit_sphere(1);
            center(&mut points, &[weight; 42]);
            assert_eq!(points, unit_sphere(1));
        }
    }

    #[test]
    fn weights_that_do_not_fit_are_refused() {
        let shape = icosphere::<f64>(1);
        let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
        for weights in [vec![1.0], vec![0.0; 42], vec![-1.0; 42], vec![f64::NAN; 42]] {
            let refused = map.centered(&VertexMap::from_vec(weights));
            assert!(matches!(refused, Err(SphereError::Mismatch(_))));
        }
    }
}
