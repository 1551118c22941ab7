//! Triangles without shared vertices, for the wireframe.
//!
//! Each corner knows its position in the triangle and fetches everything else from textures by
//! vertex index. Nothing stored per corner changes with the shape.

use three_d::{
    Context, Interpolation, Program, RenderStates, Texture2D, TextureDataType, VertexBuffer,
    Viewport, Wrapping,
};

use super::surface::{Data, Stale};

pub(super) struct Pulled {
    corners: VertexBuffer<u32>,
    positions: Texture2D,
    normals: Texture2D,
    paints: Texture2D,
    num_vertices: usize,
    pub(super) stale: Stale,
}

impl Pulled {
    pub(super) fn new(context: &Context, num_vertices: usize) -> Self {
        Self {
            corners: VertexBuffer::new(context),
            positions: texture::<[f32; 4]>(context, num_vertices),
            normals: texture::<[f32; 4]>(context, num_vertices),
            paints: texture::<[u8; 4]>(context, num_vertices),
            num_vertices,
            stale: Stale::ALL,
        }
    }

    /// Returns `true` if the buffers were made for meshes of this size.
    pub(super) fn fits(&self, num_vertices: usize) -> bool {
        self.num_vertices == num_vertices
    }

    pub(super) fn upload(&mut self, data: &Data) {
        let with_padding = |v: &[f32; 3]| [v[0], v[1], v[2], 0.0];
        if self.stale.triangles {
            self.corners.fill(data.triangles.as_flattened());
        }
        if self.stale.shape {
            fill(&self.positions, data.positions.iter().map(with_padding));
            fill(&self.normals, data.normals.iter().map(with_padding));
        }
        if self.stale.paints {
            fill(&self.paints, data.paints.iter().copied());
        }
        self.stale = Stale::default();
    }

    pub(super) fn draw(&self, program: &Program, states: RenderStates, viewport: Viewport) {
        program.use_texture("positions", &self.positions);
        program.use_texture("normals", &self.normals);
        program.use_texture("paints", &self.paints);
        program.use_vertex_attribute("corner", &self.corners);
        program.draw_arrays(states, viewport, self.corners.vertex_count());
    }
}

fn texture<T: TextureDataType>(context: &Context, len: usize) -> Texture2D {
    Texture2D::new_empty::<T>(
        context,
        WIDTH as u32,
        len.div_ceil(WIDTH).max(1) as u32,
        Interpolation::Nearest,
        Interpolation::Nearest,
        None,
        Wrapping::ClampToEdge,
        Wrapping::ClampToEdge,
    )
}

fn fill<T: TextureDataType + Default>(texture: &Texture2D, values: impl Iterator<Item = T>) {
    let len = texture.width() as usize * texture.height() as usize;
    let padding = std::iter::repeat_with(T::default);
    let padded: Vec<T> = values.chain(padding).take(len).collect();
    texture.fill(&padded);
}

/// Every card supports textures of this width. With as many rows they hold four million vertices.
const WIDTH: usize = 2048;
