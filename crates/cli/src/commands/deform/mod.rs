//! `cotan deform`: moves handles and lets the surface follow.

pub(crate) mod args;
mod edit;
mod job;
mod report;

use crate::console::Console;
use crate::error::CliError;
use crate::pipeline;

use args::DeformArgs;
pub(crate) use job::{AtLimit, DeformJob, Loose};

pub(crate) fn run(args: &DeformArgs, console: &Console) -> Result<(), CliError> {
    let job = DeformJob {
        input: &args.input,
        run: &args.run,
        options: args.options(),
        soft: args.soft,
        region: Some(&args.region),
        at_limit: AtLimit::Warn,
        loose: Loose::Follow(args.parts.settings()?),
    };
    pipeline::execute(&job, console)
}
