//! `cotan compare`: compares two meshes, vertex by vertex if they have the same faces and by the
//! distances between their surfaces otherwise.

pub(crate) mod args;
mod shapes;
mod surfaces;

use std::path::Path;

use cotan::geometry::Surface;
use cotan::{Quality, ShapeDistance};
use cotan_tool::numbers::in_file_numbers;
use serde::Serialize;

use crate::console::Console;
use crate::error::CliError;
use crate::files;
use crate::prepare::{self, positions_of};
use crate::report::{QualityFields, Table, json_text, number};
use crate::same_faces::check_same_faces;
use crate::text::Text;

use args::CompareArgs;

/// The output of `compare`.
#[derive(Debug, Serialize)]
struct Comparison {
    /// Always "same" here.
    connectivity: &'static str,
    vertices: usize,
    faces: usize,
    #[serde(flatten)]
    quality: QualityFields,
    /// The largest and the root mean square displacement of a vertex, in the unit of the files.
    max_displacement: f64,
    rms_displacement: f64,
    /// The largest displacement over the diagonal of the original's bounding box.
    max_relative_displacement: f64,
    /// The distance of the vertices to those of the shape of `--distance-to`, or to the original,
    /// over the longest side of the original's box.
    distance_rms: f64,
    distance_max: f64,
}

pub(crate) fn run(args: &CompareArgs, console: &Console) -> Result<(), CliError> {
    let (original, processing) = prepare::load(&args.original, console)?;
    let other = files::load(&args.other, console)?;
    let paths: [&Path; 2] = [&args.original, &args.other];
    if let Err(difference) = check_same_faces(paths, [&original, &other]) {
        if args.distance_to.is_some() {
            return Err(difference);
        }
        return surfaces::compare(args, &processing, &original, console);
    }

    let refuse = |path: &Path, error: cotan::Error| CliError::Mesh {
        path: path.to_owned(),
        source: in_file_numbers(error, &processing, None),
    };
    let (before, after) = (processing.positions(), positions_of(&other, &processing));
    let surface = |path: &Path, positions| {
        Surface::new(processing.mesh(), positions).map_err(|e| refuse(path, e.into()))
    };
    let (a, b) = (
        surface(&args.original, before)?,
        surface(&args.other, &after)?,
    );
    let quality = Quality::measure(&a, &b).map_err(|e| refuse(&args.other, e))?;
    let moves: Vec<f64> = before
        .values()
        .zip(after.values())
        .map(|(a, b)| (b - a).norm())
        .collect();
    let longest = moves.iter().copied().fold(0.0, f64::max);
    let mean_square = moves.iter().map(|d| d * d).sum::<f64>() / moves.len().max(1) as f64;
    let given = match &args.distance_to {
        None => None,
        Some(path) => {
            let document = files::load(path, console)?;
            check_same_faces([&args.original, path], [&original, &document])?;
            Some((path, positions_of(&document, &processing)))
        }
    };
    if let Some(path) = &args.picture {
        let png = match &given {
            None => {
                let measured = surfaces::measure(args, &a, &b, [&original, &other])?;
                let shapes = [(a.mesh(), a.positions()), (b.mesh(), b.positions())];
                surfaces::picture(shapes, &measured)
            }
            Some((_, shape)) => shapes::picture(a.mesh(), [before, &after], shape),
        };
        files::write(path, &png)?;
    }
    let distance = match &given {
        None => ShapeDistance::measure(&a, &b, &a),
        Some((path, positions)) => ShapeDistance::measure(&a, &b, &surface(path, positions)?),
    };
    let distance = distance.map_err(|e| refuse(&args.other, e))?;
    let comparison = Comparison {
        connectivity: "same",
        vertices: before.len(),
        faces: processing.mesh().num_faces(),
        quality: QualityFields::from(&quality),
        max_displacement: longest,
        rms_displacement: mean_square.sqrt(),
        max_relative_displacement: longest / a.bounding_box().diagonal(),
        distance_rms: distance.rms,
        distance_max: distance.max,
    };
    if args.json {
        return console.print(&json_text(&comparison)?);
    }
    let given = args.distance_to.as_ref().map_or("A", |_| "SHAPE");
    console.print(&table(&comparison, given))
}

fn table(comparison: &Comparison, given: &str) -> Text {
    let mut table = Table::default();
    table.row("connectivity", "the same: compared vertex by vertex");
    table.row(
        "vertices, faces",
        format!("{}, {}", comparison.vertices, comparison.faces),
    );
    table.quality(&comparison.quality);
    table.row(
        "longest move",
        format!(
            "{} ({} of the diagonal)",
            number(comparison.max_displacement),
            number(comparison.max_relative_displacement)
        ),
    );
    table.row("move, rms", number(comparison.rms_displacement));
    table.row(
        &format!("distance to {given}"),
        format!(
            "rms {}, max {} of the longest side",
            number(comparison.distance_rms),
            number(comparison.distance_max)
        ),
    );
    table.text
}
