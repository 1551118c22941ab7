//! The camera of one frame, looking into one rectangle: between the model and the screen.

use cotan::geometry::Ray;
use eframe::egui::{Pos2, Rect};
use nalgebra::{Matrix4, Point3, Rotation3, Vector3};

/// How the picture is taken.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Lens {
    /// Points of the screen that a length has at a depth of the same length.
    pub focal: f64,
    /// Depth of the nearest things seen.
    pub near: f64,
    /// Depth of the farthest things seen.
    pub far: f64,
}

/// A [`Camera`](crate::view::camera::Camera) that looks into a rectangle of the screen: what a
/// frame is drawn and picked by. Screen lengths are in egui's points.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CameraSnapshot {
    rect: Rect,
    rotation: Rotation3<f64>,
    eye: Point3<f64>,
    target: Point3<f64>,
    lens: Lens,
}

impl CameraSnapshot {
    /// `rotation` leads from the model's axes to the screen's: right, up, towards the viewer.
    pub(crate) fn new(
        rect: Rect,
        rotation: Rotation3<f64>,
        eye: Point3<f64>,
        target: Point3<f64>,
        lens: Lens,
    ) -> Self {
        Self {
            rect,
            rotation,
            eye,
            target,
            lens,
        }
    }

    /// The rectangle of the screen.
    #[must_use]
    pub fn rect(&self) -> Rect {
        self.rect
    }

    /// The place of the eye.
    #[must_use]
    pub fn eye(&self) -> Point3<f64> {
        self.eye
    }

    /// What the camera turns around.
    #[must_use]
    pub fn target(&self) -> Point3<f64> {
        self.target
    }

    /// How the picture is taken.
    #[must_use]
    pub fn lens(&self) -> Lens {
        self.lens
    }

    /// From the model's axes to the screen's: right, up, towards the viewer.
    #[must_use]
    pub fn rotation(&self) -> Rotation3<f64> {
        self.rotation
    }

    /// The direction into the screen.
    #[must_use]
    pub fn forward(&self) -> Vector3<f64> {
        -self.rotation.matrix().row(2).transpose()
    }

    /// From the model's coordinates to those of the eye.
    #[must_use]
    pub fn view(&self) -> Matrix4<f64> {
        let mut view = self.rotation.to_homogeneous();
        let shift = -(self.rotation * self.eye.coords);
        view.fixed_view_mut::<3, 1>(0, 3).copy_from(&shift);
        view
    }

    /// From the coordinates of the eye to the cube from −1 to 1.
    #[must_use]
    pub fn projection(&self) -> Matrix4<f64> {
        let Lens { focal, near, far } = self.lens;
        let (width, height) = self.size();
        let mut projection = Matrix4::zeros();
        projection[(0, 0)] = 2.0 * focal / width;
        projection[(1, 1)] = 2.0 * focal / height;
        projection[(2, 2)] = (near + far) / (near - far);
        projection[(2, 3)] = 2.0 * near * far / (near - far);
        projection[(3, 2)] = -1.0;
        projection
    }

    /// How far before the eye a point lies, along the direction of view.
    #[must_use]
    pub fn depth(&self, point: Point3<f64>) -> f64 {
        (point - self.eye).dot(&self.forward())
    }

    /// Where a point is on the screen; `None` if it is nearer than the near plane.
    #[must_use]
    pub fn project(&self, point: Point3<f64>) -> Option<Pos2> {
        let seen = self.rotation * (point - self.eye);
        let depth = -seen.z;
        // Not `<`: a coordinate that is no number is nowhere.
        if !(depth >= self.lens.near) {
            return None;
        }
        let scale = self.lens.focal / depth;
        let center = self.rect.center();
        Some(Pos2::new(
            (f64::from(center.x) + seen.x * scale) as f32,
            (f64::from(center.y) - seen.y * scale) as f32,
        ))
    }

    /// What is under the pointer, from the near plane on.
    #[must_use]
    pub fn ray(&self, pos: Pos2) -> Ray {
        let straight = self.direction(pos);
        Ray {
            origin: self.eye + straight * self.lens.near,
            direction: straight.normalize(),
        }
    }

    /// The half-line from the near plane through `point`, and the distance at which it gets there.
    #[must_use]
    pub fn ray_to(&self, point: Point3<f64>) -> Option<(Ray, f64)> {
        let depth = self.depth(point);
        if !(depth >= self.lens.near) {
            return None;
        }
        let whole = point - self.eye;
        let share = self.lens.near / depth;
        let ray = Ray {
            origin: self.eye + whole * share,
            direction: whole.normalize(),
        };
        Some((ray, whole.norm() * (1.0 - share)))
    }

    /// The point under the pointer in the plane parallel to the screen through `point`: where a
    /// dragged point goes.
    #[must_use]
    pub fn unproject_at_depth_of(&self, point: Point3<f64>, pos: Pos2) -> Point3<f64> {
        // What lies behind the eye has no place under the pointer: the near plane stands in.
        let depth = self.depth(point).max(self.lens.near);
        self.eye + self.direction(pos) * depth
    }

    /// The length that one point of the screen has at the depth of `point`.
    #[must_use]
    pub fn length_per_point(&self, point: Point3<f64>) -> f64 {
        self.depth(point).max(self.lens.near) / self.lens.focal
    }

    /// Whether a ball may show within `radius` points of the pointer: always if it does, and
    /// sometimes if it only comes near.
    #[must_use]
    pub fn may_touch(&self, center: Point3<f64>, ball: f64, pos: Pos2, radius: f32) -> bool {
        let deepest = self.depth(center) + ball;
        if deepest < self.lens.near {
            return false;
        }
        let axis = self.direction(pos);
        let to_center = center - self.eye;
        let length = to_center.dot(&axis) / axis.norm_squared();
        let aside = (to_center - axis * length).norm();
        // What shows within the radius is that near to the axis in its own plane of depth, and
        // nearer yet to the axis as a whole.
        aside <= ball + f64::from(radius) * deepest / self.lens.focal
    }

    /// From the eye through the pointer, to depth 1.
    fn direction(&self, pos: Pos2) -> Vector3<f64> {
        let center = self.rect.center();
        let x = (f64::from(pos.x) - f64::from(center.x)) / self.lens.focal;
        let y = (f64::from(pos.y) - f64::from(center.y)) / self.lens.focal;
        self.rotation.inverse() * Vector3::new(x, -y, -1.0)
    }

    fn size(&self) -> (f64, f64) {
        let side = |length: f32| f64::from(length).max(1.0);
        (side(self.rect.width()), side(self.rect.height()))
    }
}
