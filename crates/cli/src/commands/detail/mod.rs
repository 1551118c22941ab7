//! `cotan detail`: edits the mean curvature of a mesh, or adds the details of another.

pub(crate) mod args;
mod map_file;
mod transfer;

use std::ops::ControlFlow;

use cotan::geometry::Surface;
use cotan::halfedge::VertexMap;
use cotan::smooth::{
    Blend, CurvatureEdit, ScaledCurvature, TargetCurvature, TransferredCurvature,
    edit_detail_masked, edit_detail_observed,
};
use cotan_tool::Work;

use crate::commands::smooth::{Filter, FilterJob, Filtered, SmoothReport};
use crate::console::Console;
use crate::error::CliError;
use crate::part;
use crate::pipeline::{self, Context};
use crate::prepare::Prepared;
use crate::same_faces::other_positions;
use crate::vertex_field::vertex_field;

use args::DetailArgs;
use transfer::Transfer;

pub(crate) fn run(args: &DetailArgs, console: &Console) -> Result<(), CliError> {
    let (mesh, keep) = (&args.mesh, &args.keep);
    match (&args.map, &args.from) {
        (Some(map), Some(source)) => {
            let filter = Transfer { args, map, source };
            pipeline::execute(&FilterJob { mesh, keep, filter }, console)
        }
        _ => {
            let filter = args;
            pipeline::execute(&FilterJob { mesh, keep, filter }, console)
        }
    }
}

impl Filter for &DetailArgs {
    fn run(&self, mesh: &Prepared, context: &Context<'_>) -> Result<Filtered, CliError> {
        let options = self
            .options()
            .max_memory(Some(mesh.check_memory(Work::Smooth)?));
        let processing = &mesh.processing;
        let surface = Surface::new(processing.mesh(), processing.positions())
            .map_err(|e| mesh.refuse(e.into()))?;
        let scale = self.scale.unwrap_or(1.0);
        let edit: Box<dyn CurvatureEdit> = match (&self.from, &self.field) {
            (Some(other), _) => {
                let positions = other_positions(mesh, other, context.console);
                let positions = positions.map_err(with_map)?;
                Box::new(Blend {
                    mask: VertexMap::filled(processing.mesh().num_vertices(), scale),
                    off: ScaledCurvature::by(1.0),
                    on: TransferredCurvature::from(&surface.with_positions(&positions)),
                })
            }
            (_, Some(name)) => Box::new(TargetCurvature::new(&surface, &vertex_field(mesh, name)?)),
            _ => Box::new(ScaledCurvature::by(scale)),
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

/// Adds to an error about other faces what they need.
fn with_map(error: CliError) -> CliError {
    match error {
        CliError::Compare { paths, problem } => CliError::Compare {
            paths,
            problem: format!("{problem}; for meshes with other faces give --map"),
        },
        other => other,
    }
}
