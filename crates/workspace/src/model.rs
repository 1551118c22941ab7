//! The open model: a mesh with its file and its history.

use std::path::PathBuf;

use cotan::geometry::Surface;
use cotan::halfedge::HalfedgeMesh;
use nalgebra::Point3;

use crate::command::{Command, Record};
use crate::edit::edited;
use crate::files::{Fingerprint, OpenedMesh};
use crate::handle::Role;
use crate::history::{History, Step};
use crate::mirror::{Images, Mirror};
use crate::refused::{After, Refused};
use crate::scene::Scene;
use crate::settings::Others;
use crate::shape::Shape;

/// The open model: a mesh with its file and its history.
#[derive(Clone, Debug)]
pub struct Model {
    mesh: OpenedMesh,
    /// The shape as it was opened, which measurements compare with.
    original: Shape,
    history: History,
    /// The scene when the file was last read or written.
    saved: Scene,
    /// `true` if `mesh.path` names a file of the user.
    has_file: bool,
    /// The longest side of the box of the original shape.
    side: f64,
    /// The mirror images of the vertices in the opened shape, with their plane.
    images: Option<(Mirror, Images)>,
}

impl Model {
    /// A model that was just read from its file.
    pub fn new(mesh: OpenedMesh) -> Self {
        let shape = Shape::new(mesh.processing.positions().clone());
        let scene = Scene::new(shape);
        Self::with_scene(mesh, scene)
    }

    /// A model that was read from a project, with its scene.
    pub(crate) fn with_scene(mesh: OpenedMesh, scene: Scene) -> Self {
        let side = mesh.processing.surface().bounding_box().longest_side();
        Self {
            original: Shape::new(mesh.processing.positions().clone()),
            history: History::new("Open", scene.clone()),
            saved: scene,
            has_file: true,
            side,
            images: None,
            mesh,
        }
    }

    /// The same model, but without a file of the user: saving asks for one.
    #[must_use]
    pub(crate) fn without_file(mut self) -> Self {
        self.has_file = false;
        self
    }

    /// The mesh and its file.
    pub fn file(&self) -> &OpenedMesh {
        &self.mesh
    }

    /// Returns `true` if the path of the file is the user's, not that of the sample.
    pub fn has_file(&self) -> bool {
        self.has_file
    }

    /// The connectivity.
    pub fn mesh(&self) -> &HalfedgeMesh {
        self.mesh.processing.mesh()
    }

    /// A shape of this model as a surface.
    pub fn surface<'a>(&'a self, shape: &'a Shape) -> Surface<'a, f64> {
        Surface::assume_checked(self.mesh(), shape.positions())
    }

    /// The shape as it was opened.
    pub fn original(&self) -> &Shape {
        &self.original
    }

    /// The longest side of the box of the original shape.
    pub fn side(&self) -> f64 {
        self.side
    }

    /// The mirror images of the vertices, if the mirror is on.
    pub(crate) fn images(&self) -> Option<&Images> {
        let mirror = self.scene().props.mirror?;
        let (_, images) = self.images.as_ref().filter(|(of, _)| *of == mirror)?;
        Some(images)
    }

    /// Stores the images across a plane, so that they need not be found again.
    pub(crate) fn set_images(&mut self, mirror: Mirror, images: Images) {
        self.images = Some((mirror, images));
    }

    /// Finds the images across the plane of the scene, unless they are known.
    pub(crate) fn find_images(&mut self) {
        let is_known = self.images().is_some();
        if let Some(mirror) = self.scene().props.mirror.filter(|_| !is_known) {
            let surface = self.surface(&self.original);
            self.images = Some((mirror, mirror.images(&surface, self.side)));
        }
    }

    /// The point about which handles turn and scale: the pivot, or the middle of the active
    /// handles.
    pub fn pivot(&self) -> Point3<f64> {
        let scene = self.scene();
        if let Some(at) = scene.props.pivot.and_then(|v| scene.shape.get(v)) {
            return *at;
        }
        let active = scene.props.active_handles();
        let centers: Vec<_> = active
            .filter_map(|k| Some(scene.handles().get(k)?.center(&scene.rest).coords))
            .collect();
        let sum: nalgebra::Vector3<f64> = centers.iter().sum();
        Point3::from(sum / centers.len().max(1) as f64)
    }

    /// A round length of about a fiftieth of the longest side, to which motions snap.
    pub fn snap_length(&self) -> f64 {
        10_f64.powf((0.02 * self.side).log10().round())
    }

