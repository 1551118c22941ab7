//! Handles as JSON: `{"handles": [{"vertices": …, "to" | "transform" | "fixed": …, "weight":
//! k}], "parts": …}`.

use std::fmt;

use cotan::geometry::Readable;
use nalgebra::{Matrix4, Point3, Vector3};
use serde::de::{Error as _, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::constraint::{Constraint, Goal};
use super::error::{HandlePlace, HandlesError};
use super::group::{Group, GroupMotion};
use super::part_settings::PartSettings;
use super::selection::Selection;
use super::transform::{Rotate, Transform, apply, from_rows};
use super::vertices::Vertices;

/// Reads a handles file. `matrices` receives the transforms of those handles that have one.
pub(super) fn read(
    contents: &str,
    mesh: &Vertices<'_>,
    matrices: &mut Vec<(HandlePlace, Matrix4<f64>)>,
) -> Result<Vec<Constraint>, HandlesError> {
    let file: File = serde_json::from_str(contents).map_err(HandlesError::Json)?;
    let mut constraints = Vec::new();
    for (index, handle) in file.handles.0.iter().enumerate() {
        let place = HandlePlace::Handle(index);
        let matrix = handle.constrain(place, mesh, &mut constraints)?;
        matrices.extend(matrix.map(|matrix| (place, matrix)));
    }
    Ok(constraints)
}

/// Reads which parts follow.
pub(super) fn read_parts(contents: &str) -> Result<PartSettings, HandlesError> {
    let file: File = serde_json::from_str(contents).map_err(HandlesError::Json)?;
    Ok(file.parts)
}

/// Reads groups written by [`to_json`](super::to_json) without a mesh.
///
/// Their vertices are listed by index and move by a matrix, to points, or not at all. The caller
/// has to check that the vertices exist.
///
/// # Errors
/// [`HandlesError`] with the handle and the problem; also for a box, a sphere or a transform
/// given by parts, which require the mesh.
pub fn from_json(contents: &str) -> Result<Vec<Group>, HandlesError> {
    let file: File = serde_json::from_str(contents).map_err(HandlesError::Json)?;
    let entries = file.handles.0.into_iter().enumerate();
    entries
        .map(|(index, entry)| entry.group(HandlePlace::Handle(index)))
        .collect()
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    handles: HandleList,
    #[serde(default)]
    parts: PartSettings,
}

#[derive(Debug)]
struct HandleList(Vec<HandleEntry>);

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct HandleEntry {
    vertices: Selection,
    to: Option<Vec<Triple>>,
    transform: Option<TransformEntry>,
    fixed: Option<bool>,
    weight: Option<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct TransformEntry {
    translate: Option<Triple>,
    rotate: Option<RotateEntry>,
    scale: Option<f64>,
    matrix: Option<Vec<Vec<f64>>>,
    /// With a matrix: its rotation vector in degrees.
    turn: Option<Triple>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RotateEntry {
    axis: Triple,
    degrees: f64,
    about: Option<Triple>,
}

/// Three coordinates.
#[derive(Clone, Copy, PartialEq, Debug, Deserialize)]
#[serde(try_from = "Vec<f64>")]
pub(super) struct Triple([f64; 3]);

impl TryFrom<Vec<f64>> for Triple {
    type Error = String;

    fn try_from(numbers: Vec<f64>) -> Result<Self, String> {
        let found = numbers.len();
        let numbers = <[f64; 3]>::try_from(numbers);
        numbers
            .map(Self)
            .map_err(|_| format!("expected three numbers [x, y, z], found {found}"))
    }
}

impl Triple {
    pub(super) fn point(self) -> Point3<f64> {
        Point3::from(self.0)
    }

    fn vector(self) -> Vector3<f64> {
        Vector3::from(self.0)
    }
}

impl HandleEntry {
    /// Adds the handle's vertices and their targets; returns the transform that moves them, if
    /// there is one.
    fn constrain(
        &self,
        place: HandlePlace,
        mesh: &Vertices<'_>,
        constraints: &mut Vec<Constraint>,
    ) -> Result<Option<Matrix4<f64>>, HandlesError> {
        let mut map = None;
        let invalid = |problem: String| HandlesError::Invalid { place, problem };
        self.check_weight(place)?;
        let mut turn = None;
        let vertices = self.vertices.vertices(mesh, place)?;
        let goals = match (&self.to, &self.transform, self.fixed) {
            (Some(targets), None, None) => {
                if targets.len() != vertices.len() {
                    let (vertices, targets) = (vertices.len(), targets.len());
                    return Err(HandlesError::TargetCount {
                        place,
                        vertices,
                        targets,
                    });
                }
                targets
                    .iter()
                    .map(|target| Goal::To(target.point()))
                    .collect()
            }
            (None, Some(entry), None) => {
                let positions = vertices
                    .iter()
                    .map(|&v| mesh.position(v, place))
                    .collect::<Result<Vec<_>, _>>()?;
                let matrix = entry
                    .transform()
                    .matrix(centroid(&positions))
                    .map_err(invalid)?;
                map = Some(matrix);
                turn = entry.transform().wide_turn();
                positions
                    .iter()
                    .map(|&p| Goal::To(apply(&matrix, p)))
                    .collect()
            }
            (None, None, Some(true)) => vec![Goal::Stay; vertices.len()],
            (None, None, _) => {
                return Err(invalid(
                    "has no goal; add \"to\", \"transform\" or \"fixed\": true".into(),
                ));
            }
            _ => {
                return Err(invalid(
                    "has more than one goal; keep one of \"to\", \"transform\", \"fixed\"".into(),
                ));
            }
        };
        let weight = self.weight;
        let with_goals = vertices.into_iter().zip(goals);
        constraints.extend(with_goals.map(|(vertex, goal)| Constraint {
            vertex,
            goal,
            weight,
            turn,
            place,
        }));
        Ok(map)
    }

    fn check_weight(&self, place: HandlePlace) -> Result<(), HandlesError> {
        match self.weight.filter(|w| !(*w > 0.0)) {
            Some(weight) => Err(HandlesError::Invalid {
                place,
                problem: format!("has the weight {}; give a number above 0", Readable(weight)),
            }),
            None => Ok(()),
        }
    }

    fn group(self, place: HandlePlace) -> Result<Group, HandlesError> {
        let invalid = |problem: String| HandlesError::Invalid { place, problem };
        self.check_weight(place)?;
        let Selection::Numbers(vertices) = self.vertices else {
            return Err(invalid("has no list of vertices".into()));
        };
        let transform = self.transform.as_ref().map(TransformEntry::transform);
        let turn = transform.as_ref().and_then(Transform::wide_turn);
        let matrix = transform.map(|transform| transform.matrix);
        let motion = match (self.to, matrix, self.fixed) {
            (Some(targets), None, None) if targets.len() == vertices.len() => {
                GroupMotion::To(targets.into_iter().map(Triple::point).collect())
            }
            (Some(targets), None, None) => {
                let (vertices, targets) = (vertices.len(), targets.len());
                return Err(HandlesError::TargetCount {
                    place,
                    vertices,
                    targets,
                });
            }
            (None, Some(Some(rows)), None) => {
                let matrix = from_rows(&rows);
                let with_place = |problem| invalid(format!("has a matrix that {problem}"));
                GroupMotion::Matrix(matrix.map_err(with_place)?)
            }
            (None, None, Some(true)) => GroupMotion::Fixed,
            _ => {
                let problem = "needs one of \"to\", a matrix and \"fixed\": true";
                return Err(invalid(problem.into()));
            }
        };
        Ok(Group {
            vertices,
            motion,
            weight: self.weight,
            turn,
        })
    }
}

impl TransformEntry {
    fn transform(&self) -> Transform {
        Transform {
            scale: self.scale,
            rotate: self.rotate.as_ref().map(|rotate| Rotate {
                axis: rotate.axis.vector(),
                degrees: rotate.degrees,
                about: rotate.about.map(Triple::point),
            }),
            translate: self.translate.map(Triple::vector),
            matrix: self.matrix.clone(),
            turn: self.turn.map(|turn| turn.vector().map(f64::to_radians)),
        }
    }
}

/// The mean of the positions; the origin if there are none.
fn centroid(positions: &[Point3<f64>]) -> Point3<f64> {
    let sum: Vector3<f64> = positions.iter().map(|p| p.coords).sum();
    Point3::from(sum / positions.len().max(1) as f64)
}

impl<'de> Deserialize<'de> for HandleList {
    // Implemented manually, so that an error inside names its handle.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct List;

        impl<'de> Visitor<'de> for List {
            type Value = HandleList;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a list of handles")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<HandleList, A::Error> {
                let mut list = Vec::new();
                loop {
                    let index = list.len();
                    let next = seq.next_element();
                    let at = |e: A::Error| A::Error::custom(format!("handle {index}: {e}"));
                    match next.map_err(at)? {
                        Some(entry) => list.push(entry),
                        None => return Ok(HandleList(list)),
                    }
                }
            }
        }

        deserializer.deserialize_seq(List)
    }
}
