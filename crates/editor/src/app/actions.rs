//! Edits of the scene: handles, settings, jobs, undo.

use std::ops::ControlFlow;
use std::sync::Arc;

use cotan::geometry::{Positions, Readable, Surface};
use cotan::halfedge::VertexId;
use cotan::linear::Hold;
use cotan::smooth::{DetailOptions, ScaledCurvature, edit_detail_observed, smooth_observed};
use cotan::sphere::{SphereQuality, spherical_observed};
use cotan::{DeformOptions, Handles};
use eframe::egui;

use super::dialogs::Message;
use super::{Editor, JobBase, SphereView};
use crate::files::OpenedMesh;
use crate::scene::{HandleGroup, Role, Scene};
use crate::solver::Pace;
use crate::task::{Task, TaskError};
use crate::view::Picker;

/// The repairs applied to a mesh before it is opened.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Repairs {
    No,
    Safe,
}

/// The result of a task.
pub(super) enum TaskResult {
    /// A mesh was read and prepared for picking.
    Opened(Box<OpenedMesh>, Box<Picker>),
    /// A mesh could not be read, for the given reason. The path is set if repairs would help.
    NotOpened(String, Option<std::path::PathBuf>),
    /// A new shape was made from the shape on the screen.
    Shape {
        name: &'static str,
        positions: Positions<f64>,
        note: Option<String>,
    },
    /// A shape was mapped to the sphere.
    Mapped {
        source: Arc<Positions<f64>>,
        map: Positions<f64>,
        report: String,
    },
}

impl Editor {
    /// Pushes a scene with edited handles.
    fn edit_handles(&mut self, label: String, edit: impl FnOnce(&mut Vec<HandleGroup>)) {
        let Some(open) = &mut self.open else {
            return;
        };
        let mut scene = open.history.present().clone();
        let mut handles = Vec::clone(&scene.handles);
        edit(&mut handles);
        handles.retain(|group| !group.vertices.is_empty());
        if *scene.handles == handles {
            return;
        }
        scene.handles = Arc::new(handles);
        scene.label = label;
        open.history.push(scene);
        self.jobs.base = None;
    }

    /// Makes a handle of the selection.
    pub(super) fn make_handle(&mut self, role: Role) {
        let vertices = std::mem::take(&mut self.selection);
        self.tint();
        self.hold(vertices, role, None);
    }

    /// Holds vertices at their current positions and removes them from other handles.
    fn hold(&mut self, vertices: Vec<VertexId>, role: Role, name: Option<&str>) {
        let Some(scene) = self.scene().filter(|_| !vertices.is_empty()) else {
            return;
        };
        let (rest, shape) = (Arc::clone(&scene.rest), Arc::clone(&scene.shape));
        let is_settled = scene.is_settled;
        let name = name.map_or_else(|| free_name(&scene.handles, role), str::to_owned);
        let label = match role {
            Role::Fixed => format!("Fix a region: {name}"),
            Role::Movable => format!("Add handle {name}"),
        };
        self.edit_handles(label, |handles| {
            for group in handles.iter_mut() {
                let_go(group, &vertices);
            }
            handles.push(HandleGroup::new(name, vertices, role, &rest, &shape));
        });
        if role == Role::Movable {
            self.active = self.scene().map(|s| s.handles.len().saturating_sub(1));
        }
        self.tint();
        // A settled shape that is held where it is needs no solve.
        self.post(if is_settled {
            Pace::Still
        } else {
            Pace::Settle
        });
    }

    /// Removes a handle.
    pub(super) fn remove_handle(&mut self, index: usize) {
        let Some(name) = self
            .scene()
            .and_then(|s| Some(s.handles.get(index)?.name.clone()))
        else {
            return;
        };
        self.edit_handles(format!("Remove {name}"), |handles| {
            handles.remove(index);
        });
        self.active = None;
        self.tint();
        self.settle();
    }

    /// Sets the constraint of a handle: exact or by springs.
    pub(super) fn set_hold(&mut self, index: usize, hold: Hold) {
        self.edit_handles("Change a weight".to_owned(), |handles| {
            if let Some(group) = handles.get_mut(index) {
                group.hold = hold;
            }
        });
        self.settle();
    }

    /// The name of the handle that holds the open boundary.
    pub(super) const BOUNDARY: &'static str = "Boundary";

