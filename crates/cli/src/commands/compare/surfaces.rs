//! Two meshes of any connectivity, compared by the distances between their surfaces.

use cotan::geometry::{Positions, Surface};
use cotan::halfedge::{HalfedgeMesh, VertexMap};
use cotan::surface::{Deviation, DeviationOptions, OneSidedDeviation, deviation};
use cotan_io::{Document, ProcessingMesh};
use cotan_tool::{ColorScale, Work};
use serde::Serialize;

use crate::console::Console;
use crate::error::CliError;
use crate::files;
use crate::memory;
use crate::picture::{HeatMap, Panel, Quantity, Views};
use crate::prepare;
use crate::report::{Table, json_text, number};

use super::args::CompareArgs;

/// The output for meshes of different connectivity. Lengths are in the unit of the files, angles
/// in degrees.
#[derive(Debug, Serialize)]
struct SurfaceComparison {
    /// Always "different" here.
    connectivity: &'static str,
    vertices: [usize; 2],
    faces: [usize; 2],
    hausdorff: f64,
    hausdorff_bound: f64,
    /// `hausdorff` over the diagonal of the bounding box of A.
    relative_hausdorff: f64,
    mean_distance: f64,
    a_to_b: Distances,
    b_to_a: Distances,
}

/// The distances of one surface from the other.
#[derive(Debug, Serialize)]
struct Distances {
    hausdorff: f64,
    hausdorff_bound: f64,
    mean: f64,
    rms: f64,
    mean_normal_angle: f64,
    max_normal_angle: f64,
}

impl From<&OneSidedDeviation> for Distances {
    fn from(deviation: &OneSidedDeviation) -> Self {
        Self {
            hausdorff: deviation.hausdorff,
            hausdorff_bound: deviation.hausdorff_bound,
            mean: deviation.mean,
            rms: deviation.rms,
            mean_normal_angle: deviation.mean_normal_angle.to_degrees(),
            max_normal_angle: deviation.greatest_normal_angle.to_degrees(),
        }
    }
}

/// Compares the second mesh with the first, which has been read, and prints the result.
pub(super) fn compare(
    args: &CompareArgs,
    first: &ProcessingMesh,
    first_document: &Document,
    console: &Console,
) -> Result<(), CliError> {
    let (other_document, second) = prepare::load(&args.other, console)?;
    let a = surface(args, 0, first.mesh(), first.positions())?;
    let b = surface(args, 1, second.mesh(), second.positions())?;
    let measured = measure(args, &a, &b, [first_document, &other_document])?;
    if let Some(path) = &args.picture {
        let shapes = [(a.mesh(), a.positions()), (b.mesh(), b.positions())];
        files::write(path, &picture(shapes, &measured))?;
    }
    let comparison = SurfaceComparison {
        connectivity: "different",
        vertices: [a, b].map(|s| s.mesh().num_vertices()),
        faces: [a, b].map(|s| s.mesh().num_faces()),
        hausdorff: measured.hausdorff(),
        hausdorff_bound: measured.hausdorff_bound(),
        relative_hausdorff: measured.hausdorff() / a.bounding_box().diagonal(),
        mean_distance: measured.mean(),
        a_to_b: (&measured.forth).into(),
        b_to_a: (&measured.back).into(),
    };
    if args.json {
        return console.print(&json_text(&comparison)?);
    }
    console.print(&table(&comparison).text)
}

fn surface<'a>(
    args: &CompareArgs,
    which: usize,
    mesh: &'a HalfedgeMesh,
    positions: &'a Positions<f64>,
) -> Result<Surface<'a, f64>, CliError> {
    let path = [&args.original, &args.other][which];
    Surface::new(mesh, positions).map_err(|error| CliError::Mesh {
        path: path.to_path_buf(),
        source: error.into(),
    })
}

/// Measures the surfaces of both files, within the memory limit.
pub(super) fn measure(
    args: &CompareArgs,
    a: &Surface<'_, f64>,
    b: &Surface<'_, f64>,
    documents: [&Document; 2],
) -> Result<Deviation, CliError> {
    memory::check(Work::Compare, &args.original, documents[0])?;
    memory::check(Work::Compare, &args.other, documents[1])?;
    deviation(*a, *b, &DeviationOptions::default()).map_err(|error| CliError::Mesh {
        path: args.other.to_path_buf(),
        source: error.into(),
    })
}

/// Both surfaces with one camera, coloured by distance.
pub(super) fn picture(
    shapes: [(&HalfedgeMesh, &Positions<f64>); 2],
    measured: &Deviation,
) -> Vec<u8> {
    let sides = [&measured.forth, &measured.back];
    let all = sides
        .iter()
        .flat_map(|side| side.of_vertices.values().copied());
    let scale = ColorScale::size(
        "distance from the other surface, in the unit of the files",
        all,
    );
    let panel = |k: usize, caption| {
        let (mesh, positions) = shapes[k];
        let distances: &VertexMap<f64> = &sides[k].of_vertices;
        Panel {
            mesh,
            positions,
            quantity: Quantity::Vertices(distances),
            caption,
        }
    };
    let map = HeatMap {
        panels: &[panel(0, "A"), panel(1, "B")],
        scale: &scale,
        views: Views::OneCamera,
    };
    map.png()
}

fn table(comparison: &SurfaceComparison) -> Table {
    let mut table = Table::default();
    let both = |[a, b]: [usize; 2]| format!("{a} and {b}");
    table.row(
        "connectivity",
        "different: compared by the distances between the surfaces",
    );
    table.row("vertices", both(comparison.vertices));
    table.row("faces", both(comparison.faces));
    table.row(
        "Hausdorff",
        format!(
            "{} ({} of the diagonal), at most {}",
            number(comparison.hausdorff),
            number(comparison.relative_hausdorff),
            number(comparison.hausdorff_bound)
        ),
    );
    table.row("mean distance", number(comparison.mean_distance));
    for (name, side) in [
        ("A to B", &comparison.a_to_b),
        ("B to A", &comparison.b_to_a),
    ] {
        table.row(
            name,
            format!(
                "max {}, mean {}, rms {}",
                number(side.hausdorff),
                number(side.mean),
                number(side.rms)
            ),
        );
        table.row(
            &format!("{name}, normals"),
            format!(
                "mean {}°, max {}°",
                number(side.mean_normal_angle),
                number(side.max_normal_angle)
            ),
        );
    }
    table
}
