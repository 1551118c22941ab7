//! The window: what is open, what is seen, and what a person does with it.

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

/// What the program was started with.
#[derive(Debug, Default)]
pub struct Startup {
    /// The mesh to open; the sample if there is none.
    pub mesh: Option<PathBuf>,
    /// Handles to put on it.
    pub handles: Option<PathBuf>,
    /// Where every frame is told of, for tests and measurements.
    pub trace: Option<Trace>,
    /// Whether keys that break the program on purpose work, for tests of what that leaves behind.
    pub breakable: bool,
}

/// A mesh that is open.
pub(crate) struct Open {
    pub(crate) mesh: OpenedMesh,
    pub(crate) history: History,
    /// The shape as it was opened.
    original: Arc<Positions<f64>>,
    /// The history's position and the shape when the file was last written or read.
    saved: (u64, Arc<Positions<f64>>),
    /// Whether `mesh.path` names a file that is there.
    has_file: bool,
}

/// The editor.
pub struct Editor {
    open: Option<Open>,
    solver: Solver,
    meter: Meter,
    task: Option<Task<TaskResult>>,
    /// Of the goal posted last, and the first whose answers are still of interest.
    tag: u64,
    accepted_from: u64,
    /// The shape that the solver is at, as far as is known.
    solver_shape: Option<Arc<Positions<f64>>>,
    times: Option<[Instant; 3]>,
    reading: Option<Reading>,
    /// What the reading was asked for, and when.
    measured: Option<(Arc<Positions<f64>>, Field, Instant)>,
    camera: Camera,
    renderer: Arc<Mutex<Renderer>>,
    /// The shape that the renderer was given last.
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
    /// When the last was written, and of what, if it is still there.
    autosaved: (Instant, Option<Aside>),
    trace: Option<Trace>,
    startup: Startup,
    is_closing: bool,
    /// What the window's bar says: told only when it changes, as telling draws a frame.
    shown_title: String,
}

/// The shape and the handles that an autosave holds.
type Aside = (Arc<Positions<f64>>, Arc<Vec<HandleGroup>>);

/// How the mesh is shown.
#[derive(Clone, Copy, Debug, Default)]
struct Looks {
    shading: Shading,
    has_wireframe: bool,
    has_normals: bool,
    field: Field,
}

/// The settings of the jobs in the side panel, and what they have come to.
struct Jobs {
    tab: Tab,
    smooth: SmoothOptions,
    /// How strongly smoothing acts, from 0 to 1, where the method has a strength.
    strength: f64,
    detail: f64,
    sphere: SphereOptions,
    /// What a slider's job began from, while it is that slider's result that is seen.
    base: Option<JobBase>,
    map: Option<SphereView>,
    soft_weight: f64,
}

/// A scene and the job that goes on from it.
struct JobBase {
    name: &'static str,
    scene: Scene,
    /// The history's position at which it is seen.
    position: u64,
    /// Whether that is a result of the job, in whose place the next one comes.
    has_result: bool,
}

/// A map of the shape to the sphere, and how far the picture has gone towards it.
struct SphereView {
    source: Arc<Positions<f64>>,
    map: Arc<Positions<f64>>,
    share: f64,
    blend: Arc<Positions<f64>>,
    report: String,
}

/// The jobs' pages.
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
    /// One sentence: no OpenGL, or no threads.
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

    /// The shape on the screen.
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

    /// Gives the solver the handles as they are.
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

    /// Shows a scene that is not on the way of the one before: what the solver still makes of that
    /// is not wanted.
    fn show_as_is(&mut self) {
        self.post(Pace::Still);
        self.accepted_from = self.tag;
        self.solver.clear_samples();
    }

    /// Takes what the threads have come to.
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
            // It begins anew, and must be told from where.
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

    /// Brings picture and meter up to date with the shape on the screen.
    fn refresh(&mut self, ctx: &egui::Context) {
        let (Some(shape), Some(open)) = (self.displayed(), &self.open) else {
            return;
        };
        let is_drawn = self.drawn.as_ref().is_some_and(|s| Arc::ptr_eq(s, &shape));
        let mesh = Arc::clone(&open.mesh.processing);
        // Everything is compared with the mesh as it was opened, whatever a job has made of it
        // since.
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
        // Two numbers need not change with every frame while the solver has better use for the
        // processor.
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

    /// Whether there is something that is in no file.
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

/// How often the errors are measured while the shape moves and no colours show them.
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
            // Nothing else may happen until then.
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
            // Closed as it should be: what was not saved was not wanted.
            let _ = autosave.remove();
        }
    }
}
