//! Files that are written atomically.

use std::ffi::OsStr;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use cotan_io::{Access, Format, IoError, Unfinished, check_replaceable, link_target};

use crate::error::ToolError;

/// Writes `bytes` to `path` atomically: a reader sees either the old file or the new one.
///
/// The streams of the process are written to directly, see [`Stream`].
///
/// # Errors
/// [`ToolError::Write`]; an existing file is intact in that case.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), ToolError> {
    let written = match Stream::of(path) {
        Some(stream) => stream.write(bytes),
        None => cotan_io::replace_file(path, bytes),
    };
    written.map_err(|source| cannot_write(path, source))
}

/// An output that is not a file, as in `--report /dev/stdout`.
///
/// Only these names are accepted; a device or a pipe under another name is rejected, even behind
/// a link.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Stream {
    /// `/dev/stdout`.
    Output,
    /// `/dev/stderr`.
    Error,
    /// `/dev/null`.
    Null,
    /// `/dev/fd/N`, the name that shells give to a command's input.
    Descriptor(PathBuf),
}

impl Stream {
    /// The stream with this name; always `None` on systems other than Unix.
    pub fn of(path: &Path) -> Option<Self> {
        if !cfg!(unix) {
            return None;
        }
        Some(match path.to_str()? {
            "/dev/stdout" => Self::Output,
            "/dev/stderr" => Self::Error,
            "/dev/null" => Self::Null,
            name if name.starts_with("/dev/fd/") => Self::Descriptor(path.to_owned()),
            _ => return None,
        })
    }

    fn write(&self, bytes: &[u8]) -> std::io::Result<()> {
        match self {
            Self::Output => {
                let mut out = std::io::stdout().lock();
                out.write_all(bytes).and_then(|()| out.flush())
            }
            Self::Error => std::io::stderr().lock().write_all(bytes),
            Self::Null => Ok(()),
            Self::Descriptor(path) => {
                let file = std::fs::OpenOptions::new().append(true).open(path);
                file?.write_all(bytes)
            }
        }
    }
}

/// Rejects an output path that cannot be written, before the work is done rather than after it.
///
/// # Errors
/// [`ToolError::Write`] for anything but a regular file, a file without write permission, or a
/// folder in which nothing can be written; [`ToolError::NoFolder`] if the folder does not exist.
pub fn check_writable(path: &Path) -> Result<(), ToolError> {
    let failed = |source| cannot_write(path, source);
    if let Some(stream) = Stream::of(path) {
        return match stream {
            // Only open descriptors.
            Stream::Descriptor(path) => std::fs::metadata(path).map(drop).map_err(failed),
            _ => Ok(()),
        };
    }
    let target = link_target(path).map_err(failed)?;
    let folder = folder_of(&target);
    if !folder.is_dir() {
        return Err(ToolError::NoFolder {
            path: path.to_owned(),
            folder: folder.to_owned(),
        });
    }
    // `name/` denotes a folder that does not exist yet, and would become a file.
    if ends_in_separator(&target) || target.file_name().is_none() {
        return Err(failed(ErrorKind::IsADirectory.into()));
    }
    check_replaceable(&target).map_err(failed)?;
    // The output is first written to a file next to it. Only trying shows if that is possible.
    let probe = Unfinished::create(
        folder,
        OsStr::new(".cotan-"),
        OsStr::new(""),
        Access::Private,
    );
    probe.map(drop).map_err(failed)
}

fn ends_in_separator(path: &Path) -> bool {
    let last = path.as_os_str().as_encoded_bytes().last();
    last.is_some_and(|&byte| std::path::is_separator(char::from(byte)))
}

fn cannot_write(path: &Path, source: std::io::Error) -> ToolError {
    ToolError::Write {
        path: path.to_owned(),
        source,
    }
}

/// The mesh format for the extension of an output path.
///
/// # Errors
/// [`IoError::UnknownFormat`] for any other extension.
pub fn mesh_format(path: &Path) -> Result<Format, ToolError> {
    Ok(Format::from_path(path).ok_or_else(|| in_file(path, IoError::UnknownFormat))?)
}

/// Adds the file name to an error of a mesh file.
pub fn in_file(path: &Path, source: IoError) -> IoError {
    match source {
        named @ IoError::InFile { .. } => named,
        source => IoError::InFile {
            path: path.to_owned(),
            source: Box::new(source),
        },
    }
}

/// The folder that contains a file; `.` for a bare name.
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
    fn a_file_is_replaced_without_leaving_temporary_files() {
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
            check_writable(&missing),
            Err(ToolError::NoFolder { .. })
        ));
        assert!(matches!(
            check_writable(folder.path()),
            Err(ToolError::Write { .. })
        ));
        assert!(matches!(
            check_writable(&folder.path().join("new/")),
            Err(ToolError::Write { .. })
        ));
        let long = "n".repeat(300);
        assert!(check_writable(&folder.path().join(long)).is_err());
        check_writable(&folder.path().join("new")).unwrap();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        #[cfg(unix)]
        {
            let link = folder.path().join("device");
            std::os::unix::fs::symlink("/dev/null", &link).unwrap();
            check_writable(&link).unwrap_err();
            check_writable(Path::new("/dev/null")).unwrap();
            std::fs::remove_file(link).unwrap();
        }
        let unknown = folder.path().join("mesh.xyz");
        assert!(
            mesh_format(&unknown)
                .unwrap_err()
                .to_string()
                .contains(".obj")
        );
        assert_eq!(mesh_format(Path::new("mesh.ply")).unwrap(), Format::Ply);
    }
}
