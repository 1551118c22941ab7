//! `cotan resample`: remeshes a closed shape with the even triangles of an icosphere.

pub(crate) mod args;

use std::marker::PhantomData;

use cotan::geometry::Scalar;
use cotan::sphere::{SphereOptions, SphereReport};
use cotan_io::Document;

use crate::args::{EmbedArgs, Precision};
use crate::console::Console;
use crate::error::CliError;
use crate::pipeline::{self, Context, Finished, Job, Output, Plan};
use crate::prepare::{Prepared, Source};
use crate::sphere::{self, MapReport, Mapper, Resampled};

use args::ResampleArgs;

pub(crate) fn run(args: &ResampleArgs, console: &Console) -> Result<(), CliError> {
    match args.run.precision {
        Precision::F64 => pipeline::execute(&ResampleJob::<f64>::new(args), console),
        Precision::F32 => pipeline::execute(&ResampleJob::<f32>::new(args), console),
    }
}

/// The resampling of a mesh file in the number type `T`.
struct ResampleJob<'a, T> {
    args: &'a ResampleArgs,
    options: SphereOptions,
    number: PhantomData<T>,
}

impl<'a, T: Scalar> ResampleJob<'a, T> {
    fn new(args: &'a ResampleArgs) -> Self {
        Self {
            args,
            options: args.map.options(),
            number: PhantomData,
        }
    }
}

impl<T: Scalar> Job for ResampleJob<'_, T> {
    type Meshes = Prepared;
    type Report = MapReport;
    /// The library's report, for warnings.
    type Rest = SphereReport;

    fn plan(&self) -> Plan<'_, Source> {
        let input = &self.args.input;
        Plan {
            sources: input.mending.source(&input.mesh),
            output: &self.args.output,
            embed: EmbedArgs::default(),
            threads: self.args.run.threads,
            report: self.args.run.report.as_ref(),
            iterations: Some(self.options.iteration_limit),
        }
    }

    fn run(
        &self,
        mesh: &mut Prepared,
        context: &Context<'_>,
    ) -> Result<Finished<MapReport, SphereReport>, CliError> {
        let mapper = Mapper {
            mesh,
            options: &self.options,
            turn: self.args.turn.turn(),
        };
        let mapped = mapper.run::<T>(&context.progress)?;
        context.progress.phase("resample");
        let level = self.args.level;
        let shape = mapped.map.remesh(&mapped.positions, level);
        let shape = shape.map_err(|error| sphere::refuse(mesh, error))?;
        let positions = mapped.in_file(shape.positions());
        let mut report = MapReport::new(&mapped, &self.options, self.args.run.precision);
        report.resampled = Some(Resampled {
            level,
            vertices: shape.num_vertices(),
            faces: shape.num_faces(),
        });
        Ok(Finished {
            mesh: Output::New(Document::from_mesh(shape.connectivity(), &positions)?),
            report,
            rest: mapped.report,
        })
    }

    fn after_save(
        &self,
        _: &Prepared,
        finished: &mut Finished<MapReport, SphereReport>,
        context: &Context<'_>,
    ) -> Result<(), CliError> {
        sphere::warn(&finished.rest, &self.options, context.console);
        Ok(())
    }
}
