//! The window: the open mesh, its picture, and the user's actions.

mod actions;
mod dialogs;
mod drag;
pub(crate) mod file_actions;
mod keys;
mod menu;
mod panels;
mod trace;
mod viewport;

use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use cotan::geometry::{Positions, Surface};
use cotan::halfedge::{VertexId, VertexMap};
use cotan::smooth::SmoothOptions;
use cotan::sphere::SphereOptions;
use eframe::egui;
use nalgebra::Vector3;

use crate::files::{Autosave, OpenedMesh};
use crate::meter::{Field, Meter, Reading, Subject};
use crate::scene::{HandleGroup, History, Scene};
use crate::solver::{Goal, Pace, Solver, State};
use crate::task::Task;
use crate::view::{Camera, Renderer, Shading};

pub use trace::Trace;

use actions::TaskResult;
use dialogs::Dialogs;
use drag::Drag;
use viewport::{GizmoTool, Tool};

/// The arguments that the program was started with.
#[derive(Debug, Default)]
pub struct Startup {
    /// The mesh to open, or the sample if there is none.
    pub mesh: Option<PathBuf>,
    /// A file of handles to put on the mesh.
    pub handles: Option<PathBuf>,
    /// The trace that records every frame, for tests and measurements.
    pub trace: Option<Trace>,
    /// Enables keys that crash the program on purpose, for tests of crash recovery.
    pub breakable: bool,
}

/// The open mesh.
pub(crate) struct Open {
    pub(crate) mesh: OpenedMesh,
    pub(crate) history: History,
    /// The shape as it was opened.
    original: Arc<Positions<f64>>,
    /// The position of the history and the shape when the file was last read or written.
    saved: (u64, Arc<Positions<f64>>),
    /// `true` if `mesh.path` names an existing file.
    has_file: bool,
}

/// The editor.
pub struct Editor {
    open: Option<Open>,
    solver: Solver,
    meter: Meter,
    task: Option<Task<TaskResult>>,
    /// The tag of the goal posted last, and the first tag whose updates are still accepted.
    tag: u64,
    accepted_from: u64,
    /// The last known shape of the solver.
    solver_shape: Option<Arc<Positions<f64>>>,
    times: Option<[Instant; 3]>,
    reading: Option<Reading>,
    /// The shape and field of the last measurement requested, and the time of the request.
    measured: Option<(Arc<Positions<f64>>, Field, Instant)>,
    camera: Camera,
    renderer: Arc<Mutex<Renderer>>,
    /// The shape last passed to the renderer.
    drawn: Option<Arc<Positions<f64>>>,
    looks: Looks,
    tool: Tool,
    gizmo_tool: GizmoTool,
    gizmo: transform_gizmo_egui::Gizmo,
    drag: Option<Drag>,
    pick: viewport::PickState,
    selection: Vec<VertexId>,
    active: Option<usize>,
    jobs: Jobs,
    dialogs: Dialogs,
    autosave: Option<Arc<Autosave>>,
    /// The time of the last autosave, and its contents if the file still exists.
    autosaved: (Instant, Option<Aside>),
    trace: Option<Trace>,
    startup: Startup,
    is_closing: bool,
    /// The current window title.
    ///
    /// It is set only when it changes, because setting it requests a redraw.
    shown_title: String,
}

/// The shape and the handles in an autosave.
type Aside = (Arc<Positions<f64>>, Arc<Vec<HandleGroup>>);

/// The display settings of the mesh.
#[derive(Clone, Copy, Debug, Default)]
struct Looks {
    shading: Shading,
    has_wireframe: bool,
    has_normals: bool,
    field: Field,
}

/// The settings of the jobs in the side panel, and their results.
struct Jobs {
    tab: Tab,
    smooth: SmoothOptions,
    /// Strength of smoothing, from 0 to 1, for methods that have one.
    strength: f64,
    detail: f64,
    sphere: SphereOptions,
    /// The starting point of a slider's job, while the result of that slider is shown.
    base: Option<JobBase>,
    map: Option<SphereView>,
    soft_weight: f64,
}

/// A scene and the name of the job that starts from it.
struct JobBase {
    name: &'static str,
    scene: Scene,
    /// The position of the history at which the scene is shown.
    position: u64,
    /// `true` if the present scene is a result of the job, to be replaced by the next one.
    has_result: bool,
}

