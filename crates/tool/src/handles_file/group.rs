//! Groups of vertices that move alike, which an editor shows as one handle.

use nalgebra::{Matrix4, Point3, Vector3};

use super::transform::apply;
use super::{Constraint, Contents, Goal, HandlePlace, Kind};

/// Vertices that are held together.
#[derive(Clone, PartialEq, Debug)]
pub struct Group {
    /// The 0-based vertex indices.
    pub vertices: Vec<usize>,
    /// The motion of the vertices.
    pub motion: GroupMotion,
    /// The weight of their springs, if the group is soft.
    pub weight: Option<f64>,
    /// The rotation vector of the motion in radians, if it is stated: a rotation of more than half
    /// a turn, which the motion alone does not distinguish from the complementary one.
    pub turn: Option<Vector3<f64>>,
}

/// The motion of the vertices of a group.
#[derive(Clone, PartialEq, Debug)]
pub enum GroupMotion {
    /// The vertices stay in place.
    Fixed,
    /// An affine transform, which acts on columns (x, y, z, 1): its last row is 0 0 0 1.
    Matrix(Matrix4<f64>),
    /// A target point for each vertex, in vertex order.
    To(Vec<Point3<f64>>),
}

impl Group {
    /// Returns the goal of each vertex, given the rest positions of all vertices.
    ///
    /// Vertices without a position or a target point are omitted.
    pub fn goals(&self, positions: &[Point3<f64>]) -> Vec<(usize, Goal)> {
        let vertices = self.vertices.iter().copied();
        match &self.motion {
            GroupMotion::Fixed => vertices.map(|vertex| (vertex, Goal::Stay)).collect(),
            GroupMotion::Matrix(matrix) => vertices
                .filter_map(|vertex| {
                    let position = *positions.get(vertex)?;
                    Some((vertex, Goal::To(apply(matrix, position))))
                })
                .collect(),
            GroupMotion::To(points) => {
                let goals = points.iter().map(|&point| Goal::To(point));
                vertices.zip(goals).collect()
            }
        }
    }
}

/// Converts groups to constraints per vertex, whose places are the group indices.
///
/// `positions` are the rest positions of the document.
pub fn constraints(groups: &[Group], positions: &[Point3<f64>]) -> Vec<Constraint> {
    let of_group = |(index, group): (usize, &Group)| {
        let (weight, turn) = (group.weight, group.turn);
        let goals = group.goals(positions).into_iter();
        goals
            .map(move |(vertex, goal)| Constraint {
                vertex,
                goal,
                weight,
                turn,
                place: HandlePlace::Handle(index),
            })
            .collect::<Vec<_>>()
    };
    groups.iter().enumerate().flat_map(of_group).collect()
}

impl Contents {
    /// Groups the constraints after they were mapped to the surface.
    pub(super) fn groups(&self, held: Vec<Constraint>, positions: &[Point3<f64>]) -> Vec<Group> {
        if self.kind == Kind::Sel {
            let is_fixed = |c: &Constraint| c.goal == Goal::Stay;
            let (fixed, moved): (Vec<_>, Vec<_>) = held.into_iter().partition(is_fixed);
            let matrix = self.matrices.first().map(|(_, matrix)| matrix);
            let kinds = [fixed, moved];
            let kinds = kinds.iter().filter(|kind| !kind.is_empty());
            return kinds.map(|kind| group(kind, matrix, positions)).collect();
        }
        let of_place = |place| {
            let found = self.matrices.binary_search_by_key(&place, |(at, _)| *at);
            found.ok().map(|index| &self.matrices[index].1)
        };
        let runs = held.chunk_by(|a, b| a.place == b.place);
        runs.map(|run| group(run, of_place(run[0].place), positions))
            .collect()
    }
}

/// Builds a group from a non-empty list of constraints of one kind.
fn group(held: &[Constraint], matrix: Option<&Matrix4<f64>>, rest: &[Point3<f64>]) -> Group {
    let points = held.iter().map(|c| match c.goal {
        Goal::Stay => rest.get(c.vertex).copied().unwrap_or_default(),
        Goal::To(point) => point,
    });
    // The transform does not give the targets of vertices that were welded within a distance.
    let by_matrix = matrix.filter(|matrix| {
        held.iter().zip(points.clone()).all(|(c, point)| {
            let from = rest.get(c.vertex);
            from.is_some_and(|&from| same_bits(apply(matrix, from), point))
        })
    });
    let motion = match by_matrix {
        _ if held.iter().all(|c| c.goal == Goal::Stay) => GroupMotion::Fixed,
        Some(matrix) => GroupMotion::Matrix(*matrix),
        None => GroupMotion::To(points.collect()),
    };
    Group {
        vertices: held.iter().map(|c| c.vertex).collect(),
        motion,
        weight: held.first().and_then(|c| c.weight),
        turn: held.first().and_then(|c| c.turn),
    }
}

fn same_bits(a: Point3<f64>, b: Point3<f64>) -> bool {
    (0..3).all(|k| a[k].to_bits() == b[k].to_bits())
}
