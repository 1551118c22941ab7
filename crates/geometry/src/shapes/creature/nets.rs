//! Surface nets: the zero set of a [`Field`] as quads, with one vertex in each grid cell and one
//! quad for each grid edge that the surface crosses.
//!
//! **Source**: Gibson 1998, "Constrained elastic surface nets", with the vertex at the mean of
//! the crossings of the cell's edges.

use cotan_parallel::Chunks;
use nalgebra::{Point3, Vector3};

use super::field::Field;

/// Vertices and quads. Each quad is counter-clockwise as seen from the outside.
pub(super) struct Net {
    pub(super) points: Vec<Point3<f64>>,
    pub(super) quads: Vec<[u32; 4]>,
}

/// Computes the net of `field` on a grid with `resolution` cells along the longest side.
pub(super) fn surface_net(field: &Field, resolution: usize) -> Net {
    let grid = Grid::around(field, resolution);
    let mut values = grid.sample(field);
    grid.fill_ambiguous(&mut values);
    let mut net = Net {
        points: Vec::new(),
        quads: Vec::new(),
    };
    let mut vertex_of_cell = vec![u32::MAX; values.len()];
    for index in grid.cells() {
        if let Some(point) = grid.crossing_mean(&values, index) {
            vertex_of_cell[grid.at(index)] = net.points.len() as u32;
            net.points.push(point);
        }
    }
    for index in grid.cells() {
        for axis in 0..3 {
            net.quads
                .extend(grid.quad(&values, &vertex_of_cell, index, axis));
        }
    }
    net
}

/// A grid of points around a field, with a margin of two cells on every side.
struct Grid {
    origin: Point3<f64>,
    cell: f64,
    /// Points along x, y, z.
    size: [usize; 3],
}

impl Grid {
    fn around(field: &Field, resolution: usize) -> Self {
        let (min, max) = field.bounds();
        let extents = max - min;
        let cell = extents.max() / resolution as f64;
        // Offset by half a cell from the planes of symmetry, so that no value is exactly zero
        // there.
        let origin = min - Vector3::repeat(1.5 * cell);
        let size = [0, 1, 2].map(|k| (extents[k] / cell) as usize + 5);
        Self { origin, cell, size }
    }

    fn at(&self, [i, j, k]: [usize; 3]) -> usize {
        (i * self.size[1] + j) * self.size[2] + k
    }

    fn point(&self, index: [usize; 3]) -> Point3<f64> {
        self.origin + Vector3::from(index.map(|i| i as f64)) * self.cell
    }

    /// All cells, identified by their lowest corner.
    fn cells(&self) -> impl Iterator<Item = [usize; 3]> + use<> {
        let [nx, ny, nz] = self.size.map(|n| n - 1);
        (0..nx).flat_map(move |i| (0..ny).flat_map(move |j| (0..nz).map(move |k| [i, j, k])))
    }

    /// Samples the field at every point, in slabs of `BLOCK` layers. Blocks that the surface
    /// cannot reach get the value of their centre throughout.
    fn sample(&self, field: &Field) -> Vec<f32> {
        let layer = self.size[1] * self.size[2];
        let mut values = vec![0.0; layer * self.size[0]];
        let slabs = Chunks::of(layer * BLOCK);
        slabs.for_each(&mut values[..], |first, values| {
            let layers = values.len() / layer;
            for j in (0..self.size[1]).step_by(BLOCK) {
                for k in (0..self.size[2]).step_by(BLOCK) {
                    self.sample_block(field, [first / layer, j, k], layers, values);
                }
            }
        });
        values
    }

    fn sample_block(&self, field: &Field, first: [usize; 3], layers: usize, values: &mut [f32]) {
        let half = 0.5 * (BLOCK - 1) as f64 * self.cell;
        let middle = field.value(&(self.point(first) + Vector3::repeat(half)));
        // The gradient is at most 1, so a larger value keeps its sign throughout the block. One
        // more cell ensures that no crossing between blocks is missed.
        let is_far = middle.abs() > (half + self.cell) * 3.0_f64.sqrt();
        for i in 0..layers {
            for j in first[1]..self.size[1].min(first[1] + BLOCK) {
                for k in first[2]..self.size[2].min(first[2] + BLOCK) {
                    let index = [first[0] + i, j, k];
                    let value = if is_far {
                        middle
                    } else {
                        field.value(&self.point(index))
                    };
                    values[self.at([i, j, k])] = value as f32;
                }
            }
        }
    }