/// A map of the shape to the sphere, and the state of the morph between the two.
struct SphereView {
    source: Arc<Positions<f64>>,
    map: Arc<Positions<f64>>,
    share: f64,
    blend: Arc<Positions<f64>>,
    report: String,
}

/// The tabs of the jobs.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Tab {
    Deform,
    Smooth,
    Sphere,
}

impl Editor {
    /// Makes the editor in eframe's window.
    ///
    /// # Errors
    /// One sentence: OpenGL is missing, or a thread cannot be started.
    pub fn new(cc: &eframe::CreationContext<'_>, mut startup: Startup) -> Result<Self, String> {
        let gl = cc.gl.as_ref().ok_or("the window has no OpenGL")?;
        let renderer = Renderer::new(gl)?;
        let no_thread = |e: std::io::Error| format!("cannot start a thread: {e}");
        let repaint = |ctx: &egui::Context| {
            let ctx = ctx.clone();
            move || ctx.request_repaint()
        };
        let dialogs = Dialogs::new();
        let mut editor = Self {
            open: None,
            solver: Solver::start(repaint(&cc.egui_ctx)).map_err(no_thread)?,
            meter: Meter::start(repaint(&cc.egui_ctx)).map_err(no_thread)?,
            task: None,
            tag: 0,
            accepted_from: 0,
            solver_shape: None,
            times: None,
            reading: None,
            measured: None,
            camera: Camera::new(&cotan::shapes::icosphere::<f64>(0).surface().bounding_box()),
            renderer: Arc::new(Mutex::new(renderer)),
            drawn: None,
            looks: Looks::default(),
            tool: Tool::Select,
            gizmo_tool: GizmoTool::Move,
            gizmo: transform_gizmo_egui::Gizmo::default(),
            drag: None,
            pick: viewport::PickState::default(),
            selection: Vec::new(),
            active: None,
            jobs: Jobs {
                tab: Tab::Deform,
                smooth: SmoothOptions::default(),
                strength: 0.5,
                detail: 1.0,
                sphere: SphereOptions::default(),
                base: None,
                map: None,
                soft_weight: 100.0,
            },
            dialogs,
            autosave: None,
            autosaved: (Instant::now(), None),
            trace: startup.trace.take(),
            startup,
            is_closing: false,
            shown_title: String::new(),
        };
        editor.start_autosave();
        match editor.startup.mesh.clone() {
            Some(path) => editor.open_path(&cc.egui_ctx, path, actions::Repairs::No),
            None => editor.open_sample(),
        }
        Ok(editor)
    }

    /// The shape that is shown on the screen.
    fn displayed(&self) -> Option<Arc<Positions<f64>>> {
        if let Some(view) = &self.jobs.map
            && view.share > 0.0
        {
            return Some(Arc::clone(&view.blend));
        }
        let open = self.open.as_ref()?;
        Some(Arc::clone(&open.history.present().shape))
    }

    fn scene(&self) -> Option<&Scene> {
        Some(self.open.as_ref()?.history.present())
    }

    /// Posts the current handles to the solver.
    fn post(&mut self, pace: Pace) {
        let Some(open) = &self.open else {
            return;
        };
        let scene = open.history.present();
        self.tag += 1;
        let is_known = self
            .solver_shape
            .as_ref()
            .is_some_and(|shape| Arc::ptr_eq(shape, &scene.shape));
        let goal = Goal {
            tag: self.tag,
            mesh: Arc::clone(&open.mesh.processing),
            rest: Arc::clone(&scene.rest),
            handles: Arc::clone(&scene.handles),
            options: scene.options.clone(),
            shape: (!is_known).then(|| Arc::clone(&scene.shape)),
            pace,
            posted: Instant::now(),
        };
        self.solver_shape = Some(Arc::clone(&scene.shape));
        self.solver.post(goal);
    }

    /// Shows a scene that does not continue the previous one.
    ///
    /// Updates for the previous scene are discarded.
    fn show_as_is(&mut self) {
        self.post(Pace::Still);
        self.accepted_from = self.tag;
        self.solver.clear_samples();
    }

