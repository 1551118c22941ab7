//! The files of this run, found in the command line by their types.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use clap::{Arg, ArgMatches, Command};
use cotan_io::{Document, check_replaceable, num_names};
use cotan_tool::paths::{Conflict, Paths};

use crate::args::{InputPath, OutputPath};
use crate::console::Console;
use crate::error::CliError;

/// Checks all files that the command line names, before anything is read.
///
/// # Errors
/// [`CliError::Conflict`] for an output that is also an input or another output;
/// [`CliError::Tool`] for an output that cannot be written.
pub(crate) fn check(
    command: &Command,
    matches: &ArgMatches,
    console: &Console,
) -> Result<(), CliError> {
    let paths = named(command, matches);
    paths.check()?;
    paths.check_writable()?;
    for output in paths.outputs() {
        warn_of_other_names(&output.path, console);
    }
    // Set once, by `main`.
    let _ = NAMED.set(paths);
    Ok(())
}

/// Refuses an input that is not named on the command line if it is an output.
///
/// # Errors
/// [`CliError::Conflict`] if it is an output.
pub(crate) fn check_read(name: &str, path: &Path) -> Result<(), CliError> {
    let checked = NAMED.get().map(|paths| paths.check_read(name, path));
    Ok(checked.transpose().map(drop)?)
}

/// The files that the command line names, to be checked against files found later.
static NAMED: OnceLock<Paths> = OnceLock::new();

fn named(command: &Command, matches: &ArgMatches) -> Paths {
    let mut paths = Paths::default();
    let Some((name, matches)) = matches.subcommand() else {
        return paths;
    };
    let command = command.find_subcommand(name);
    for id in matches.ids() {
        let name = || name_of(command, id.as_str());
        // Arguments of other types, and groups, give errors here.
        if let Ok(Some(inputs)) = matches.try_get_many::<InputPath>(id.as_str()) {
            inputs.for_each(|path| paths.read(name(), path.to_path_buf()));
        }
        if let Ok(Some(outputs)) = matches.try_get_many::<OutputPath>(id.as_str()) {
            outputs.for_each(|path| paths.write(name(), path.to_path_buf()));
        }
    }
    paths
}

/// The argument in the notation of the command line: `--report`, `MESH`.
fn name_of(command: Option<&Command>, id: &str) -> String {
    let is_it = |argument: &&Arg| argument.get_id() == id;
    let argument = command.and_then(|command| command.get_arguments().find(is_it));
    let value = argument.and_then(|argument| argument.get_value_names()?.first());
    match argument.and_then(Arg::get_long) {
        Some(long) => format!("--{long}"),
        None => value.map_or_else(|| id.to_uppercase(), ToString::to_string),
    }
}

fn warn_of_other_names(path: &Path, console: &Console) {
    let Ok(Some(metadata)) = check_replaceable(path) else {
        return;
    };
    let names = num_names(&metadata);
    if names > 1 {
        console.warn(format_args!(
            "{}: the file has {names} names (hard links); the others keep the old content",
            path.display()
        ));
    }
}

/// Refuses a mesh if one of its further files (buffers, material libraries, images) is an output.
///
/// # Errors
/// [`CliError::Conflict`] with the file; [`CliError::Io`] if the files cannot be determined.
pub(crate) fn check_companions(document: &Document, path: &Path) -> Result<(), CliError> {
    let companions = document
        .companions()
        .map_err(|source| cotan_tool::files::in_file(path, source))?;
    let folder = cotan_tool::files::folder_of(path);
    let paths = companions.iter().map(|companion| folder.join(companion));
    // A missing file is not read.
    let mut paths = paths.filter(|path| path.exists());
    paths.try_for_each(|path| check_read("a file that the mesh refers to,", &path))
}

/// Fails if another output would overwrite one of the files that were copied next to a mesh.
///
/// # Errors
/// [`CliError::Conflict`] with the file.
pub(crate) fn check_copied(copied: &[PathBuf]) -> Result<(), CliError> {
    let Some(paths) = NAMED.get() else {
        return Ok(());
    };
    let check = |path: &PathBuf| paths.check_written("a file next to the mesh,", path);
    Ok(copied.iter().try_for_each(check)?)
}

impl From<Conflict> for CliError {
    fn from(conflict: Conflict) -> Self {
        Self::Conflict(Box::new(conflict))
    }
}
