//! The files of this run, found in the command line by their types.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock};

use clap::{Arg, ArgMatches, Command};
use cotan_io::{Folder, Resolve, check_replaceable, num_names};
use cotan_tool::paths::{Conflict, Paths};

use crate::args::{InputPath, OutputPath};
use crate::console::Console;
use crate::error::CliError;

/// Finds all files that the command line names, and refuses an output that is an input or another
/// output, or that cannot be written. Nothing was read yet.
///
/// # Errors
/// [`CliError::Conflict`]; [`CliError::Tool`] for an output that cannot be written.
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

/// Refuses a file that a command reads without its being named on the command line.
///
/// # Errors
/// [`CliError::Conflict`] if it is an output.
pub(crate) fn check_read(name: &str, path: &Path) -> Result<(), CliError> {
    let checked = NAMED.get().map(|paths| paths.check_read(name, path));
    Ok(checked.transpose().map(drop)?)
}

/// The files that the command line names, for those that are found later.
static NAMED: OnceLock<Paths> = OnceLock::new();

fn named(command: &Command, matches: &ArgMatches) -> Paths {
    let mut paths = Paths::default();
    let Some((name, matches)) = matches.subcommand() else {
        return paths;
    };
    let command = command.find_subcommand(name);
    for id in matches.ids() {
        let name = || name_of(command, id.as_str());
        // Arguments of other types, and groups, are errors here.
        if let Ok(Some(inputs)) = matches.try_get_many::<InputPath>(id.as_str()) {
            inputs.for_each(|path| paths.read(name(), path.to_path_buf()));
        }
        if let Ok(Some(outputs)) = matches.try_get_many::<OutputPath>(id.as_str()) {
            outputs.for_each(|path| paths.write(name(), path.to_path_buf()));
        }
    }
    paths
}

/// The argument as a person writes it: `--report`, `MESH`.
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

/// The folder of a mesh, which remembers what was found in it.
#[derive(Debug)]
pub(crate) struct Companions {
    folder: Folder,
    root: PathBuf,
    found: Mutex<Vec<String>>,
}

impl Companions {
    /// Of the mesh at `path`.
    pub(crate) fn of(path: &Path) -> Self {
        Self {
            folder: Folder::of(path),
            root: cotan_tool::files::folder_of(path).to_owned(),
            found: Mutex::default(),
        }
    }

    /// Refuses a mesh one of whose further files is an output.
    ///
    /// # Errors
    /// [`CliError::Conflict`] with the file.
    pub(crate) fn check(&self) -> Result<(), CliError> {
        let found = self.found.lock().unwrap_or_else(|e| e.into_inner());
        let check =
            |uri: &String| check_read("a file that the mesh refers to,", &self.root.join(uri));
        found.iter().try_for_each(check)
    }
}

impl Resolve for Companions {
    fn resolve(&self, uri: &str, max_bytes: u64) -> Result<Vec<u8>, std::io::Error> {
        let bytes = self.folder.resolve(uri, max_bytes)?;
        let mut found = self.found.lock().unwrap_or_else(|e| e.into_inner());
        found.push(uri.to_owned());
        Ok(bytes)
    }
}

impl From<Conflict> for CliError {
    fn from(conflict: Conflict) -> Self {
        Self::Conflict(Box::new(conflict))
    }
}
