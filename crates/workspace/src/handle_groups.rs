//! Conversion between the handles of the window and the groups of a handles file.

use cotan::geometry::Positions;
use cotan::halfedge::VertexId;
use cotan::linear::Hold;
use cotan::nearest_turn;
use cotan_io::ProcessingMesh;
use cotan_tool::handles_file::{Group, GroupMotion};
use nalgebra::{Matrix4, Point3, Vector3};

use crate::handle::{HandleGroup, Origin, Role};

/// Converts handles to groups with the vertex indices of the document.
pub(crate) fn groups_of(handles: &[HandleGroup], processing: &ProcessingMesh) -> Vec<Group> {
    let group = |handle: &HandleGroup| {
        let motion = match handle.job_motion() {
            cotan::Motion::Stay => GroupMotion::Fixed,
            cotan::Motion::Transform(matrix) => GroupMotion::Matrix(matrix),
            cotan::Motion::To(places) => GroupMotion::To(places),
        };
        let vertices = handle
            .vertices
            .iter()
            .map(|&v| processing.document_vertex(v));
        Group {
            vertices: vertices.collect(),
            motion,
            weight: match handle.hold {
                Hold::Hard => None,
                Hold::Soft(weight) => Some(weight),
            },
            turn: handle.stated_turn(),
        }
    };
    handles.iter().map(group).collect()
}

/// Converts groups with the vertex indices of the document to handles.
pub(crate) fn handles_of(
    groups: &[Group],
    processing: &ProcessingMesh,
    rest: &Positions<f64>,
) -> Vec<HandleGroup> {
    let mut handles = Vec::with_capacity(groups.len());
    for (index, group) in groups.iter().enumerate() {
        let (motion, role) = match &group.motion {
            GroupMotion::Fixed => (None, Role::Fixed),
            GroupMotion::Matrix(matrix) => (Some(*matrix), Role::Movable),
            GroupMotion::To(_) => (None, Role::Movable),
        };
        let mut held: Vec<(VertexId, Point3<f64>)> = Vec::new();
        for (place, &vertex) in group.vertices.iter().enumerate() {
            let Some(v) = processing.vertex(vertex) else {
                continue;
            };
            let at = match &group.motion {
                GroupMotion::To(places) => places.get(place).copied(),
                _ => rest.get(v).copied(),
            };
            held.extend(at.map(|at| (v, at)));
        }
        held.sort_by_key(|(v, _)| *v);
        held.dedup_by_key(|(v, _)| *v);
        let (vertices, places): (Vec<_>, Vec<_>) = held.into_iter().unzip();
        handles.push(HandleGroup {
            name: match role {
                Role::Fixed => format!("Fixed {}", index + 1),
                Role::Movable => format!("Handle {}", index + 1),
            },
            vertices,
            role,
            origin: match group.motion {
                GroupMotion::To(_) => Origin::Places(places),
                _ => Origin::Rest,
            },
            matrix: motion.unwrap_or_else(Matrix4::identity),
            turn: group.turn.unwrap_or_else(|| turn_of(motion.as_ref())),
            hold: group.weight.map_or(Hold::Hard, Hold::Soft),
        });
    }
    handles
}

/// The rotation vector of a motion that states none.
fn turn_of(motion: Option<&Matrix4<f64>>) -> Vector3<f64> {
    motion.map_or_else(Vector3::zeros, |motion| {
        nearest_turn(motion, &Vector3::zeros())
    })
}

#[cfg(test)]
mod tests {
    use cotan_io::Document;
    use cotan_tool::handles_file::{from_json, to_json};
    use nalgebra::{Isometry3, Rotation3};

    use super::*;

    #[test]
    fn handles_come_back_from_their_file_as_they_were() {
        let shape = cotan::shapes::bar::<f64>([4.0, 1.0, 1.0], [16, 4, 4]);
        let document = Document::from_mesh(shape.connectivity(), shape.positions()).unwrap();
        let processing = document.surface().unwrap();
        let rest = processing.positions();
        let bent = rest.map(|p| p + Vector3::new(0.0, 0.1 * p.x * p.x, 0.0));
        let some = |from: usize| (from..from + 4).map(VertexId::new).collect::<Vec<_>>();
        let named = |vertices, role, at| HandleGroup::new(String::new(), vertices, role, rest, at);
        let mut turned = named(some(10), Role::Movable, rest);
        turned.move_to(Isometry3::new(Vector3::new(0.1, 0.2, 0.3), Vector3::z()).to_homogeneous());
        let mut pulled = named(some(20), Role::Movable, &bent);
        pulled.matrix = Matrix4::new_translation(&Vector3::x());
        pulled.hold = Hold::Soft(3.5);
        // Turned on and on, in four drags of 82.5° each.
        let mut wound = named(some(30), Role::Movable, rest);
        for drag in 1..=4 {
            let turn = Vector3::x() * f64::to_radians(82.5 * f64::from(drag));
            wound.move_to(Rotation3::new(turn).to_homogeneous());
        }
        let handles = [named(some(0), Role::Fixed, rest), turned, pulled, wound];

        let text = to_json(&groups_of(&handles, &processing));
        // Only the one of more than half a turn.
        assert_eq!(text.matches("\"turn\"").count(), 1, "{text}");
        let read = handles_of(&from_json(&text).unwrap(), &processing, rest);
        assert_eq!(read.len(), handles.len());
        for (read, handle) in read.iter().zip(&handles) {
            assert_eq!(read.vertices, handle.vertices);
            assert_eq!(read.hold, handle.hold);
            assert_eq!(read.role, handle.role);
            assert_eq!(read.job_motion(), handle.job_motion());
            assert!((read.turn - handle.turn).norm() < 1e-12);
        }
    }
}
