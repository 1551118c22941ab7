//! The camera: a perspective turntable around a target.
//!
//! All computations use `f64` and differences to the eye or the target, so a mesh far from the
//! origin is drawn and picked as accurately as one around it.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use cotan::geometry::{BoundingBox, Ray};
use eframe::egui::{Pos2, Rect, Vec2};
use nalgebra::{Matrix4, Point3, UnitQuaternion, Vector3};
use transform_gizmo_egui::GizmoConfig;
use transform_gizmo_egui::math::DMat4;

use crate::view::snapshot::{CameraSnapshot, Lens};

/// A camera that orbits a target.
#[derive(Clone, Debug)]
pub struct Camera {
    pose: Pose,
    /// The pose that [`Camera::advance`] moves towards. Equals `pose` while nothing is animated.
    goal: Pose,
    scene: Sphere,
    up: UpAxis,
}

/// The axis of the model that points up on the screen.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum UpAxis {
    /// Common in computer graphics.
    #[default]
    Y,
    /// Common in engineering.
    Z,
}

/// The standard views.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum StandardView {
    /// The front view: against the third axis if Y is up.
    Front,
    /// The back view.
    Back,
    /// The view from the model's right.
    Right,
    /// The view from the model's left.
    Left,
    /// The view from above.
    Top,
    /// The view from below.
    Bottom,
    /// The front view, from slightly right and above.
    Oblique,
}

impl Camera {
    /// Makes a camera that sees all of `bounds` in the oblique view.
    #[must_use]
    pub fn new(bounds: &BoundingBox<f64>) -> Self {
        let scene = Sphere::around(bounds);
        let (yaw, pitch) = StandardView::Oblique.angles();
        let pose = Pose {
            target: scene.center,
            distance: scene.radius,
            yaw,
            pitch,
        };
        let mut camera = Self {
            pose,
            goal: pose,
            scene,
            up: UpAxis::default(),
        };
        camera.fit(bounds);
        camera.jump();
        camera
    }

    /// Sets the bounds of the scene, which determine the depth planes and the zoom range.
    ///
    /// Does not move the camera. Call this when the shape has changed.
    pub fn set_scene(&mut self, bounds: &BoundingBox<f64>) {
        self.scene = Sphere::around(bounds);
    }

    /// Sets the axis of the model that points up.
    pub fn set_up(&mut self, up: UpAxis) {
        self.up = up;
    }

    /// Orbits the target as the pointer drags the model by `delta` points.
    pub fn orbit(&mut self, delta: Vec2) {
        self.pose.yaw = (self.pose.yaw - f64::from(delta.x) * TURN_PER_POINT).rem_euclid(TAU);
        self.pose.pitch =
            (self.pose.pitch + f64::from(delta.y) * TURN_PER_POINT).clamp(-FRAC_PI_2, FRAC_PI_2);
        self.goal = self.pose;
    }

    /// Pans the view so that the plane through the target follows the pointer by `delta` points.
    pub fn pan(&mut self, delta: Vec2, rect: Rect) {
        let snapshot = self.at(rect);
        let step = self.pose.distance / snapshot.lens().focal;
        let shift = Vector3::new(-f64::from(delta.x), f64::from(delta.y), 0.0) * step;
        self.pose.target += self.rotation().inverse() * shift;
        self.goal = self.pose;
    }

    /// Zooms by `factor` (above 1 is nearer), fixing the point under the pointer in the plane
    /// through the target.
    ///
    /// If a surface is under the pointer, use [`Camera::zoom_about`].
    pub fn zoom(&mut self, factor: f64, pos: Pos2, rect: Rect) {
        let anchor = self.unproject_at_depth_of(self.pose.target, pos, rect);
        self.zoom_about(factor, anchor);
    }

    /// Zooms towards `anchor` by `factor` (above 1 is nearer).
    ///
    /// The anchor stays fixed on the screen, and the zoom near it is limited only by `f64` and
    /// the depth buffer.
    pub fn zoom_about(&mut self, factor: f64, anchor: Point3<f64>) {
        if !(factor > 0.0 && factor.is_finite()) {
            return;
        }
        let nearest = self.scene.radius * NEAREST;
        let farthest = self.scene.radius * FARTHEST;
        let distance = (self.pose.distance / factor).clamp(nearest, farthest);
        // Scaling eye and target about the anchor keeps its direction from the eye.
        let shrink = distance / self.pose.distance;
        self.pose.target = anchor + (self.pose.target - anchor) * shrink;
        self.pose.distance = distance;
        self.goal = self.pose;
    }

