//! Rasterization of triangles: `euc` with a depth buffer and one shader.
//!
//! `euc` is small, pure Rust, and the only such library with a depth buffer. Releases are rare,
//! but it is maintained, and the parts used here are finished. The alternative, a two-dimensional
//! rasterizer with triangles sorted by depth, leaves hairlines between triangles and draws folded
//! surfaces wrong.

use euc::buffer::Buffer2d;
use euc::rasterizer::{BackfaceCullingDisabled, Triangles};
use euc::{Interpolate, Pipeline};

use super::image::Image;

/// A corner of a triangle on the panel.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Corner {
    /// Homogeneous coordinates.
    pub(super) position: [f32; 4],
    pub(super) paint: Paint,
}

/// The input of the shader. Colours are linear.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Paint {
    /// The normal in camera coordinates: to the right, up, towards the viewer.
    pub(super) normal: [f32; 3],
    pub(super) color: [f32; 3],
}

impl Interpolate for Paint {
    fn lerp2(a: Self, b: Self, x: f32, y: f32) -> Self {
        Self::lerp3(a, b, b, x, y, 0.0)
    }

    fn lerp3(a: Self, b: Self, c: Self, x: f32, y: f32, z: f32) -> Self {
        let mix = |a: [f32; 3], b: [f32; 3], c: [f32; 3]| {
            [0, 1, 2].map(|k| a[k] * x + b[k] * y + c[k] * z)
        };
        Self {
            normal: mix(a.normal, b.normal, c.normal),
            color: mix(a.color, b.color, c.color),
        }
    }
}

/// A panel being drawn, with several samples per pixel.
pub(super) struct Canvas {
    panel: [usize; 2],
    color: Buffer2d<[u8; 3]>,
    depth: Buffer2d<f32>,
}

impl Canvas {
    /// An empty panel.
    pub(super) fn new(panel: [usize; 2]) -> Self {
        let samples = panel.map(|x| x * SAMPLES);
        let mut color = Buffer2d::new(samples, [0; 3]);
        let [width, height] = samples;
        for (y, row) in color.as_mut().chunks_mut(width.max(1)).enumerate() {
            let share = y as f32 / height.max(1) as f32;
            row.fill(encode(
                [0, 1, 2].map(|k| TOP[k] + (BOTTOM[k] - TOP[k]) * share),
            ));
        }
        Self {
            panel,
            color,
            depth: Buffer2d::new(samples, 1.0),
        }
    }

    /// Draws triangles, given as three corners each, with depth test.
    pub(super) fn draw(&mut self, corners: &[Corner], light: Light) {
        let shader = Shader { light };
        shader.draw::<Triangles<'_, Buffer2d<f32>, BackfaceCullingDisabled>, _>(
            corners,
            &mut self.color,
            Some(&mut self.depth),
        );
    }

    /// The panel, downsampled to one sample per pixel.
    pub(super) fn into_image(self) -> Image {
        let [width, height] = self.panel;
        let samples = self.color.as_ref();
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let mut sums = [0u32; 3];
                for dy in 0..SAMPLES {
                    let start = (y * SAMPLES + dy) * width * SAMPLES + x * SAMPLES;
                    for sample in &samples[start..start + SAMPLES] {
                        // Light adds up as squares of the encoded values.
                        (0..3).for_each(|k| sums[k] += u32::from(sample[k]).pow(2));
                    }
                }
                let mean = |sum: u32| (sum as f32 / (SAMPLES * SAMPLES) as f32).sqrt();
                pixels.push(sums.map(|sum| mean(sum).round() as u8));
            }
        }
        Image::from_pixels(width, pixels)
    }
}

/// Samples along each side of a pixel.
const SAMPLES: usize = 3;

/// The background, in linear colours.
pub(super) const TOP: [f32; 3] = [0.97, 0.975, 0.985];
pub(super) const BOTTOM: [f32; 3] = [0.80, 0.82, 0.85];

/// The lighting of the surface.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Light {
    /// Strong shading and a slight highlight, to show the shape.
    Sculpture,
    /// Weak shading and no highlight, so that colours can be compared with a scale.
    Chart,
}

struct Shader {
    light: Light,
}

impl Pipeline for Shader {
    type Vertex = Corner;
    type VsOut = Paint;
    type Pixel = [u8; 3];

    fn vert(&self, corner: &Corner) -> ([f32; 4], Paint) {
        (corner.position, corner.paint)
    }

    fn frag(&self, paint: &Paint) -> [u8; 3] {
        let length = dot(paint.normal, paint.normal).sqrt().max(1e-6);
        let normal = paint.normal.map(|x| x / length);
        // Wrapped Lambertian shading, so that no side is black.
        let wrap = |light: [f32; 3]| (0.5 + 0.5 * dot(normal, light)).max(0.0);
        let key = wrap(KEY);
        if self.light == Light::Chart {
            // 1 at normal incidence, so that full light shows the colour of the scale.
            return encode(paint.color.map(|c| c * (0.45 + 0.55 * key)));
        }
        let light = 0.10 + 0.95 * key * key + 0.12 * wrap(FILL);
        let shine = dot(normal, HALFWAY).max(0.0);
        let shine = 0.10 * shine.powi(24);
        encode(paint.color.map(|c| c * light + shine))
    }
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Encodes linear values in eight bits by a square root, the inverse of the scale's
/// [`decode`](cotan_tool::color_scale::decode).
///
/// Close enough to sRGB, and the same on every machine.
pub(super) fn encode(linear: [f32; 3]) -> [u8; 3] {
    linear.map(|c| (c.clamp(0.0, 1.0).sqrt() * 255.0).round() as u8)
}

/// Unit vectors to the lights: one from above on the left, one from below on the right.
const KEY: [f32; 3] = [-0.45, 0.66, 0.60];
const FILL: [f32; 3] = [0.80, -0.36, 0.48];

/// The halfway vector between the key light and the viewer.
const HALFWAY: [f32; 3] = [-0.25, 0.37, 0.894];
