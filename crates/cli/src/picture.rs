//! Pictures: a mesh before and after, side by side under the same camera; and, in [`heat`],
//! surfaces coloured by a quantity.
//!
//! The surface is drawn by the software rasterizer `euc` (depth buffer, perspective) with three
//! by three samples per pixel. Fixed handles are blue, moved ones orange. The output is the same
//! in every run.

mod camera;
mod color_bar;
mod curvature;
mod distance;
mod heat;
mod image;
mod pair;
mod raster;
mod scene;
mod text;

use cotan::geometry::Positions;
use cotan::halfedge::{FaceId, VertexId};

pub(crate) use cotan_tool::ColorScale;
pub(crate) use curvature::curvature_picture;
pub(crate) use distance::distance_picture;
pub(crate) use heat::{HeatMap, Panel, Quantity, Views};
pub(crate) use image::{Depth, png};
use pair::Mark;
pub(crate) use pair::{BeforeAfter, marks};

use camera::Camera;
use image::Image;
use raster::{Canvas, Light};
use scene::Scene;

impl BeforeAfter<'_> {
    /// Draws the picture and encodes it as PNG.
    pub(crate) fn png(&self) -> Vec<u8> {
        let camera = Camera::for_both(self);
        let panels = [self.before, self.after].map(|positions| {
            let mut canvas = Canvas::new(camera.panel());
            canvas.draw(self.scene(positions, &camera).corners(), Light::Sculpture);
            canvas.into_image()
        });
        Image::side_by_side(&panels).png()
    }

    /// The surface, coloured by its handles, with dots at isolated handles.
    fn scene<'s>(&'s self, positions: &Positions<f64>, camera: &'s Camera) -> Scene<'s> {
        let color = |v| self.marks[v].color();
        let mut scene = Scene::new(self.mesh, positions, camera, |_, v| color(v));
        for v in self.mesh.vertices().filter(|&v| self.is_lone(v)) {
            scene.dot(v, color(v));
        }
        scene
    }

    /// Returns `true` if a handle vertex has no face with three handle corners, so that its
    /// colour hardly shows.
    fn is_lone(&self, v: VertexId) -> bool {
        let is_held = |v: VertexId| self.marks[v] != Mark::Free;
        let is_held_face = |f: FaceId| self.mesh.triangle(f).into_iter().all(is_held);
        is_held(v) && !self.mesh.vertex_faces(v).any(is_held_face)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cotan::halfedge::VertexMap;
    use cotan::shapes;
    use nalgebra::Vector3;

    fn picture(shift: f64) -> Vec<u8> {
        let shape = shapes::icosphere::<f64>(2);
        let after = shape.positions().map(|p| p + Vector3::new(shift, 0.0, 0.0));
        let mut marks = VertexMap::filled(shape.num_vertices(), Mark::Free);
        marks.as_mut_slice()[0] = Mark::Moved;
        marks.as_mut_slice()[5] = Mark::Fixed;
        BeforeAfter {
            mesh: shape.connectivity(),
            before: shape.positions(),
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
            let scaled = shape.positions().map(|p| p * scale);
            let pair = BeforeAfter {
                mesh: shape.connectivity(),
                before: &scaled,
                after: &scaled,
                marks: &marks,
            };
            assert!(!pair.png().is_empty());
        }
    }
}
