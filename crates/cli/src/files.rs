//! Files that are written whole or not at all.

use std::io::Write;
use std::path::Path;

use cotan_io::{Document, Folder, Format, IoError, Limits, load_with};

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

/// How many oddities of a file are told.
const MOST_WARNINGS: usize = 10;

/// Writes `bytes` to `path` in one step: a reader sees the old file or the new one.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    replace(path, bytes).map_err(|source| CliError::Write {
        path: path.to_owned(),
        source,
    })
}

fn replace(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    // Devices and pipes (`--report /dev/stdout`) cannot be replaced, only written to.
    if std::fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir()) {
        return std::fs::OpenOptions::new()
            .write(true)
            .open(path)?
            .write_all(bytes);
    }
    let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let mut builder = tempfile::Builder::new();
    builder.prefix(".cotan-");
    #[cfg(unix)]
    {
        // As any new file: what the process's mask leaves of read and write for all.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(folder_of(&target))?;
    file.write_all(bytes)?;
    file.persist(&target).map_err(|error| error.error)?;
    Ok(())
}

/// Refuses a path to write to before the work is done rather than after it.
pub(crate) fn check_writable(path: &Path) -> Result<(), CliError> {
    if path.is_dir() {
        return Err(CliError::Write {
            path: path.to_owned(),
            source: std::io::ErrorKind::IsADirectory.into(),
        });
    }
    let folder = folder_of(path);
    if folder.is_dir() {
        return Ok(());
    }
    Err(CliError::NoFolder {
        path: path.to_owned(),
        folder: folder.to_owned(),
    })
}

/// As [`check_writable`], for a mesh: its extension must name a format, which is returned.
pub(crate) fn check_mesh_path(path: &Path) -> Result<Format, CliError> {
    check_writable(path)?;
    Ok(Format::from_path(path).ok_or_else(|| in_file(path, IoError::UnknownFormat))?)
}

/// An error of a mesh file with the file's name.
pub(crate) fn in_file(path: &Path, source: IoError) -> IoError {
    match source {
        named @ IoError::InFile { .. } => named,
        source => IoError::InFile {
            path: path.to_owned(),
            source: Box::new(source),
        },
    }
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_and_nothing_is_left_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("report.json");
        write(&path, b"one").unwrap();
        write(&path, b"two").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"two");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn paths_that_cannot_work_are_refused_early() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("missing").join("mesh.obj");
        assert!(matches!(
            check_mesh_path(&missing),
            Err(CliError::NoFolder { .. })
        ));
        assert!(matches!(
            check_writable(folder.path()),
            Err(CliError::Write { .. })
        ));
        let unknown = folder.path().join("mesh.xyz");
        assert!(
            check_mesh_path(&unknown)
                .unwrap_err()
                .to_string()
                .contains(".obj")
        );
        assert_eq!(check_mesh_path(Path::new("mesh.ply")).unwrap(), Format::Ply);
    }
}
