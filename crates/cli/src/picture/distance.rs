//! A surface coloured by distance, with lines of equal distance.

use cotan::geometry::{Mesh, Positions};
use cotan::halfedge::{FaceMap, HalfedgeMesh, VertexMap};
use cotan_tool::ColorScale;
use nalgebra::Point3;

use super::heat::{HeatMap, Panel, Quantity, Views};

/// The title of the bar. The unit is that of the file.
const TITLE: &str = "distance along the surface, in the unit of the file";

/// One panel, cut along `lines` lines at equal steps. The lines are grey, and so is a component
/// without a source.
pub(crate) fn distance_picture(
    mesh: &HalfedgeMesh,
    positions: &Positions<f64>,
    distances: &VertexMap<f64>,
    lines: usize,
) -> Vec<u8> {
    let finite = || distances.values().copied().filter(|d| d.is_finite());
    let scale = ColorScale::size(TITLE, finite());
    let greatest = finite().fold(0.0_f64, f64::max);
    let step = greatest / (lines as f64 + 1.0);
    let pieces = Pieces::cut(mesh, positions, distances, step, step * LINE_SHARE);
    let draw = |mesh, positions, quantity| {
        let panel = Panel {
            mesh,
            positions,
            quantity,
            caption: "",
        };
        let map = HeatMap {
            panels: &[panel],
            scale: &scale,
            views: Views::OneDirection,
        };
        map.png()
    };
    match Mesh::<f64>::from_triangles(&pieces.points, &pieces.corners) {
        Ok(cut) => {
            let values = FaceMap::from_vec(pieces.values);
            let quantity = Quantity::Faces(&values);
            draw(cut.connectivity(), cut.positions(), quantity)
        }
        // Without triangles nothing can be cut.
        Err(_) => draw(mesh, positions, Quantity::Vertices(distances)),
    }
}

/// The surface as separate triangles, none of which crosses the border of a line.
#[derive(Default)]
struct Pieces {
    points: Vec<[f64; 3]>,
    corners: Vec<u32>,
    /// The distance at the middle of each triangle; NaN on a line.
    values: Vec<f64>,
}

/// A corner of a piece and its distance.
type Corner = (Point3<f64>, f64);

impl Pieces {
    /// Lines are `width` wide, and are at every multiple of `step` but 0.
    fn cut(
        mesh: &HalfedgeMesh,
        positions: &Positions<f64>,
        distances: &VertexMap<f64>,
        step: f64,
        width: f64,
    ) -> Self {
        let mut pieces = Self::default();
        for f in mesh.faces() {
            let face: Vec<Corner> = mesh
                .triangle(f)
                .map(|v| (positions[v], distances[v]))
                .to_vec();
            let [low, high] = range(&face);
            if !(step > 0.0) || !high.is_finite() {
                pieces.fan(&face, f64::NAN);
                continue;
            }
            // A face that crosses more lines than can be distinguished is left whole.
            let (first, last) = ((low / step).floor(), (high / step).ceil());
            if last - first > MAX_LINES {
                pieces.fan(&face, 0.5 * (low + high));
                continue;
            }
            let mut rest = face;
            let mut k = first.max(1.0);
            while k <= last && !rest.is_empty() {
                let [line, end] = [k * step - 0.5 * width, k * step + 0.5 * width];
                let (below, above) = split(&rest, line);
                let (on, above) = split(&above, end);
                let [low, high] = range(&below);
                pieces.fan(&below, 0.5 * (low + high));
                pieces.fan(&on, f64::NAN);
                rest = above;
                k += 1.0;
            }
            let [low, high] = range(&rest);
            pieces.fan(&rest, 0.5 * (low + high));
        }
        pieces
    }

    /// Adds a convex polygon.
    fn fan(&mut self, polygon: &[Corner], value: f64) {
        for k in 2..polygon.len() {
            let start = self.points.len() as u32;
            let corners = [&polygon[0], &polygon[k - 1], &polygon[k]];
            self.points
                .extend(corners.map(|(p, _)| <[f64; 3]>::from(*p)));
            self.corners.extend([start, start + 1, start + 2]);
            self.values.push(value);
        }
    }
}

fn range(polygon: &[Corner]) -> [f64; 2] {
    let values = polygon.iter().map(|(_, d)| *d);
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], d| {
        [low.min(d), high.max(d)]
    })
}

/// The parts of a convex polygon below and above a distance.
fn split(polygon: &[Corner], level: f64) -> (Vec<Corner>, Vec<Corner>) {
    let (mut below, mut above) = (Vec::new(), Vec::new());
    for (k, &(point, d)) in polygon.iter().enumerate() {
        let (next, next_d) = polygon[(k + 1) % polygon.len()];
        if d <= level {
            below.push((point, d));
        }
        if d >= level {
            above.push((point, d));
        }
        if (d < level) != (next_d < level) && d != level && next_d != level {
            let share = (level - d) / (next_d - d);
            let crossing = (point + (next - point) * share, level);
            below.push(crossing);
            above.push(crossing);
        }
    }
    (below, above)
}

/// The width of a line, as a share of the step between lines.
const LINE_SHARE: f64 = 0.08;

/// Lines across one face.
const MAX_LINES: f64 = 1000.0;

#[cfg(test)]
mod tests {
    use cotan::shapes;

    use super::*;

    fn area(points: &[[f64; 3]]) -> f64 {
        let triangles = points.chunks_exact(3).map(|t| {
            let [a, b, c] = [t[0], t[1], t[2]].map(Point3::from);
            (b - a).cross(&(c - a)).norm() / 2.0
        });
        triangles.sum()
    }

    #[test]
    fn the_pieces_cover_the_surface_and_lines_their_share_of_it() {
        let shape = shapes::bumpy_plane::<f64>([1.0, 1.0], [7, 5], 0.0);
        let low = shape
            .positions()
            .values()
            .fold(f64::INFINITY, |m, p| m.min(p.x));
        let distances = shape.positions().map(|p| p.x - low);
        let pieces = Pieces::cut(
            shape.connectivity(),
            shape.positions(),
            &distances,
            0.13,
            0.01,
        );
        assert!((area(&pieces.points) - 1.0).abs() < 1e-12);
        let lines: Vec<[f64; 3]> = pieces
            .values
            .iter()
            .zip(pieces.points.chunks_exact(3))
            .filter(|(value, _)| value.is_nan())
            .flat_map(|(_, corners)| corners.to_vec())
            .collect();
        // Seven lines.
        assert!((area(&lines) - 0.07).abs() < 1e-12);
    }

    #[test]
    fn unreached_parts_and_no_distances_at_all_are_drawn() {
        let shape = shapes::icosphere::<f64>(1);
        for value in [0.0, f64::INFINITY, f64::NAN] {
            let distances = shape.positions().map(|_| value);
            let png = distance_picture(shape.connectivity(), shape.positions(), &distances, 9);
            assert!(png.starts_with(b"\x89PNG"));
        }
    }
}