    /// Turns outside points into inside points until the net is a manifold.
    ///
    /// The net is a manifold if no cell has a face in which diagonal corners agree while adjacent
    /// ones differ, and no cell has two opposite corners that differ from all others
    /// (well-composedness, Latecki 1997). Points only ever change in one direction, so this
    /// terminates.
    fn fill_ambiguous(&self, values: &mut [f32]) {
        loop {
            let mut is_done = true;
            for cell in self.cells() {
                let corner = |c: usize| self.at([0, 1, 2].map(|k| cell[k] + (c >> k & 1)));
                let mask = (0..8).fold(0_u8, |m, c| m | u8::from(values[corner(c)] < 0.0) << c);
                if !is_ambiguous(mask) {
                    continue;
                }
                is_done = false;
                // The outside corner nearest to the surface.
                let outside = (0..8).filter(|c| mask >> c & 1 == 0).map(corner);
                if let Some(index) = outside.min_by(|&a, &b| values[a].total_cmp(&values[b])) {
                    values[index] = -values[index].max(f32::MIN_POSITIVE);
                }
            }
            if is_done {
                return;
            }
        }
    }

    /// The mean of the crossings on the edges of a cell, if there are any.
    fn crossing_mean(&self, values: &[f32], cell: [usize; 3]) -> Option<Point3<f64>> {
        let corner = |c: usize| [0, 1, 2].map(|k| cell[k] + (c >> k & 1));
        let value: [f32; 8] = std::array::from_fn(|c| values[self.at(corner(c))]);
        let num_inside = value.iter().filter(|&&v| v < 0.0).count();
        if num_inside == 0 || num_inside == 8 {
            return None;
        }
        let mut sum = Vector3::zeros();
        let mut count = 0;
        for a in 0..8 {
            for axis in (0..3).filter(|axis| a >> axis & 1 == 0) {
                let b = a | 1 << axis;
                if (value[a] < 0.0) != (value[b] < 0.0) {
                    let share = f64::from(value[a]) / (f64::from(value[a]) - f64::from(value[b]));
                    let (p, q) = (self.point(corner(a)), self.point(corner(b)));
                    sum += p.coords + (q - p) * share;
                    count += 1;
                }
            }
        }
        Some(Point3::from(sum / f64::from(count)))
    }

    /// The quad across the grid edge that starts at the lowest corner of `cell` along `axis`.
    fn quad(
        &self,
        values: &[f32],
        vertex_of_cell: &[u32],
        cell: [usize; 3],
        axis: usize,
    ) -> Option<[u32; 4]> {
        let mut end = cell;
        end[axis] += 1;
        let is_inside = |index| values[self.at(index)] < 0.0;
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        if is_inside(cell) == is_inside(end) || cell[u] == 0 || cell[v] == 0 {
            return None;
        }
        let vertex = |du: usize, dv: usize| {
            let mut around = cell;
            around[u] -= du;
            around[v] -= dv;
            vertex_of_cell[self.at(around)]
        };
        // u × v = axis: counter-clockwise as seen from the end of the edge.
        let quad = [vertex(1, 1), vertex(0, 1), vertex(0, 0), vertex(1, 0)];
        let [a, b, c, d] = quad;
        Some(if is_inside(cell) { quad } else { [a, d, c, b] })
    }
}

/// Returns true if the inside corners of a cell (bit x + 2 y + 4 z of the mask) are connected
/// only across a diagonal of a face or of the cell.
fn is_ambiguous(mask: u8) -> bool {
    let bit = |c: usize| mask >> c & 1;
    let is_crossed = |(base, u, v): (usize, usize, usize)| {
        let [a, b, c, d] = [base, base | u, base | u | v, base | v].map(bit);
        a == c && b == d && a != b
    };
    let faces = [(1, 2, 4), (2, 4, 1), (4, 1, 2)]
        .into_iter()
        .flat_map(|(axis, u, v)| [(0, u, v), (axis, u, v)]);
    let lone_pair = |m: u8| m.count_ones() == 2 && (0..4).any(|c| m == 1 << c | 1 << (7 - c));
    faces.into_iter().any(is_crossed) || lone_pair(mask) || lone_pair(!mask)
}

/// Points along each side of a block that is either sampled or skipped as a whole.
const BLOCK: usize = 8;
