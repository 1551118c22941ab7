//! The report of a command that changes the triangles of a mesh.

use std::path::Path;

use cotan::geometry::{Surface, SurfaceTree};
use cotan::halfedge::{FaceMap, HalfedgeMesh};
use cotan_tool::ColorScale;
use serde::Serialize;

use crate::console::Console;
use crate::picture::{HeatMap, Panel, Quantity, Views};
use crate::report::{Report, Seconds, Table, number};
use crate::text::Text;

/// The machine-readable report.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct TessellationReport {
    before: Counts,
    after: Counts,
    /// The largest distance of the original's vertices from the result, in the unit of the file.
    distance_to_result: f64,
    /// The largest distance of the result's vertices from the original.
    distance_to_original: f64,
    /// Properties of the file that were left out.
    losses: Vec<String>,
    seconds: f64,
}

/// The measures of one of the two meshes.
#[derive(Clone, Copy, Debug, Serialize)]
struct Counts {
    vertices: usize,
    faces: usize,
    genus: usize,
    boundary_loops: usize,
    mean_edge_length: f64,
    /// In degrees.
    least_angle: f64,
    area: f64,
}

impl Counts {
    /// Counts `polygons` and measures the triangles of `surface`.
    fn new(polygons: &HalfedgeMesh, surface: &Surface<'_, f64>) -> Self {
        Self {
            vertices: polygons.num_vertices(),
            faces: polygons.num_faces(),
            genus: polygons.genus(),
            boundary_loops: polygons.boundary_loops().len(),
            mean_edge_length: surface.mean_edge_length(),
            least_angle: surface.angle_statistics().min.to_degrees(),
            area: surface.area(),
        }
    }
}

impl TessellationReport {
    /// Measures the result. The meshes may have polygons, the surfaces are their triangles.
    pub(crate) fn measure(
        [before, after]: [&HalfedgeMesh; 2],
        [original, result]: [&Surface<'_, f64>; 2],
        losses: &[String],
    ) -> Self {
        let distance = |from: &Surface<'_, f64>, to: &Surface<'_, f64>| {
            let tree = SurfaceTree::new(*to);
            let feet = tree.closest_of(from.positions().as_slice());
            feet.iter().map(|foot| foot.distance).fold(0.0, f64::max)
        };
        Self {
            before: Counts::new(before, original),
            after: Counts::new(after, result),
            distance_to_result: distance(original, result),
            distance_to_original: distance(result, original),
            losses: losses.to_vec(),
            seconds: 0.0,
        }
    }
}

impl TessellationReport {
    /// Warns about properties of the original that the file at `path` lacks.
    pub(crate) fn warn(&self, path: &Path, console: &Console) {
        for loss in &self.losses {
            console.warn(format_args!("{}: {loss}", path.display()));
        }
    }
}

impl Report for TessellationReport {
    fn set_seconds(&mut self, seconds: Seconds) {
        self.seconds = seconds.total;
    }

    fn table(&self) -> Text {
        let (a, b) = (&self.before, &self.after);
        let mut table = Table::default();
        table.row("vertices", format!("{} -> {}", a.vertices, b.vertices));
        table.row("faces", format!("{} -> {}", a.faces, b.faces));
        let pair = |a: f64, b: f64| format!("{} -> {}", number(a), number(b));
        table.row("mean edge", pair(a.mean_edge_length, b.mean_edge_length));
        table.row("least angle, degrees", pair(a.least_angle, b.least_angle));
        table.row("area", pair(a.area, b.area));
        table.row("original to result", number(self.distance_to_result));
        table.row("result to original", number(self.distance_to_original));
        table.row("seconds", number(self.seconds));
        table.text
    }
}

/// The meshes before and after, coloured by the least angle of each triangle.
pub(crate) fn picture(before: &Surface<'_, f64>, after: &Surface<'_, f64>) -> Vec<u8> {
    let angles = [before, after].map(least_angles);
    let values = angles.iter().flat_map(|map| map.values().copied());
    let scale = ColorScale::size("least angle of a face, degrees", values);
    HeatMap {
        panels: &[
            Panel {
                mesh: before.mesh(),
                positions: before.positions(),
                quantity: Quantity::Faces(&angles[0]),
                caption: "before",
            },
            Panel {
                mesh: after.mesh(),
                positions: after.positions(),
                quantity: Quantity::Faces(&angles[1]),
                caption: "after",
            },
        ],
        scale: &scale,
        views: Views::OneCamera,
    }
    .png()
}

fn least_angles(surface: &Surface<'_, f64>) -> FaceMap<f64> {
    let mesh = surface.mesh();
    let angle = |f| {
        let sides = mesh.face_halfedges(f);
        let angles = sides.map(|h| cotan::geometry::halfedge_corner_angle(surface, h));
        angles.fold(f64::INFINITY, f64::min).to_degrees()
    };
    mesh.faces().map(angle).collect()
}
