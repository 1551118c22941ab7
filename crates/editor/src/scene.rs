//! What is edited: the mesh, its handles and settings, and how it was before.
//!
//! A [`Scene`] is a value that never changes: an edit makes a new one, which shares what is the
//! same. So undo is a list of scenes, and the solver can hold one while the next is made.

use std::sync::Arc;

use cotan::geometry::Positions;
use cotan::halfedge::VertexId;
use cotan::linear::Hold;
use cotan::{DeformOptions, Handles, Motion};
use nalgebra::{Matrix4, Point3, Vector3};

/// Vertices that a person holds.
#[derive(Clone, PartialEq, Debug)]
pub struct HandleGroup {
    /// What the list of handles calls it.
    pub name: String,
    /// Sorted, each once.
    pub vertices: Vec<VertexId>,
    /// Whether a person means to move it.
    pub role: Role,
    /// Where it was when it was made.
    pub origin: Origin,
    /// How it was moved from there.
    pub matrix: Matrix4<f64>,
    /// Exactly or by springs.
    pub hold: Hold,
}

/// Whether a group is there to be moved.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Role {
    /// It stays where it is.
    Fixed,
    /// It can be dragged.
    Movable,
}

/// Where the vertices of a group were when it was made.
#[derive(Clone, PartialEq, Debug)]
pub enum Origin {
    /// Where they are in the rest shape.
    Rest,
    /// Each at its own place, in the order of the vertices: made on a deformed shape, or read.
    Places(Vec<Point3<f64>>),
}

impl HandleGroup {
    /// A group at the places that its vertices have in `shape`.
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
            hold: Hold::Hard,
        }
    }

    /// The motion as a job takes it.
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

    /// The middle of the group before it was moved, in a rest shape.
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

    /// The middle of the group where it is now.
    pub fn center(&self, rest: &Positions<f64>) -> Point3<f64> {
        self.matrix.transform_point(&self.pivot(rest))
    }
}

/// One state of everything that an edit can change.
#[derive(Clone, Debug)]
pub struct Scene {
    /// What led here, for the names of undo and redo.
    pub label: String,
    /// The shape that deformation keeps to: the file's, or what smoothing made of it.
    pub rest: Arc<Positions<f64>>,
    /// The shape that is seen and saved.
    pub shape: Arc<Positions<f64>>,
    /// Whether the shape follows its handles to the end, as far as the tolerance asks.
    pub is_settled: bool,
    /// Who holds the mesh.
    pub handles: Arc<Vec<HandleGroup>>,
    /// How it follows.
    pub options: DeformOptions,
}

impl Scene {
    /// A mesh as it was opened.
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

    /// The handles as a job takes them, with what no handle holds held still by a last group: each
    /// connected part needs one. `loose` are the vertices of those parts.
    pub fn job_handles(handles: &[HandleGroup], loose: &[VertexId]) -> Handles<f64> {
        let mut all = Handles::new();
        for group in handles {
            all = all.add(group.vertices.iter().copied(), group.job_motion());
            if let Hold::Soft(weight) = group.hold {
                all = all.soft(weight);
            }
        }
        if !loose.is_empty() {
            all = all.fix(loose.iter().copied());
        }
        all
    }
}

/// The command line's defaults, but to a tolerance at which two ways to a shape end at the same
/// one.
pub fn editor_options() -> DeformOptions {
    DeformOptions::default().tolerance(SETTLED)
}

/// Of the diagonal: what is left is far below a pixel, and 1e-6 of the box is safely met.
const SETTLED: f64 = 1e-9;

/// Scenes in the order in which they were made, and which of them is seen.
#[derive(Debug)]
pub struct History {
    past: Vec<Scene>,
    present: Scene,
    future: Vec<Scene>,
    /// How many edits lie before the present, in all: also those that were forgotten.
    count: u64,
}

impl History {
    /// Begins with a scene.
    pub fn new(scene: Scene) -> Self {
        Self {
            past: Vec::new(),
            present: scene,
            future: Vec::new(),
            count: 0,
        }
    }

    /// What is seen.
    pub fn present(&self) -> &Scene {
        &self.present
    }

    /// The present, to follow what the solver makes of it; no step of its own.
    pub fn present_mut(&mut self) -> &mut Scene {
        &mut self.present
    }

    /// A number that differs between any two states of one history that are an edit apart.
    pub fn position(&self) -> u64 {
        self.count
    }

    /// Goes on to a new scene; what was undone is forgotten, and so are scenes long past.
    pub fn push(&mut self, scene: Scene) {
        self.future.clear();
        self.count += 1;
        self.past.push(std::mem::replace(&mut self.present, scene));
        let forgotten = self.past.len().saturating_sub(self.most_past());
        self.past.drain(..forgotten);
    }

    /// What undo would take back, if there is something.
    pub fn undo_label(&self) -> Option<&str> {
        (!self.past.is_empty()).then_some(self.present.label.as_str())
    }

    /// What redo would do again, if there is something.
    pub fn redo_label(&self) -> Option<&str> {
        self.future.last().map(|scene| scene.label.as_str())
    }

    /// Goes back by one edit.
    pub fn undo(&mut self) -> bool {
        let Some(scene) = self.past.pop() else {
            return false;
        };
        self.count = self.count.saturating_sub(1);
        self.future
            .push(std::mem::replace(&mut self.present, scene));
        true
    }

    /// Goes forward by one edit that was undone.
    pub fn redo(&mut self) -> bool {
        let Some(scene) = self.future.pop() else {
            return false;
        };
        self.count += 1;
        self.past.push(std::mem::replace(&mut self.present, scene));
        true
    }

    /// Scenes that fit the memory meant for them.
    fn most_past(&self) -> usize {
        let bytes = self.present.shape.len().max(1) * size_of::<Point3<f64>>();
        (MOST_BYTES / bytes).clamp(20, 1000)
    }
}

/// Positions of past scenes, which mostly differ.
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
        // Made on a deformed shape, it is held where it is there.
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