    /// Starts to move so that all of `bounds` is visible, from the same direction.
    pub fn fit(&mut self, bounds: &BoundingBox<f64>) {
        let center = bounds.center();
        let rotation = self.rotation_of(&self.goal);
        let spread = (0.5 * FIELD_OF_VIEW).tan();
        // The distance at which a corner touches the circle inscribed in the picture.
        let distance = |corner: usize| {
            let side = |k: usize| [bounds.min[k], bounds.max[k]][corner >> k & 1];
            let offset = rotation * (Point3::new(side(0), side(1), side(2)) - center);
            offset.z + offset.xy().norm() / spread
        };
        let farthest = (0..8).map(distance).fold(0.0, f64::max);
        self.goal.target = center;
        self.goal.distance = (farthest * FIT_MARGIN).max(self.scene.radius * NEAREST);
    }

    /// Starts to move to a standard view of the same target.
    pub fn look_from(&mut self, view: StandardView) {
        (self.goal.yaw, self.goal.pitch) = view.angles();
    }

    /// Starts to move so that `point` becomes the target, with the same direction and distance.
    pub fn look_at(&mut self, point: Point3<f64>) {
        self.goal.target = point;
    }

    /// Advances the animation by `seconds`. Returns whether it continues.
    pub fn advance(&mut self, seconds: f64) -> bool {
        if self.pose == self.goal {
            return false;
        }
        let share = 1.0 - (-seconds.max(0.0) / SMOOTHING).exp();
        self.pose = self.pose.towards(&self.goal, share);
        if self.pose.is_near(&self.goal) {
            self.pose = self.goal;
        }
        self.pose != self.goal
    }

    /// Ends an animation at once.
    pub fn jump(&mut self) {
        self.pose = self.goal;
    }

    /// The point that the camera orbits.
    #[must_use]
    pub fn target(&self) -> Point3<f64> {
        self.pose.target
    }

    /// The position of the eye.
    #[must_use]
    pub fn eye(&self) -> Point3<f64> {
        self.pose.target + self.rotation().inverse() * Vector3::z() * self.pose.distance
    }

    /// The snapshot of the camera for a rectangle of the screen, which projects and unprojects.
    #[must_use]
    pub fn at(&self, rect: Rect) -> CameraSnapshot {
        let rotation = self.rotation().to_rotation_matrix();
        let eye = self.eye();
        let middle = -(rotation * (self.scene.center - eye)).z;
        let reach = self.scene.radius * MARGIN;
        let near = (middle - reach).max(self.pose.distance * NEAR_SHARE);
        let far = (middle + reach).max(near * 2.0);
        let side = f64::from(rect.width().min(rect.height())).max(1.0);
        let lens = Lens {
            focal: 0.5 * side / (0.5 * FIELD_OF_VIEW).tan(),
            near,
            far,
        };
        CameraSnapshot::new(rect, rotation, eye, self.pose.target, lens)
    }

    /// The matrix from model coordinates to the cube from −1 to 1.
    #[must_use]
    pub fn view_projection(&self, rect: Rect) -> Matrix4<f64> {
        let snapshot = self.at(rect);
        snapshot.projection() * snapshot.view()
    }

    /// Projects a point to the screen. Returns `None` if it is nearer than the near plane.
    #[must_use]
    pub fn project(&self, point: Point3<f64>, rect: Rect) -> Option<Pos2> {
        self.at(rect).project(point)
    }

    /// The ray under the pointer.
    #[must_use]
    pub fn ray(&self, pos: Pos2, rect: Rect) -> Ray {
        self.at(rect).ray(pos)
    }

    /// The point under the pointer in the plane parallel to the screen through `point`.
    #[must_use]
    pub fn unproject_at_depth_of(&self, point: Point3<f64>, pos: Pos2, rect: Rect) -> Point3<f64> {
        self.at(rect).unproject_at_depth_of(point, pos)
    }

    /// The camera's part of the configuration of a `transform_gizmo_egui` gizmo.
    ///
    /// The rest has its default values.
    #[must_use]
    pub fn gizmo_config(&self, rect: Rect, pixels_per_point: f32) -> GizmoConfig {
        let snapshot = self.at(rect);
        let columns = |m: Matrix4<f64>| DMat4::from_cols_array_2d(&m.into());
        GizmoConfig {
            view_matrix: columns(snapshot.view()).into(),
            projection_matrix: columns(snapshot.projection()).into(),
            viewport: rect,
            pixels_per_point,
            ..GizmoConfig::default()
        }
    }

