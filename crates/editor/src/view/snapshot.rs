//! The camera of one frame in a rectangle of the screen, which maps between model and screen.

use cotan::geometry::Ray;
use eframe::egui::{Pos2, Rect};
use nalgebra::{Matrix4, Point3, Rotation3, Vector3};

/// The projection parameters.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Lens {
    /// The focal length: the size in screen points of an object at a depth equal to its length.
    pub focal: f64,
    /// The depth of the near plane.
    pub near: f64,
    /// The depth of the far plane.
    pub far: f64,
}

/// A [`Camera`](crate::view::camera::Camera) in a rectangle of the screen, used to draw and pick
/// in one frame.
///
/// Lengths on the screen are in egui's points.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CameraSnapshot {
    rect: Rect,
    rotation: Rotation3<f64>,
    eye: Point3<f64>,
    target: Point3<f64>,
    lens: Lens,
}

impl CameraSnapshot {
    /// Makes a snapshot.
    ///
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

    /// The position of the eye.
    #[must_use]
    pub fn eye(&self) -> Point3<f64> {
        self.eye
    }

    /// The point that the camera orbits.
    #[must_use]
    pub fn target(&self) -> Point3<f64> {
        self.target
    }

    /// The projection parameters.
    #[must_use]
    pub fn lens(&self) -> Lens {
        self.lens
    }

    /// The rotation from the model's axes to the screen's: right, up, towards the viewer.
    #[must_use]
    pub fn rotation(&self) -> Rotation3<f64> {
        self.rotation
    }

    /// The direction into the screen.
    #[must_use]
    pub fn forward(&self) -> Vector3<f64> {
        -self.rotation.matrix().row(2).transpose()
    }

    /// The matrix from model to eye coordinates.
    #[must_use]
    pub fn view(&self) -> Matrix4<f64> {
        let mut view = self.rotation.to_homogeneous();
        let shift = -(self.rotation * self.eye.coords);
        view.fixed_view_mut::<3, 1>(0, 3).copy_from(&shift);
        view
    }

    /// The matrix from eye coordinates to the cube from −1 to 1.
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

    /// The depth of a point: its distance from the eye along the viewing direction.
    #[must_use]
    pub fn depth(&self, point: Point3<f64>) -> f64 {
        (point - self.eye).dot(&self.forward())
    }

    /// Projects a point to the screen. Returns `None` if it is nearer than the near plane.
    #[must_use]
    pub fn project(&self, point: Point3<f64>) -> Option<Pos2> {
        let seen = self.rotation * (point - self.eye);
        let depth = -seen.z;
        // Not `<`, so that NaN is rejected.
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

    /// The ray under the pointer, starting at the near plane.
    #[must_use]
    pub fn ray(&self, pos: Pos2) -> Ray {
        let straight = self.direction(pos);
        Ray {
            origin: self.eye + straight * self.lens.near,
            direction: straight.normalize(),
        }
    }

    /// The ray from the near plane through `point`, and the distance to the point along it.
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

    /// The point under the pointer in the plane parallel to the screen through `point`, for
    /// example the target of a dragged point.
    #[must_use]
    pub fn unproject_at_depth_of(&self, point: Point3<f64>, pos: Pos2) -> Point3<f64> {
        // A point behind the eye is replaced by the near plane.
        let depth = self.depth(point).max(self.lens.near);
        self.eye + self.direction(pos) * depth
    }

    /// The length of one screen point at the depth of `point`.
    #[must_use]
    pub fn length_per_point(&self, point: Point3<f64>) -> f64 {
        self.depth(point).max(self.lens.near) / self.lens.focal
    }

    /// Returns `true` if a ball may be visible within `radius` points of the pointer.
    ///
    /// Conservative: it may return `true` for a ball that only comes near, but never `false` for
    /// one that is visible.
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
        // A point visible within the radius is that close to the axis in its own depth plane, and
        // closer still to the axis as a whole.
        aside <= ball + f64::from(radius) * deepest / self.lens.focal
    }

    /// The vector from the eye through the pointer, scaled to depth 1.
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
