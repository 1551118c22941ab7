//! `cotan detail`: edits the mean curvature of a mesh.

pub(crate) mod args;

use std::ops::ControlFlow;

use cotan::geometry::Surface;
use cotan::smooth::{
    CurvatureEdit, ScaledCurvature, TargetCurvature, TransferredCurvature, edit_detail_masked,
    edit_detail_observed,
};
use cotan_tool::Work;

use crate::commands::smooth::{Filter, FilterJob, Filtered, SmoothReport};
use crate::console::Console;
use crate::error::CliError;
use crate::part;
use crate::pipeline;
use crate::prepare::Prepared;
use crate::same_faces::other_positions;
use crate::vertex_field::vertex_field;

use args::DetailArgs;

pub(crate) fn run(args: &DetailArgs, console: &Console) -> Result<(), CliError> {
    let job = FilterJob {
        mesh: &args.mesh,
        keep: &args.keep,
        filter: args,
    };
    pipeline::execute(&job, console)
}

impl Filter for &DetailArgs {
    fn run(&self, mesh: &Prepared, console: &Console) -> Result<Filtered, CliError> {
        let options = self
            .options()
            .max_memory(Some(mesh.check_memory(Work::Smooth)?));
        let processing = &mesh.processing;
        let surface = Surface::new(processing.mesh(), processing.positions())
            .map_err(|e| mesh.refuse(e.into()))?;
        let edit: Box<dyn CurvatureEdit> = match (&self.from, &self.field) {
            (Some(other), _) => {
                let positions = other_positions(mesh, other, console)?;
                Box::new(TransferredCurvature::from(
                    &surface.with_positions(&positions),
                ))
            }
            (_, Some(name)) => Box::new(TargetCurvature::new(&surface, &vertex_field(mesh, name)?)),
            _ => Box::new(ScaledCurvature::by(self.scale.unwrap_or(1.0))),
        };
        let observer = |_| ControlFlow::Continue(());
        let handles = part::handles(&self.part, mesh)?;
        let edited = match part::mask(&self.part, mesh)? {
            Some(mask) => edit_detail_masked(surface, &handles, &mask, &edit, &options, &observer),
            None => edit_detail_observed(surface, &handles, &edit, &options, &observer),
        };
        let edited = edited.map_err(|error| mesh.refuse(error))?;
        Ok(Filtered {
            positions: edited.positions,
            report: SmoothReport {
                method: "detail",
                iterations: options.iterations,
                anchor: Some(options.anchor),
                kept_vertices: edited.kept_vertices,
                ..SmoothReport::default()
            },
        })
    }
}
