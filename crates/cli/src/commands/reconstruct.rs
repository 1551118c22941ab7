//! `cotan reconstruct`: rebuilds a shape from its two scalar fields.

use crate::args::ReconstructArgs;
use crate::commands::deform::{AtLimit, Job, Loose};
use crate::console::Console;
use crate::error::CliError;
use crate::threads;

pub(crate) fn run(args: &ReconstructArgs, console: &Console) -> Result<(), CliError> {
    let options = args.options();
    let at_limit = if options.tolerance > 0.0 {
        AtLimit::Warn
    } else {
        AtLimit::Expected
    };
    let job = Job {
        input: &args.input,
        run: &args.run,
        options,
        soft: None,
        at_limit,
        loose: Loose::Refuse,
    };
    let report = threads::with_threads(args.run.threads, || job.run(console))??;
    console.note(&report.table());
    Ok(())
}
