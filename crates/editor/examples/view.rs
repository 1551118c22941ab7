//! A window on a mesh, with nothing but the editor's 3D view.
//!
//! `cargo run --release -p cotan-editor --example view -- mesh.obj`
//!
//! Left drag turns, right or middle drag shifts, the wheel zooms to the pointer; a click marks a
//! vertex, a drag with Shift paints. Keys: W wireframe, S shading, H heat map, N normals, T theme,
//! F fit, 1 2 3 front, right and top, D deform on and on. Milliseconds are printed each second.

use std::error::Error;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use cotan::geometry::{BoundingBox, Positions, Surface, vertex_normals};
use cotan::halfedge::HalfedgeMesh;
use cotan_editor::view::{Camera, Renderer, Shading, StandardView, Style};
use eframe::egui::{self, Key, PointerButton};
use eframe::egui_glow::CallbackFn;

fn main() -> Result<(), Box<dyn Error>> {
    let (mesh, positions) = match std::env::args_os().nth(1) {
        Some(path) => {
            let processing = cotan_io::load(path)?.surface()?;
            (processing.mesh().clone(), processing.positions().clone())
        }
        None => {
            let shape = cotan::shapes::creature::<f64>(cotan::shapes::CREATURE_RESOLUTION);
            (shape.mesh, shape.positions)
        }
    };
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
    camera: Camera,
    style: Style,
    renderer: Arc<Mutex<Renderer>>,
    times: Arc<Mutex<Times>>,
}

impl Viewer {
    fn new(
        gl: &Arc<eframe::glow::Context>,
        mesh: HalfedgeMesh,
        positions: Positions<f64>,
    ) -> Result<Self, String> {
        let surface = Surface::new(&mesh, &positions).map_err(|e| e.to_string())?;
        let normals = vertex_normals(&surface);
        let bounds = cotan::geometry::bounding_box(&surface);
        let mut renderer = Renderer::new(gl)?;
        renderer.set_mesh(&mesh);
        renderer.set_shape(&positions, &normals);
        Ok(Self {
            camera: Camera::new(&bounds),
            bounds,
            style: Style::light(),
            renderer: Arc::new(Mutex::new(renderer)),
            times: Arc::default(),
            mesh,
            positions,
        })
    }

    fn keys(&mut self, ui: &egui::Ui) {
        let pressed = |key| ui.input(|input| input.key_pressed(key));
        if pressed(Key::S) {
            self.style.shading = match self.style.shading {
                Shading::Smooth => Shading::Flat,
                Shading::Flat => Shading::Smooth,
            };
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
        if response.dragged_by(PointerButton::Primary) {
            self.camera.orbit(response.drag_delta());
        }
        if response.dragged_by(PointerButton::Secondary)
            || response.dragged_by(PointerButton::Middle)
        {
            self.camera.pan(response.drag_delta(), rect);
        }
        if let Some(pos) = response.hover_pos() {
            let scroll = ui.input(|input| input.smooth_scroll_delta.y);
            if scroll != 0.0 {
                self.camera.zoom((f64::from(scroll) * 0.005).exp(), pos, rect);
            }
        }
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
        egui::CentralPanel::no_frame().show_inside(ui, |ui| {
            let (rect, response) =
                ui.allocate_exact_size(ui.available_size(), egui::Sense::click_and_drag());
            self.keys(ui);
            self.pointer(ui, &response);
            let seconds = ui.input(|input| input.stable_dt);
            if self.camera.advance(f64::from(seconds)) {
                ui.ctx().request_repaint();
            }
            self.paint(ui, rect);
        });
    }
}

/// Milliseconds of the frames of the last second.
#[derive(Default)]
struct Times {
    uploads: Vec<Duration>,
    frames: Vec<Duration>,
    printed: Option<Instant>,
}

impl Times {
    fn add(&mut self, upload: Duration, frame: Duration) {
        self.uploads.push(upload);
        self.frames.push(frame);
        let printed = *self.printed.get_or_insert_with(Instant::now);
        if printed.elapsed() > Duration::from_secs(1) {
            let (upload, frame) = (median(&mut self.uploads), median(&mut self.frames));
            println!(
                "{} frames: upload {upload:.2} ms, all {frame:.2} ms",
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
