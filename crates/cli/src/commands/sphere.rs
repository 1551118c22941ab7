//! `cotan sphere`: a closed mesh onto the unit sphere, without a flipped triangle.

use std::time::Instant;

use cotan::geometry::Scalar;

use crate::args::{Precision, SphereArgs};
use crate::commands::repair::forgotten;
use crate::console::Console;
use crate::edit;
use crate::error::CliError;
use crate::files;
use crate::prepare;
use crate::report::{Seconds, json_text};
use crate::sphere::{self, Mapper, Phases, SphereRun};

pub(crate) fn run(args: &SphereArgs, console: &Console) -> Result<(), CliError> {
    let job = || match args.run.precision {
        Precision::F64 => run_as::<f64>(args, console),
        Precision::F32 => run_as::<f32>(args, console),
    };
    let report = edit::with_threads(args.run.threads, job)??;
    console.note(report.table());
    Ok(())
}

/// Reads, maps, writes; warns of what should be known.
fn run_as<T: Scalar>(args: &SphereArgs, console: &Console) -> Result<SphereRun, CliError> {
    let clock = Instant::now();
    let format = files::check_mesh_path(&args.output)?;
    for path in [&args.run.report, &args.picture].into_iter().flatten() {
        files::check_writable(path)?;
    }
    let options = args.map.options();
    let progress = console.progress(options.iteration_limit);
    progress.phase("load");
    let mut seconds = Seconds::default();
    let source = args.input.mending.source(&args.input.mesh);
    let prepared = prepare::prepare(&source, &mut seconds, console)?;
    let mapper = Mapper {
        source: &source,
        prepared: &prepared,
        options: &options,
    };
    let mapped = mapper.run::<T>(&progress)?;
    drop(progress);

    let mut document = prepared.document.clone();
    let in_file = |error| files::in_file(&args.input.mesh, error);
    document
        .set_positions(&prepared.processing, mapped.map.positions())
        .map_err(in_file)?;
    cotan_io::save(&document, &args.output)?;
    let losses = document.losses(format).into_iter();
    for lost in losses.chain(forgotten(format, &prepared.changes)) {
        console.warn(format_args!("{}: {lost}", args.output.display()));
    }
    sphere::warn_of_short_numbers(&args.output, format, &mapped, &prepared.processing, console)?;
    sphere::warn(&mapped.report, console);
    let mut report = SphereRun::new(&mapped, &options, args.run.precision);
    report.phases = Phases {
        load: seconds.load,
        build: seconds.build,
        map: mapped.seconds,
    };
    report.seconds = clock.elapsed().as_secs_f64();
    if let Some(path) = &args.run.report {
        files::write(path, json_text(&report)?.as_bytes())?;
    }
    if let Some(path) = &args.picture {
        files::write(path, &sphere::area_picture(&mapped))?;
    }
    Ok(report)
}
