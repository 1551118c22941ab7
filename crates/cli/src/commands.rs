//! The commands, one file each.

mod bench;
mod compare;
mod completions;
mod convert;
mod deform;
mod demo;
mod edit;
mod info;
mod morph;
mod reconstruct;
mod repair;
mod resample;
mod smooth;
mod sphere;

use std::process::ExitCode;

use crate::args::Command;
use crate::console::Console;
use crate::error::CliError;

/// Runs a command and returns its exit code.
pub(crate) fn run(command: &Command, console: &Console) -> Result<ExitCode, CliError> {
    match command {
        Command::Demo(args) => demo::run(args, console),
        Command::Info(args) => info::run(args, console),
        Command::Edit(args) => return edit::run(args),
        Command::Repair(args) => repair::run(args, console),
        Command::Deform(args) => deform::run(args, console),
        Command::Reconstruct(args) => reconstruct::run(args, console),
        Command::Sphere(args) => sphere::run(args, console),
        Command::Resample(args) => resample::run(args, console),
        Command::Morph(args) => morph::run(args, console),
        Command::Smooth(args) => smooth::run_smooth(args, console),
        Command::Detail(args) => smooth::run_detail(args, console),
        Command::Compare(args) => compare::run(args, console),
        Command::Convert(args) => convert::run(args, console),
        Command::Bench(args) => bench::run(args, console),
        Command::Completions(args) => completions::run(args, console),
    }?;
    Ok(ExitCode::SUCCESS)
}