    /// Collects the results of the worker threads.
    fn collect(&mut self, ctx: &egui::Context) {
        if let Some(update) = self.solver.take()
            && update.tag >= self.accepted_from
            && let Some(open) = &mut self.open
        {
            let scene = open.history.present_mut();
            scene.shape = Arc::clone(&update.shape);
            scene.is_settled = update.state == State::Settled && update.tag == self.tag;
            self.solver_shape = Some(Arc::clone(&update.shape));
            self.times = Some(update.times);
            if self.jobs.map.is_none() {
                self.give_renderer(&update.shape, &update.normals);
            }
            if let Some(trace) = &mut self.trace {
                trace.taken(update.tag, update.times);
            }
        }
        if matches!(self.solver.state().0, State::Failed(_)) {
            // The solver restarts and needs a starting shape.
            self.solver_shape = None;
        }
        if let Some(reading) = self.meter.take() {
            let colors = reading
                .colors
                .as_ref()
                .map(|(.., colors)| colors.as_slice());
            crate::newest::lock(&self.renderer).set_colors(colors);
            self.reading = Some(reading);
        }
        self.take_task();
        self.refresh(ctx);
    }

    /// Brings the picture and the meter up to date with the shape on the screen.
    fn refresh(&mut self, ctx: &egui::Context) {
        let (Some(shape), Some(open)) = (self.displayed(), &self.open) else {
            return;
        };
        let is_drawn = self.drawn.as_ref().is_some_and(|s| Arc::ptr_eq(s, &shape));
        let mesh = Arc::clone(&open.mesh.processing);
        // Measurements compare with the mesh as it was opened, even after a job has replaced the
        // rest shape.
        let original = Arc::clone(&open.original);
        if !is_drawn && let Ok(surface) = Surface::new(mesh.mesh(), &shape) {
            let normals = surface.vertex_normals();
            self.give_renderer(&shape, &normals);
        }
        let field = self.looks.field;
        let is_measured = self
            .measured
            .as_ref()
            .is_some_and(|(s, f, _)| Arc::ptr_eq(s, &shape) && *f == field);
        // Without colours the errors need not be measured in every frame while the solver is
        // busy.
        let may_wait = field == Field::Plain && self.solver.state().0 == State::Running;
        let is_recent = |(.., when): &(_, _, Instant)| when.elapsed() < NUMBERS_EVERY;
        if !is_measured && may_wait && self.measured.as_ref().is_some_and(is_recent) {
            ctx.request_repaint_after(NUMBERS_EVERY);
        } else if !is_measured {
            self.measured = Some((Arc::clone(&shape), field, Instant::now()));
            self.meter.post(Subject {
                mesh,
                original,
                shape,
                field,
            });
        }
    }

    fn give_renderer(&mut self, shape: &Arc<Positions<f64>>, normals: &VertexMap<Vector3<f64>>) {
        crate::newest::lock(&self.renderer).set_shape(shape, normals);
        self.drawn = Some(Arc::clone(shape));
    }

    /// Returns `true` if there are unsaved changes.
    fn is_changed(&self) -> bool {
        self.open.as_ref().is_some_and(|open| {
            let scene = open.history.present();
            let (position, shape) = &open.saved;
            open.history.position() != *position || !Arc::ptr_eq(shape, &scene.shape)
        })
    }

    fn title(&self) -> String {
        let Some(open) = &self.open else {
            return "cotan".to_owned();
        };
        let name = open.mesh.path.file_name().unwrap_or_default();
        let mark = if self.is_changed() { "*" } else { "" };
        format!("{}{mark} – cotan", name.to_string_lossy())
    }
}

/// Interval between error measurements while the shape moves and no colours show them.
const NUMBERS_EVERY: Duration = Duration::from_millis(250);

impl eframe::App for Editor {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        let begin = Instant::now();
        let ctx = ui.ctx().clone();
        self.collect(&ctx);
        self.keys(&ctx);
        self.menu(ui);
        self.status(ui);
        self.panels(ui);
        self.viewport(ui);
        self.show_dialogs(&ctx);
        if let Some(wait) = self.autosave_if_due() {
            // Without other events the next frame comes only then.
            ctx.request_repaint_after(wait);
        }
        self.close_if_asked(&ctx);
        let title = self.title();
        if title != self.shown_title {
            let shown = cotan_io::printable(&title).into_owned();
            ctx.send_viewport_cmd(egui::ViewportCommand::Title(shown));
            self.shown_title = title;
        }
        if self.task.is_some() {
            ctx.request_repaint_after(Duration::from_millis(100));
        }
        self.write_trace(&ctx, begin);
    }

    fn on_exit(&mut self, _gl: Option<&eframe::glow::Context>) {
        if let Some(autosave) = &self.autosave {
            // A regular exit: unsaved changes were discarded deliberately.
            let _ = autosave.remove();
        }
    }
}
