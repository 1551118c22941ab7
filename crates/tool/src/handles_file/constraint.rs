//! A held vertex, the common form of all handles files.

use cotan::geometry::Scalar;
use cotan::{Handles, Motion};
use cotan_io::ProcessingMesh;
use nalgebra::{Point3, Vector3};

use super::error::{HandlePlace, HandlesError};
use super::vertices::Vertices;

/// A vertex of the mesh file and its target.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Constraint {
    /// The 0-based vertex index in the mesh file.
    pub vertex: usize,
    /// The target.
    pub goal: Goal,
    /// The weight of its spring, if given in the file.
    pub weight: Option<f64>,
    /// The rotation vector that moves it, in radians, if the file states a rotation of more than
    /// half a turn.
    pub turn: Option<Vector3<f64>>,
    /// The location in the handles file.
    pub place: HandlePlace,
}

/// The target of a held vertex.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Goal {
    /// The current position.
    Stay,
    /// This point, in the units of the mesh file.
    To(Point3<f64>),
}

impl Constraint {
    /// Returns `true` if the vertex leaves its position, or returns to it by a full turn.
    pub fn moves(&self, from: Point3<f64>) -> bool {
        self.turn.is_some() || matches!(self.goal, Goal::To(target) if target != from)
    }
}

/// Rejects vertices that do not exist, targets that are not finite, and vertices with two
/// different targets.
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

/// Converts constraints to handles of the library, relative to `origin`.
///
/// Targets are rounded to `T` once.
///
/// Each vertex must be used by a face, which is checked for every file.
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
