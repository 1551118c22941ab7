//! The bar: a box with a grid on each side.

use nalgebra::Point3;
use std::collections::BTreeMap;

use super::connect;
use crate::mesh::Mesh;
use crate::scalar::Scalar;

/// A closed box centred at the origin, with sharp edges and triangulated grids on its sides.
///
/// **Units**: `size` are the lengths along x, y, z. `segments` are the numbers of cells along
/// each axis, clamped to 1 … 512.
#[must_use]
pub fn bar<T: Scalar>(size: [T; 3], segments: [usize; 3]) -> Mesh<T> {
    let size = size.map(T::as_f64);
    let segments = segments.map(|count| count.clamp(1, MAX_BAR_SEGMENTS));
    let mut grid = BoxGrid {
        size,
        segments,
        numbers: BTreeMap::new(),
        points: Vec::new(),
    };
    let mut faces = Vec::new();
    for axis in 0..3 {
        for end in [0, segments[axis]] {
            push_side(&mut grid, axis, end, &mut faces);
        }
    }
    connect(&grid.points, &faces)
}

/// Adds two triangles for each cell of the side where coordinate `axis` equals `end`.
fn push_side(grid: &mut BoxGrid, axis: usize, end: usize, faces: &mut Vec<[u32; 3]>) {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    for i in 0..grid.segments[u] {
        for j in 0..grid.segments[v] {
            let mut corner = |di: usize, dj: usize| {
                let mut cell = [0; 3];
                cell[axis] = end;
                cell[u] = i + di;
                cell[v] = j + dj;
                grid.vertex(cell)
            };
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            // The diagonals alternate, so that the grid has no preferred direction.
            let pair = if (i + j) % 2 == 0 {
                [[a, b, c], [a, c, d]]
            } else {
                [[a, b, d], [b, c, d]]
            };
            // u × v = +axis: counter-clockwise on the far side, and reversed on the near one.
            faces.extend(pair.map(|[p, q, r]| if end > 0 { [p, q, r] } else { [p, r, q] }));
        }
    }
}

/// The grid vertices created so far.
struct BoxGrid {
    size: [f64; 3],
    segments: [usize; 3],
    numbers: BTreeMap<[usize; 3], u32>,
    points: Vec<Point3<f64>>,
}

impl BoxGrid {
    fn vertex(&mut self, cell: [usize; 3]) -> u32 {
        *self.numbers.entry(cell).or_insert_with(|| {
            let coordinate =
                |k: usize| self.size[k] * (cell[k] as f64 / self.segments[k] as f64 - 0.5);
            self.points
                .push(Point3::new(coordinate(0), coordinate(1), coordinate(2)));
            (self.points.len() - 1) as u32
        })
    }
}

/// Gives 1.6 million vertices if used along all three axes.
const MAX_BAR_SEGMENTS: usize = 512;
