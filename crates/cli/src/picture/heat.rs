//! A picture of surfaces coloured by a quantity, with a colour bar.
//!
//! Any number of panels stand side by side, all on one colour scale:
//!
//! ```ignore
//! let scale = ColorScale::signed("ln of the area ratio (0: kept)", ratios.values().copied());
//! let quantity = Quantity::Faces(&ratios);
//! let panel = |positions, caption| Panel { mesh, positions, quantity, caption };
//! let panels = [panel(&before, "mesh"), panel(&after, "sphere")];
//! let png = HeatMap { panels: &panels, scale: &scale, views: Views::OneDirection }.png();
//! ```

use cotan::geometry::{Positions, Surface, face_area_vectors};
use cotan::halfedge::{FaceId, FaceMap, HalfedgeMesh, VertexId, VertexMap};
use cotan_tool::ColorScale;
use nalgebra::{Matrix3, Vector3};

use super::camera::{Camera, Frame, view_of};
use super::color_bar;
use super::image::Image;
use super::raster::{BOTTOM, Canvas, Light, TOP, encode};
use super::scene::Scene;
use super::text::{self, LINE};

/// Surfaces side by side, coloured on the same scale.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HeatMap<'a> {
    pub(crate) panels: &'a [Panel<'a>],
    pub(crate) scale: &'a ColorScale,
    pub(crate) views: Views,
}

/// One surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Panel<'a> {
    pub(crate) mesh: &'a HalfedgeMesh,
    pub(crate) positions: &'a Positions<f64>,
    pub(crate) quantity: Quantity<'a>,
    /// A line above the panel; may be empty.
    pub(crate) caption: &'a str,
}

/// The quantity that the colours show. NaN is grey.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Quantity<'a> {
    /// One number per face, drawn as a single colour.
    Faces(&'a FaceMap<f64>),
    /// One number per vertex, interpolated across faces.
    Vertices(&'a VertexMap<f64>),
}

/// The cameras of the panels. The direction shows most of the first panel.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Views {
    /// One camera for all, so that sizes and positions can be compared.
    OneCamera,
    /// The same direction for all, each as large as its panel allows.
    OneDirection,
}

impl Quantity<'_> {
    fn at(&self, face: FaceId, vertex: VertexId) -> f64 {
        let value = match self {
            Self::Faces(values) => values.get(face),
            Self::Vertices(values) => values.get(vertex),
        };
        value.copied().unwrap_or(f64::NAN)
    }
}

impl HeatMap<'_> {
    /// Draws the picture and encodes it as PNG.
    pub(crate) fn png(&self) -> Vec<u8> {
        let cameras = self.cameras();
        let drawn = self.panels.iter().zip(&cameras);
        let mut panels: Vec<Image> = drawn
            .map(|(panel, camera)| panel.draw(camera, self.scale))
            .collect();
        if panels.is_empty() {
            panels.push(Canvas::new([PANEL_HEIGHT; 2]).into_image());
        }
        let panels = Image::side_by_side(&panels);
        let width = panels.width();
        let [top, bottom] = [TOP, BOTTOM].map(encode);
        let bar = color_bar::draw(self.scale, width, bottom);
        let captions = self.captions(&cameras, Image::filled(width, CAPTION, top));
        match captions {
            Some(captions) => Image::stacked(&[captions, panels, bar]),
            None => Image::stacked(&[panels, bar]),
        }
        .png()
    }

    fn cameras(&self) -> Vec<Camera> {
        let axes = self.direction();
        // The title of the bar must fit below the panels.
        let share = color_bar::least_width(self.scale).div_ceil(self.panels.len().max(1));
        let frame = |captions: &mut dyn Iterator<Item = &str>| Frame::Height {
            height: PANEL_HEIGHT,
            least_width: captions
                .map(|caption| text::width(caption) + LINE)
                .fold(share, usize::max),
        };
        match self.views {
            Views::OneCamera => {
                let shapes: Vec<_> = self.panels.iter().map(|panel| panel.positions).collect();
                let frame = frame(&mut self.panels.iter().map(|panel| panel.caption));
                let camera = Camera::new(axes, &shapes, frame);
                vec![camera; self.panels.len()]
            }
            Views::OneDirection => {
                let own = |panel: &Panel<'_>| {
                    let frame = frame(&mut std::iter::once(panel.caption));
                    Camera::new(axes, &[panel.positions], frame)
                };
                self.panels.iter().map(own).collect()
            }
        }
    }

    /// The view that shows most of the first panel's surface and of its colours.
    fn direction(&self) -> Matrix3<f64> {
        let first = self.panels.first();
        let surface = first.and_then(|p| Some((p, Surface::new(p.mesh, p.positions).ok()?)));
        let Some((panel, surface)) = surface else {
            return Matrix3::identity();
        };
        let areas = face_area_vectors(&surface);
        let strong: Vec<Vector3<f64>> = areas
            .iter()
            .map(|(face, area)| {
                let values = panel
                    .mesh
                    .triangle(face)
                    .map(|v| panel.quantity.at(face, v));
                *area * values.map(|x| self.scale.strength(x)).iter().sum::<f64>()
            })
            .collect();
        view_of(&surface, &strong)
    }

    /// Draws the captions on `strip`. Returns `None` if there are none.
    fn captions(&self, cameras: &[Camera], mut strip: Image) -> Option<Image> {
        let mut left = 0;
        for (panel, camera) in self.panels.iter().zip(cameras) {
            let [width, _] = camera.panel();
            let at = [left + width / 2, (CAPTION - LINE) / 2];
            text::draw(&mut strip, panel.caption, at);
            left += width;
        }
        let is_captioned = self.panels.iter().any(|panel| !panel.caption.is_empty());
        is_captioned.then_some(strip)
    }
}

