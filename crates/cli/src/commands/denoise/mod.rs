//! `cotan denoise`: removes the noise of a mesh, as much as is found.

pub(crate) mod args;

use crate::commands::smooth::{ByMethod, FilterJob};
use crate::console::Console;
use crate::error::CliError;
use crate::pipeline;

use args::DenoiseArgs;

pub(crate) fn run(args: &DenoiseArgs, console: &Console) -> Result<(), CliError> {
    let job = FilterJob {
        mesh: &args.mesh,
        keep: &args.keep,
        filter: ByMethod {
            options: args.options(),
            part: &args.part,
        },
    };
    pipeline::execute(&job, console)
}
