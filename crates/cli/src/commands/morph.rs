//! `cotan morph`: a shape between two, via the sphere that both are mapped to.

use cotan::geometry::{Mesh, Positions};
use cotan::sphere::{Morph, SphereMap};
use cotan_io::Document;

use crate::args::{Align, MorphArgs};
use crate::console::Console;
use crate::error::CliError;
use crate::files;
use crate::prepare;
use crate::report::Seconds;
use crate::sphere::{self, Input, Mapped, Mapper, Turn};
use crate::text::Text;
use crate::threads;

pub(crate) fn run(args: &MorphArgs, console: &Console) -> Result<(), CliError> {
    files::mesh_format(&args.output)?;
    threads::with_threads(args.threads, || morph(args, console))?
}

fn morph(args: &MorphArgs, console: &Console) -> Result<(), CliError> {
    let options = args.map.options();
    let progress = console.progress(options.iteration_limit);
    progress.phase("load");
    let sources = [&args.start, &args.end].map(|path| args.mending.source(path));
    let load = |k: usize| prepare::prepare(&sources[k], &mut Seconds::default(), console);
    let prepared = [load(0)?, load(1)?];
    let inputs = [0, 1].map(|k| Input {
        source: &sources[k],
        prepared: &prepared[k],
    });
    let map = |input| {
        let mapper = Mapper {
            input,
            options: &options,
            turn: Turn::None,
        };
        let mapped = mapper.run::<f64>(&progress)?;
        sphere::warn(&mapped.report, &options, console);
        Ok::<_, CliError>(mapped)
    };
    let mapped = [map(inputs[0])?, map(inputs[1])?];
    progress.phase("align");
    let end = aligned(args, &inputs, &mapped)?;
    let [a, b] = &mapped;
    let of_file = [a, b].map(|mapped| mapped.in_file(&mapped.positions));
    let shapes = ((&a.map, &of_file[0]), (&end, &of_file[1]));
    let morph = match args.level {
        Some(level) => Morph::on_icosphere(shapes.0, shapes.1, level),
        None => Morph::on_first(shapes.0, shapes.1),
    };
    let shape = morph
        .map_err(|error| inputs[0].refuse(error))?
        .shape_at(args.time);
    drop(progress);
    write(args, inputs[0], &shape, console)
}

/// Writes the shape: a new file if it was resampled on an icosphere, otherwise the file of A.
fn write(
    args: &MorphArgs,
    start: Input<'_>,
    shape: &Mesh<f64>,
    console: &Console,
) -> Result<(), CliError> {
    let document = match args.level {
        Some(_) => Document::from_mesh(shape.connectivity(), shape.positions())?,
        None => {
            let mut document = start.prepared.document.clone();
            let moved = document.set_positions(&start.prepared.processing, shape.positions());
            moved.map_err(|error| files::in_file(&args.start, error))?;
            document
        }
    };
    files::save(&document, &args.output, args.embed, console)?;
    console.note(&Text::of(format_args!(
        "{}: {} vertices, {} faces",
        args.output.display(),
        document.positions().len(),
        document.faces().len()
    )));
    Ok(())
}

/// The sphere of B, rotated to fit that of A.
fn aligned(
    args: &MorphArgs,
    inputs: &[Input<'_>; 2],
    mapped: &[Mapped<f64>; 2],
) -> Result<SphereMap<f64>, CliError> {
    let [a, b] = mapped;
    let refuse = |error| inputs[1].refuse(error);
    let aligned = match (&args.landmarks, args.align) {
        (Some(path), _) => {
            let pairs = sphere::pairs(path, *inputs)?;
            let pairs: Vec<_> = pairs.into_iter().map(|[a, b]| (b, a)).collect();
            b.map.align_landmarks(&a.map, &pairs)
        }
        (None, Align::Pose) => b.map.align(&in_box(b), &a.map, &in_box(a)),
        (None, Align::Areas) => {
            let [of_a, of_b] = [a, b].map(|m| m.map.area_density(&m.positions));
            b.map
                .align(&of_b.map_err(refuse)?, &a.map, &of_a.map_err(refuse)?)
        }
        (None, Align::None) => return Ok(b.map.clone()),
    };
    Ok(aligned.map_err(refuse)?.map)
}

/// The positions relative to the bounding box, so that shapes of different size and place
/// compare.
fn in_box(mapped: &Mapped<f64>) -> Positions<f64> {
    let bounds = mapped.surface().bounding_box();
    let (center, size) = (bounds.center(), bounds.diagonal());
    mapped.positions.map(|p| ((p - center) / size).into())
}
