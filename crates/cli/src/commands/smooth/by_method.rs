//! The filter of `denoise`, and of `smooth --method`.

use std::ops::ControlFlow;

use cotan::SchemeKind;
use cotan::geometry::Surface;
use cotan::smooth::{SmoothOptions, Smoothed, smooth_masked, smooth_observed};
use cotan_tool::Work;

use super::job::{Filter, Filtered};
use super::report::SmoothReport;
use crate::args::PartArgs;
use crate::error::CliError;
use crate::part;
use crate::pipeline::Context;
use crate::prepare::Prepared;

/// A smoothing method with its settings.
pub(crate) struct ByMethod<'a> {
    pub(crate) options: SmoothOptions,
    pub(crate) part: &'a PartArgs,
}

impl Filter for ByMethod<'_> {
    fn run(&self, mesh: &Prepared, context: &Context<'_>) -> Result<Filtered, CliError> {
        let max_memory = mesh.check_memory(Work::Smooth)?;
        let options = self.options.max_memory(Some(max_memory));
        let handles = part::handles(self.part, mesh)?;
        let processing = &mesh.processing;
        let surface = Surface::assume_checked(processing.mesh(), processing.positions());
        let observer = |_| ControlFlow::Continue(());
        let smoothed = match part::mask(self.part, mesh)? {
            Some(mask) => smooth_masked(surface, &handles, &mask, &options, &observer),
            None => smooth_observed(surface, &handles, &options, &observer),
        };
        let smoothed = smoothed.map_err(|error| mesh.refuse(error))?;
        if options.scheme != SchemeKind::default() && !smoothed.method.uses_scheme() {
            context.console.warn(format_args!(
                "--scheme is ignored by the method {}, which has weights of its own; anchored, \
                 paper and implicit use it",
                smoothed.method.name()
            ));
        }
        Ok(smoothed.into())
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
