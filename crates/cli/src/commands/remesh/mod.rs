//! `cotan remesh`: triangles of even size and shape.

pub(crate) mod args;

use cotan::surface::{corner_places, remesh};
use cotan_tool::Work;

use crate::args::MeshArgs;
use crate::error::CliError;
use crate::pipeline::Context;
use crate::prepare::Prepared;
use crate::tessellation::args::OutcomeArgs;
use crate::tessellation::{self, Base, Tessellate, Tessellated, TessellationReport};

use args::RemeshArgs;

impl Tessellate for RemeshArgs {
    fn args(&self) -> (&MeshArgs, &OutcomeArgs) {
        (&self.mesh, &self.outcome)
    }

    fn tessellate(&self, mesh: &Prepared, context: &Context<'_>) -> Result<Tessellated, CliError> {
        let memory = mesh.check_memory(Work::Smooth)?;
        context.progress.phase("remesh");
        let base = Base::triangles(mesh);
        let seams = base.seams(&mesh.document).map_err(|e| mesh.in_file(e))?;
        let surface = mesh.processing.surface();
        let mean = surface.mean_edge_length();
        let options = self.options(mean, seams).max_memory(Some(memory));
        let refuse = |error| tessellation::refuse(mesh.path(), error);
        let made = remesh(&surface, &options).map_err(refuse)?;
        let corners = corner_places(&surface, &made.mesh, &made.places).map_err(refuse)?;
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
