//! A window on a mesh with only the editor's 3D view.
//!
//! `cargo run --release -p cotan-editor --example view -- mesh.obj [offset]`
//!
//! The offset is added to all coordinates, to view a mesh far from the origin.
//!
//! Left drag orbits, right or middle drag pans, the wheel zooms to the pointer; a click marks a
//! vertex, a drag with Shift paints. Keys: W wireframe, S shading, H heat map, N normals, T
//! theme, F fit, 1 2 3 front, right and top, D continuous deformation, P measure picking, Q quit.
//! Timings in milliseconds are printed each second.

use std::error::Error;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use cotan::geometry::{BoundingBox, Positions, Surface};
use cotan::halfedge::{HalfedgeMesh, VertexMap};
use cotan_editor::view::{
    Camera, Mark, Picker, Reach, Renderer, Shading, StandardView, Style, brush, lasso,
};
use eframe::egui::{self, Key, PointerButton};
use eframe::egui_glow::CallbackFn;
use nalgebra::{Rotation3, Vector3};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let (mesh, positions) = match arguments.next() {
        Some(path) => {
            let processing = cotan_io::load(path)?.surface()?;
            (processing.mesh().clone(), processing.positions().clone())
        }
        None => cotan::shapes::creature::<f64>(cotan::shapes::CREATURE_RESOLUTION).into_parts(),
    };
    let offset: f64 = arguments.next().map_or(Ok(0.0), |text| text.parse())?;
    let positions = positions.map(|p| p + Vector3::repeat(offset));
    let options = eframe::NativeOptions {
        depth_buffer: 24,
        viewport: egui::ViewportBuilder::default().with_inner_size([1280.0, 800.0]),
        ..Default::default()
    };
    let app = |context: &eframe::CreationContext<'_>| -> Result<Box<dyn eframe::App>, _> {
        let gl = context.gl.as_ref().ok_or("eframe runs without OpenGL")?;
        Ok(Box::new(Viewer::new(gl, mesh, positions)?))
    };
    eframe::run_native("view", options, Box::new(app))?;
    Ok(())
}

struct Viewer {
    mesh: HalfedgeMesh,
    positions: Positions<f64>,
    bounds: BoundingBox<f64>,
    picker: Picker,
    camera: Camera,
    style: Style,
    renderer: Arc<Mutex<Renderer>>,
    times: Arc<Mutex<Times>>,
    marks: Vec<Mark>,
    tints: Vec<u8>,
    has_heat: bool,
    /// The start of the swinging motion, if it is on.
    swings: Option<Instant>,
}

impl Viewer {
    fn new(
        gl: &Arc<eframe::glow::Context>,
        mesh: HalfedgeMesh,
        positions: Positions<f64>,
    ) -> Result<Self, String> {
        let surface = Surface::new(&mesh, &positions).map_err(|e| e.to_string())?;
        let bounds = surface.bounding_box();
        let mut renderer = Renderer::new(gl)?;
        renderer.set_mesh(&mesh);
        renderer.set_shape(&positions, &surface.vertex_normals());
        let start = Instant::now();
        let picker = Picker::new(&mesh, &positions);
        println!(
            "{} vertices, picker built in {:.1} ms",
            mesh.num_vertices(),
            milliseconds(start)
        );
        Ok(Self {
            camera: Camera::new(&bounds),
            bounds,
            picker,
            style: Style::light(),
            renderer: Arc::new(Mutex::new(renderer)),
            times: Arc::default(),
            marks: Vec::new(),
            tints: vec![0; mesh.num_vertices()],
            has_heat: false,
            swings: None,
            mesh,
            positions,
        })
    }

    fn draw_by(&self, change: impl FnOnce(&mut Renderer)) {
        change(&mut self.renderer.lock().unwrap_or_else(PoisonError::into_inner));
    }

