//! The triangles of a picture: a coloured surface, and dots.

use cotan::geometry::Positions;
use cotan::halfedge::{FaceId, HalfedgeMesh, VertexId, VertexMap};
use nalgebra::Vector3;

use super::camera::Camera;
use super::raster::{Corner, Paint};

/// A surface in camera coordinates, as triangles on the panel.
#[derive(Clone, Debug)]
pub(super) struct Scene<'a> {
    mesh: &'a HalfedgeMesh,
    camera: &'a Camera,
    /// Positions, and area vectors of the faces, in camera coordinates.
    local: VertexMap<Vector3<f64>>,
    areas: Vec<Vector3<f64>>,
    corners: Vec<Corner>,
}

impl<'a> Scene<'a> {
    /// Makes the surface. `color` gives the linear colour of a corner, the vertex of a face.
    pub(super) fn new(
        mesh: &'a HalfedgeMesh,
        positions: &Positions<f64>,
        camera: &'a Camera,
        color: impl Fn(FaceId, VertexId) -> [f32; 3],
    ) -> Self {
        let local = positions.map(|p| camera.local(*p));
        let areas = mesh.faces().map(|f| {
            let [a, b, c] = mesh.triangle(f).map(|v| local[v]);
            (b - a).cross(&(c - a))
        });
        let areas = areas.collect();
        let mut scene = Self {
            mesh,
            camera,
            local,
            areas,
            corners: Vec::new(),
        };
        mesh.faces().for_each(|f| scene.face(f, &color));
        scene
    }

    /// Three corners per triangle.
    pub(super) fn corners(&self) -> &[Corner] {
        &self.corners
    }

    fn face(&mut self, face: FaceId, color: impl Fn(FaceId, VertexId) -> [f32; 3]) {
        let vertices = self.mesh.triangle(face);
        let corners = vertices.map(|v| self.camera.project(self.local[v]));
        let area = signed_area(corners);
        // A triangle seen edge-on covers nothing, and its map to the panel has no inverse.
        if !(area.abs() > 1e-12) {
            return;
        }
        let is_back = area < 0.0;
        for (v, position) in vertices.into_iter().zip(corners) {
            let mut normal = self.corner_normal(v, face);
            let mut color = color(face, v);
            if is_back {
                normal = -normal;
                color = INSIDE;
            }
            let paint = Paint {
                normal: normal.map(|x| x as f32).into(),
                color,
            };
            self.corners.push(Corner { position, paint });
        }
    }

    /// The normal of the faces around the vertex whose angle to this face is below the crease
    /// angle.
    fn corner_normal(&self, v: VertexId, face: FaceId) -> Vector3<f64> {
        let area = |f: FaceId| self.areas[f.index()];
        let own = area(face);
        let smooth: Vector3<f64> = self
            .mesh
            .vertex_faces(v)
            .map(area)
            .filter(|a| a.dot(&own) >= COS_CREASE * a.norm() * own.norm())
            .sum();
        smooth.try_normalize(0.0).unwrap_or_else(Vector3::z)
    }

    /// Adds a disc that faces the camera, slightly in front of the vertex.
    pub(super) fn dot(&mut self, v: VertexId, color: [f32; 3]) {
        let center = self.local[v];
        let radius = DOT_PIXELS * self.camera.pixel(center);
        let center = center + Vector3::z() * radius;
        let rim = |k: usize| {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / DOT_SIDES as f64).sin_cos();
            center + Vector3::new(cos, sin, 0.0) * radius
        };
        let paint = Paint {
            normal: FACING,
            color,
        };
        for k in 0..DOT_SIDES {
            for p in [center, rim(k), rim((k + 1) % DOT_SIDES)] {
                self.corners.push(Corner {
                    position: self.camera.project(p),
                    paint,
                });
            }
        }
    }
}

/// Twice the area on the panel; negative if seen from behind.
fn signed_area(corners: [[f32; 4]; 3]) -> f32 {
    let [a, b, c] = corners.map(|p| [p[0] / p[3], p[1] / p[3]]);
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// The colour of the inside of an open mesh.
const INSIDE: [f32; 3] = [0.42, 0.30, 0.28];

/// Faces at more than 60° to each other form a crease: a box has sharp edges, a coarse ear has
/// none.
const COS_CREASE: f64 = 0.5;

const DOT_PIXELS: f64 = 6.0;
const DOT_SIDES: usize = 16;

/// The normal of a dot: seen from the front, slightly from above.
const FACING: [f32; 3] = [0.0, 0.3, 0.95];
