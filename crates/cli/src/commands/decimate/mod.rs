//! `cotan decimate`: fewer triangles.

pub(crate) mod args;

use cotan::surface::{Attributes, Features, corner_places, decimate, places_near};
use cotan_tool::Work;

use crate::args::OutputPath;
use crate::console::Console;
use crate::error::CliError;
use crate::pipeline::{self, Context, Finished, Job, Output, Plan};
use crate::prepare::{Prepared, Source};
use crate::tessellation::{self, Base, TessellationReport};

use args::DecimateArgs;

pub(crate) fn run(args: &DecimateArgs, console: &Console) -> Result<(), CliError> {
    pipeline::execute(&DecimateJob(args), console)
}

/// The decimation of a mesh file.
struct DecimateJob<'a>(&'a DecimateArgs);

impl Job for DecimateJob<'_> {
    type Meshes = Prepared;
    type Report = TessellationReport;
    /// The new mesh.
    type Rest = cotan::Mesh<f64>;

    fn plan(&self) -> Plan<'_, Source> {
        tessellation::plan(&self.0.mesh, &self.0.outcome)
    }

    fn run(
        &self,
        mesh: &mut Prepared,
        context: &Context<'_>,
    ) -> Result<Finished<TessellationReport, Self::Rest>, CliError> {
        mesh.check_memory(Work::Smooth)?;
        context.progress.phase("decimate");
        let base = Base::triangles(mesh);
        let seams = base.seams(&mesh.document).map_err(|e| mesh.in_file(e))?;
        let surface = mesh.processing.surface();
        let options = self.0.options(base.mesh.num_faces());
        let options = options.features(Features::none().with_edges(seams));
        let options = options.attributes(self.attributes(mesh, &base)?);
        let refuse = |error| tessellation::refuse(mesh.path(), error);
        let made = decimate(&surface, &options).map_err(refuse)?;
        let places = places_near(&surface, made.mesh.positions(), &made.sources).map_err(refuse)?;
        let corners = corner_places(&surface, &made.mesh, &places).map_err(refuse)?;
        let derived = base.derive(&mesh.document, &made.mesh, &corners);
        let derived = derived.map_err(|e| mesh.in_file(e))?;
        let report = TessellationReport::measure(
            [surface.mesh(), made.mesh.connectivity()],
            [&surface, &made.mesh.surface()],
            &derived.losses,
        );
        Ok(Finished {
            mesh: Output::New(derived.document),
            report,
            rest: made.mesh,
        })
    }

    fn after_save(
        &self,
        _: &Prepared,
        finished: &mut Finished<TessellationReport, Self::Rest>,
        context: &Context<'_>,
    ) -> Result<(), CliError> {
        finished.report.warn(&self.0.mesh.output, context.console);
        Ok(())
    }

    fn picture(
        &self,
        mesh: &Prepared,
        finished: &Finished<TessellationReport, Self::Rest>,
    ) -> Option<(&OutputPath, Vec<u8>)> {
        let path = self.0.outcome.picture.as_ref()?;
        let png = tessellation::picture(&mesh.processing.surface(), &finished.rest.surface());
        Some((path, png))
    }
}

impl DecimateJob<'_> {
    /// The properties of the file that count as a cost.
    fn attributes(&self, mesh: &Prepared, base: &Base) -> Result<Attributes, CliError> {
        let mut attributes = Attributes::new();
        for (name, option, weight) in self.0.weights() {
            let channels = base
                .corner_values(&mesh.document, name)
                .map_err(|e| mesh.in_file(e))?
                .ok_or_else(|| CliError::NoProperty {
                    path: mesh.path().to_owned(),
                    property: name,
                    option,
                })?;
            for values in channels {
                attributes = attributes.with_corners(values, weight);
            }
        }
        Ok(attributes)
    }
}
