//! The `cotan` command: parses the arguments, runs the command, and returns the exit code.

mod args;
mod command_line;
mod commands;
mod console;
mod error;
mod files;
mod losses;
mod memory;
mod part;
mod parts;
mod paths;
mod picture;
mod pipeline;
mod prepare;
mod report;
mod same_faces;
mod sphere;
mod tessellation;
mod text;
mod threads;
mod vertex_field;

use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches};

use command_line::Arguments;
use console::Console;

fn main() -> ExitCode {
    console::install_panic_hook();
    let mut command = Arguments::command();
    let parsed = command.try_get_matches_from_mut(command_line::joined(std::env::args_os()));
    let parsed = parsed.and_then(|matches| {
        let arguments = Arguments::from_arg_matches(&matches);
        Ok((arguments.map_err(|e| e.format(&mut command))?, matches))
    });
    let (arguments, matches) = match parsed {
        Ok(parsed) => parsed,
        Err(usage) => {
            // Help goes to standard output with exit code 0, a usage error to standard error with
            // 2.
            let code = u8::try_from(usage.exit_code()).unwrap_or(2);
            console::print_usage(usage);
            return ExitCode::from(code);
        }
    };
    let console = Console::new(&arguments.messages);
    if let Err(error) = cotan_tool::interrupt::remove_files_on_signals() {
        console.warn(format_args!(
            "a signal may leave a temporary file behind: {error}"
        ));
    }
    let run = || {
        memory::set(&arguments.limits);
        paths::check(&command, &matches, &console)?;
        commands::run(&arguments.command, &console)
    };
    match threads::within_pool(run).flatten() {
        Ok(code) => code,
        Err(error) => {
            console::print_error(&error);
            ExitCode::from(error.exit_code())
        }
    }
}