    fn rotation(&self) -> UnitQuaternion<f64> {
        self.rotation_of(&self.pose)
    }

    /// The rotation from the model's axes to the screen's: right, up, towards the viewer.
    fn rotation_of(&self, pose: &Pose) -> UnitQuaternion<f64> {
        let up = match self.up {
            UpAxis::Y => UnitQuaternion::identity(),
            UpAxis::Z => UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -FRAC_PI_2),
        };
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), pose.pitch)
            * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -pose.yaw)
            * up
    }
}

impl StandardView {
    /// Yaw and pitch of the eye, seen from the target.
    fn angles(self) -> (f64, f64) {
        match self {
            Self::Front => (0.0, 0.0),
            Self::Back => (PI, 0.0),
            Self::Right => (FRAC_PI_2, 0.0),
            Self::Left => (3.0 * FRAC_PI_2, 0.0),
            Self::Top => (0.0, FRAC_PI_2),
            Self::Bottom => (0.0, -FRAC_PI_2),
            Self::Oblique => (0.5, 0.35),
        }
    }
}

#[derive(Clone, Copy, PartialEq, Debug)]
struct Pose {
    target: Point3<f64>,
    distance: f64,
    /// Angle around the up axis, from 0 to 2π.
    yaw: f64,
    /// Angle above the horizon, from −π/2 to π/2.
    pitch: f64,
}

impl Pose {
    /// Interpolates between two poses: the distance geometrically, the yaw along the shorter arc.
    fn towards(&self, goal: &Self, share: f64) -> Self {
        Self {
            target: self.target + (goal.target - self.target) * share,
            distance: self.distance * (goal.distance / self.distance).powf(share),
            yaw: (self.yaw + short_turn(self.yaw, goal.yaw) * share).rem_euclid(TAU),
            pitch: self.pitch + (goal.pitch - self.pitch) * share,
        }
    }

    /// Returns `true` if the difference is invisible.
    fn is_near(&self, goal: &Self) -> bool {
        (self.target - goal.target).norm() < UNSEEN * goal.distance
            && (self.distance / goal.distance - 1.0).abs() < UNSEEN
            && short_turn(self.yaw, goal.yaw).abs() < UNSEEN
            && (self.pitch - goal.pitch).abs() < UNSEEN
    }
}

/// The signed angle from `start` to `end`, at most half a turn.
fn short_turn(start: f64, end: f64) -> f64 {
    (end - start + PI).rem_euclid(TAU) - PI
}

#[derive(Clone, Copy, PartialEq, Debug)]
struct Sphere {
    center: Point3<f64>,
    radius: f64,
}

impl Sphere {
    fn around(bounds: &BoundingBox<f64>) -> Self {
        let center = bounds.center();
        // A single point has no size. Any radius that `f64` can distinguish from the point will
        // do.
        let least = center.coords.amax().max(1.0) * 1e-9;
        let radius = 0.5 * bounds.diagonal();
        Self {
            center,
            radius: if radius > least { radius } else { least },
        }
    }
}

/// Field of view along the shorter side of the picture. A wider one distorts the border.
const FIELD_OF_VIEW: f64 = 35.0 * PI / 180.0;

/// Factor on the fitting distance that leaves a margin around the model.
const FIT_MARGIN: f64 = 1.05;

/// Half a turn for a drag of 400 points, across the middle of a typical window.
const TURN_PER_POINT: f64 = PI / 400.0;

/// Smallest distance from eye to target, relative to the radius of the scene.
///
/// There the `f32` of the graphics card still places a vertex within half a pixel.
const NEAREST: f64 = 2e-4;

/// Largest distance from eye to target, relative to the radius of the scene.
///
/// There the model is a dot.
const FARTHEST: f64 = 200.0;

/// Lower bound of the near plane, relative to the distance to the target. 24 bits of depth then
/// resolve steps of 6e-6 of that distance, a hundredth of a pixel's width.
const NEAR_SHARE: f64 = 0.01;

/// Factor on the radius of the scene for the depth planes: marks and normals stick out of the
/// surface.
const MARGIN: f64 = 1.2;

/// Time constant of the animation in seconds, after which e⁻¹ of the motion remains.
const SMOOTHING: f64 = 0.07;

/// A smaller difference, in radians or relative to the distance, moves nothing by a pixel.
const UNSEEN: f64 = 3e-4;

#[cfg(test)]
#[path = "camera_tests.rs"]
mod tests;