    /// Fixes or releases the open boundary.
    pub(super) fn fix_boundary(&mut self, is_fixed: bool) {
        let Some(open) = &self.open else {
            return;
        };
        if is_fixed {
            let mesh = open.mesh.processing.mesh();
            let all = mesh.vertices().filter(|&v| mesh.is_boundary_vertex(v));
            let held = &open.history.present().handles;
            let is_free = |v: &VertexId| {
                held.iter()
                    .all(|group| group.vertices.binary_search(v).is_err())
            };
            let rim: Vec<VertexId> = all.filter(is_free).collect();
            self.hold(rim, Role::Fixed, Some(Self::BOUNDARY));
        } else if let Some(index) = self.boundary_handle() {
            self.remove_handle(index);
        }
    }

    /// The index of the handle that holds the open boundary.
    pub(super) fn boundary_handle(&self) -> Option<usize> {
        let handles = &self.scene()?.handles;
        handles
            .iter()
            .position(|group| group.name == Self::BOUNDARY)
    }

    /// Pushes a scene with other options of the deformation.
    pub(super) fn set_options(&mut self, label: &str, options: DeformOptions) {
        let Some(open) = &mut self.open else {
            return;
        };
        let mut scene = open.history.present().clone();
        scene.options = options;
        scene.label = label.to_owned();
        open.history.push(scene);
        self.settle();
    }

    /// Replaces all handles and starts from the rest shape, as `cotan deform` does.
    pub(super) fn load_groups(&mut self, new: Vec<HandleGroup>) {
        let Some(open) = &mut self.open else {
            return;
        };
        let mut scene = open.history.present().clone();
        // A new `Arc` of the same rest shape makes the solver start afresh, not from where the
        // previous handles had moved it.
        scene.rest = Arc::new(Positions::clone(&scene.rest));
        scene.shape = Arc::clone(&scene.rest);
        scene.handles = Arc::new(new);
        scene.label = "Load handles".to_owned();
        open.history.push(scene);
        self.jobs.base = None;
        self.active = None;
        self.tint();
        self.settle();
    }

    /// Removes all handles.
    pub(super) fn remove_all_handles(&mut self) {
        self.edit_handles("Let go of all handles".to_owned(), Vec::clear);
        self.active = None;
        self.tint();
        self.settle();
    }

    /// Lets the shape converge with the current handles and settings.
    pub(super) fn settle(&mut self) {
        let Some(open) = &mut self.open else {
            return;
        };
        let scene = open.history.present_mut();
        if scene.handles.is_empty() {
            self.post(Pace::Still);
            return;
        }
        scene.is_settled = false;
        self.solver.clear_samples();
        self.post(Pace::Settle);
    }

    /// Stops the solver and keeps the current shape.
    pub(super) fn stop(&mut self) {
        self.show_as_is();
    }

    /// Returns to the rest shape, with the handles at their original positions.
    pub(super) fn reset_shape(&mut self) {
        if let Some(rest) = self.scene().map(|scene| Arc::clone(&scene.rest)) {
            self.push_shape("Back to the rest shape".to_owned(), rest);
        }
    }

    pub(super) fn undo(&mut self) {
        self.travel(super::History::undo);
    }

    pub(super) fn redo(&mut self) {
        self.travel(super::History::redo);
    }

    fn travel(&mut self, go: fn(&mut super::History) -> bool) {
        self.cancel_drag();
        self.cancel_task();
        self.jobs.map = None;
        self.jobs.base = None;
        let Some(open) = &mut self.open else {
            return;
        };
        if go(&mut open.history) {
            let count = open.history.present().handles.len();
            self.active = self.active.filter(|&a| a < count);
            self.tint();
            self.show_as_is();
        }
    }

    /// Colours the selected and held vertices in the picture.
    pub(super) fn tint(&mut self) {
        let Some(open) = &self.open else {
            return;
        };
        let mut tints = vec![0_u8; open.mesh.processing.mesh().num_vertices()];
        for (index, group) in open.history.present().handles.iter().enumerate() {
            let tint = match group.role {
                _ if self.active == Some(index) => tint::ACTIVE,
                Role::Fixed => tint::FIXED,
                Role::Movable => tint::MOVABLE,
            };
            group.vertices.iter().for_each(|v| tints[v.index()] = tint);
        }
        self.selection
            .iter()
            .for_each(|v| tints[v.index()] = tint::SELECTED);
        crate::newest::lock(&self.renderer).set_tints(&tints);
    }

    // Jobs.

    /// Cancels the running job.
    pub(super) fn cancel_task(&mut self) {
        if let Some(task) = &self.task {
            task.cancel();
        }
    }

