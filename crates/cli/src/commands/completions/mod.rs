//! `cotan completions`: prints a completion script for a shell.

pub(crate) mod args;

use clap::CommandFactory;

use crate::command_line::Arguments;
use crate::console::Console;
use crate::error::CliError;

use args::CompletionsArgs;

pub(crate) fn run(args: &CompletionsArgs, console: &Console) -> Result<(), CliError> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Arguments::command(), "cotan", &mut script);
    console.print_own(&String::from_utf8_lossy(&script))
}
