//! Dragging a handle.

use eframe::egui::{Pos2, Rect};
use nalgebra::{
    Matrix3, Matrix4, Point3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3,
};
use transform_gizmo_egui::math::Transform;

use cotan_workspace::Command;

use super::Editor;

/// The way in which the pointer holds a handle.
pub(super) struct Drag {
    /// The handle's motion and centroid when it was grabbed.
    motion: Matrix4<f64>,
    center: Point3<f64>,
    how: How,
}

impl Drag {
    /// Returns `true` if the handle is dragged by the gizmo rather than directly.
    pub(super) fn is_by_gizmo(&self) -> bool {
        matches!(self.how, How::Gizmo(..))
    }
}

/// The part that the pointer holds.
enum How {
    /// The handle itself, which moves in the plane of the screen.
    ///
    /// Holds the point that was grabbed.
    Free(Point3<f64>),
    /// The gizmo, with the transform it assumes for the handle, and its axes.
    Gizmo(Transform, Matrix3<f64>),
}

impl Editor {
    /// Starts to drag a handle directly.
    pub(super) fn grab(&mut self, handle: usize, pos: Pos2, rect: Rect) {
        let Some(center) = self.center(handle) else {
            return;
        };
        let grip = self.shown.camera.unproject_at_depth_of(center, pos, rect);
        self.begin_drag(handle, How::Free(grip));
    }

    /// Starts to drag a handle by the gizmo.
    pub(super) fn grab_gizmo(&mut self, handle: usize) {
        if let Some(pivot) = self.workspace.model().map(cotan_workspace::Model::pivot) {
            let axes = self.axes();
            self.begin_drag(handle, How::Gizmo(gizmo_at(pivot, &axes), axes));
            if let Some(drag) = &mut self.pointer.drag {
                drag.center = pivot;
            }
        }
    }

    fn begin_drag(&mut self, handle: usize, how: How) {
        self.run(Command::Grab { handle });
        let group = self.scene().and_then(|scene| scene.handles().get(handle));
        let drag = group.zip(self.center(handle)).map(|(group, center)| Drag {
            motion: group.matrix,
            center,
            how,
        });
        self.pointer.drag = drag;
    }

    /// The current centroid of a handle.
    pub(super) fn center(&self, handle: usize) -> Option<Point3<f64>> {
        let scene = self.scene()?;
        Some(scene.handles().get(handle)?.center(scene.rest.positions()))
    }

    /// Moves a directly held handle to the pointer.
    ///
    /// With a step, each coordinate of the way is a multiple of it.
    pub(super) fn drag_to(&mut self, pos: Pos2, rect: Rect, step: Option<f64>) {
        let Some(Drag {
            how: How::Free(grip),
            center,
            motion,
        }) = &self.pointer.drag
        else {
            return;
        };
        let now = self.shown.camera.unproject_at_depth_of(*center, pos, rect);
        let way = (now - grip).map(|x| step.map_or(x, |step| (x / step).round() * step));
        let motion = Translation3::from(way).to_homogeneous() * motion;
        self.run(Command::Drag { motion });
    }

    /// The transform that the gizmo assumes for the handle.
    pub(super) fn gizmo_transform(&self) -> Option<Transform> {
        match &self.pointer.drag {
            Some(Drag {
                how: How::Gizmo(transform, _),
                ..
            }) => Some(*transform),
            Some(_) => None,
            None => {
                self.scene()?.props.active?;
                Some(gizmo_at(self.workspace.model()?.pivot(), &self.axes()))
            }
        }
    }

    /// Moves the handle to the gizmo's transform.
    pub(super) fn gizmo_to(&mut self, transform: Transform) {
        let Some(Drag {
            how: How::Gizmo(held, axes),
            center,
            motion,
        }) = &mut self.pointer.drag
        else {
            return;
        };
        *held = transform;
        let about = Translation3::from(-center.coords).to_homogeneous();
        let about = axes.transpose().to_homogeneous() * about;
        let motion = matrix_of(&transform) * about * *motion;
        self.run(Command::Drag { motion });
    }

    /// Ends the drag.
    pub(super) fn release(&mut self) {
        if self.pointer.drag.take().is_some() {
            self.run(Command::Drop);
        }
    }

    /// Cancels the drag.
    pub(super) fn cancel_drag(&mut self) {
        self.pointer.drag = None;
        self.run(Command::CancelDrag);
    }
}

fn gizmo_at(center: Point3<f64>, axes: &Matrix3<f64>) -> Transform {
    let axes = Rotation3::from_matrix_unchecked(*axes);
    let q = UnitQuaternion::from_rotation_matrix(&axes);
    Transform::from_scale_rotation_translation(
        [1.0; 3],
        transform_gizmo_egui::math::DQuat::from_xyzw(q.i, q.j, q.k, q.w),
        [center.x, center.y, center.z],
    )
}

/// The matrix that scales, then rotates, then translates.
fn matrix_of(transform: &Transform) -> Matrix4<f64> {
    let q = transform.rotation;
    let quaternion = Quaternion::new(q.s, q.v.x, q.v.y, q.v.z);
    let s = transform.scale;
    let t = transform.translation;
    Translation3::new(t.x, t.y, t.z).to_homogeneous()
        * UnitQuaternion::from_quaternion(quaternion).to_homogeneous()
        * Matrix4::new_nonuniform_scaling(&Vector3::new(s.x, s.y, s.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gizmo_that_has_not_moved_is_a_translation() {
        let center = Point3::new(1.0, -2.0, 3.0);
        let back = Translation3::from(-center.coords).to_homogeneous();
        let axes = Matrix3::identity();
        assert_eq!(
            matrix_of(&gizmo_at(center, &axes)) * back,
            Matrix4::identity()
        );
        let axes = *Rotation3::new(Vector3::new(0.3, -2.0, 0.7)).matrix();
        let still = matrix_of(&gizmo_at(center, &axes)) * axes.transpose().to_homogeneous() * back;
        assert!((still - Matrix4::identity()).norm() < 1e-12);
    }
}
