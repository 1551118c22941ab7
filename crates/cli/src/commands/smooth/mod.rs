//! `cotan smooth`: removes the bumps of a mesh that are smaller than a size.

pub(crate) mod args;
mod by_method;
mod by_size;
mod job;
mod report;

use crate::console::Console;
use crate::error::CliError;
use crate::pipeline;

use args::SmoothArgs;
pub(crate) use by_method::ByMethod;
use by_size::BySize;
pub(crate) use job::{Filter, FilterJob, Filtered};
pub(crate) use report::{SmoothReport, TransferReport};

pub(crate) fn run(args: &SmoothArgs, console: &Console) -> Result<(), CliError> {
    let (mesh, keep, part) = (&args.mesh, &args.keep, &args.part);
    match args.by_method() {
        Some(options) => {
            let filter = ByMethod { options, part };
            pipeline::execute(&FilterJob { mesh, keep, filter }, console)
        }
        None => {
            let filter = BySize {
                size: args.size(),
                options: args.by_size(),
                part,
            };
            pipeline::execute(&FilterJob { mesh, keep, filter }, console)
        }
    }
}
