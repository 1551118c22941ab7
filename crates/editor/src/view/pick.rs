//! Picking under the pointer, and visibility of vertices.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use cotan::geometry::{Positions, Ray, TriangleTree, triangle_corners};
use cotan::halfedge::{FaceId, HalfedgeMesh, VertexId};
use eframe::egui::Pos2;
use nalgebra::Point3;

use crate::view::snapshot::CameraSnapshot;

/// Finds triangles and vertices of a shape by ray casting.
pub struct Picker {
    tree: TriangleTree,
    /// The faces of the triangles; `None` if they are all, in their order.
    faces: Option<Vec<FaceId>>,
    positions: Positions<f64>,
}

/// The first intersection of a ray with the surface.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Hit {
    /// The triangle that was hit.
    pub face: FaceId,
    /// The vertices of the triangle.
    pub corners: [u32; 3],
    /// The triangle's corner nearest to the point.
    pub vertex: VertexId,
    /// The intersection point.
    pub point: Point3<f64>,
    /// The distance from the ray's origin to the point.
    pub distance: f64,
}

impl Picker {
    /// Builds the search tree, in about a microsecond per triangle on two busy cores.
    ///
    /// **Panics** if there are fewer positions than vertices.
    #[must_use]
    pub fn new(mesh: &HalfedgeMesh, positions: &Positions<f64>) -> Self {
        let triangle = |f| mesh.triangle(f).map(|v| v.index() as u32);
        let triangles = mesh.faces().map(triangle).collect();
        Self::from_tree(TriangleTree::build(triangles, positions), positions)
    }

    /// Builds the search tree of the faces without hidden vertices.
    ///
    /// **Panics** if there are fewer positions than vertices.
    #[must_use]
    pub fn without(mesh: &HalfedgeMesh, positions: &Positions<f64>, hidden: &[VertexId]) -> Self {
        if hidden.is_empty() {
            return Self::new(mesh, positions);
        }
        let is_shown = |f: &FaceId| {
            let corners = mesh.triangle(*f);
            corners.iter().all(|v| hidden.binary_search(v).is_err())
        };
        let faces: Vec<FaceId> = mesh.faces().filter(is_shown).collect();
        let corners = |f: &FaceId| mesh.triangle(*f).map(|v| v.index() as u32);
        let triangles = faces.iter().map(corners).collect();
        Self {
            faces: Some(faces),
            ..Self::from_tree(TriangleTree::build(triangles, positions), positions)
        }
    }

    /// Makes a picker of the search tree of a shape, whose triangles are the faces in their order.
    #[must_use]
    pub fn from_tree(tree: TriangleTree, positions: &Positions<f64>) -> Self {
        Self {
            tree,
            faces: None,
            positions: positions.clone(),
        }
    }

    /// Updates the tree for a shape that has moved, in a tenth of the time of [`Picker::new`].
    ///
    /// After a change of the whole pose a new picker is faster to query.
    ///
    /// **Panics** if the number of positions has changed.
    pub fn refit(&mut self, positions: &Positions<f64>) {
        self.positions
            .as_mut_slice()
            .copy_from_slice(positions.as_slice());
        self.tree.refit(positions);
    }

    /// The positions used for ray casting.
    #[must_use]
    pub fn positions(&self) -> &Positions<f64> {
        &self.positions
    }

    /// The first intersection of a ray with the surface, from either side.
    #[must_use]
    pub fn hit(&self, ray: &Ray) -> Option<Hit> {
        let meeting = self.tree.first(ray, &self.positions)?;
        let point = ray.at(meeting.distance);
        let triangle = self.tree.triangles()[meeting.triangle];
        let squares =
            triangle_corners(triangle, &self.positions).map(|p| (p - point).norm_squared());
        Some(Hit {
            face: match &self.faces {
                Some(faces) => faces[meeting.triangle],
                None => FaceId::new(meeting.triangle),
            },
            corners: triangle,
            vertex: VertexId::new(triangle[least(squares)] as usize),
            point,
            distance: meeting.distance,
        })
    }

    /// Returns `true` if a vertex is beyond the near plane and hidden by no triangles except its
    /// own.
    #[must_use]
    pub fn visible(&self, vertex: VertexId, camera: &CameraSnapshot) -> bool {
        let own = vertex.index() as u32;
        let Some((ray, distance)) = camera.ray_to(self.positions[vertex]) else {
            return false;
        };
        // Another vertex at the same position does not hide this one.
        let limit = distance - 1e-9 * (distance + camera.lens().near);
        !self
            .tree
            .meets_any(&ray, limit, &self.positions, |t| !t.contains(&own))
    }

    /// The visible vertex nearest to the pointer on the screen, within `radius` points.
    ///
    /// If there is none but the pointer is over a triangle, returns the corner of that triangle
    /// nearest on the screen.
    #[must_use]
    pub fn pick_vertex(&self, camera: &CameraSnapshot, pos: Pos2, radius: f32) -> Option<VertexId> {
        // Many vertices may share a pixel, but only the nearest few are tested. A heap avoids
        // sorting the rest.
        let mut near = BinaryHeap::from(self.vertices_near(camera, pos, radius));
        let mut last = None;
        while let Some(Reverse((_, vertex))) = near.pop() {
            // A vertex occurs once for each of its triangles.
            if last.replace(vertex) != Some(vertex) && self.visible(vertex, camera) {
                return Some(vertex);
            }
        }
        self.corner_under(camera, pos)
    }

    /// The vertices within `radius` points of the pointer, including hidden ones, each with the
    /// bits of its distance.
    ///
    /// The bits of non-negative numbers are ordered like the numbers.
    fn vertices_near(
        &self,
        camera: &CameraSnapshot,
        pos: Pos2,
        radius: f32,
    ) -> Vec<Reverse<(u32, VertexId)>> {
        let mut near = Vec::new();
        self.tree.each_near(
            |center, ball| camera.may_touch(center, ball, pos, radius),
            |triangle| {
                for v in triangle.map(|v| VertexId::new(v as usize)) {
                    let away = camera.project(self.positions[v]).map(|p| p.distance(pos));
                    let within = away.filter(|d| *d <= radius);
                    near.extend(within.map(|d| Reverse((d.to_bits(), v))));
                }
            },
        );
        near
    }

    fn corner_under(&self, camera: &CameraSnapshot, pos: Pos2) -> Option<VertexId> {
        let hit = self.hit(&camera.ray(pos))?;
        let away = hit.corners.map(|v| {
            let place = camera.project(self.positions[VertexId::new(v as usize)]);
            place.map_or(f64::INFINITY, |p| f64::from(p.distance(pos)))
        });
        let nearest = least(away);
        // All three corners are behind the eye, so the one nearest in space is used.
        if away[nearest].is_finite() {
            Some(VertexId::new(hit.corners[nearest] as usize))
        } else {
            Some(hit.vertex)
        }
    }
}

/// The index of the smallest of three values.
fn least(values: [f64; 3]) -> usize {
    let [a, b, c] = values;
    match (a <= b && a <= c, b <= c) {
        (true, _) => 0,
        (false, true) => 1,
        (false, false) => 2,
    }
}

#[cfg(test)]
#[path = "pick_tests.rs"]
mod tests;
