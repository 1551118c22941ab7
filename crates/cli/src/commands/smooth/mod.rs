//! `cotan smooth`: filters the noise of a mesh.

pub(crate) mod args;
mod job;
mod report;

use cotan::Handles;
use cotan::geometry::Surface;
use cotan::smooth::{SmoothOptions, Smoothed, smooth};
use cotan_tool::Work;

use crate::console::Console;
use crate::error::CliError;
use crate::pipeline;
use crate::prepare::Prepared;

use args::SmoothArgs;
pub(crate) use job::{Filter, FilterJob, Filtered};
pub(crate) use report::SmoothReport;

pub(crate) fn run(args: &SmoothArgs, console: &Console) -> Result<(), CliError> {
    let job = FilterJob {
        mesh: &args.mesh,
        keep: &args.keep,
        filter: args.options(),
    };
    pipeline::execute(&job, console)
}

impl Filter for SmoothOptions {
    fn run(&self, mesh: &Prepared, _: &Console) -> Result<Filtered, CliError> {
        let options = self.max_memory(Some(mesh.check_memory(Work::Smooth)?));
        let processing = &mesh.processing;
        let surface = Surface::assume_checked(processing.mesh(), processing.positions());
        let smoothed = smooth(surface, &Handles::new(), &options);
        Ok(smoothed.map_err(|error| mesh.refuse(error))?.into())
    }
}

impl From<Smoothed<f64>> for Filtered {
    fn from(smoothed: Smoothed<f64>) -> Self {
        Self {
            report: SmoothReport {
                method: smoothed.method.name(),
                reason: smoothed.reason,
                iterations: smoothed.iterations,
                anchor: smoothed.anchor,
                kept_vertices: smoothed.kept_vertices,
                noise: smoothed.noise.map(|n| n.noise),
                ..SmoothReport::default()
            },
            positions: smoothed.positions,
        }
    }
}
