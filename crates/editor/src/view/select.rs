//! Selecting vertices on the screen: by a brush on the surface, by a lasso around them.

use std::collections::HashSet;

use cotan::halfedge::{FaceId, HalfedgeMesh, VertexId};
use cotan_parallel::Chunks;
use eframe::egui::{Pos2, Rect, Vec2};

use crate::view::pick::Picker;
use crate::view::snapshot::CameraSnapshot;

/// Whether a lasso takes what is hidden.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Reach {
    /// Only what one sees.
    #[default]
    Visible,
    /// All that is inside, through the surface.
    Through,
}

/// The visible vertices within `radius` points of the pointer, on the piece of the surface under
/// the pointer: what the brush's circle covers of other limbs before or behind is left out.
///
/// The piece is what one reaches from the triangle under the pointer over triangles that touch the
/// circle and show the same side. Nothing under the pointer, nothing selected. Sorted.
#[must_use]
pub fn brush(
    mesh: &HalfedgeMesh,
    picker: &Picker,
    camera: &CameraSnapshot,
    pos: Pos2,
    radius: f32,
) -> Vec<VertexId> {
    let Some(hit) = picker.hit(&camera.ray(pos)) else {
        return Vec::new();
    };
    let corners = |face: FaceId| mesh.triangle(face);
    let shown = |face: FaceId| -> Option<[Vec2; 3]> {
        let [a, b, c] = corners(face).map(|v| camera.project(picker.positions()[v]));
        Some([a? - pos, b? - pos, c? - pos])
    };
    let side = shown(hit.face).map_or(0.0, signed_area).signum();
    let mut seen = HashSet::from([hit.face]);
    let mut stack = vec![hit.face];
    let mut vertices = Vec::new();
    while let Some(face) = stack.pop() {
        // A triangle that reaches behind the eye: its visible part may be under the brush, but
        // whether it is cannot be told from its corners. The one under the pointer is.
        let triangle = shown(face);
        let is_covered = match triangle {
            Some(t) => signed_area(t) * side > 0.0 && touches(t, radius),
            None => false,
        };
        if !is_covered && face != hit.face {
            continue;
        }
        if let Some(places) = triangle {
            let near = corners(face).into_iter().zip(places);
            vertices.extend(near.filter(|(_, p)| p.length() <= radius).map(|(v, _)| v));
        }
        for halfedge in mesh.face_halfedges(face) {
            let across = mesh.face(halfedge.twin());
            stack.extend(across.filter(|f| seen.insert(*f)));
        }
    }
    vertices.sort_unstable();
    vertices.dedup();
    only_visible(vertices, picker, camera)
}

/// The vertices inside a polygon on the screen, which may cross itself (what it winds around is
/// inside). Sorted.
#[must_use]
pub fn lasso(
    picker: &Picker,
    camera: &CameraSnapshot,
    polygon: &[Pos2],
    reach: Reach,
) -> Vec<VertexId> {
    let bounds = Rect::from_points(polygon);
    let positions = picker.positions().as_slice();
    let is_inside = |i: usize| {
        camera
            .project(positions[i])
            .is_some_and(|p| bounds.contains(p) && winding(polygon, p) != 0)
    };
    let vertices = CHUNKS.filter_map(positions.len(), |i| is_inside(i).then(|| VertexId::new(i)));
    match reach {
        Reach::Visible => only_visible(vertices, picker, camera),
        Reach::Through => vertices,
    }
}

fn only_visible(
    vertices: Vec<VertexId>,
    picker: &Picker,
    camera: &CameraSnapshot,
) -> Vec<VertexId> {
    CHUNKS.filter_map(vertices.len(), |i| {
        Some(vertices[i]).filter(|v| picker.visible(*v, camera))
    })
}

fn cross(a: Vec2, b: Vec2) -> f32 {
    a.x * b.y - a.y * b.x
}

fn signed_area([a, b, c]: [Vec2; 3]) -> f32 {
    0.5 * cross(b - a, c - a)
}

/// Whether a triangle and the disc of a radius around the origin have a point in common.
fn touches(triangle: [Vec2; 3], radius: f32) -> bool {
    let [a, b, c] = triangle;
    let sides = [(a, b), (b, c), (c, a)];
    let turns = sides.map(|(p, q)| cross(p, q));
    let holds_origin = turns.iter().all(|t| *t >= 0.0) || turns.iter().all(|t| *t <= 0.0);
    holds_origin || sides.iter().any(|(p, q)| from_origin(*p, *q) <= radius)
}

/// The distance of a segment from the origin.
fn from_origin(p: Vec2, q: Vec2) -> f32 {
    let along = q - p;
    let share = -p.dot(along) / along.length_sq().max(f32::MIN_POSITIVE);
    (p + along * share.clamp(0.0, 1.0)).length()
}

/// How often a polygon winds around a point, counterclockwise or not.
fn winding(polygon: &[Pos2], point: Pos2) -> i32 {
    let next = polygon.iter().cycle().skip(1);
    polygon
        .iter()
        .zip(next)
        .map(|(a, b)| {
            let turn = cross(*b - *a, point - *a);
            match (a.y <= point.y, b.y <= point.y) {
                (true, false) if turn > 0.0 => 1,
                (false, true) if turn < 0.0 => -1,
                _ => 0,
            }
        })
        .sum()
}

/// Vertices of a task: a ray is shot for each of them.
const CHUNKS: Chunks = Chunks::of(64);

#[cfg(test)]
#[path = "select_tests.rs"]
mod tests;
