//! A picture of a mesh before and after, side by side, seen by the same camera.
//!
//! The surface is drawn by the software rasterizer `euc` (depth buffer, perspective), three by three
//! samples a pixel; handles are coloured: what stays in blue, what moves in orange. Same bytes in
//! every run.

mod camera;
mod raster;
mod scene;

use cotan::geometry::Positions;
use cotan::halfedge::{HalfedgeMesh, VertexMap};
use cotan_io::ProcessingMesh;

use camera::Camera;
use raster::Canvas;
use scene::Scene;

use crate::handles_file::Constraint;

/// What a vertex is to the picture.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Mark {
    /// It follows.
    Free,
    /// It is held in its place.
    Fixed,
    /// It is moved.
    Moved,
}

/// What the handles make of every vertex.
pub(crate) fn marks(constraints: &[Constraint], processing: &ProcessingMesh) -> VertexMap<Mark> {
    let mut marks = VertexMap::filled(processing.mesh().num_vertices(), Mark::Free);
    for constraint in constraints {
        let Some(v) = processing.vertex(constraint.vertex) else {
            continue;
        };
        let moves = constraint.moves(processing.positions()[v]);
        marks[v] = if moves { Mark::Moved } else { Mark::Fixed };
    }
    marks
}

/// One mesh, twice.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BeforeAfter<'a> {
    pub(crate) mesh: &'a HalfedgeMesh,
    pub(crate) before: &'a Positions<f64>,
    pub(crate) after: &'a Positions<f64>,
    pub(crate) marks: &'a VertexMap<Mark>,
}

impl BeforeAfter<'_> {
    /// Draws the picture and encodes it as PNG.
    pub(crate) fn png(&self) -> Vec<u8> {
        let camera = Camera::for_both(self);
        let panel = camera.panel();
        let panels = [self.before, self.after].map(|positions| {
            let mut canvas = Canvas::new(panel);
            let scene = Scene::new(self.mesh, positions, self.marks, &camera);
            canvas.draw(&scene.corners);
            canvas.into_pixels()
        });
        let [width, height] = panel;
        let rows = panels[0].chunks(3 * width).zip(panels[1].chunks(3 * width));
        let pixels: Vec<u8> = rows
            .flat_map(|(left, right)| [left, right])
            .flatten()
            .copied()
            .collect();
        encode(2 * width, height, &pixels)
    }
}

fn encode(width: usize, height: usize, pixels: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    // Writing to memory cannot fail, and the pixels have the size that was announced.
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(pixels)?;
        writer.finish()
    });
    debug_assert!(written.is_ok(), "{written:?}");
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use cotan::shapes;
    use nalgebra::Vector3;

    fn picture(shift: f64) -> Vec<u8> {
        let shape = shapes::icosphere::<f64>(2);
        let after = shape.positions.map(|p| p + Vector3::new(shift, 0.0, 0.0));
        let mut marks = VertexMap::filled(shape.mesh.num_vertices(), Mark::Free);
        marks.as_mut_slice()[0] = Mark::Moved;
        marks.as_mut_slice()[5] = Mark::Fixed;
        BeforeAfter {
            mesh: &shape.mesh,
            before: &shape.positions,
            after: &after,
            marks: &marks,
        }
        .png()
    }

    #[test]
    fn the_same_meshes_give_the_same_bytes() {
        assert_eq!(picture(0.5), picture(0.5));
        assert_ne!(picture(0.5), picture(0.0));
    }

    #[test]
    fn both_panels_show_the_shape_on_a_light_background() {
        let decoder = png::Decoder::new(std::io::Cursor::new(picture(0.0)));
        let mut reader = decoder.read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        let (width, height) = (info.width as usize, info.height as usize);
        let at = |x: usize, y: usize| &pixels[3 * (y * width + x)..][..3];
        assert!(at(2, 2).iter().all(|c| *c > 220), "{:?}", at(2, 2));
        let middle = at(width / 4, height / 2);
        assert!(middle.iter().any(|c| *c < 215), "{middle:?}");
        // Nothing moved, so the halves are the same.
        assert!((0..height).all(|y| (0..width / 2).all(|x| at(x, y) == at(x + width / 2, y))));
    }

    #[test]
    fn meshes_without_extent_or_with_huge_coordinates_are_drawn_too() {
        let shape = shapes::tetrahedron::<f64>();
        let marks = VertexMap::filled(4, Mark::Fixed);
        for scale in [0.0, 1e-300, 1e300] {
            let scaled = shape.positions.map(|p| p * scale);
            let pair = BeforeAfter {
                mesh: &shape.mesh,
                before: &scaled,
                after: &scaled,
                marks: &marks,
            };
            assert!(!pair.png().is_empty());
        }
    }
}