    pub(super) fn start_task(
        &mut self,
        ctx: &egui::Context,
        name: &str,
        work: impl FnOnce(&crate::task::Control) -> Result<TaskResult, TaskError> + Send + 'static,
    ) {
        self.cancel_task();
        let ctx = ctx.clone();
        match Task::start(name, move || ctx.request_repaint(), work) {
            Ok(task) => self.task = Some(task),
            Err(error) => self.tell(Message::error(format!("cannot start a thread: {error}"))),
        }
    }

    /// The scene that a slider's job starts from: the one shown before the slider was moved.
    fn job_scene(&mut self, name: &'static str) -> Option<Scene> {
        let open = self.open.as_ref()?;
        let position = open.history.position();
        if let Some(base) = &self.jobs.base
            && base.name == name
            && base.position == position
        {
            return Some(base.scene.clone());
        }
        let scene = open.history.present().clone();
        self.jobs.base = Some(JobBase {
            name,
            scene: scene.clone(),
            position,
            has_result: false,
        });
        Some(scene)
    }

    /// Smooths the current shape.
    pub(super) fn smooth(&mut self, ctx: &egui::Context) {
        let Some((scene, open)) = self.job_scene("Smooth").zip(self.open.as_ref()) else {
            return;
        };
        let mesh = Arc::clone(&open.mesh.processing);
        let options = self.jobs.smooth;
        self.start_task(ctx, "Smoothing", move |control| {
            let of = options.iterations.unwrap_or_else(|| {
                options
                    .method
                    .smoother()
                    .unwrap_or_default()
                    .default_iterations()
            });
            let observer = |done| control.advance(done, of);
            let smoothed = smooth_observed(
                Surface::assume_checked(mesh.mesh(), &scene.shape),
                &Handles::new(),
                &options,
                &observer,
            )
            .map_err(refusal)?;
            let note = smoothed
                .reason
                .map(|r| format!("{}: {r}", smoothed.method.name()));
            Ok(TaskResult::Shape {
                name: "Smooth",
                positions: smoothed.positions,
                note,
            })
        });
    }

    /// Scales the details of the current shape.
    pub(super) fn scale_details(&mut self, ctx: &egui::Context) {
        let Some((scene, open)) = self.job_scene("Details").zip(self.open.as_ref()) else {
            return;
        };
        let mesh = Arc::clone(&open.mesh.processing);
        let edit = ScaledCurvature::by(self.jobs.detail);
        self.start_task(ctx, "Scaling details", move |control| {
            let options = DetailOptions::default();
            let observer = |done| control.advance(done, options.iterations);
            let edited = edit_detail_observed(
                Surface::assume_checked(mesh.mesh(), &scene.shape),
                &Handles::new(),
                &edit,
                &options,
                &observer,
            );
            Ok(TaskResult::Shape {
                name: "Details",
                positions: edited.map_err(refusal)?.positions,
                note: None,
            })
        });
    }

    /// Maps the current shape to the sphere.
    pub(super) fn map_to_sphere(&mut self, ctx: &egui::Context) {
        let Some(open) = &self.open else {
            return;
        };
        let mesh = Arc::clone(&open.mesh.processing);
        let source = Arc::clone(&open.history.present().shape);
        let options = self.jobs.sphere.clone();
        self.start_task(ctx, "Mapping to the sphere", move |control| {
            let observer = |step: &cotan::flow::StepReport| {
                control.advance(step.iteration.min(options.iteration_limit), 0)
            };
            let made = spherical_observed(
                Surface::assume_checked(mesh.mesh(), &source),
                &options,
                observer,
            )
            .map_err(|e| TaskError::Failed(e.to_string()))?;
            if control.advance(0, 0) == ControlFlow::Break(()) {
                return Err(TaskError::Cancelled);
            }
            let surface =
                Surface::new(mesh.mesh(), &source).map_err(|e| TaskError::Failed(e.to_string()))?;
            let quality = SphereQuality::measure(&surface, &made.map);
            let report = format!(
                "no flipped triangle; angles off by {:.2}° on average, areas by a factor of {}",
                quality.angle_error_degrees.mean,
                Readable(quality.area_distortion.mean.exp())
            );
            Ok(TaskResult::Mapped {
                map: made.map.into_positions(),
                source,
                report,
            })
        });
    }

    /// Sets the position of the morph between the shape and its map.
    pub(super) fn set_morph(&mut self, share: f64) {
        let Some(view) = &mut self.jobs.map else {
            return;
        };
        view.share = share;
        view.blend = Arc::new(cotan::sphere::towards_sphere(
            &view.source,
            &view.map,
            share,
        ));
    }

