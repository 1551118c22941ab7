//! A triangulated sphere during construction: connectivity, target shapes, and positions for
//! which the faces are always upright (neither flipped nor degenerate).

use cotan_geometry::Scalar;
use nalgebra::{Point3, Vector3};

use super::corners::{CornerTable, face_of, prev};
use super::energy::{Blend, Local, Rest, Wedge};
use super::predicate::is_upright;

/// Rounds a direction to a point of the unit sphere whose coordinates are representable in a
/// scalar type.
pub(super) type Rounding = fn(&Vector3<f64>) -> Vector3<f64>;

/// The [`Rounding`] of `T`.
pub(super) fn rounded<T: Scalar>(direction: &Vector3<f64>) -> Vector3<f64> {
    direction.normalize().map(|x| T::of_f64(x).as_f64())
}

/// Positions on the sphere with all data needed to move one of them.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    /// The connectivity.
    pub(super) table: CornerTable,
    /// Per vertex: its source position.
    pub(super) source: Vec<Vector3<f64>>,
    /// Per face: its target shape.
    pub(super) rest: Vec<Rest>,
    /// Per vertex: its position on the sphere, rounded.
    pub(super) place: Vec<Vector3<f64>>,
    /// The weights of the energy terms.
    pub(super) blend: Blend,
    /// The rounding of positions.
    pub(super) round: Rounding,
}

impl Layout {
    /// Sets the shape of a face from the source positions of its corners.
    pub(super) fn reshape(&mut self, face: usize) {
        let corners = self.table.triangle(face);
        let weight = self.rest[face].weight;
        let corners = corners.map(|v| &self.source[v as usize]);
        self.rest[face] = Rest::new(weight, corners);
    }

    /// Collects the faces around `vertex`.
    pub(super) fn star(&self, vertex: u32, star: &mut Vec<Wedge>) {
        star.clear();
        star.extend(self.table.outgoing(vertex).map(|h| {
            let Rest { weight, cot } = self.rest[face_of(h)];
            let k = h as usize % 3;
            Wedge {
                b: self.place[self.table.target(h) as usize],
                c: self.place[self.table.origin(prev(h)) as usize],
                rest: Rest {
                    weight,
                    cot: [cot[k], cot[(k + 1) % 3], cot[(k + 2) % 3]],
                },
            }
        }));
    }

    /// Returns true if a face is upright at the current positions.
    pub(super) fn is_upright(&self, face: usize) -> bool {
        let [a, b, c] = self.table.triangle(face).map(|v| self.place[v as usize]);
        upright(&a, &b, &c)
    }

    /// The energy of the whole map; infinite if a face is not upright.
    pub(super) fn energy(&self) -> f64 {
        let of_face = |f: usize| {
            let [x, b, c] = self.table.triangle(f).map(|v| self.place[v as usize]);
            let rest = self.rest[f];
            Wedge { b, c, rest }.value(&x, self.blend)
        };
        (0..self.table.num_faces()).map(of_face).sum()
    }

    /// Looks for a better position of `vertex` with upright faces, starting from the current one.
    ///
    /// `reach` scales the first step (over-relaxation); `star` is scratch space.
    pub(super) fn better_place(
        &self,
        vertex: u32,
        reach: f64,
        star: &mut Vec<Wedge>,
    ) -> Option<Vector3<f64>> {
        self.star(vertex, star);
        step(
            star,
            &self.place[vertex as usize],
            reach,
            self.blend,
            self.round,
        )
    }

    /// The largest distance from the vertex to a neighbour.
    pub(super) fn size_of_star(star: &[Wedge], x: &Vector3<f64>) -> f64 {
        star.iter()
            .map(|w| (w.b - x).norm_squared())
            .fold(0.0, f64::max)
            .sqrt()
    }
}

/// The exact sign of [`is_upright`] for vectors.
pub(super) fn upright(a: &Vector3<f64>, b: &Vector3<f64>, c: &Vector3<f64>) -> bool {
    is_upright(&Point3::from(*a), &Point3::from(*b), &Point3::from(*c))
}

/// Returns true if all faces of the star are upright with the vertex at `x`, by exact signs.
pub(super) fn is_valid(star: &[Wedge], x: &Vector3<f64>) -> bool {
    star.iter().all(|w| upright(x, &w.b, &w.c))
}

/// The energy of a star with the vertex at `x`.
pub(super) fn energy(star: &[Wedge], x: &Vector3<f64>, blend: Blend) -> f64 {
    star.iter().map(|w| w.value(x, blend)).sum()
}

/// One Newton step for the vertex of a star, shortened until the energy decreases and all faces
/// are upright after rounding. `None` if there is no such step.
pub(super) fn step(
    star: &[Wedge],
    x: &Vector3<f64>,
    reach: f64,
    blend: Blend,
    round: Rounding,
) -> Option<Vector3<f64>> {
    let frame = tangents(x);
    let mut local = Local::default();
    for wedge in star {
        wedge.accumulate(x, &frame, blend, &mut local);
    }
    let newton = newton_step(&local)?;
    let gain = -newton.dot(&local.gradient);
    if !(gain > MIN_GAIN * local.value) {
        return None;
    }
    let longest = Layout::size_of_star(star, x);
    let mut share = reach.min(longest / newton.norm());
    for _ in 0..HALVINGS {
        let direction = x + (frame[0] * newton.x + frame[1] * newton.y) * share;
        let to = round(&direction);
        if energy(star, &to, blend) < local.value && is_valid(star, &to) {
            return Some(to);
        }
        share *= if share > 1.0 { 1.0 / share } else { 0.4 };
    }
    None
}

/// Solves the slightly regularized Hessian for the descent step.
fn newton_step(local: &Local) -> Option<nalgebra::Vector2<f64>> {
    let [xx, xy, yy] = local.hessian;
    let stiffer = STIFFER * (xx + yy);
    let (xx, yy) = (xx + stiffer, yy + stiffer);
    let det = xx * yy - xy * xy;
    let g = local.gradient;
    let newton = -nalgebra::Vector2::new(yy * g.x - xy * g.y, xx * g.y - xy * g.x) / det;
    (det > 0.0 && newton.iter().all(|x| x.is_finite())).then_some(newton)
}

/// Two unit vectors that form a right-handed frame with `x`.
pub(super) fn tangents(x: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let axis = match x.iamin() {
        0 => Vector3::x(),
        1 => Vector3::y(),
        _ => Vector3::z(),
    };
    let first = axis.cross(x).normalize();
    [first, x.cross(&first)]
}

/// A step whose predicted gain is below this fraction of the energy is not worthwhile.
const MIN_GAIN: f64 = 1e-9;
/// The fraction of the Hessian's trace that is added to its diagonal against rounding.
const STIFFER: f64 = 1e-9;
/// The last trial step is 1e-4 of a Newton step.
const HALVINGS: usize = 11;
