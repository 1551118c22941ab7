//! Mesh files, read with their warnings told, and outputs, which are [`OutputPath`]s.

use cotan_io::{Document, Format, Limits, load_with};
pub(crate) use cotan_tool::files::in_file;

use crate::args::{InputPath, OutputPath};
use crate::console::Console;
use crate::error::CliError;
use crate::paths::Companions;

/// Reads a mesh file, and warns of what is odd about it; the buffers of a glTF may lie in the
/// file's own folder.
pub(crate) fn load(path: &InputPath, console: &Console) -> Result<Document, CliError> {
    let companions = Companions::of(path);
    let document = load_with(path, &Limits::default(), &companions)?;
    companions.check()?;
    for warning in document.warnings().iter().take(MOST_WARNINGS) {
        console.warn(format_args!("{}: {warning}", path.display()));
    }
    if let Some(more) = document.warnings().len().checked_sub(MOST_WARNINGS)
        && more > 0
    {
        console.warn(format_args!("{}: {more} more warnings", path.display()));
    }
    Ok(document)
}

/// The format of a mesh to be written.
///
/// # Errors
/// [`cotan_io::IoError::UnknownFormat`] for an extension that names none.
pub(crate) fn mesh_format(path: &OutputPath) -> Result<Format, CliError> {
    Ok(cotan_tool::files::mesh_format(path)?)
}

/// Writes a mesh file in the format of its extension, in one step.
///
/// # Errors
/// [`CliError::Io`]; an older file is whole then.
pub(crate) fn save(document: &Document, path: &OutputPath) -> Result<(), CliError> {
    Ok(cotan_io::save(document, path)?)
}

/// Writes a report or a picture in one step.
///
/// # Errors
/// [`CliError::Tool`]; an older file is whole then.
pub(crate) fn write(path: &OutputPath, bytes: &[u8]) -> Result<(), CliError> {
    Ok(cotan_tool::files::write(path, bytes)?)
}

/// How many oddities of a file are told.
const MOST_WARNINGS: usize = 10;
