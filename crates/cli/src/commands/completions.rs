//! `cotan completions`: prints a completion script for a shell.

use clap::CommandFactory;

use crate::args::{Arguments, CompletionsArgs};
use crate::console::Console;
use crate::error::CliError;

pub(crate) fn run(args: &CompletionsArgs, console: &Console) -> Result<(), CliError> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Arguments::command(), "cotan", &mut script);
    console.print_own(&String::from_utf8_lossy(&script))
}