    /// Makes the morph on the screen the new shape.
    pub(super) fn keep_morph(&mut self) {
        let Some(view) = self.jobs.map.take() else {
            return;
        };
        let label = format!("Morph {:.0} % to the sphere", 100.0 * view.share);
        self.push_shape(label, Arc::clone(&view.blend));
    }

    /// Pushes a scene with a new rest shape, in which the handles hold their vertices where they
    /// are.
    fn push_shape(&mut self, label: String, shape: Arc<Positions<f64>>) {
        let Some(open) = &mut self.open else {
            return;
        };
        let scene = reshaped(open.history.present(), label, shape);
        open.history.push(scene);
        self.show_as_is();
    }

    /// Takes the result of the task, if it has ended.
    pub(super) fn take_task(&mut self) {
        let Some(result) = self.task.as_ref().and_then(Task::poll) else {
            return;
        };
        self.task = None;
        match result {
            Err(TaskError::Cancelled) => {}
            Err(error) => self.tell(Message::error(error.to_string())),
            Ok(TaskResult::Opened(mesh, picker)) => self.opened(*mesh, *picker),
            Ok(TaskResult::NotOpened(problem, repairable)) => {
                self.not_opened(problem, repairable);
            }
            Ok(TaskResult::Shape {
                name,
                positions,
                note,
            }) => self.take_shape(name, Arc::new(positions), note),
            Ok(TaskResult::Mapped {
                source,
                map,
                report,
            }) => {
                let is_current = |scene: &Scene| Arc::ptr_eq(&scene.shape, &source);
                if !self.scene().is_some_and(is_current) {
                    let note = "the shape has changed since it was mapped: map it again";
                    self.dialogs.note = Some(note.to_owned());
                    return;
                }
                let map = Arc::new(map);
                self.jobs.map = Some(SphereView {
                    blend: Arc::clone(&source),
                    source,
                    map,
                    share: 0.0,
                    report,
                });
                self.set_morph(1.0);
            }
        }
    }

    /// Shows the result of a slider's job in place of its previous result.
    fn take_shape(&mut self, name: &'static str, shape: Arc<Positions<f64>>, note: Option<String>) {
        let (Some(open), Some(base)) = (&mut self.open, &mut self.jobs.base) else {
            return;
        };
        if base.name != name || base.position != open.history.position() {
            return;
        }
        let scene = reshaped(&base.scene, name.to_owned(), shape);
        if base.has_result {
            *open.history.present_mut() = scene;
        } else {
            open.history.push(scene);
            base.position = open.history.position();
            base.has_result = true;
        }
        self.dialogs.note = note;
        self.show_as_is();
    }
}

/// The tints of the picture, as indices into the style's palette.
mod tint {
    pub(super) const SELECTED: u8 = 1;
    pub(super) const FIXED: u8 = 5;
    pub(super) const MOVABLE: u8 = 3;
    pub(super) const ACTIVE: u8 = 6;
}

fn reshaped(scene: &Scene, label: String, shape: Arc<Positions<f64>>) -> Scene {
    let handles = scene.handles.iter().map(|group| HandleGroup {
        hold: group.hold,
        ..HandleGroup::new(
            group.name.clone(),
            group.vertices.clone(),
            group.role,
            &shape,
            &shape,
        )
    });
    Scene {
        label,
        handles: Arc::new(handles.collect()),
        rest: Arc::clone(&shape),
        shape,
        is_settled: true,
        options: scene.options.clone(),
    }
}

fn let_go(group: &mut HandleGroup, vertices: &[VertexId]) {
    let is_kept: Vec<bool> = group
        .vertices
        .iter()
        .map(|v| vertices.binary_search(v).is_err())
        .collect();
    let mut kept = is_kept.iter();
    group.vertices.retain(|_| kept.next() == Some(&true));
    if let crate::scene::Origin::Places(places) = &mut group.origin {
        let mut kept = is_kept.iter();
        places.retain(|_| kept.next() == Some(&true));
    }
}

fn free_name(handles: &[HandleGroup], role: Role) -> String {
    let is_free = |name: &String| handles.iter().all(|group| group.name != *name);
    let mut names: Box<dyn Iterator<Item = String>> = match role {
        Role::Fixed => Box::new((1..).map(|k| format!("Fixed {k}"))),
        Role::Movable => {
            let letters = ('A'..='Z').map(String::from);
            Box::new(letters.chain((1..).map(|k| format!("Handle {k}"))))
        }
    };
    names.find(is_free).unwrap_or_default()
}

fn refusal(error: cotan::Error) -> TaskError {
    match error {
        cotan::Error::Cancelled => TaskError::Cancelled,
        error => TaskError::Failed(error.to_string()),
    }
}
