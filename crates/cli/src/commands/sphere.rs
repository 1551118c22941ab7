//! `cotan sphere`: maps a closed mesh onto the unit sphere without flipping a triangle.

use std::time::Instant;

use cotan::geometry::Scalar;

use crate::args::{Precision, SphereArgs};
use crate::commands::repair::forgotten;
use crate::console::Console;
use crate::error::CliError;
use crate::files;
use crate::prepare::{self, Prepared};
use crate::report::{Seconds, write_json};
use crate::sphere::{self, Input, Mapped, Mapper, Phases, SphereRun, Upright, WrittenSphere};
use crate::threads;

pub(crate) fn run(args: &SphereArgs, console: &Console) -> Result<(), CliError> {
    let job = || match args.run.precision {
        Precision::F64 => run_as::<f64>(args, console),
        Precision::F32 => run_as::<f32>(args, console),
    };
    let report = threads::with_threads(args.run.threads, job)??;
    console.note(&report.table());
    Ok(())
}

/// Reads, maps and writes, and prints warnings.
fn run_as<T: Scalar>(args: &SphereArgs, console: &Console) -> Result<SphereRun, CliError> {
    let clock = Instant::now();
    files::mesh_format(&args.output)?;
    let options = args.map.options();
    let progress = console.progress(options.iteration_limit);
    progress.phase("load");
    let mut seconds = Seconds::default();
    let source = args.input.mending.source(&args.input.mesh);
    let prepared = prepare::prepare(&source, &mut seconds, console)?;
    let input = Input {
        source: &source,
        prepared: &prepared,
    };
    let mapper = Mapper {
        input,
        options: &options,
        turn: args.turn.turn(),
    };
    let mapped = mapper.run::<T>(&progress)?;
    drop(progress);

    let written = write_sphere(args, input, &mapped, console)?;
    sphere::warn(&mapped.report, &options, console);
    let mut report = SphereRun::new(&mapped, &options, args.run.precision).written(&written);
    report.phases = Phases {
        load: seconds.load,
        build: seconds.build,
        map: mapped.seconds,
    };
    report.seconds = clock.elapsed().as_secs_f64();
    if let Some(path) = &args.geometry_image {
        let drawn = sphere::geometry_image(&mapped, args.size);
        let (png, fields) = drawn.map_err(|error| input.refuse(error))?;
        files::write(path, &png)?;
        report.geometry_image = Some(fields);
    }
    if let Some(path) = &args.run.report {
        write_json(path, &report)?;
    }
    if let Some(path) = &args.picture {
        files::write(path, &sphere::area_picture(&mapped))?;
    }
    Ok(report)
}

/// Writes the document with all its vertices on the sphere, and warns about losses.
///
/// Polygons are written so that every reader cuts them without a flip.
fn write_sphere<T: Scalar>(
    args: &SphereArgs,
    input: Input<'_>,
    mapped: &Mapped<T>,
    console: &Console,
) -> Result<WrittenSphere, CliError> {
    let format = files::mesh_format(&args.output)?;
    let Prepared {
        document,
        processing,
        changes,
        ..
    } = input.prepared;
    let in_file = |error| files::in_file(&args.input.mesh, error);
    let source = document.positions();
    let mut document = document.clone();
    document
        .set_positions(processing, mapped.map.positions())
        .map_err(in_file)?;
    sphere::join_welded(&mut document, processing).map_err(in_file)?;
    let unused_vertices =
        sphere::place_unused(&mut document, source, mapped, processing).map_err(in_file)?;
    let sphericity_error = sphere::sphericity_error(&document);
    if args.uv {
        document = sphere::with_texture(document, mapped, processing).map_err(in_file)?;
    }
    let Upright {
        document,
        written_as_triangles,
    } = sphere::upright(document, format, processing).map_err(in_file)?;
    files::save(&document, &args.output, args.embed, console)?;
    for lost in forgotten(format, changes) {
        console.warn(format_args!("{}: {lost}", args.output.display()));
    }
    sphere::warn_of_short_numbers(&args.output, format, mapped, processing, console)?;
    Ok(WrittenSphere {
        unused_vertices,
        written_as_triangles,
        sphericity_error,
    })
}
