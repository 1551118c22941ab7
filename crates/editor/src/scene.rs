//! The document being edited: the mesh, its handles and settings, and the undo history.
//!
//! A [`Scene`] is immutable: an edit makes a new one that shares the unchanged parts with the old
//! one. Undo is therefore a list of scenes, and the solver can hold one while the next is being
//! made.

use std::f64::consts::PI;
use std::sync::Arc;

use cotan::geometry::Positions;
use cotan::halfedge::VertexId;
use cotan::linear::Hold;
use cotan::{DeformOptions, Handles, Motion, nearest_turn};
use nalgebra::{Matrix4, Point3, Vector3};

/// A group of vertices held by the user.
#[derive(Clone, PartialEq, Debug)]
pub struct HandleGroup {
    /// The name shown in the list of handles.
    pub name: String,
    /// The vertices, sorted and without duplicates.
    pub vertices: Vec<VertexId>,
    /// The role: fixed or movable.
    pub role: Role,
    /// The positions of the vertices when the group was made.
    pub origin: Origin,
    /// The motion applied to the group since then.
    pub matrix: Matrix4<f64>,
    /// The rotation vector of that motion in radians, which may exceed half a turn.
    pub turn: Vector3<f64>,
    /// The kind of constraint: exact or by springs.
    pub hold: Hold,
}

/// The role of a group of handles.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Role {
    /// The group stays where it is.
    Fixed,
    /// The group can be dragged.
    Movable,
}

/// The positions of a group's vertices when it was made.
#[derive(Clone, PartialEq, Debug)]
pub enum Origin {
    /// The positions in the rest shape.
    Rest,
    /// One position per vertex, in the order of `vertices`: the group was made on a deformed
    /// shape or read from a file.
    Places(Vec<Point3<f64>>),
}

impl HandleGroup {
    /// Makes a group whose vertices are held at their positions in `shape`.
    pub fn new(
        name: String,
        vertices: Vec<VertexId>,
        role: Role,
        rest: &Positions<f64>,
        shape: &Positions<f64>,
    ) -> Self {
        let is_at_rest = vertices.iter().all(|&v| rest.get(v) == shape.get(v));
        let origin = match is_at_rest {
            true => Origin::Rest,
            false => {
                let places = vertices.iter().filter_map(|&v| shape.get(v).copied());
                Origin::Places(places.collect())
            }
        };
        Self {
            name,
            vertices,
            role,
            origin,
            matrix: Matrix4::identity(),
            turn: Vector3::zeros(),
            hold: Hold::Hard,
        }
    }

    /// Replaces the motion. Of the turns that it can mean, the one that differs least from the
    /// turn before is taken.
    pub fn move_to(&mut self, matrix: Matrix4<f64>) {
        self.turn = nearest_turn(&matrix, &self.turn);
        self.matrix = matrix;
    }

    /// The turn that a deformation or a file is to know, which the motion alone does not tell.
    pub fn stated_turn(&self) -> Option<Vector3<f64>> {
        // Two groups that turn by less are never wound relative to each other. The turn of places
        // on a deformed shape is not that of the rest shape.
        let is_wide = self.turn.norm() > 0.5 * PI && self.origin == Origin::Rest;
        is_wide.then_some(self.turn)
    }

    /// Returns the motion in the form that a deformation takes.
    pub fn job_motion(&self) -> Motion<f64> {
        let is_still = self.matrix == Matrix4::identity();
        match &self.origin {
            Origin::Rest if is_still => Motion::Stay,
            Origin::Rest => Motion::Transform(self.matrix),
            Origin::Places(places) if is_still => Motion::To(places.clone()),
            Origin::Places(places) => {
                let moved = places.iter().map(|p| self.matrix.transform_point(p));
                Motion::To(moved.collect())
            }
        }
    }

    /// The centroid of the group before it was moved, given the rest shape.
    pub fn pivot(&self, rest: &Positions<f64>) -> Point3<f64> {
        let share = 1.0 / self.vertices.len().max(1) as f64;
        let mut sum = Vector3::zeros();
        match &self.origin {
            Origin::Places(places) => places.iter().for_each(|p| sum += p.coords * share),
            Origin::Rest => {
                let at = self.vertices.iter().filter_map(|&v| rest.get(v));
                at.for_each(|p| sum += p.coords * share);
            }
        }
        Point3::from(sum)
    }

    /// The centroid of the group at its current position.
    pub fn center(&self, rest: &Positions<f64>) -> Point3<f64> {
        self.matrix.transform_point(&self.pivot(rest))
    }
}

/// One state of everything that an edit can change.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The edit that led here, used to name undo and redo.
    pub label: String,
    /// The rest shape of the deformation: as read from the file or as left by a smoothing job.
    pub rest: Arc<Positions<f64>>,
    /// The shape that is shown and saved.
    pub shape: Arc<Positions<f64>>,
    /// `true` if the shape has converged to its handles, within the tolerance.
    pub is_settled: bool,
    /// The handles that hold the mesh.
    pub handles: Arc<Vec<HandleGroup>>,
    /// The options of the deformation.
    pub options: DeformOptions,
}

impl Scene {
    /// Makes the scene of a mesh that was just opened.
    pub fn new(positions: Arc<Positions<f64>>) -> Self {
        Self {
            label: "Open".to_owned(),
            rest: Arc::clone(&positions),
            shape: positions,
            is_settled: true,
            handles: Arc::default(),
            options: editor_options(),
        }
    }