    fn keys(&mut self, ui: &egui::Ui, rect: egui::Rect) {
        let pressed = |key| ui.input(|input| input.key_pressed(key));
        if pressed(Key::S) {
            self.style.shading = match self.style.shading {
                Shading::Smooth => Shading::Flat,
                Shading::Flat => Shading::Smooth,
            };
        }
        if pressed(Key::W) {
            self.style.wireframe = toggled(self.style.wireframe, [30, 34, 40]);
        }
        if pressed(Key::N) {
            self.style.normals = toggled(self.style.normals, [30, 90, 200]);
        }
        if pressed(Key::T) {
            let (background, theme) = (self.style.background, Style::dark().background);
            self.style.background = match background == theme {
                true => Style::light().background,
                false => theme,
            };
        }
        if pressed(Key::H) {
            self.has_heat = !self.has_heat;
            let colors = heat(&self.positions, &self.bounds);
            let colors = self.has_heat.then_some(colors.as_slice());
            self.draw_by(|renderer| renderer.set_colors(colors));
        }
        if pressed(Key::D) {
            self.swings = match self.swings {
                Some(_) => None,
                None => Some(Instant::now()),
            };
        }
        if pressed(Key::Q) {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
        }
        if pressed(Key::P) {
            self.measure_picking(rect);
        }
        if pressed(Key::F) {
            self.camera.fit(&self.bounds);
        }
        for (key, view) in [
            (Key::Num1, StandardView::Front),
            (Key::Num2, StandardView::Right),
            (Key::Num3, StandardView::Top),
        ] {
            if pressed(key) {
                self.camera.look_from(view);
            }
        }
    }

    fn pointer(&mut self, ui: &egui::Ui, response: &egui::Response) {
        let rect = response.rect;
        let is_shifted = ui.input(|input| input.modifiers.shift);
        if response.dragged_by(PointerButton::Primary) {
            match response.interact_pointer_pos() {
                Some(pos) if is_shifted => self.brush(pos, rect),
                _ => self.camera.orbit(response.drag_delta()),
            }
        }
        if response.dragged_by(PointerButton::Secondary)
            || response.dragged_by(PointerButton::Middle)
        {
            self.camera.pan(response.drag_delta(), rect);
        }
        if response.clicked()
            && let Some(pos) = response.interact_pointer_pos()
        {
            self.pick(pos, rect);
        }
        if let Some(pos) = response.hover_pos() {
            let scroll = f64::from(ui.input(|input| input.smooth_scroll_delta().y));
            if scroll != 0.0 {
                let factor = (scroll * 0.005).exp();
                match self.picker.hit(&self.camera.ray(pos, rect)) {
                    Some(hit) => self.camera.zoom_about(factor, hit.point),
                    None => self.camera.zoom(factor, pos, rect),
                }
            }
        }
    }

    fn pick(&mut self, pos: egui::Pos2, rect: egui::Rect) {
        let start = Instant::now();
        let picked = self.picker.pick_vertex(&self.camera.at(rect), pos, 12.0);
        println!("picked {picked:?} in {:.2} ms", milliseconds(start));
        let Some(vertex) = picked else {
            return;
        };
        self.marks.push(Mark {
            position: self.positions[vertex],
            color: [220, 40, 40],
            size: 12.0,
        });
        let marks = self.marks.clone();
        self.draw_by(|renderer| renderer.set_marks(marks));
    }

    fn brush(&mut self, pos: egui::Pos2, rect: egui::Rect) {
        let start = Instant::now();
        let camera = self.camera.at(rect);
        let painted = brush(&self.mesh, &self.picker, &camera, pos, 30.0);
        println!("{} painted in {:.2} ms", painted.len(), milliseconds(start));
        for vertex in painted {
            self.tints[vertex.index()] = 1;
        }
        self.draw_by(|renderer| renderer.set_tints(&self.tints));
    }

    fn measure_picking(&mut self, rect: egui::Rect) {
        let camera = self.camera.at(rect);
        let start = Instant::now();
        let mut picker = Picker::new(&self.mesh, &self.positions);
        let built = milliseconds(start);
        let start = Instant::now();
        picker.refit(&self.positions);
        let refitted = milliseconds(start);
        let start = Instant::now();
        let share = |i: u32, prime: u32| (i * prime % 1000) as f32 / 1000.0;
        let place = |i| rect.min + rect.size() * egui::vec2(share(i, 137), share(i, 71));
        let hits = (0..1000).filter(|i| picker.hit(&camera.ray(place(*i))).is_some());
        let hits = hits.count();
        let shot = milliseconds(start);
        let start = Instant::now();
        let [min, max] = [rect.min, rect.max];
        let polygon = [min, egui::pos2(max.x, min.y), max, egui::pos2(min.x, max.y)];
        let seen = lasso(&picker, &camera, &polygon, Reach::Visible).len();
        println!(
            "picker built in {built:.1} ms, refitted in {refitted:.1} ms; a ray {shot:.1} µs \
             ({hits} of 1000 hit); lasso around all in {:.1} ms ({seen} visible)",
            milliseconds(start)
        );
    }

