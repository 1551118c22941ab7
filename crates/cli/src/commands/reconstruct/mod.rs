//! `cotan reconstruct`: rebuilds a shape from its two scalar fields.

pub(crate) mod args;

use crate::commands::deform::{AtLimit, DeformJob, Loose};
use crate::console::Console;
use crate::error::CliError;
use crate::pipeline;

use args::ReconstructArgs;

pub(crate) fn run(args: &ReconstructArgs, console: &Console) -> Result<(), CliError> {
    let options = args.options();
    let at_limit = if options.tolerance > 0.0 {
        AtLimit::Warn
    } else {
        AtLimit::Expected
    };
    let job = DeformJob {
        input: &args.input,
        run: &args.run,
        options,
        soft: None,
        region: None,
        at_limit,
        loose: Loose::Refuse,
    };
    pipeline::execute(&job, console)
}