    /// Builds the handles of a deformation.
    ///
    /// Where parts are to be still, a last group fixes the vertices in `loose`, those
    /// of the parts that have none.
    pub fn job_handles(handles: &[HandleGroup], loose: &[VertexId]) -> Handles<f64> {
        let mut all = Handles::new();
        for group in handles {
            all = all.add(group.vertices.iter().copied(), group.job_motion());
            if let Hold::Soft(weight) = group.hold {
                all = all.soft(weight);
            }
            if let Some(turn) = group.stated_turn() {
                all = all.turned(turn);
            }
        }
        if !loose.is_empty() {
            all = all.fix(loose.iter().copied());
        }
        all
    }
}

/// The defaults of the command line, with a tolerance tight enough that two paths to a shape end
/// at the same shape.
pub fn editor_options() -> DeformOptions {
    DeformOptions::default().tolerance(SETTLED)
}

/// Tolerance relative to the diagonal. The remaining change is far below a pixel, and 1e-6 of the
/// bounding box is met with a margin.
const SETTLED: f64 = 1e-9;

/// The scenes in the order in which they were made, and the one that is shown.
#[derive(Debug)]
pub struct History {
    past: Vec<Scene>,
    present: Scene,
    future: Vec<Scene>,
    /// Number of edits before the present one, including those that were dropped.
    count: u64,
}

impl History {
    /// Starts a history with one scene.
    pub fn new(scene: Scene) -> Self {
        Self {
            past: Vec::new(),
            present: scene,
            future: Vec::new(),
            count: 0,
        }
    }

    /// The scene that is shown.
    pub fn present(&self) -> &Scene {
        &self.present
    }

    /// The scene that is shown, to be updated as the solver proceeds. This adds no undo step.
    pub fn present_mut(&mut self) -> &mut Scene {
        &mut self.present
    }

    /// A number that differs between any two states of the history that are one edit apart.
    pub fn position(&self) -> u64 {
        self.count
    }

    /// Appends a new scene.
    ///
    /// Drops the scenes that were undone, and the oldest ones beyond the limit.
    pub fn push(&mut self, scene: Scene) {
        self.future.clear();
        self.count += 1;
        self.past.push(std::mem::replace(&mut self.present, scene));
        let forgotten = self.past.len().saturating_sub(self.most_past());
        self.past.drain(..forgotten);
    }

    /// The label of the edit that undo would revert, if any.
    pub fn undo_label(&self) -> Option<&str> {
        (!self.past.is_empty()).then_some(self.present.label.as_str())
    }

    /// The label of the edit that redo would repeat, if any.
    pub fn redo_label(&self) -> Option<&str> {
        self.future.last().map(|scene| scene.label.as_str())
    }

    /// Goes back by one edit. Returns `false` if there is none.
    pub fn undo(&mut self) -> bool {
        let Some(scene) = self.past.pop() else {
            return false;
        };
        self.count = self.count.saturating_sub(1);
        self.future
            .push(std::mem::replace(&mut self.present, scene));
        true
    }

    /// Repeats one edit that was undone. Returns `false` if there is none.
    pub fn redo(&mut self) -> bool {
        let Some(scene) = self.future.pop() else {
            return false;
        };
        self.count += 1;
        self.past.push(std::mem::replace(&mut self.present, scene));
        true
    }

    /// The number of past scenes that fit in the memory reserved for them.
    fn most_past(&self) -> usize {
        let bytes = self.present.shape.len().max(1) * size_of::<Point3<f64>>();
        (MOST_BYTES / bytes).clamp(20, 1000)
    }
}

/// Memory for the positions of past scenes, which mostly differ.
const MOST_BYTES: usize = 512 << 20;

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(x: f64) -> Scene {
        let positions: Positions<f64> = [Point3::new(x, 0.0, 0.0)].into_iter().collect();
        Scene {
            label: format!("{x}"),
            ..Scene::new(Arc::new(positions))
        }
    }

    #[test]
    fn undo_and_redo_give_back_the_very_scenes() {
        let mut history = History::new(scene(0.0));
        (1..=3).for_each(|x| history.push(scene(f64::from(x))));
        let last = Arc::clone(&history.present().shape);
        assert!(history.undo() && history.undo());
        assert_eq!(history.present().label, "1");
        assert_eq!(
            (history.undo_label(), history.redo_label()),
            (Some("1"), Some("2"))
        );
        assert!(history.redo() && history.redo() && !history.redo());
        assert!(Arc::ptr_eq(&last, &history.present().shape));
        assert!(history.undo());
        history.push(scene(9.0));
        assert!(!history.redo() && history.position() == 3);
    }

    #[test]
    fn the_past_is_bounded() {
        let mut history = History::new(scene(0.0));
        (0..3000).for_each(|x| history.push(scene(f64::from(x))));
        let mut count = 0;
        while history.undo() {
            count += 1;
        }
        assert_eq!(count, 1000);
    }

    #[test]
    fn a_group_is_moved_from_its_rest() {
        let rest: Positions<f64> = [0.0, 2.0]
            .map(|x| Point3::new(x, 0.0, 0.0))
            .into_iter()
            .collect();
        let all = vec![VertexId::new(0), VertexId::new(1)];
        let mut group = HandleGroup::new("A".to_owned(), all.clone(), Role::Movable, &rest, &rest);
        assert_eq!(group.job_motion(), Motion::Stay);
        group.matrix = Matrix4::new_translation(&Vector3::z());
        assert_eq!(group.center(&rest), Point3::new(1.0, 0.0, 1.0));
        // A group made on a deformed shape is held where it is in that shape.
        let bent = rest.map(|p| p + Vector3::y());
        let made = HandleGroup::new("B".to_owned(), all, Role::Fixed, &rest, &bent);
        assert_eq!(made.center(&rest), Point3::new(1.0, 1.0, 0.0));
        assert_eq!(
            made.job_motion(),
            Motion::To(bent.values().copied().collect())
        );
        let handles = Scene::job_handles(&[group], &[]);
        assert_eq!(handles.len(), 1);
    }
}
