//! Mesh files, read with their warnings told; writing is what all programs share.

use std::path::Path;

use cotan_io::{Document, Folder, Format, IoError, Limits, load_with, save_with};
pub(crate) use cotan_tool::files::{check_mesh_path, check_writable, in_file, write};

use crate::args::EmbedArgs;
use crate::console::Console;
use crate::error::CliError;

/// Reads a mesh file, and warns of what is odd about it; the buffers of a glTF may lie in the
/// file's own folder.
pub(crate) fn load(path: &Path, console: &Console) -> Result<Document, CliError> {
    let document = load_with(path, &Limits::default(), &Folder::of(path))?;
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

/// Writes a mesh file; tells which files were copied beside it, and warns of what it lacks.
pub(crate) fn save(
    document: &Document,
    path: &Path,
    embed: EmbedArgs,
    console: &Console,
) -> Result<(), CliError> {
    let format = Format::from_path(path).ok_or_else(|| in_file(path, IoError::UnknownFormat))?;
    let saved = save_with(document, path, embed.companions())?;
    for copied in &saved.copied {
        console.tell(format_args!(
            "{}: copied, since {} refers to it",
            copied.display(),
            path.display()
        ));
    }
    for warning in saved.left.iter().chain(&document.losses(format)) {
        console.warn(format_args!("{}: {warning}", path.display()));
    }
    Ok(())
}

/// How many oddities of a file are told.
const MOST_WARNINGS: usize = 10;
