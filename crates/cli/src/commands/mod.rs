//! The commands, one folder each.
//!
//! The command line (`command_line`) has the arguments of every command, and this module runs the
//! one that was given: the two are one concept.

pub(crate) mod bench;
pub(crate) mod compare;
pub(crate) mod completions;
pub(crate) mod convert;
pub(crate) mod decimate;
pub(crate) mod deform;
pub(crate) mod demo;
pub(crate) mod denoise;
pub(crate) mod detail;
pub(crate) mod edit;
pub(crate) mod geodesic;
pub(crate) mod info;
pub(crate) mod merge;
pub(crate) mod morph;
pub(crate) mod reconstruct;
pub(crate) mod remesh;
pub(crate) mod repair;
pub(crate) mod resample;
pub(crate) mod smooth;
pub(crate) mod sphere;
pub(crate) mod subdivide;

use std::process::ExitCode;

use crate::command_line::Command;
use crate::console::Console;
use crate::error::CliError;
use crate::tessellation;

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
        Command::Merge(args) => merge::run(args, console),
        Command::Morph(args) => morph::run(args, console),
        Command::Smooth(args) => smooth::run(args, console),
        Command::Denoise(args) => denoise::run(args, console),
        Command::Detail(args) => detail::run(args, console),
        Command::Geodesic(args) => geodesic::run(args, console),
        Command::Remesh(args) => tessellation::run(args, console),
        Command::Decimate(args) => tessellation::run(args, console),
        Command::Subdivide(args) => tessellation::run(args, console),
        Command::Compare(args) => compare::run(args, console),
        Command::Convert(args) => convert::run(args, console),
        Command::Bench(args) => bench::run(args, console),
        Command::Completions(args) => completions::run(args, console),
    }?;
    Ok(ExitCode::SUCCESS)
}
