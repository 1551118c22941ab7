//! Conversion from the model's `f64` to the card's `f32` without visible loss.

use cotan::geometry::{BoundingBox, Positions};
use nalgebra::{Point3, Vector3};
use three_d::{Mat3, Mat4, Program, Vec2, Vec3, Viewport};

use crate::view::snapshot::CameraSnapshot;

/// The coordinates on the card: relative to a centre, in units of a size.
///
/// They change only when the shape has left them, because all data on the card depends on them.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct LocalFrame {
    center: Point3<f64>,
    size: f64,
}

impl Default for LocalFrame {
    fn default() -> Self {
        Self {
            center: Point3::origin(),
            // No shape fits size 0, so the first shape sets the frame.
            size: 0.0,
        }
    }
}

impl LocalFrame {
    /// Moves the frame to the shape if the shape has left it. Returns whether it moved.
    pub(super) fn follow(&mut self, positions: &Positions<f64>) -> bool {
        let Some(bounds) = BoundingBox::of(positions.values()) else {
            return false;
        };
        let (center, size) = (bounds.center(), 0.5 * bounds.longest_side());
        let fits = (center - self.center).amax() <= self.size
            && size <= 2.0 * self.size
            && size >= 0.25 * self.size;
        let moves = !fits && size.is_finite();
        if moves {
            self.center = center;
            self.size = if size > 0.0 { size } else { 1.0 };
        }
        moves
    }

    pub(super) fn point(&self, p: &Point3<f64>) -> [f32; 3] {
        let local = (p - self.center) / self.size;
        [local.x as f32, local.y as f32, local.z as f32]
    }
}

/// The uniforms of one frame.
pub(super) struct DrawFrame {
    pub(super) viewport: Viewport,
    /// A point near the target that is subtracted first: the difference of close `f32` values is
    /// exact.
    pub(super) pivot: Vec3,
    /// The rotation from the model's axes to the screen's.
    pub(super) turn: Mat3,
    /// The pivot in eye coordinates.
    pub(super) pivot_seen: Vec3,
    /// The matrix from eye coordinates to the cube from −1 to 1.
    pub(super) projection: Mat4,
    /// Width and height in pixels.
    pub(super) size: Vec2,
    /// The focal length: the size in pixels of an object at a depth equal to its length.
    pub(super) focal: f32,
    /// Pixels per egui point.
    pub(super) pixels_per_point: f32,
}

impl DrawFrame {
    pub(super) fn new(
        camera: &CameraSnapshot,
        local: &LocalFrame,
        viewport: Viewport,
        pixels_per_point: f32,
    ) -> Self {
        let scale = if local.size > 0.0 { local.size } else { 1.0 };
        let pivot = local.point(&camera.target());
        // The pivot as the card stores it, after rounding.
        let exact = local.center + Vector3::from(pivot.map(f64::from)) * scale;
        let seen = camera.rotation() * (exact - camera.eye()) / scale;
        let mut projection = camera.projection();
        // Depth in units of the size, like all other lengths.
        projection[(2, 3)] /= scale;
        let column = |i: usize| camera.rotation().matrix().column(i).map(|x| x as f32);
        let turn = [0, 1, 2].map(|i| Vec3::new(column(i).x, column(i).y, column(i).z));
        Self {
            viewport,
            pivot: pivot.into(),
            turn: Mat3::from_cols(turn[0], turn[1], turn[2]),
            pivot_seen: Vec3::new(seen.x as f32, seen.y as f32, seen.z as f32),
            projection: <[[f32; 4]; 4]>::from(projection.map(|x| x as f32)).into(),
            size: Vec2::new(viewport.width as f32, viewport.height as f32),
            focal: camera.lens().focal as f32 * pixels_per_point,
            pixels_per_point,
        }
    }

    /// Sets the uniforms of the camera.
    pub(super) fn send(&self, program: &Program) {
        program.use_uniform("pivot", self.pivot);
        program.use_uniform("pivot_seen", self.pivot_seen);
        program.use_uniform("turn", self.turn);
        program.use_uniform("projection", self.projection);
    }

    /// Sets the uniforms of the screen, needed to draw at constant size.
    pub(super) fn send_screen(&self, program: &Program) {
        program.use_uniform("size", self.size);
        program.use_uniform("focal", self.focal);
        program.use_uniform("pixels_per_point", self.pixels_per_point);
    }
}
