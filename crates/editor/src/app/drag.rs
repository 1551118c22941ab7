//! Dragging a handle.

use std::sync::Arc;

use eframe::egui::{Pos2, Rect};
use nalgebra::{Matrix4, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use transform_gizmo_egui::math::Transform;

use super::Editor;
use crate::scene::Scene;
use crate::solver::Pace;

/// A handle that is being dragged.
pub(super) struct Drag {
    pub(super) handle: usize,
    /// The scene before the drag.
    before: Scene,
    /// The handle's transform and centroid before the drag.
    matrix: Matrix4<f64>,
    center: Point3<f64>,
    how: How,
    has_moved: bool,
}

impl Drag {
    /// Returns `true` if the handle is dragged by the gizmo rather than directly.
    pub(super) fn is_by_gizmo(&self) -> bool {
        matches!(self.how, How::Gizmo(_))
    }
}

/// The part that the pointer holds.
enum How {
    /// The handle itself, which moves in the plane of the screen.
    ///
    /// Holds the point that was grabbed.
    Free(Point3<f64>),
    /// The gizmo, with the transform it assumes for the handle.
    Gizmo(Transform),
}

impl Editor {
    /// Starts to drag a handle directly.
    pub(super) fn grab(&mut self, handle: usize, pos: Pos2, rect: Rect) {
        let Some(center) = self.center(handle) else {
            return;
        };
        let grip = self.camera.unproject_at_depth_of(center, pos, rect);
        self.begin_drag(handle, How::Free(grip));
    }

    /// Starts to drag a handle by the gizmo.
    pub(super) fn grab_gizmo(&mut self, handle: usize) {
        if let Some(center) = self.center(handle) {
            self.begin_drag(handle, How::Gizmo(gizmo_at(center)));
        }
    }

    fn begin_drag(&mut self, handle: usize, how: How) {
        let (Some(scene), Some(center)) = (self.scene(), self.center(handle)) else {
            return;
        };
        let Some(group) = scene.handles.get(handle) else {
            return;
        };
        self.drag = Some(Drag {
            handle,
            before: scene.clone(),
            matrix: group.matrix,
            center,
            how,
            has_moved: false,
        });
        self.active = Some(handle);
        self.solver.clear_samples();
    }

    /// The current centroid of a handle.
    pub(super) fn center(&self, handle: usize) -> Option<Point3<f64>> {
        let scene = self.scene()?;
        Some(scene.handles.get(handle)?.center(&scene.rest))
    }

    /// Moves a directly held handle to the pointer.
    pub(super) fn drag_to(&mut self, pos: Pos2, rect: Rect) {
        let Some(Drag {
            how: How::Free(grip),
            center,
            matrix,
            ..
        }) = &self.drag
        else {
            return;
        };
        let now = self.camera.unproject_at_depth_of(*center, pos, rect);
        let moved = Translation3::from(now - grip).to_homogeneous() * matrix;
        self.move_held(moved);
    }

    /// The transform that the gizmo assumes for the handle.
    pub(super) fn gizmo_transform(&self) -> Option<Transform> {
        match &self.drag {
            Some(Drag {
                how: How::Gizmo(transform),
                ..
            }) => Some(*transform),
            Some(_) => None,
            None => Some(gizmo_at(self.center(self.active?)?)),
        }
    }

    /// Moves the handle to the gizmo's transform.
    pub(super) fn gizmo_to(&mut self, transform: Transform) {
        let Some(Drag {
            how: How::Gizmo(held),
            center,
            matrix,
            ..
        }) = &mut self.drag
        else {
            return;
        };
        *held = transform;
        let about = Translation3::from(-center.coords).to_homogeneous();
        let moved = matrix_of(&transform) * about * *matrix;
        self.move_held(moved);
    }

    fn move_held(&mut self, matrix: Matrix4<f64>) {
        let Some(drag) = &mut self.drag else {
            return;
        };
        let handle = drag.handle;
        let Some(open) = &mut self.open else {
            return;
        };
        let scene = open.history.present_mut();
        let Some(group) = scene.handles.get(handle) else {
            return;
        };
        if group.matrix == matrix {
            return;
        }
        drag.has_moved = true;
        let mut handles = Vec::clone(&scene.handles);
        handles[handle].move_to(matrix);
        scene.handles = Arc::new(handles);
        scene.is_settled = false;
        self.post(Pace::Held);
    }

    /// Ends the drag: it becomes an edit, and the shape converges.
    pub(super) fn release(&mut self) {
        let Some(drag) = self.drag.take() else {
            return;
        };
        let Some(open) = self.open.as_mut().filter(|_| drag.has_moved) else {
            return;
        };
        let name = |scene: &Scene| scene.handles.get(drag.handle).map(|g| g.name.clone());
        let mut after = open.history.present().clone();
        after.label = format!("Move {}", name(&after).unwrap_or_default());
        *open.history.present_mut() = drag.before;
        open.history.push(after);
        self.jobs.base = None;
        self.post(Pace::Settle);
    }

    /// Cancels the drag and restores the scene from before it.
    pub(super) fn cancel_drag(&mut self) {
        let Some(drag) = self.drag.take() else {
            return;
        };
        if let Some(open) = &mut self.open {
            *open.history.present_mut() = drag.before;
            self.show_as_is();
        }
    }
}

fn gizmo_at(center: Point3<f64>) -> Transform {
    Transform::from_scale_rotation_translation(
        [1.0; 3],
        transform_gizmo_egui::math::DQuat::IDENTITY,
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
        assert_eq!(matrix_of(&gizmo_at(center)) * back, Matrix4::identity());
    }
}