impl Panel<'_> {
    fn draw(&self, camera: &Camera, scale: &ColorScale) -> Image {
        let mut canvas = Canvas::new(camera.panel());
        let color = |face, vertex| scale.color(self.quantity.at(face, vertex));
        let scene = Scene::new(self.mesh, self.positions, camera, color);
        canvas.draw(scene.corners(), Light::Chart);
        canvas.into_image()
    }
}

/// Heights in pixels.
const PANEL_HEIGHT: usize = 720;
const CAPTION: usize = LINE + 20;

#[cfg(test)]
mod tests {
    use super::*;
    use cotan::shapes;

    fn size(png: &[u8]) -> [u32; 2] {
        let decoder = png::Decoder::new(std::io::Cursor::new(png));
        let reader = decoder.read_info().unwrap();
        [reader.info().width, reader.info().height]
    }

    #[test]
    fn panels_stand_side_by_side_above_the_bar() {
        let shape = shapes::icosphere::<f64>(2);
        let heights = shape.positions().map(|p| p.z);
        let scale = ColorScale::signed("height, in radii", heights.values().copied());
        let panel = |caption| Panel {
            mesh: shape.connectivity(),
            positions: shape.positions(),
            quantity: Quantity::Vertices(&heights),
            caption,
        };
        let png = |panels: &[Panel<'_>], views| {
            let map = HeatMap {
                panels,
                scale: &scale,
                views,
            };
            map.png()
        };
        let one = png(&[panel("")], Views::OneDirection);
        let both = png(&[panel("before"), panel("after")], Views::OneCamera);
        let ([w1, h1], [w2, h2]) = (size(&one), size(&both));
        assert_eq!(w2, 2 * w1);
        assert_eq!(h2, h1 + CAPTION as u32);
        assert_eq!(one, png(&[panel("")], Views::OneCamera));
        assert!(!png(&[], Views::OneDirection).is_empty());
    }

    #[test]
    fn values_that_are_not_numbers_are_drawn_too() {
        let shape = shapes::tetrahedron::<f64>();
        let values = FaceMap::from_vec(vec![f64::NAN, f64::INFINITY, -1e300, 0.0]);
        let scale = ColorScale::signed("nothing", values.values().copied());
        for size in [1.0, 0.0, 1e300] {
            let positions = shape.positions().map(|p| p * size);
            let panel = Panel {
                mesh: shape.connectivity(),
                positions: &positions,
                quantity: Quantity::Faces(&values),
                caption: "a caption that is much wider than the panel would otherwise have been made",
            };
            let map = HeatMap {
                panels: &[panel],
                scale: &scale,
                views: Views::OneDirection,
            };
            assert!(map.png().starts_with(b"\x89PNG"));
        }
    }
}
