//! Groups of vertices that are held.

use std::f64::consts::PI;

use cotan::geometry::Positions;
use cotan::halfedge::VertexId;
use cotan::linear::Hold;
use cotan::{Handles, Motion, nearest_turn};
use nalgebra::{Matrix4, Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::plain;

/// A group of vertices held by the user.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct HandleGroup {
    /// The name shown in the list of handles.
    pub name: String,
    /// The vertices, sorted and without duplicates.
    #[serde(with = "plain::ids")]
    pub vertices: Vec<VertexId>,
    /// The role: fixed or movable.
    pub role: Role,
    /// The positions of the vertices when the group was made.
    pub origin: Origin,
    /// The motion applied to the group since then.
    #[serde(with = "plain::matrix")]
    pub matrix: Matrix4<f64>,
    /// The rotation vector of that motion in radians, which may exceed half a turn.
    #[serde(with = "plain::vector")]
    pub turn: Vector3<f64>,
    /// The kind of constraint: exact or by springs.
    #[serde(with = "plain::hold")]
    pub hold: Hold,
}

/// The role of a group of handles.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// The group stays where it is.
    Fixed,
    /// The group can be dragged.
    Movable,
}

/// The positions of a group's vertices when it was made.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// The positions in the rest shape.
    Rest,
    /// One position per vertex, in the order of `vertices`: the group was made on a deformed
    /// shape or read from a file.
    Places(#[serde(with = "plain::points")] Vec<Point3<f64>>),
}

impl HandleGroup {
    /// Makes a group whose vertices are held at their positions in `shape`.
    pub fn new(
        name: String,
        vertices: Vec<VertexId>,
        role: Role,
        rest: &Positions<f64>,
        shape: &Positions<f64>,
    ) -> Self {
        let is_at_rest = vertices.iter().all(|&v| rest.get(v) == shape.get(v));
        let origin = match is_at_rest {
            true => Origin::Rest,
            false => {
                let places = vertices.iter().filter_map(|&v| shape.get(v).copied());
                Origin::Places(places.collect())
            }
        };
        Self {
            name,
            vertices,
            role,
            origin,
            matrix: Matrix4::identity(),
            turn: Vector3::zeros(),
            hold: Hold::Hard,
        }
    }

    /// Replaces the motion. Of the turns that it can mean, the one that differs least from the
    /// turn before is taken.
    pub fn move_to(&mut self, matrix: Matrix4<f64>) {
        self.turn = nearest_turn(&matrix, &self.turn);
        self.matrix = matrix;
    }

    /// The turn that a deformation or a file is to know, which the motion alone does not tell.
    pub fn stated_turn(&self) -> Option<Vector3<f64>> {
        // Two groups that turn by less are never wound relative to each other. The turn of places
        // on a deformed shape is not that of the rest shape.
        let is_wide = self.turn.norm() > 0.5 * PI && self.origin == Origin::Rest;
        is_wide.then_some(self.turn)
    }

    /// Returns the motion in the form that a deformation takes.
    pub fn job_motion(&self) -> Motion<f64> {
        let is_still = self.matrix == Matrix4::identity();
        match &self.origin {
            Origin::Rest if is_still => Motion::Stay,
            Origin::Rest => Motion::Transform(self.matrix),
            Origin::Places(places) if is_still => Motion::To(places.clone()),
            Origin::Places(places) => {
                let moved = places.iter().map(|p| self.matrix.transform_point(p));
                Motion::To(moved.collect())
            }
        }
    }

    /// The centroid of the group before it was moved, given the rest shape.
    pub fn pivot(&self, rest: &Positions<f64>) -> Point3<f64> {
        let share = 1.0 / self.vertices.len().max(1) as f64;
        let mut sum = Vector3::zeros();
        match &self.origin {
            Origin::Places(places) => places.iter().for_each(|p| sum += p.coords * share),
            Origin::Rest => {
                let at = self.vertices.iter().filter_map(|&v| rest.get(v));
                at.for_each(|p| sum += p.coords * share);
            }
        }
        Point3::from(sum)
    }

    /// The centroid of the group at its current position.
    pub fn center(&self, rest: &Positions<f64>) -> Point3<f64> {
        self.matrix.transform_point(&self.pivot(rest))
    }

