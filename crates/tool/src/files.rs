//! Files that are written whole or not at all.

use std::io::Write;
use std::path::Path;

use cotan_io::{Format, IoError};

use crate::error::ToolError;

/// Writes `bytes` to `path` in one step: a reader sees the old file or the new one. Devices and
/// pipes are written to as they are.
///
/// # Errors
/// [`ToolError::Write`]; an older file is whole then.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), ToolError> {
    replace(path, bytes).map_err(|source| ToolError::Write {
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
    cotan_io::replace_file(path, bytes)
}

/// Refuses a path to write to before the work is done rather than after it.
///
/// # Errors
/// [`ToolError::Write`] for a folder, [`ToolError::NoFolder`] for a file in none.
pub fn check_writable(path: &Path) -> Result<(), ToolError> {
    if path.is_dir() {
        return Err(ToolError::Write {
            path: path.to_owned(),
            source: std::io::ErrorKind::IsADirectory.into(),
        });
    }
    let folder = folder_of(path);
    if folder.is_dir() {
        return Ok(());
    }
    Err(ToolError::NoFolder {
        path: path.to_owned(),
        folder: folder.to_owned(),
    })
}

/// As [`check_writable`], for a mesh: its extension must name a format, which is returned.
///
/// # Errors
/// As [`check_writable`]; [`IoError::UnknownFormat`] for another extension.
pub fn check_mesh_path(path: &Path) -> Result<Format, ToolError> {
    check_writable(path)?;
    Ok(Format::from_path(path).ok_or_else(|| in_file(path, IoError::UnknownFormat))?)
}

/// An error of a mesh file with the file's name.
pub fn in_file(path: &Path, source: IoError) -> IoError {
    match source {
        named @ IoError::InFile { .. } => named,
        source => IoError::InFile {
            path: path.to_owned(),
            source: Box::new(source),
        },
    }
}

/// The folder that a file lies in; `.` for a bare name.
pub fn folder_of(path: &Path) -> &Path {
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
            Err(ToolError::NoFolder { .. })
        ));
        assert!(matches!(
            check_writable(folder.path()),
            Err(ToolError::Write { .. })
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
