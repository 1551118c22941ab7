//! One vertex that is held: what every handles file comes down to.

use cotan::geometry::Scalar;
use cotan::{Handles, Motion};
use cotan_io::ProcessingMesh;
use nalgebra::{Point3, Vector3};

use super::error::{HandlesError, Place};
use super::vertices::Vertices;

/// A vertex of the mesh file and where it is to be.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Constraint {
    /// The vertex, as the mesh file numbers it, from 0.
    pub vertex: usize,
    /// Where it is to be.
    pub goal: Goal,
    /// The weight of its spring, where the file gives one.
    pub weight: Option<f64>,
    /// The rotation vector that moves it, in radians, where the file states a rotation of more
    /// than half a turn.
    pub turn: Option<Vector3<f64>>,
    /// Where the handles file says so.
    pub place: Place,
}

/// Where a held vertex goes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Goal {
    /// Where it is.
    Stay,
    /// To this point, in the units of the mesh file.
    To(Point3<f64>),
}

impl Constraint {
    /// Whether the vertex is to leave its place, or comes back to it by a whole turn.
    pub fn moves(&self, from: Point3<f64>) -> bool {
        self.turn.is_some() || matches!(self.goal, Goal::To(target) if target != from)
    }
}

/// Refuses vertices that do not exist, targets that are not finite, and vertices that are wanted at
/// two places.
pub(super) fn check(constraints: &[Constraint], mesh: &Vertices<'_>) -> Result<(), HandlesError> {
    let mut wanted = Vec::with_capacity(constraints.len());
    for constraint in constraints {
        let &Constraint {
            vertex,
            goal,
            place,
            ..
        } = constraint;
        let position = mesh.position(vertex, place)?;
        let target = match goal {
            Goal::Stay => position,
            Goal::To(target) => target,
        };
        if target.iter().any(|x| !x.is_finite()) {
            return Err(HandlesError::NonFinite { place, vertex });
        }
        wanted.push((vertex, target, place));
    }
    wanted.sort_by_key(|&(vertex, _, place)| (vertex, place));
    match wanted
        .windows(2)
        .find(|pair| pair[0].0 == pair[1].0 && pair[0].1 != pair[1].1)
    {
        Some(pair) => Err(HandlesError::Contradiction {
            places: [pair[0].2, pair[1].2],
            vertex: pair[0].0,
        }),
        None => Ok(()),
    }
}

/// The handles as the library takes them, relative to `origin`. Targets are rounded to `T` once.
///
/// A vertex that some face uses is expected, which every file is checked for.
pub fn to_handles<T: Scalar>(
    constraints: &[Constraint],
    processing: &ProcessingMesh,
    origin: Point3<f64>,
) -> Handles<T> {
    // One group for each run of vertices that are held alike.
    let alike = |a: &Constraint, b: &Constraint| {
        let kinds = [a, b].map(|c| matches!(c.goal, Goal::Stay));
        a.place == b.place && a.weight == b.weight && a.turn == b.turn && kinds[0] == kinds[1]
    };
    let mut handles = Handles::new();
    for run in constraints.chunk_by(alike) {
        let vertices: Vec<_> = run
            .iter()
            .filter_map(|c| processing.vertex(c.vertex))
            .collect();
        let targets = run.iter().filter_map(|c| match c.goal {
            Goal::Stay => None,
            Goal::To(target) => Some(Point3::from((target - origin).map(T::of_f64))),
        });
        let targets: Vec<_> = targets.collect();
        let motion = if targets.is_empty() {
            Motion::Stay
        } else {
            Motion::To(targets)
        };
        handles = handles.add(vertices, motion);
        if let Some(turn) = run[0].turn {
            handles = handles.turned(turn.map(T::of_f64));
        }
        if let Some(weight) = run[0].weight {
            handles = handles.soft(weight);
        }
    }
    handles
}
