//! Rendering of the triangles.

use cotan::geometry::Positions;
use cotan::halfedge::{HalfedgeMesh, VertexId, VertexMap};
use nalgebra::Vector3;
use three_d::{
    Blend, Context, Cull, DepthTest, ElementBuffer, Program, RenderStates, Vec3, VertexBuffer,
    WriteMask,
};

use super::frame::{DrawFrame, LocalFrame};
use super::pulled::Pulled;
use super::shaders;
use super::style::{Light, Shading, Style};

/// Draws the surface, with or without its edges.
pub(super) struct SurfacePass {
    plain: Program,
    with_edges: Program,
    data: Data,
    has_colors: bool,
    shared: Option<Shared>,
    pulled: Option<Pulled>,
}

/// The data to draw.
#[derive(Default)]
pub(super) struct Data {
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) normals: Vec<[f32; 3]>,
    /// The colour, with the tint as the last component.
    pub(super) paints: Vec<[u8; 4]>,
}

/// Flags for the data that the card does not have yet.
#[derive(Clone, Copy, Default)]
pub(super) struct Stale {
    pub(super) triangles: bool,
    pub(super) shape: bool,
    pub(super) paints: bool,
}

impl Stale {
    pub(super) const ALL: Self = Self {
        triangles: true,
        shape: true,
        paints: true,
    };
}

/// The mesh on the card with one entry per vertex: the fast path, without a wireframe.
struct Shared {
    elements: ElementBuffer<u32>,
    positions: VertexBuffer<[f32; 3]>,
    normals: VertexBuffer<[f32; 3]>,
    paints: VertexBuffer<[u8; 4]>,
    stale: Stale,
}

impl SurfacePass {
    pub(super) fn new(context: &Context) -> Result<Self, String> {
        Ok(Self {
            plain: shaders::program(context, &shaders::surface())?,
            with_edges: shaders::program(context, &shaders::surface_with_edges())?,
            data: Data::default(),
            has_colors: false,
            shared: None,
            pulled: None,
        })
    }

    pub(super) fn data(&self) -> &Data {
        &self.data
    }

    pub(super) fn set_mesh(&mut self, mesh: &HalfedgeMesh) {
        self.data = Data {
            triangles: triangles_in_strips(mesh),
            paints: vec![[0; 4]; mesh.num_vertices()],
            ..Data::default()
        };
        self.has_colors = false;
        self.mark_stale(Stale::ALL);
    }

    pub(super) fn set_hidden(&mut self, mesh: &HalfedgeMesh, hidden: &[VertexId]) {
        let mut is_hidden = vec![false; mesh.num_vertices()];
        for v in hidden {
            is_hidden[v.index()] = true;
        }
        let is_shown = |corners: &[u32; 3]| corners.iter().all(|v| !is_hidden[*v as usize]);
        self.data.triangles = triangles_in_strips(mesh);
        self.data.triangles.retain(is_shown);
        self.mark_stale(Stale {
            triangles: true,
            ..Stale::default()
        });
    }

    pub(super) fn set_shape(
        &mut self,
        frame: &LocalFrame,
        positions: &Positions<f64>,
        normals: &VertexMap<Vector3<f64>>,
    ) {
        let data = &mut self.data;
        // With a shape of another mesh the card would read out of bounds.
        if positions.len() != data.paints.len() || normals.len() != data.paints.len() {
            return;
        }
        data.positions.clear();
        data.positions
            .extend(positions.values().map(|p| frame.point(p)));
        data.normals.clear();
        data.normals.extend(
            normals
                .values()
                .map(|n| [n.x as f32, n.y as f32, n.z as f32]),
        );
        self.mark_stale(Stale {
            shape: true,
            ..Stale::default()
        });
    }

    pub(super) fn set_colors(&mut self, colors: Option<&[[u8; 3]]>) {
        let colors = colors.filter(|colors| colors.len() == self.data.paints.len());
        self.has_colors = colors.is_some();
        for (paint, color) in self.data.paints.iter_mut().zip(colors.unwrap_or_default()) {
            paint[..3].copy_from_slice(color);
        }
        self.mark_stale_paints();
    }

    pub(super) fn set_tints(&mut self, tints: &[u8]) {
        let tints = tints.iter().copied().chain(std::iter::repeat(0));
        for (paint, tint) in self.data.paints.iter_mut().zip(tints) {
            paint[3] = tint;
        }
        self.mark_stale_paints();
    }

