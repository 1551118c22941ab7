//! `cotan subdivide`: every face cut into smaller ones.

pub(crate) mod args;

use cotan::geometry::Mesh;
use cotan::halfedge::HalfedgeMesh;
use cotan::surface::{Subdivided, SubdivisionScheme, subdivide};
use cotan_tool::Work;

use crate::args::MeshArgs;
use crate::error::CliError;
use crate::pipeline::Context;
use crate::prepare::Prepared;
use crate::tessellation::args::OutcomeArgs;
use crate::tessellation::{self, Base, Tessellate, Tessellated, TessellationReport};

use args::SubdivideArgs;

impl Tessellate for SubdivideArgs {
    fn args(&self) -> (&MeshArgs, &OutcomeArgs) {
        (&self.mesh, &self.outcome)
    }

    fn tessellate(&self, mesh: &Prepared, context: &Context<'_>) -> Result<Tessellated, CliError> {
        let memory = mesh.check_memory(Work::Smooth)?;
        context.progress.phase("subdivide");
        let base = match self.scheme() {
            SubdivisionScheme::Loop => Base::triangles(mesh),
            _ => Base::polygons(mesh)?,
        };
        let refuse = |error| tessellation::refuse(mesh.path(), error);
        let options = self.options(&base).max_memory(Some(memory));
        let made = subdivide(&base.mesh, &base.positions, &options).map_err(refuse)?;
        let derived = base.subdivided(&mesh.document, &made);
        let derived = derived.map_err(|e| mesh.in_file(e))?;
        let triangles = triangulated(&made).map_err(|error| mesh.refuse(error.into()))?;
        let report = TessellationReport::measure(
            [&base.mesh, &made.connectivity],
            [&mesh.processing.surface(), &triangles.surface()],
            &derived.losses,
        );
        Ok(Tessellated {
            document: derived.document,
            report,
            triangles,
        })
    }
}

/// The result as triangles, for measurements and the picture.
fn triangulated(made: &Subdivided<f64>) -> Result<Mesh<f64>, cotan::MeshError> {
    let positions: Vec<[f64; 3]> = made.positions.values().map(|p| (*p).into()).collect();
    Mesh::from_faces(&positions, &HalfedgeMesh::to_faces(&made.connectivity))
}
