//! `cotan decimate`: fewer triangles.

pub(crate) mod args;

use cotan::surface::{DecimateAttributes, Features, corner_places, decimate, places_near};
use cotan_tool::Work;

use crate::args::MeshArgs;
use crate::error::CliError;
use crate::pipeline::Context;
use crate::prepare::Prepared;
use crate::tessellation::args::OutcomeArgs;
use crate::tessellation::{self, Base, Tessellate, Tessellated, TessellationReport};

use args::DecimateArgs;

impl Tessellate for DecimateArgs {
    fn args(&self) -> (&MeshArgs, &OutcomeArgs) {
        (&self.mesh, &self.outcome)
    }

    fn tessellate(&self, mesh: &Prepared, context: &Context<'_>) -> Result<Tessellated, CliError> {
        mesh.check_memory(Work::Smooth)?;
        context.progress.phase("decimate");
        let base = Base::triangles(mesh);
        let seams = base.seams(&mesh.document).map_err(|e| mesh.in_file(e))?;
        let surface = mesh.processing.surface();
        let options = self.options(base.mesh.num_faces());
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
        Ok(Tessellated {
            document: derived.document,
            report,
            triangles: made.mesh,
        })
    }
}

impl DecimateArgs {
    /// The properties of the file that count as a cost.
    fn attributes(&self, mesh: &Prepared, base: &Base) -> Result<DecimateAttributes, CliError> {
        let mut attributes = DecimateAttributes::new();
        for (name, option, weight) in self.weights() {
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
