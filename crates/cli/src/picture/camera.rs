//! The camera of a picture.

use cotan::geometry::{BoundingBox, Positions, Surface, face_area_vectors, vertex_area_vectors};
use cotan::halfedge::VertexMap;
use nalgebra::{Matrix3, Point3, Vector3};

use super::pair::{BeforeAfter, Mark};

/// A camera that shows one or more embeddings of a mesh at the same scale, with mild perspective.
#[derive(Clone, Debug)]
pub(super) struct Camera {
    center: Point3<f64>,
    /// Half the diagonal of the shapes' common bounding box.
    radius: f64,
    /// Rows: to the right, up, towards the viewer.
    axes: Matrix3<f64>,
    /// The centre of the projected shapes, and the scale from their units to half a panel.
    middle: [f64; 2],
    scale: [f64; 2],
    panel: [usize; 2],
}

impl Camera {
    /// A camera that shows both shapes well.
    pub(super) fn for_both(pair: &BeforeAfter<'_>) -> Self {
        let frame = Frame::Area(PANEL_PIXELS);
        Self::new(best_view(pair), &[pair.before, pair.after], frame)
    }

    /// A camera that looks along `axes` (rows: to the right, up, towards the viewer) and shows
    /// all of `shapes`.
    pub(super) fn new(axes: Matrix3<f64>, shapes: &[&Positions<f64>], frame: Frame) -> Self {
        let points = || shapes.iter().flat_map(|positions| positions.values());
        let bounds = BoundingBox::of(points());
        let center = bounds.map_or(Point3::origin(), |b| b.center());
        // Halve first: the diagonal of huge coordinates would overflow.
        let radius = bounds.map_or(0.0, |b| (b.extents() * 0.5).norm());
        let mut camera = Self {
            center,
            radius: if radius > 0.0 && radius.is_finite() {
                radius
            } else {
                1.0
            },
            axes,
            middle: [0.0; 2],
            scale: [1.0; 2],
            panel: [0; 2],
        };
        camera.fit(points(), frame);
        camera
    }

    /// Width and height of one panel, in pixels.
    pub(super) fn panel(&self) -> [usize; 2] {
        self.panel
    }

    /// Chooses panel and scale so that all points are visible.
    fn fit<'p>(&mut self, points: impl Iterator<Item = &'p Point3<f64>>, frame: Frame) {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for point in points {
            let p = self.local(*point);
            let w = DISTANCE - p.z;
            for (k, x) in [p.x / w, p.y / w].into_iter().enumerate() {
                low[k] = low[k].min(x);
                high[k] = high[k].max(x);
            }
        }
        let size = [0, 1].map(|k| (high[k] - low[k]).max(1e-3));
        self.middle = [0, 1].map(|k| 0.5 * (low[k] + high[k]));
        let aspect = (size[0] / size[1]).clamp(MIN_ASPECT, MAX_ASPECT);
        self.panel = match frame {
            Frame::Area(pixels) => {
                let height = (pixels / aspect).sqrt();
                [height * aspect, height].map(|x| x.round() as usize)
            }
            Frame::Height {
                height,
                least_width,
            } => {
                let width = (height as f64 * aspect).round() as usize;
                [width.max(least_width), height]
            }
        };
        let [width, height] = self.panel.map(|x| x as f64);
        // The same scale horizontally and vertically: pixels per unit.
        let pixels = MARGIN * (width / size[0]).min(height / size[1]);
        self.scale = [2.0 * pixels / width, 2.0 * pixels / height];
    }

    /// A point in camera coordinates (right, up, towards the viewer), in units of the radius.
    pub(super) fn local(&self, point: Point3<f64>) -> Vector3<f64> {
        let offset = self.axes * ((point - self.center) / self.radius);
        // Coordinates that overflow, in a mesh of huge numbers, are drawn in the centre.
        offset.map(|x| {
            if x.is_finite() {
                x.clamp(-1.5, 1.5)
            } else {
                0.0
            }
        })
    }

    /// Homogeneous panel coordinates of a local point. The panel is [−1, 1]² × [0, 1].
    pub(super) fn project(&self, p: Vector3<f64>) -> [f32; 4] {
        let w = DISTANCE - p.z;
        let x = (p.x - self.middle[0] * w) * self.scale[0];
        let y = (p.y - self.middle[1] * w) * self.scale[1];
        [x, y, w - NEAR, w].map(|x| x as f32)
    }

    /// The size of a pixel at the depth of a local point, in local units.
    pub(super) fn pixel(&self, p: Vector3<f64>) -> f64 {
        2.0 * (DISTANCE - p.z) / (self.scale[1] * self.panel[1] as f64)
    }
}

/// The size of a panel.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Frame {
    /// This many pixels, whatever the aspect ratio.
    Area(f64),
    /// This high, and as wide as the shapes need.
    Height { height: usize, least_width: usize },
}

/// The distance from the camera to the centre, in radii: mild perspective.
const DISTANCE: f64 = 5.0;

/// A lower bound for the distance of the scene from the camera.
const NEAR: f64 = 3.0;

