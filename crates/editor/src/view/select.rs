//! Selection of vertices on the screen, by a brush on the surface or by a lasso.

use std::collections::HashSet;

use cotan::halfedge::{FaceId, HalfedgeMesh, VertexId};
use cotan_parallel::Chunks;
use eframe::egui::{Pos2, Rect, Vec2};

use crate::view::pick::Picker;
use crate::view::snapshot::CameraSnapshot;

/// The reach of a lasso.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Reach {
    /// Visible vertices only.
    #[default]
    Visible,
    /// All vertices inside the lasso, including hidden ones.
    Through,
}

/// Selects the visible vertices within `radius` points of the pointer, on the piece of the
/// surface under the pointer.
///
/// Other parts of the surface in front or behind are left out.
///
/// The piece consists of the triangles that can be reached from the one under the pointer via
/// triangles that touch the circle and face the same way. If nothing is under the pointer,
/// nothing is selected. The result is sorted.
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
        // The corners of a triangle that reaches behind the eye do not tell whether its visible
        // part is under the brush. The triangle under the pointer certainly is.
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

/// Selects the vertices inside a polygon on the screen.
///
/// The polygon may intersect itself; the inside is where the winding number is not zero. The
/// result is sorted.
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

/// Returns `true` if a triangle intersects the disc of the given radius around the origin.
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

/// The winding number of a polygon around a point.
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

/// Vertices per task: a ray is cast for each.
const CHUNKS: Chunks = Chunks::of(64);

#[cfg(test)]
#[path = "select_tests.rs"]
mod tests;