    /// Twists the shape back and forth like a solver, so that per-frame updates are measured.
    fn swing(&self, seconds: f64) -> Option<()> {
        let (center, size) = (self.bounds.center(), self.bounds.longest_side());
        let twisted = |p: &nalgebra::Point3<f64>| {
            let angle = seconds.sin() * (p.y - center.y) / size;
            center + Rotation3::from_axis_angle(&Vector3::y_axis(), angle) * (p - center)
        };
        let moved: Positions<f64> = self.positions.map(twisted);
        let start = Instant::now();
        let normals = Surface::new(&self.mesh, &moved).ok()?.vertex_normals();
        let normals_took = milliseconds(start);
        let start = Instant::now();
        self.draw_by(|renderer| renderer.set_shape(&moved, &normals));
        let mut times = self.times.lock().unwrap_or_else(PoisonError::into_inner);
        times.shape = [normals_took, milliseconds(start)];
        Some(())
    }

    fn paint(&self, ui: &egui::Ui, rect: egui::Rect) {
        let (renderer, times) = (self.renderer.clone(), self.times.clone());
        let (camera, style) = (self.camera.at(rect), self.style.clone());
        let callback = CallbackFn::new(move |info, _| {
            let start = Instant::now();
            let mut renderer = renderer.lock().unwrap_or_else(PoisonError::into_inner);
            renderer.draw(&info, &camera, &style);
            renderer.finish();
            let mut times = times.lock().unwrap_or_else(PoisonError::into_inner);
            times.add(renderer.timing().upload, start.elapsed());
        });
        ui.painter().add(egui::PaintCallback {
            rect,
            callback: Arc::new(callback),
        });
    }
}

impl eframe::App for Viewer {
    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        egui::Panel::bottom("keys").show_inside(ui, |ui| ui.label(KEYS));
        egui::CentralPanel::no_frame().show_inside(ui, |ui| {
            let (rect, response) =
                ui.allocate_exact_size(ui.available_size(), egui::Sense::click_and_drag());
            self.keys(ui, rect);
            self.pointer(ui, &response);
            if let Some(start) = self.swings {
                self.swing(start.elapsed().as_secs_f64());
                ui.ctx().request_repaint();
            }
            let seconds = ui.input(|input| input.stable_dt);
            if self.camera.advance(f64::from(seconds)) {
                ui.ctx().request_repaint();
            }
            self.paint(ui, rect);
        });
    }
}

const KEYS: &str = "W wireframe   S shading   H heat   N normals   T theme   F fit   1 2 3 views   \
                    D swing   P measure picking   Q quit   click: mark a vertex   Shift and drag: paint";

/// The height of each vertex as a colour, from blue through grey to red.
fn heat(positions: &Positions<f64>, bounds: &BoundingBox<f64>) -> Vec<[u8; 3]> {
    let heights: VertexMap<f64> =
        positions.map(|p| (p.y - bounds.min.y) / bounds.extents().y.max(f64::MIN_POSITIVE));
    let [cold, middle, hot] = [
        [59.0, 76.0, 192.0],
        [221.0, 221.0, 221.0],
        [180.0, 4.0, 38.0],
    ];
    let color = |t: &f64| {
        let (from, to, share) = match *t < 0.5 {
            true => (cold, middle, 2.0 * t),
            false => (middle, hot, 2.0 * t - 1.0),
        };
        [0, 1, 2].map(|k| (from[k] + (to[k] - from[k]) * share) as u8)
    };
    heights.values().map(color).collect()
}

fn toggled(color: Option<[u8; 3]>, on: [u8; 3]) -> Option<[u8; 3]> {
    match color {
        Some(_) => None,
        None => Some(on),
    }
}

fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

/// Timings of the frames in the last second.
#[derive(Default)]
struct Times {
    uploads: Vec<Duration>,
    frames: Vec<Duration>,
    printed: Option<Instant>,
    /// Milliseconds to compute normals and to pass the shape to the renderer.
    shape: [f64; 2],
}

impl Times {
    fn add(&mut self, upload: Duration, frame: Duration) {
        self.uploads.push(upload);
        self.frames.push(frame);
        let printed = *self.printed.get_or_insert_with(Instant::now);
        if printed.elapsed() > Duration::from_secs(1) {
            let (upload, frame) = (median(&mut self.uploads), median(&mut self.frames));
            let [normals, shape] = self.shape;
            println!(
                "{} frames: normals {normals:.2} ms, to f32 {shape:.2} ms, upload {upload:.2} ms, \
                 upload and draw {frame:.2} ms",
                self.frames.len()
            );
            *self = Self::default();
        }
    }
}

fn median(times: &mut [Duration]) -> f64 {
    times.sort_unstable();
    times
        .get(times.len() / 2)
        .map_or(0.0, |t| t.as_secs_f64() * 1e3)
}