/// The fraction of a panel that the shapes fill.
const MARGIN: f64 = 0.86;

/// Pixels of one panel, whatever the aspect ratio.
const PANEL_PIXELS: f64 = 720.0 * 720.0;

const MIN_ASPECT: f64 = 0.6;
const MAX_ASPECT: f64 = 1.6;

/// The best view of a pair, as rows right, up, towards the viewer.
///
/// It looks along the axis that shows most of the surface and its motion, from the side that
/// shows most of the handles, slightly from the right or left and from above.
fn best_view(pair: &BeforeAfter<'_>) -> Matrix3<f64> {
    best_side(best_axis(pair), &held_area(pair))
}

/// The best view of one shape: along the axis that shows most of the surface, from the side that
/// shows most of `areas`.
pub(super) fn view_of(surface: &Surface<'_, f64>, areas: &[Vector3<f64>]) -> Matrix3<f64> {
    let shown = shown_areas(surface);
    best_side(first_best(|axis| shown[axis]), areas)
}

/// The view along an axis, from the side that shows most of `areas`, slightly from the right or
/// left.
fn best_side(axis: usize, areas: &[Vector3<f64>]) -> Matrix3<f64> {
    let shows = |axes: &Matrix3<f64>| -> f64 {
        let towards = axes.row(2).transpose();
        areas.iter().map(|area| area.dot(&towards).max(0.0)).sum()
    };
    let [right, up, towards] = sides(axis);
    let views = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
    let views = views.map(|(side, yaw)| tilted([right * side, up, towards * side], YAW * yaw));
    // The first of the views that are equally good up to rounding.
    let better = |best, view| {
        if shows(&view) > 1.01 * shows(&best) {
            view
        } else {
            best
        }
    };
    views[1..].iter().copied().fold(views[0], better)
}

/// The axis (0, 1, 2) that shows most of the surface and its motion.
fn best_axis(pair: &BeforeAfter<'_>) -> usize {
    let mut areas = Vector3::zeros();
    for positions in [pair.before, pair.after] {
        if let Ok(surface) = Surface::new(pair.mesh, positions) {
            areas += shown_areas(&surface);
        }
    }
    let moves = pair
        .before
        .values()
        .zip(pair.after.values())
        .map(|(a, b)| b - a);
    let moved: Vector3<f64> = moves.map(|d| d.component_mul(&d)).sum();
    // The share of the squared motion that is visible along an axis.
    let seen = |k: usize| match moved.sum() {
        total if total > 0.0 => 1.0 - moved[k] / total,
        _ => 1.0,
    };
    let score = |k: usize| areas[k] * (1.0 + seen(k));
    first_best(score)
}

/// The area of the surface projected along each axis, front and back.
fn shown_areas(surface: &Surface<'_, f64>) -> Vector3<f64> {
    let areas = face_area_vectors(surface);
    areas.values().map(|a| a.abs()).sum()
}

/// The axis with the highest score.
fn first_best(score: impl Fn(usize) -> f64) -> usize {
    // z first, so that it wins a tie.
    let better = |best, k| {
        if score(k) > 1.001 * score(best) {
            k
        } else {
            best
        }
    };
    [0, 1].into_iter().fold(2, better)
}

/// The area vectors of the handle vertices, before and after. Moved handles count most.
fn held_area(pair: &BeforeAfter<'_>) -> Vec<Vector3<f64>> {
    let mut held = Vec::new();
    for positions in [pair.before, pair.after] {
        let areas: VertexMap<_> = match Surface::new(pair.mesh, positions) {
            Ok(surface) => vertex_area_vectors(&surface),
            Err(_) => continue,
        };
        held.extend(
            areas
                .values()
                .zip(pair.marks.values())
                .map(|(area, mark)| match mark {
                    Mark::Free => Vector3::zeros(),
                    Mark::Fixed => area * 0.1,
                    Mark::Moved => *area,
                }),
        );
    }
    held
}

/// The directions right, up, and towards the viewer when looking along an axis.
fn sides(axis: usize) -> [Vector3<f64>; 3] {
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    match axis {
        0 => [-z, y, x],
        // When looking along y, z is up, as in modelling programs whose ground is the x–y plane.
        1 => [x, z, -y],
        _ => [x, y, z],
    }
}

/// Turns a view slightly to the right (or left, if `yaw` is negative) and upwards.
fn tilted([right, up, towards]: [Vector3<f64>; 3], yaw: f64) -> Matrix3<f64> {
    let (sin_yaw, cos_yaw) = yaw.to_radians().sin_cos();
    let (sin_pitch, cos_pitch) = PITCH.to_radians().sin_cos();
    let towards = cos_pitch * (cos_yaw * towards + sin_yaw * right) + sin_pitch * up;
    let right = up.cross(&towards).normalize();
    let up = towards.cross(&right);
    Matrix3::from_rows(&[right.transpose(), up.transpose(), towards.transpose()])
}

/// In degrees.
const YAW: f64 = 24.0;
const PITCH: f64 = 16.0;
