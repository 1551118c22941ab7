//! The filter of `smooth --size`.

use cotan::geometry::Surface;
use cotan::smooth::{BumpSize, BySizeOptions, SmoothBySize};
use cotan_tool::Work;

use super::job::{Filter, Filtered};
use super::report::SmoothReport;
use crate::args::PartArgs;
use crate::error::CliError;
use crate::part;
use crate::pipeline::Context;
use crate::prepare::Prepared;

/// Smoothing by size with its settings.
pub(super) struct BySize<'a> {
    pub(super) size: BumpSize,
    pub(super) options: BySizeOptions,
    pub(super) part: &'a PartArgs,
}

impl Filter for BySize<'_> {
    fn run(&self, mesh: &Prepared, _: &Context<'_>) -> Result<Filtered, CliError> {
        let max_memory = mesh.check_memory(Work::Smooth)?;
        let options = self.options.max_memory(Some(max_memory));
        let handles = part::handles(self.part, mesh)?;
        let mask = part::mask(self.part, mesh)?;
        let processing = &mesh.processing;
        let surface = Surface::assume_checked(processing.mesh(), processing.positions());
        let smoothed = SmoothBySize::new(surface, &handles, &options).and_then(|mut job| {
            job.set_mask(mask)?;
            job.smooth(&self.size)
        });
        let smoothed = smoothed.map_err(|error| mesh.refuse(error))?;
        let longest = surface.bounding_box().longest_side();
        Ok(Filtered {
            report: SmoothReport {
                method: "size",
                size: match self.size {
                    BumpSize::Share(share) => Some(share * longest),
                    BumpSize::Length(length) => Some(length),
                    BumpSize::PerVertex(_) => None,
                },
                iterations: smoothed.solves,
                kept_vertices: smoothed.kept_vertices,
                ..SmoothReport::default()
            },
            positions: smoothed.positions,
        })
    }
}
