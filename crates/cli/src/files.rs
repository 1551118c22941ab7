//! Mesh files, read with their warnings told; writing is what all programs share.

use std::path::Path;

use cotan_io::{Document, Folder, load_with};
pub(crate) use cotan_tool::files::{check_mesh_path, check_writable, in_file, write};

use crate::console::Console;
use crate::error::CliError;
use crate::memory;

/// Reads a mesh file, and warns of what is odd about it; the buffers of a glTF may lie in the
/// file's own folder.
pub(crate) fn load(path: &Path, console: &Console) -> Result<Document, CliError> {
    let document = load_with(path, memory::limits(), &Folder::of(path))?;
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

/// How many oddities of a file are told.
const MOST_WARNINGS: usize = 10;
