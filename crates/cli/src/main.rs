//! The command `cotan`: arguments to a command, its outcome to an exit code.

mod args;
mod bench;
mod commands;
mod console;
mod edit;
mod error;
mod files;
mod inspect;
mod memory;
mod picture;
mod prepare;
mod report;
mod sphere;
mod threads;

use std::process::ExitCode;

use clap::Parser;

use args::Arguments;
use console::Console;

fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(usage) => {
            // Help goes to standard output with 0, a usage error to standard error with 2. If the
            // stream is gone, there is no one left to tell.
            let _ = usage.print();
            return ExitCode::from(u8::try_from(usage.exit_code()).unwrap_or(2));
        }
    };
    let console = Console::new(&arguments.messages);
    let run = || {
        memory::set(&arguments.limits);
        commands::run(&arguments.command, &console)
    };
    match threads::within_pool(run).flatten() {
        Ok(code) => code,
        Err(error) => {
            console::print_error(&error);
            ExitCode::from(1)
        }
    }
}