    /// Uploads the changed data that this style draws.
    pub(super) fn upload(&mut self, context: &Context, style: &Style) {
        let num_vertices = self.data.positions.len();
        if num_vertices == 0 {
            return;
        }
        if style.wireframe.is_some() {
            self.pulled.take_if(|pulled| !pulled.fits(num_vertices));
            self.pulled
                .get_or_insert_with(|| Pulled::new(context, num_vertices))
                .upload(&self.data);
        } else {
            self.shared
                .get_or_insert_with(|| Shared::new(context))
                .upload(&self.data);
        }
    }

    pub(super) fn draw(&self, frame: &DrawFrame, style: &Style) {
        if self.data.positions.is_empty() || self.data.triangles.is_empty() {
            return;
        }
        if let (Some(lines), Some(pulled)) = (style.wireframe, &self.pulled) {
            let program = &self.with_edges;
            frame.send(program);
            self.send_style(program, style);
            program.use_uniform("line_color", color(lines));
            program.use_uniform("line_width", frame.pixels_per_point);
            pulled.draw(program, OPAQUE, frame.viewport);
        } else if let Some(shared) = &self.shared {
            frame.send(&self.plain);
            self.send_style(&self.plain, style);
            shared.draw(&self.plain, frame);
        }
    }

    fn mark_stale(&mut self, more: Stale) {
        let shared = self.shared.iter_mut().map(|s| &mut s.stale);
        let pulled = self.pulled.iter_mut().map(|p| &mut p.stale);
        for stale in shared.chain(pulled) {
            stale.triangles |= more.triangles;
            stale.shape |= more.shape;
            stale.paints |= more.paints;
        }
    }

    fn mark_stale_paints(&mut self) {
        self.mark_stale(Stale {
            paints: true,
            ..Stale::default()
        });
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
        let lighting = match style.light {
            Light::Studio => 0_i32,
            Light::Eye => 1,
            Light::Clay => 2,
        };
        program.use_uniform("lighting", lighting);
        let mut palette = [Vec3::new(0.0, 0.0, 0.0); 8];
        for (entry, tint) in palette[1..].iter_mut().zip(style.palette) {
            *entry = color(tint);
        }
        program.use_uniform_array("palette", &palette);
    }
}

impl Shared {
    fn new(context: &Context) -> Self {
        Self {
            elements: ElementBuffer::new(context),
            positions: VertexBuffer::new(context),
            normals: VertexBuffer::new(context),
            paints: VertexBuffer::new(context),
            stale: Stale::ALL,
        }
    }

    fn upload(&mut self, data: &Data) {
        if self.stale.triangles {
            self.elements.fill(data.triangles.as_flattened());
        }
        if self.stale.shape {
            self.positions.fill(&data.positions);
            self.normals.fill(&data.normals);
        }
        if self.stale.paints {
            self.paints.fill(&data.paints);
        }
        self.stale = Stale::default();
    }

    fn draw(&self, program: &Program, frame: &DrawFrame) {
        program.use_vertex_attribute("position", &self.positions);
        program.use_vertex_attribute("normal", &self.normals);
        program.use_vertex_attribute("paint", &self.paints);
        program.draw_elements(OPAQUE, frame.viewport, &self.elements);
    }
}

/// The triangles, ordered so that each follows one that it shares an edge with where possible.
///
/// The card then reuses the vertices it has just computed.
fn triangles_in_strips(mesh: &HalfedgeMesh) -> Vec<[u32; 3]> {
    let mut is_taken = vec![false; mesh.num_faces()];
    let mut triangles = Vec::with_capacity(mesh.num_faces());
    let mut stack = Vec::new();
    for start in mesh.faces() {
        stack.push(start);
        while let Some(face) = stack.pop() {
            if std::mem::replace(&mut is_taken[face.index()], true) {
                continue;
            }
            triangles.push(mesh.triangle(face).map(|v| v.index() as u32));
            let across = mesh
                .face_halfedges(face)
                .filter_map(|h| mesh.face(h.twin()));
            stack.extend(across.filter(|f| !is_taken[f.index()]));
        }
    }
    triangles
}

/// Converts bytes to values from 0 to 1.
pub(super) fn color(bytes: [u8; 3]) -> Vec3 {
    bytes.map(|c| f32::from(c) / 255.0).into()
}

const OPAQUE: RenderStates = RenderStates {
    depth_test: DepthTest::LessOrEqual,
    write_mask: WriteMask::COLOR_AND_DEPTH,
    blend: Blend::Disabled,
    cull: Cull::None,
};