    /// The group on a new rest shape, holding its vertices where they are there.
    #[must_use]
    pub fn on(&self, shape: &Positions<f64>) -> Self {
        let vertices = self.vertices.clone();
        Self {
            hold: self.hold,
            ..Self::new(self.name.clone(), vertices, self.role, shape, shape)
        }
    }

    /// Removes vertices, which are sorted, from the group.
    pub fn let_go(&mut self, vertices: &[VertexId]) {
        let is_kept = |v: &VertexId| vertices.binary_search(v).is_err();
        if let Origin::Places(places) = &mut self.origin {
            let mut of = self.vertices.iter();
            places.retain(|_| of.next().is_some_and(is_kept));
        }
        self.vertices.retain(is_kept);
    }

    /// Returns `true` if the group is one of a mesh of so many vertices, with finite numbers.
    pub(crate) fn fits(&self, num_vertices: usize) -> bool {
        let is_sorted = self.vertices.is_sorted_by(|a, b| a < b);
        let is_inside = self
            .vertices
            .last()
            .is_some_and(|v| v.index() < num_vertices);
        let places = match &self.origin {
            Origin::Rest => true,
            Origin::Places(places) => {
                let numbers = places.iter().flat_map(|p| p.iter());
                places.len() == self.vertices.len() && numbers.copied().all(f64::is_finite)
            }
        };
        let numbers = self.matrix.iter().chain(self.turn.iter());
        let is_held = match self.hold {
            Hold::Hard => true,
            Hold::Soft(weight) => weight.is_finite() && weight > 0.0,
        };
        is_sorted && is_inside && places && is_held && numbers.copied().all(f64::is_finite)
    }
}

/// Builds the handles of a deformation.
///
/// If parts are to be still, a last group fixes the vertices in `loose`, those of the parts
/// that have none.
pub fn job_handles(handles: &[HandleGroup], loose: &[VertexId]) -> Handles<f64> {
    let mut all = Handles::new();
    for group in handles {
        all = all.add(group.vertices.iter().copied(), group.job_motion());
        if let Hold::Soft(weight) = group.hold {
            all = all.soft(weight);
        }
        if let Some(turn) = group.stated_turn() {
            all = all.turned(turn);
        }
    }
    if !loose.is_empty() {
        all = all.fix(loose.iter().copied());
    }
    all
}

/// A name that no group has: a letter for a movable one, a number for a fixed one.
pub(crate) fn free_name(handles: &[HandleGroup], role: Role) -> String {
    let is_free = |name: &String| handles.iter().all(|group| group.name != *name);
    let mut names: Box<dyn Iterator<Item = String>> = match role {
        Role::Fixed => Box::new((1..).map(|k| format!("Fixed {k}"))),
        Role::Movable => {
            let letters = ('A'..='Z').map(String::from);
            Box::new(letters.chain((1..).map(|k| format!("Handle {k}"))))
        }
    };
    names.find(is_free).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_group_is_moved_from_its_rest() {
        let rest: Positions<f64> = [0.0, 2.0]
            .map(|x| Point3::new(x, 0.0, 0.0))
            .into_iter()
            .collect();
        let all = vec![VertexId::new(0), VertexId::new(1)];
        let mut group = HandleGroup::new("A".to_owned(), all.clone(), Role::Movable, &rest, &rest);
        assert_eq!(group.job_motion(), Motion::Stay);
        group.matrix = Matrix4::new_translation(&Vector3::z());
        assert_eq!(group.center(&rest), Point3::new(1.0, 0.0, 1.0));
        // A group made on a deformed shape is held where it is in that shape.
        let bent = rest.map(|p| p + Vector3::y());
        let mut made = HandleGroup::new("B".to_owned(), all, Role::Fixed, &rest, &bent);
        assert_eq!(made.center(&rest), Point3::new(1.0, 1.0, 0.0));
        assert_eq!(
            made.job_motion(),
            Motion::To(bent.values().copied().collect())
        );
        let handles = job_handles(&[group], &[]);
        assert_eq!(handles.len(), 1);
        made.let_go(&[VertexId::new(0)]);
        let second = vec![Point3::new(2.0, 1.0, 0.0)];
        assert_eq!(made.origin, Origin::Places(second));
        assert!(made.fits(2) && !made.fits(1));
    }
}
