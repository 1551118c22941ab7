//! The triangles.

use cotan::geometry::Positions;
use cotan::halfedge::{HalfedgeMesh, VertexMap};
use nalgebra::Vector3;
use three_d::{
    Context, Cull, DepthTest, ElementBuffer, Program, RenderStates, Vec3, VertexBuffer,
};

use super::frame::{DrawFrame, LocalFrame};
use super::shaders;
use super::style::{Shading, Style};

/// Draws the surface, with or without its edges.
pub(super) struct SurfacePass {
    program: Program,
    triangles: Vec<[u32; 3]>,
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    /// Colour, and in the last place the tint.
    paints: Vec<[u8; 4]>,
    has_colors: bool,
    stale: Stale,
    buffers: Option<Buffers>,
}

/// What the card does not have yet.
#[derive(Clone, Copy, Default)]
struct Stale {
    triangles: bool,
    shape: bool,
    paints: bool,
}

struct Buffers {
    elements: ElementBuffer<u32>,
    positions: VertexBuffer<[f32; 3]>,
    normals: VertexBuffer<[f32; 3]>,
    paints: VertexBuffer<[u8; 4]>,
}

impl SurfacePass {
    pub(super) fn new(context: &Context) -> Result<Self, String> {
        let [vertex, fragment] = shaders::surface();
        let program =
            Program::from_source(context, &vertex, &fragment).map_err(|e| e.to_string())?;
        Ok(Self {
            program,
            triangles: Vec::new(),
            positions: Vec::new(),
            normals: Vec::new(),
            paints: Vec::new(),
            has_colors: false,
            stale: Stale::default(),
            buffers: None,
        })
    }

    pub(super) fn set_mesh(&mut self, mesh: &HalfedgeMesh) {
        self.triangles.clear();
        for face in mesh.faces() {
            self.triangles
                .push(mesh.triangle(face).map(|v| v.index() as u32));
        }
        self.positions.clear();
        self.normals.clear();
        self.paints = vec![[0; 4]; mesh.num_vertices()];
        self.has_colors = false;
        self.stale = Stale {
            triangles: true,
            shape: false,
            paints: true,
        };
    }

    pub(super) fn set_shape(
        &mut self,
        frame: &LocalFrame,
        positions: &Positions<f64>,
        normals: &VertexMap<Vector3<f64>>,
    ) {
        // A shape of another mesh would be read beyond its end by the card.
        if positions.len() != self.paints.len() || normals.len() != self.paints.len() {
            return;
        }
        self.positions.clear();
        self.positions
            .extend(positions.values().map(|p| frame.point(p)));
        self.normals.clear();
        self.normals
            .extend(normals.values().map(|n| [n.x as f32, n.y as f32, n.z as f32]));
        self.stale.shape = true;
    }

    pub(super) fn set_colors(&mut self, colors: Option<&[[u8; 3]]>) {
        self.has_colors = colors.is_some_and(|colors| colors.len() == self.paints.len());
        if let (true, Some(colors)) = (self.has_colors, colors) {
            for (paint, color) in self.paints.iter_mut().zip(colors) {
                paint[..3].copy_from_slice(color);
            }
            self.stale.paints = true;
        }
    }

    pub(super) fn set_tints(&mut self, tints: &[u8]) {
        let tints = tints.iter().copied().chain(std::iter::repeat(0));
        for (paint, tint) in self.paints.iter_mut().zip(tints) {
            paint[3] = tint;
        }
        self.stale.paints = true;
    }

    /// Hands over what has changed.
    pub(super) fn upload(&mut self, context: &Context) {
        if self.positions.is_empty() {
            return;
        }
        let buffers = self.buffers.get_or_insert_with(|| Buffers {
            elements: ElementBuffer::new(context),
            positions: VertexBuffer::new(context),
            normals: VertexBuffer::new(context),
            paints: VertexBuffer::new(context),
        });
        if self.stale.triangles {
            buffers.elements.fill(self.triangles.as_flattened());
        }
        if self.stale.shape {
            buffers.positions.fill(&self.positions);
            buffers.normals.fill(&self.normals);
        }
        if self.stale.paints {
            buffers.paints.fill(&self.paints);
        }
        self.stale = Stale::default();
    }

    pub(super) fn draw(&self, frame: &DrawFrame, style: &Style) {
        let Some(buffers) = self.buffers.as_ref().filter(|_| !self.positions.is_empty()) else {
            return;
        };
        let program = &self.program;
        frame.send(program);
        self.send_style(program, style);
        program.use_vertex_attribute("position", &buffers.positions);
        program.use_vertex_attribute("normal", &buffers.normals);
        program.use_vertex_attribute("paint", &buffers.paints);
        program.draw_elements(OPAQUE, frame.viewport, &buffers.elements);
    }

    fn send_style(&self, program: &Program, style: &Style) {
        program.use_uniform("base", color(style.base));
        program.use_uniform("painted", f32::from(u8::from(self.has_colors)));
        program.use_uniform("inside", color(style.inside));
        let flatness = match style.shading {
            Shading::Smooth => 0.0_f32,
            Shading::Flat => 1.0,
        };
        program.use_uniform("flatness", flatness);
        let mut palette = [Vec3::new(0.0, 0.0, 0.0); 8];
        for (entry, tint) in palette[1..].iter_mut().zip(style.palette) {
            *entry = color(tint);
        }
        program.use_uniform_array("palette", &palette);
    }
}

/// From bytes to shares.
pub(super) fn color(bytes: [u8; 3]) -> Vec3 {
    bytes.map(|c| f32::from(c) / 255.0).into()
}

const OPAQUE: RenderStates = RenderStates {
    depth_test: DepthTest::LessOrEqual,
    write_mask: three_d::WriteMask::COLOR_AND_DEPTH,
    blend: three_d::Blend::Disabled,
    cull: Cull::None,
};
