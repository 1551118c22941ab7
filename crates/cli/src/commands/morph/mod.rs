//! `cotan morph`: a shape between two, via the sphere that both are mapped to.

pub(crate) mod args;

use cotan::sphere::{Morph, SphereMap, SphereOptions};
use cotan_io::Document;

use crate::console::Console;
use crate::error::CliError;
use crate::pipeline::{self, Context, Finished, Job, Output, Plan};
use crate::prepare::{Prepared, Source};
use crate::report::MeshCounts;
use crate::sphere::{self, Common, Mapped, Mapper, Turn};

use args::{Align, MorphArgs};

pub(crate) fn run(args: &MorphArgs, console: &Console) -> Result<(), CliError> {
    let job = MorphJob {
        args,
        options: args.map.options(),
    };
    pipeline::execute(&job, console)
}

struct MorphJob<'a> {
    args: &'a MorphArgs,
    options: SphereOptions,
}

impl Job for MorphJob<'_> {
    type Meshes = [Prepared; 2];
    type Report = MeshCounts;
    type Rest = ();

    fn plan(&self) -> Plan<'_, [Source; 2]> {
        let args = self.args;
        Plan {
            sources: [&args.start, &args.end].map(|path| args.mending.source(path)),
            output: &args.output,
            embed: args.embed,
            threads: args.threads,
            report: None,
            iterations: Some(self.options.iteration_limit),
        }
    }

    fn run(
        &self,
        meshes: &mut [Prepared; 2],
        context: &Context<'_>,
    ) -> Result<Finished<MeshCounts, ()>, CliError> {
        let args = self.args;
        let mapped = [
            self.map(&meshes[0], context)?,
            self.map(&meshes[1], context)?,
        ];
        context.progress.phase("align");
        let end = self.aligned(meshes, &mapped)?;
        let [a, b] = &mapped;
        let of_file = [a, b].map(|mapped| mapped.in_file(&mapped.positions));
        let shapes = ((&a.map, &of_file[0]), (&end, &of_file[1]));
        let morph = match args.level {
            Some(level) => Morph::on_icosphere(shapes.0, shapes.1, level),
            None => Morph::on_first(shapes.0, shapes.1),
        };
        let start = &mut meshes[0];
        let morph = morph.map_err(|error| sphere::refuse(start, error))?;
        let shape = morph.shape_at(args.time);
        let mesh = match args.level {
            Some(_) => Output::New(Document::from_mesh(
                shape.connectivity(),
                shape.positions(),
            )?),
            None => {
                start.set_positions(shape.positions())?;
                Output::InPlace
            }
        };
        let written = match &mesh {
            Output::New(document) => document,
            Output::InPlace => &start.document,
        };
        Ok(Finished {
            report: MeshCounts::new(&args.output, written),
            mesh,
            rest: (),
        })
    }
}

impl MorphJob<'_> {
    fn map(&self, mesh: &Prepared, context: &Context<'_>) -> Result<Mapped<f64>, CliError> {
        let mapper = Mapper {
            mesh,
            options: &self.options,
            turn: Turn::None,
        };
        let mapped = mapper.run::<f64>(&context.progress)?;
        sphere::warn(&mapped.report, &self.options, context.console);
        Ok(mapped)
    }

    /// The sphere of B, rotated to fit that of A.
    fn aligned(
        &self,
        meshes: &[Prepared; 2],
        mapped: &[Mapped<f64>; 2],
    ) -> Result<SphereMap<f64>, CliError> {
        let common = match (&self.args.landmarks, self.args.align) {
            (Some(path), _) => Common::Landmarks(path),
            (None, Align::Pose) => Common::Pose,
            (None, Align::Areas) => Common::Areas,
            (None, Align::None) => return Ok(mapped[1].map.clone()),
        };
        sphere::aligned(meshes.each_ref(), mapped.each_ref(), common)
    }
}
