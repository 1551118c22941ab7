//! The picture of the mesh, drawn by OpenGL into a part of egui's window.
//!
//! A [`Renderer`] is told of the mesh, the shape, colours and marks at any time and place; only
//! [`Renderer::draw`] talks to the graphics card, from within egui's paint callback, and there
//! uploads what has changed. What goes to the card is `f32`, relative to a centre and a size of
//! the shape, so that a mesh far from the origin does not jitter.
//!
//! three-d draws triangles only, and only through its API is OpenGL safe to call. Hence lines and
//! marks are small rectangles, and the wireframe is drawn by the surface's own shader, from each
//! fragment's distance to the triangle's sides.

mod frame;
mod marks;
mod pulled;
mod shaders;
mod style;
mod surface;

use std::sync::Arc;
use std::time::{Duration, Instant};

use cotan::geometry::Positions;
use cotan::halfedge::{HalfedgeMesh, VertexMap};
use eframe::egui::PaintCallbackInfo;
use eframe::glow;
use nalgebra::Vector3;
use three_d::{ClearState, Context, RenderTarget, ScissorBox, Viewport};

pub use marks::{Line, Mark};
pub use style::{Palette, Shading, Style};

use crate::view::snapshot::CameraSnapshot;
use frame::{DrawFrame, LocalFrame};
use marks::{LinePass, MarkPass};
use surface::SurfacePass;

/// What draws the mesh.
pub struct Renderer {
    context: Context,
    surface: SurfacePass,
    marks: MarkPass,
    lines: LinePass,
    frame: LocalFrame,
    timing: Timing,
}

/// How long the last frame took.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Timing {
    /// Handing over what had changed.
    pub upload: Duration,
    /// Handing over the drawing commands. The card works on afterwards: see [`Renderer::finish`].
    pub draw: Duration,
}

impl Renderer {
    /// A renderer into eframe's window, whose context must be current: in the closure that makes
    /// the app, say.
    ///
    /// # Errors
    /// What OpenGL says if it is too old for the shaders.
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

    /// Another mesh. It is not drawn before [`Renderer::set_shape`] has given it positions.
    pub fn set_mesh(&mut self, mesh: &HalfedgeMesh) {
        self.surface.set_mesh(mesh);
        self.frame = LocalFrame::default();
    }

    /// The positions and unit normals of the mesh's vertices.
    pub fn set_shape(&mut self, positions: &Positions<f64>, normals: &VertexMap<Vector3<f64>>) {
        if self.frame.follow(positions) {
            self.marks.mark_stale();
        }
        self.lines.mark_stale();
        self.surface.set_shape(&self.frame, positions, normals);
    }

    /// One colour a vertex (sRGB), or the style's for all.
    pub fn set_colors(&mut self, colors: Option<&[[u8; 3]]>) {
        self.surface.set_colors(colors);
    }

    /// For each vertex the number of a colour of [`Style::palette`] to be tinted with, 0 for none;
    /// an empty slice for none at all.
    pub fn set_tints(&mut self, tints: &[u8]) {
        self.surface.set_tints(tints);
    }

    /// Balls of constant size on the screen, instead of those before.
    pub fn set_marks(&mut self, marks: Vec<Mark>) {
        self.marks.set(marks);
    }

    /// Lines of constant width on the screen, instead of those before.
    pub fn set_lines(&mut self, lines: Vec<Line>) {
        self.lines.set(lines);
    }

    /// Draws a frame; to be called from within egui's paint callback. Only the callback's part of
    /// the window is touched, and egui itself sets up its state again afterwards.
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

    /// How long the last frame took.
    #[must_use]
    pub fn timing(&self) -> Timing {
        self.timing
    }

    /// Waits until all that was drawn is there: for measuring, from within the paint callback.
    pub fn finish(&self) {
        let corner = ScissorBox::new_at_origo(1, 1);
        let _: Vec<[u8; 4]> =
            RenderTarget::screen(&self.context, 1, 1).read_color_partially(corner);
    }
}

/// The callback's place in the window, and the part of it that is not clipped.
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
