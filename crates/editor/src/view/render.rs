//! Rendering of the mesh with OpenGL into a part of egui's window.
//!
//! Mesh, shape, colours and marks of a [`Renderer`] can be set at any time. Only
//! [`Renderer::draw`] talks to the graphics card: it runs in egui's paint callback and uploads
//! what has changed. The card receives `f32` coordinates relative to a centre and a size of the
//! shape, so a mesh far from the origin does not jitter.
//!
//! three-d draws only triangles, and only its API gives safe access to OpenGL. Lines and marks
//! are therefore small rectangles, and the surface shader draws the wireframe from each
//! fragment's distance to the sides of its triangle.

mod frame;
mod marks;
mod pulled;
mod shaders;
mod style;
mod surface;

use std::sync::Arc;
use std::time::{Duration, Instant};

use cotan::geometry::Positions;
use cotan::halfedge::{HalfedgeMesh, VertexId, VertexMap};
use eframe::egui::PaintCallbackInfo;
use eframe::glow;
use nalgebra::Vector3;
use three_d::{ClearState, Context, RenderTarget, ScissorBox, Viewport};

pub use marks::{Line, Mark};
pub use style::{Light, Palette, Shading, Style};

use crate::view::snapshot::CameraSnapshot;
use frame::{DrawFrame, LocalFrame};
use marks::{LinePass, MarkPass};
use surface::SurfacePass;

/// Draws the mesh.
pub struct Renderer {
    context: Context,
    surface: SurfacePass,
    marks: MarkPass,
    lines: LinePass,
    frame: LocalFrame,
    timing: Timing,
}

/// Timings of the last frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Timing {
    /// Time to upload what had changed.
    pub upload: Duration,
    /// Time to submit the drawing commands.
    ///
    /// The card continues to work afterwards; see [`Renderer::finish`].
    pub draw: Duration,
}

impl Renderer {
    /// Makes a renderer for eframe's window, whose context must be current, for example in the
    /// closure that makes the app.
    ///
    /// # Errors
    /// Returns OpenGL's message if it is too old for the shaders.
    pub fn new(gl: &Arc<glow::Context>) -> Result<Self, String> {
        let context = Context::from_gl_context(gl.clone()).map_err(|e| e.to_string())?;
        Ok(Self {
            surface: SurfacePass::new(&context)?,
            marks: MarkPass::new(&context)?,
            lines: LinePass::new(&context)?,
            context,
            frame: LocalFrame::default(),
            timing: Timing::default(),
        })
    }

    /// Sets the mesh. It is drawn once [`Renderer::set_shape`] has given it positions.
    pub fn set_mesh(&mut self, mesh: &HalfedgeMesh) {
        self.surface.set_mesh(mesh);
        self.frame = LocalFrame::default();
    }

    /// Leaves out the faces of some vertices, in ascending order, of the same mesh.
    pub fn set_hidden(&mut self, mesh: &HalfedgeMesh, hidden: &[VertexId]) {
        self.surface.set_hidden(mesh, hidden);
    }

    /// Sets the positions and unit normals of the vertices.
    pub fn set_shape(&mut self, positions: &Positions<f64>, normals: &VertexMap<Vector3<f64>>) {
        if self.frame.follow(positions) {
            self.marks.mark_stale();
        }
        self.lines.mark_stale();
        self.surface.set_shape(&self.frame, positions, normals);
    }

    /// Sets one colour per vertex (sRGB), or the style's colour for all.
    pub fn set_colors(&mut self, colors: Option<&[[u8; 3]]>) {
        self.surface.set_colors(colors);
    }

    /// Sets the tint of each vertex: an index into [`Style::palette`] counted from 1, or 0 for
    /// none.
    ///
    /// An empty slice removes all tints.
    pub fn set_tints(&mut self, tints: &[u8]) {
        self.surface.set_tints(tints);
    }

    /// Replaces the marks, balls of constant size on the screen.
    pub fn set_marks(&mut self, marks: Vec<Mark>) {
        self.marks.set(marks);
    }

    /// Replaces the lines, which have constant width on the screen.
    pub fn set_lines(&mut self, lines: Vec<Line>) {
        self.lines.set(lines);
    }

    /// Draws a frame.
    ///
    /// Call this from egui's paint callback. Only the callback's part of the window is drawn to,
    /// and egui restores its own state afterwards.
    pub fn draw(&mut self, info: &PaintCallbackInfo, camera: &CameraSnapshot, style: &Style) {
        let start = Instant::now();
        self.surface.upload(&self.context, style);
        self.marks.upload(&self.frame);
        self.lines.upload(&self.frame, self.surface.data(), style);
        let uploaded = Instant::now();
        let (viewport, scissor) = pixels(info);
        if viewport.width > 0 && viewport.height > 0 && scissor.width > 0 && scissor.height > 0 {
            let frame = DrawFrame::new(camera, &self.frame, viewport, info.pixels_per_point);
            let [red, green, blue] = style.background.map(|c| f32::from(c) / 255.0);
            let [width, height] = info.screen_size_px;
            RenderTarget::screen(&self.context, width, height).clear_partially(
                scissor,
                ClearState::color_and_depth(red, green, blue, 1.0, 1.0),
            );
            self.surface.draw(&frame, style);
            self.lines.draw(&frame, style);
            self.marks.draw(&frame, style);
        }
        self.timing = Timing {
            upload: uploaded - start,
            draw: uploaded.elapsed(),
        };
    }

    /// Timings of the last frame.
    #[must_use]
    pub fn timing(&self) -> Timing {
        self.timing
    }

    /// Waits until everything is drawn. Used for measurements, from the paint callback.
    pub fn finish(&self) {
        let corner = ScissorBox::new_at_origo(1, 1);
        let _: Vec<[u8; 4]> =
            RenderTarget::screen(&self.context, 1, 1).read_color_partially(corner);
    }
}

/// The viewport of the callback in the window, and its unclipped part.
fn pixels(info: &PaintCallbackInfo) -> (Viewport, ScissorBox) {
    let place = info.viewport_in_pixels();
    let viewport = Viewport {
        x: place.left_px,
        y: place.from_bottom_px,
        width: place.width_px.max(0) as u32,
        height: place.height_px.max(0) as u32,
    };
    let clip = info.clip_rect_in_pixels();
    let scissor = ScissorBox {
        x: clip.left_px,
        y: clip.from_bottom_px,
        width: clip.width_px.max(0) as u32,
        height: clip.height_px.max(0) as u32,
    };
    (viewport, scissor.intersection(viewport))
}