    /// The history.
    pub fn history(&self) -> &History {
        &self.history
    }

    pub(crate) fn history_mut(&mut self) -> &mut History {
        &mut self.history
    }

    /// The scene that is shown.
    pub fn scene(&self) -> &Scene {
        self.history.scene()
    }

    /// The number of parts that stay behind when a handle is moved: they have no handle, and either
    /// the settings say so or only a region follows.
    pub fn num_left_behind(&self) -> usize {
        let follow = &self.scene().settings().follow;
        let handles = self.scene().handles();
        let do_all_follow = follow.others == Others::Follow && follow.influence.is_none();
        if do_all_follow || handles.iter().all(|group| group.role == Role::Fixed) {
            return 0;
        }
        let components = self.mesh().components();
        let mut is_held = vec![false; components.count()];
        for &v in handles.iter().flat_map(|group| &group.vertices) {
            is_held[components.of(v)] = true;
        }
        is_held.iter().filter(|is_held| !**is_held).count()
    }

    /// Marks the present scene as saved, in a file of the user or deliberately nowhere.
    pub(crate) fn mark_saved(&mut self) {
        self.saved = self.scene().clone();
    }

    /// Makes a file that was written the open one.
    pub(crate) fn set_file(&mut self, path: PathBuf, fingerprint: Fingerprint) {
        self.mesh.path = path;
        self.mesh.fingerprint = fingerprint;
        self.has_file = true;
    }

    /// Adds a step with a scene that was recovered after a crash.
    pub(crate) fn push_recovered(&mut self, scene: Scene) {
        self.history.push(Step {
            command: None,
            label: "Recovered".to_owned(),
            scene,
        });
    }

    /// The losses of closing the model now, in words; empty if nothing would be.
    ///
    /// The selection counts for nothing.
    pub fn losses(&self) -> Vec<String> {
        let (now, saved) = (self.scene(), &self.saved);
        let mut losses = Vec::new();
        if now.shape != saved.shape {
            losses.push(format!(
                "the shape (last: {})",
                self.history.present().label
            ));
        }
        if now.handles() != saved.handles() {
            let names: Vec<&str> = now.handles().iter().map(|g| g.name.as_str()).collect();
            losses.push(match names.as_slice() {
                [] => "the removal of all handles".to_owned(),
                [one] => format!("the handle {one}"),
                all => format!("the handles {}", all.join(", ")),
            });
        }
        if now.props.masks != saved.props.masks {
            let names: Vec<&str> = now.props.masks.iter().map(|m| m.name.as_str()).collect();
            losses.push(match names.as_slice() {
                [] => "the removal of all masks".to_owned(),
                all => format!("the masks {}", all.join(", ")),
            });
        }
        if now.settings().follow != saved.settings().follow {
            losses.push("the deformation settings".to_owned());
        }
        losses
    }

    /// Returns `true` if closing the model would lose something.
    pub fn is_changed(&self) -> bool {
        let (now, saved) = (self.scene(), &self.saved);
        now.shape != saved.shape
            || now.handles() != saved.handles()
            || now.props.masks != saved.props.masks
            || now.settings().follow != saved.settings().follow
    }

    /// Carries out a recorded command. Returns what the solver is to do, or `None` if nothing has
    /// changed.
    ///
    /// The result depends on nothing but the history and the command: replaying a list of commands
    /// leads to the same scenes.
    ///
    /// # Errors
    /// [`Refused`] if the command names what does not exist, or makes no sense now.
    pub fn record(&mut self, command: &Command) -> Result<Option<After>, Refused> {
        // A project may begin with a mirror.
        self.find_images();
        if let Record::Travel = command.record() {
            let has_moved = match *command {
                Command::Undo => self.history.undo(),
                Command::Redo => self.history.redo(),
                Command::GoTo { step } => self.history.go_to(step),
                _ => false,
            };
            return Ok(has_moved.then_some(After::Show));
        }
        let Some(edited) = edited(self, command)? else {
            return Ok(None);
        };
        let step = Step {
            command: Some(command.clone()),
            label: edited.label,
            scene: edited.scene,
        };
        match command.record() {
            Record::InPlace => *self.history.scene_mut() = step.scene,
            Record::Selection if self.history.is_selection() => self.history.replace(step),
            _ if edited.is_again => self.history.replace(step),
            _ => self.history.push(step),
        }
        self.find_images();
        Ok(Some(edited.after))
    }
}
