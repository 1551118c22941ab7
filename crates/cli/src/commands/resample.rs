//! `cotan resample`: remeshes a closed shape with the even triangles of an icosphere.

use std::time::Instant;

use cotan::geometry::Scalar;
use cotan_io::Document;

use crate::args::{EmbedArgs, Precision, ResampleArgs};
use crate::console::Console;
use crate::error::CliError;
use crate::files;
use crate::prepare;
use crate::report::{Seconds, write_json};
use crate::sphere::{self, Input, Mapper, Phases, Resampled, SphereRun};
use crate::threads;

pub(crate) fn run(args: &ResampleArgs, console: &Console) -> Result<(), CliError> {
    let job = || match args.run.precision {
        Precision::F64 => run_as::<f64>(args, console),
        Precision::F32 => run_as::<f32>(args, console),
    };
    let report = threads::with_threads(args.run.threads, job)??;
    console.note(&report.table());
    Ok(())
}

fn run_as<T: Scalar>(args: &ResampleArgs, console: &Console) -> Result<SphereRun, CliError> {
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
    progress.phase("resample");
    let shape = mapped.map.remesh(&mapped.positions, args.level);
    let shape = shape.map_err(|error| input.refuse(error))?;
    drop(progress);

    let document = Document::from_mesh(shape.connectivity(), &mapped.in_file(shape.positions()))?;
    files::save(&document, &args.output, EmbedArgs::default(), console)?;
    sphere::warn(&mapped.report, &options, console);
    let mut report = SphereRun::new(&mapped, &options, args.run.precision);
    report.phases = Phases {
        load: seconds.load,
        build: seconds.build,
        map: mapped.seconds,
    };
    report.resampled = Some(Resampled {
        level: args.level,
        vertices: shape.num_vertices(),
        faces: shape.num_faces(),
    });
    report.seconds = clock.elapsed().as_secs_f64();
    if let Some(path) = &args.run.report {
        write_json(path, &report)?;
    }
    Ok(report)
}
