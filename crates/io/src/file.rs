//! Files: opened within limits, replaced in one step.

use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;

use crate::document::Document;
use crate::error::IoError;
use crate::format::Format;
use crate::limits::Limits;
use crate::{obj, off, ply};

/// Reads a document from bytes.
///
/// The content decides the format (`ply`, or a header word that ends in `OFF`); what announces
/// nothing is read as `hint`, or as OBJ if there is none.
///
/// # Errors
/// [`IoError`] naming the line or byte, the element and what is wrong with it. No input panics.
///
/// ```
/// use cotan_io::{Limits, read};
/// let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
/// let document = read(triangle.as_bytes(), None, &Limits::default())?;
/// assert_eq!((document.positions().len(), document.faces().len()), (3, 1));
/// # Ok::<(), cotan_io::IoError>(())
/// ```
pub fn read(
    bytes: impl Into<Vec<u8>>,
    hint: Option<Format>,
    limits: &Limits,
) -> Result<Document, IoError> {
    let bytes = bytes.into();
    limits.check_bytes(bytes.len() as u64)?;
    match Format::from_content(&bytes).or(hint).unwrap_or(Format::Obj) {
        Format::Obj => obj::read(bytes, limits),
        Format::Ply => ply::read(bytes, limits),
        Format::Off => off::read(bytes, limits),
    }
}

/// Reads a file within the default [`Limits`].
///
/// # Errors
/// [`IoError::InFile`] with the path and what is wrong.
pub fn load(path: impl AsRef<Path>) -> Result<Document, IoError> {
    load_within(path, &Limits::default())
}

/// Reads a file within `limits`. The content decides the format, then the extension.
///
/// Only this path is opened, never one that the file names.
///
/// # Errors
/// [`IoError::InFile`] with the path and what is wrong; [`IoError::UnknownFormat`] if neither
/// content nor extension tells the format.
pub fn load_within(path: impl AsRef<Path>, limits: &Limits) -> Result<Document, IoError> {
    let path = path.as_ref();
    let read = || {
        let bytes = read_bytes(path, limits)?;
        let format = Format::from_content(&bytes)
            .or_else(|| Format::from_path(path))
            .ok_or(IoError::UnknownFormat)?;
        self::read(bytes, Some(format), limits)
    };
    read().map_err(|source| in_file(path, source))
}

fn read_bytes(path: &Path, limits: &Limits) -> Result<Vec<u8>, IoError> {
    let file = File::open(path).map_err(IoError::Read)?;
    let size = file.metadata().map_err(IoError::Read)?.len();
    limits.check_bytes(size)?;
    // Room for what the file is said to hold now; the reading itself is bounded too, since a
    // device or a growing file can give more.
    let mut bytes = Vec::new();
    let room = usize::try_from(size).unwrap_or(usize::MAX);
    bytes
        .try_reserve_exact(room)
        .map_err(|_| IoError::OverLimit {
            what: "bytes (there is not enough memory)",
            limit: limits.max_bytes,
        })?;
    file.take(limits.max_bytes.saturating_add(1))
        .read_to_end(&mut bytes)
        .map_err(IoError::Read)?;
    limits.check_bytes(bytes.len() as u64)?;
    Ok(bytes)
}

/// Writes a document to a file, in the format of the path's extension.
///
/// See [`Document::write`] for what is kept. The new file is written beside the old one and takes
/// its place in one step, so that after a failure the old file is whole.
///
/// # Errors
/// [`IoError::InFile`] with the path and what is wrong; [`IoError::UnknownFormat`] if the
/// extension is not known.
pub fn save(document: &Document, path: impl AsRef<Path>) -> Result<(), IoError> {
    let path = path.as_ref();
    let write = || {
        let format = Format::from_path(path).ok_or(IoError::UnknownFormat)?;
        replace(path, &document.write(format)?).map_err(IoError::Write)
    };
    write().map_err(|source| in_file(path, source))
}

fn replace(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    // A link is followed, so that the file that it leads to is replaced and not the link.
    let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut file = tempfile::Builder::new()
        .prefix(".cotan-")
        .tempfile_in(folder)?;
    file.write_all(bytes)?;
    keep_permissions(&target, file.as_file())?;
    file.as_file().sync_all()?;
    file.persist(&target).map_err(|error| error.error)?;
    Ok(())
}

/// Gives the new file the permissions of the old one, or the usual ones: a temporary file is
/// readable by its owner alone.
fn keep_permissions(target: &Path, file: &File) -> std::io::Result<()> {
    match std::fs::metadata(target) {
        Ok(old) => file.set_permissions(old.permissions()),
        Err(_) => {
            #[cfg(unix)]
            {
                use std::os::unix::fs::PermissionsExt;
                file.set_permissions(std::fs::Permissions::from_mode(0o644))?;
            }
            Ok(())
        }
    }
}

fn in_file(path: &Path, source: IoError) -> IoError {
    IoError::InFile {
        path: path.to_owned(),
        source: Box::new(source),
    }
}
