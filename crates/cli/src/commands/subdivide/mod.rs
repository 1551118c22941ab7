//! `cotan subdivide`: every face cut into smaller ones.

pub(crate) mod args;

use cotan::geometry::Mesh;
use cotan::halfedge::HalfedgeMesh;
use cotan::surface::{Subdivided, SubdivisionScheme, subdivide};
use cotan_tool::Work;

use crate::args::OutputPath;
use crate::console::Console;
use crate::error::CliError;
use crate::pipeline::{self, Context, Finished, Job, Output, Plan};
use crate::prepare::{Prepared, Source};
use crate::tessellation::{self, Base, TessellationReport};

use args::SubdivideArgs;

pub(crate) fn run(args: &SubdivideArgs, console: &Console) -> Result<(), CliError> {
    pipeline::execute(&SubdivideJob(args), console)
}

/// The subdivision of a mesh file.
struct SubdivideJob<'a>(&'a SubdivideArgs);

impl Job for SubdivideJob<'_> {
    type Meshes = Prepared;
    type Report = TessellationReport;
    /// The new mesh, triangulated.
    type Rest = cotan::Mesh<f64>;

    fn plan(&self) -> Plan<'_, Source> {
        tessellation::plan(&self.0.mesh, &self.0.outcome)
    }

    fn run(
        &self,
        mesh: &mut Prepared,
        context: &Context<'_>,
    ) -> Result<Finished<TessellationReport, Self::Rest>, CliError> {
        let memory = mesh.check_memory(Work::Smooth)?;
        context.progress.phase("subdivide");
        let base = match self.0.scheme() {
            SubdivisionScheme::Loop => Base::triangles(mesh),
            _ => Base::polygons(mesh)?,
        };
        let refuse = |error| tessellation::refuse(mesh.path(), error);
        let options = self.0.options(&base).max_memory(Some(memory));
        let made = subdivide(&base.mesh, &base.positions, &options).map_err(refuse)?;
        let derived = base.subdivided(&mesh.document, &made);
        let derived = derived.map_err(|e| mesh.in_file(e))?;
        let triangles = triangulated(&made).map_err(|error| mesh.refuse(error.into()))?;
        let report = TessellationReport::measure(
            [&base.mesh, &made.connectivity],
            [&mesh.processing.surface(), &triangles.surface()],
            &derived.losses,
        );
        Ok(Finished {
            mesh: Output::New(derived.document),
            report,
            rest: triangles,
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

/// The result as triangles, for measurements and the picture.
fn triangulated(made: &Subdivided<f64>) -> Result<Mesh<f64>, cotan::MeshError> {
    let positions: Vec<[f64; 3]> = made.positions.values().map(|p| (*p).into()).collect();
    Mesh::from_faces(&positions, &HalfedgeMesh::to_faces(&made.connectivity))
}
