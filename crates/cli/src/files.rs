//! Reading mesh files with their warnings, and writing outputs, which are [`OutputPath`]s.

use cotan_io::{Document, Folder, Format, IoError, load_with, save_with};
pub(crate) use cotan_tool::files::in_file;

use crate::args::{EmbedArgs, InputPath, OutputPath};
use crate::console::Console;
use crate::error::CliError;
use crate::{memory, paths};

/// Reads a mesh file and prints its warnings.
///
/// The buffers of a glTF must be in the folder of the file.
pub(crate) fn load(path: &InputPath, console: &Console) -> Result<Document, CliError> {
    let document = read(path)?;
    warn(path, &document, console);
    Ok(document)
}

/// Reads a mesh file; the caller [prints its warnings](warn).
pub(crate) fn read(path: &InputPath) -> Result<Document, CliError> {
    let document = load_with(path, memory::limits(), &Folder::of(path))?;
    paths::check_companions(&document, path)?;
    Ok(document)
}

/// Prints the warnings of a mesh file.
pub(crate) fn warn(path: &InputPath, document: &Document, console: &Console) {
    for warning in document.warnings().iter().take(MAX_WARNINGS) {
        console.warn(format_args!("{}: {warning}", path.display()));
    }
    if let Some(more) = document.warnings().len().checked_sub(MAX_WARNINGS)
        && more > 0
    {
        console.warn(format_args!("{}: {more} more warnings", path.display()));
    }
}

/// The format of a mesh to be written.
///
/// # Errors
/// [`cotan_io::IoError::UnknownFormat`] for an unknown extension.
pub(crate) fn mesh_format(path: &OutputPath) -> Result<Format, CliError> {
    Ok(cotan_tool::files::mesh_format(path)?)
}

/// Writes a mesh file in one step, in the format of its extension.
///
/// Reports the files that were copied next to it, and warns about what the file lacks.
///
/// # Errors
/// [`CliError::Io`]; an existing file stays intact. [`CliError::Conflict`] if a copied file has
/// the name of another output, which is not written then.
pub(crate) fn save(
    document: &Document,
    path: &OutputPath,
    embed: EmbedArgs,
    console: &Console,
) -> Result<(), CliError> {
    let format = Format::from_path(path).ok_or_else(|| in_file(path, IoError::UnknownFormat))?;
    let saved = save_with(document, path, embed.companions())?;
    for copied in &saved.copied {
        console.inform(format_args!(
            "{}: copied, since {} refers to it",
            copied.display(),
            path.display()
        ));
    }
    paths::check_copied(&saved.copied)?;
    for warning in saved.left.iter().chain(&document.losses(format)) {
        console.warn(format_args!("{}: {warning}", path.display()));
    }
    Ok(())
}

/// Writes a report or a picture in one step.
///
/// # Errors
/// [`CliError::Tool`]; an existing file stays intact.
pub(crate) fn write(path: &OutputPath, bytes: &[u8]) -> Result<(), CliError> {
    Ok(cotan_tool::files::write(path, bytes)?)
}

/// The largest number of warnings printed for a file.
const MAX_WARNINGS: usize = 10;
