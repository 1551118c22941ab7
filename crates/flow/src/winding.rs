//! Turns of more than half a turn: the shape that is wound up with its handles, and how much of
//! them a body holds.

use std::cmp::Ordering;
use std::f64::consts::{FRAC_PI_4, PI};

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::{FaceId, VertexId, VertexMap};
use cotan_parallel as parallel;
use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

use crate::error::FlowError;
use crate::fit::{Fit, Pair};
use crate::rest::Rest;
use crate::start::{Groups, spread};
use crate::workspace::Workspace;

/// The turns of handle vertices that are stated, as rotation vectors in radians: they may be more
/// than half a turn, which positions alone cannot tell.
pub(crate) type StatedTurns = Vec<(VertexId, Vector3<f64>)>;

/// The winding of a mesh whose handles are stated to turn by more than half a turn relative to
/// each other.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub struct Winding {
    /// The rotation of every vertex if the stated turns are spread evenly.
    ///
    /// **Shapes**: one entry per vertex.
    pub rotations: VertexMap<Matrix3<f64>>,
    /// The number of diameters between the two handles that turn most relative to each other. A
    /// body that is not equally thick counts as far as its thinnest part: the twist gathers there.
    pub diameters: f64,
}

/// The winding that the stated turns give, and the turn of each group of handles and of each
/// vertex; `None` unless two groups turn by more than half a turn relative to each other.
struct Wound {
    groups: Groups,
    turns: Vec<Vector3<f64>>,
    /// The widest of the turns of two groups relative to each other.
    widest: f64,
    field: VertexMap<Vector3<f64>>,
    winding: Winding,
}

impl Wound {
    fn new<T: Scalar>(
        work: &mut Workspace<T>,
        stated: &StatedTurns,
    ) -> Result<Option<Self>, FlowError> {
        if !could_wind(stated) {
            return Ok(None);
        }
        let groups = Groups::new(&work.rest, work.targets.handles(), work.targets.in_box());
        let turns = stated_turns(&groups, work, stated);
        let Some([low, high]) = widest(&turns) else {
            return Ok(None);
        };
        let widest = (high - low).norm();
        if widest <= PI {
            return Ok(None);
        }
        if !(widest <= WIDEST) {
            return Err(FlowError::Setting {
                setting: "stated turn relative to another handle, in degrees",
                range: "at most 36000",
                value: widest.to_degrees(),
            });
        }
        let at_handles = groups.at_handles(work, &turns);
        let field = spread(work, at_handles)?;
        let axis = (high - low) / widest;
        let along = |turn: &Vector3<f64>| ((turn - low).dot(&axis) / widest).clamp(0.0, 1.0);
        let winding = Winding {
            rotations: field.map(|turn| Rotation3::new(*turn).into_inner()),
            diameters: diameters(&work.rest, &field.map(along)),
        };
        Ok(Some(Self {
            groups,
            turns,
            widest,
            field,
            winding,
        }))
    }
}

/// The winding that the stated turns of the current handles give; `None` unless two groups of
/// handles turn by more than half a turn relative to each other.
pub(crate) fn winding<T: Scalar>(
    work: &mut Workspace<T>,
    stated: &StatedTurns,
) -> Result<Option<Winding>, FlowError> {
    Ok(Wound::new(work, stated)?.map(|wound| wound.winding))
}

/// The shape that is wound up with the handles; `None` as from [`winding`].
///
/// Every group turns about its own centre, which moves straight to its target, in steps of at most
/// 45° relative to each other. In each step the motions of the groups, as twists in se(3), are
/// spread over the mesh by the system.
pub(crate) fn wind<T: Scalar>(
    work: &mut Workspace<T>,
    stated: &StatedTurns,
) -> Result<Option<(Positions<f64>, Winding)>, FlowError> {
    let Some(wound) = Wound::new(work, stated)? else {
        return Ok(None);
    };
    let groups = &wound.groups;
    let num_steps = (wound.widest / FRAC_PI_4).ceil();
    let mut shape: Positions<f64> = work.rest.positions().map(|p| p.map(T::as_f64));
    let mut done = 0.0;
    while done < num_steps {
        let at = |center: &Pair, step: f64| {
            center.before + (center.after - center.before) * (step / num_steps)
        };
        let shift = |(center, turn): (&Pair, &Vector3<f64>)| {
            let omega = turn / num_steps;
            let moved = at(center, done + 1.0) - Rotation3::new(omega) * at(center, done);
            let [along, _] = twist_matrices(&omega);
            along.try_inverse().map_or(moved, |inverse| inverse * moved)
        };
        let centers = groups.centers.iter();
        let us: Vec<_> = centers.zip(&wound.turns).map(shift).collect();
        let us = groups.at_handles(work, &us);
        let us = spread(work, us)?;
        let (turns, us) = (wound.field.as_slice(), us.as_slice());
        parallel::update(shape.as_mut_slice(), |i, x| {
            let [along, turn] = twist_matrices(&(turns[i] / num_steps));
            *x = Point3::from(turn * x.coords + along * us[i]);
        });
        done += 1.0;
    }
    Ok(Some((shape, wound.winding)))
}

/// A hundred turns: more are no turns of a body.
const WIDEST: f64 = 200.0 * PI;

/// Returns `true` if some turn is so wide that two of them can differ by more than half a turn.
fn could_wind(stated: &StatedTurns) -> bool {
    stated.iter().any(|(_, turn)| !(turn.norm() <= 0.5 * PI))
}

/// The two turns that differ most.
fn widest(turns: &[Vector3<f64>]) -> Option<[Vector3<f64>; 2]> {
    // Most groups are turned by the same.
    let mut distinct = turns.to_vec();
    distinct.sort_by(|a, b| a.iter().partial_cmp(b.iter()).unwrap_or(Ordering::Equal));
    distinct.dedup();
    let mut widest: Option<[Vector3<f64>; 2]> = None;
    for (g, a) in distinct.iter().enumerate() {
        for b in &distinct[..g] {
            let most = widest.map_or(0.0, |[low, high]| (high - low).norm());
            if (a - b).norm() > most {
                widest = Some([*b, *a]);
            }
        }
    }
    widest
}

/// The rotation vector of every group: the stated one where its handles agree with it, else the
/// least one that fits them.
fn stated_turns<T: Scalar>(
    groups: &Groups,
    work: &Workspace<T>,
    stated: &StatedTurns,
) -> Vec<Vector3<f64>> {
    /// Radians between the stated turn and that of the targets.
    const AGREES: f64 = 0.2;
    let handles = work.targets.handles();
    let of_group = |group: &Vec<usize>| {
        let own: Vec<Pair> = group.iter().map(|&k| groups.pairs[k]).collect();
        let fit = Fit::new(&own);
        let vertex = handles[group[0]].vertex;
        let given = stated
            .iter()
            .find(|(v, _)| *v == vertex)
            .map(|(_, turn)| *turn);
        if !fit.determines_rotation(own.len()) {
            return given.unwrap_or_else(Vector3::zeros);
        }
        let fitted = Rotation3::from_matrix_unchecked(fit.rotation);
        let least = UnitQuaternion::from_rotation_matrix(&fitted);
        match given {
            Some(turn) if least.angle_to(&UnitQuaternion::from_scaled_axis(turn)) < AGREES => turn,
            _ => least.scaled_axis(),
        }
    };
    groups.members.iter().map(of_group).collect()
}

/// V(ω) and exp(ω): a twist (ω, u) takes x to exp(ω) x + V(ω) u.
fn twist_matrices(omega: &Vector3<f64>) -> [Matrix3<f64>; 2] {
    let angle = omega.norm();
    let cross = omega.cross_matrix();
    let square = cross * cross;
    let (a, b) = if angle < 1e-4 {
        (
            0.5 - angle * angle / 24.0,
            1.0 / 6.0 - angle * angle / 120.0,
        )
    } else {
        (
            (1.0 - angle.cos()) / (angle * angle),
            (angle - angle.sin()) / angle.powi(3),
        )
    };
    let along = Matrix3::identity() + cross * a + square * b;
    [along, Rotation3::new(*omega).into_inner()]
}

/// The number of diameters between the two ends of a body, `along` being a smooth function from 0
/// at one end to 1 at the other.
///
/// Between two levels of the function that differ by Δ the body has the girth g and the length l,
///
/// ```text
/// g = S₁ / Δ,   l = Δ S₁ / S₂,   S₁ = ∫ |∇u| dA,   S₂ = ∫ |∇u|² dA
/// ```
///
/// where limbs without handles, in which ∇u = 0, do not count. Its diameter is d = g / π.
///
/// A twist gathers where the body is thin, and is lost where it collapses a stretch that is
/// [`COLLAPSES`] diameters long. So the thinnest pieces that are together that long count in full,
/// for l / d; the thickest of them has the diameter d_c. Thicker parts turn less than they would
/// hold: under a torque a tube turns by l / d³, and they count for l / d · (d_c / d)².
fn diameters<T: Scalar>(rest: &Rest<T>, along: &VertexMap<f64>) -> f64 {
    /// Pieces between the ends.
    const PIECES: usize = 16;
    const WIDTH: f64 = 1.0 / PIECES as f64;
    let mesh = rest.mesh();
    let mut sums = [[0.0; 2]; PIECES];
    for f in mesh.faces() {
        let corners = mesh.triangle(f);
        let gradient = gradient(rest, f, along);
        let values = corners.map(|v| along[v]);
        let low = values.iter().copied().fold(1.0, f64::min);
        let high = values.iter().copied().fold(0.0, f64::max);
        if !(high > low && gradient[0].is_finite()) {
            continue;
        }
        let first = (low * PIECES as f64) as usize;
        for (piece, sum) in sums.iter_mut().enumerate().skip(first) {
            let start = piece as f64 * WIDTH;
            let part = (high.min(start + WIDTH) - low.max(start)) / (high - low);
            if part <= 0.0 {
                break;
            }
            sum[0] += part * gradient[0];
            sum[1] += part * gradient[1];
        }
    }
    // d and l / d of every piece.
    let pieces = sums.map(|[s1, s2]| [s1 / (PI * WIDTH), PI * WIDTH * WIDTH / s2]);
    let critical = critical_diameter(pieces);
    let counted = pieces.map(|[d, length]| length * (critical / d).min(1.0).powi(2));
    let sum: f64 = counted.iter().sum();
    // Handles that touch leave nothing between them.
    if sum.is_finite() { sum } else { 0.0 }
}

/// The diameter of the thickest of the thinnest pieces that are together as long as a collapse.
/// Each piece has its diameter and its length in diameters.
fn critical_diameter<const N: usize>(mut pieces: [[f64; 2]; N]) -> f64 {
    pieces.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut left = COLLAPSES;
    let mut thickest = 0.0;
    for [d, length] in pieces {
        thickest = d;
        left -= length;
        if left <= 0.0 {
            break;
        }
    }
    thickest
}

/// The length in diameters of the stretch in which a twisted body collapses, taken to be that which
/// struts are worth. Estimates for tapered and necked rods are within 7 % and 19 % of the angles at
/// which they lose their turns.
const COLLAPSES: f64 = 1.7;

/// The integrals of the length of the gradient over a triangle and of its square.
fn gradient<T: Scalar>(rest: &Rest<T>, f: FaceId, values: &VertexMap<f64>) -> [f64; 2] {
    let corners = rest.mesh().triangle(f);
    let [a, b, c] = corners.map(|v| rest.positions()[v].map(T::as_f64));
    let [u, v, w] = corners.map(|v| values[v]);
    let twice = (b - a).cross(&(c - a)).norm();
    // ∇u turned by a right angle, times twice the area.
    let turned = (c - b) * u + (a - c) * v + (b - a) * w;
    let length = turned.norm();
    [0.5 * length, 0.5 * length * length / twice]
}
