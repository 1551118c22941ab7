//! Files: opened within limits, replaced in one step.

use std::io::Read;
use std::path::Path;

use crate::document::Document;
use crate::error::IoError;
use crate::format::Format;
use crate::limits::Limits;
use crate::regular::open_regular;
use crate::replace::replace_file;
use crate::resolve::{NoFiles, Resolve};
use crate::{gltf, gzip, obj, off, ply, stl};

/// Reads a document from bytes.
///
/// The content decides the format (see [`Format::from_content`]); what announces nothing is read
/// as `hint`, or as OBJ if there is none. What is compressed by gzip is read as what it holds.
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
    read_with(bytes, hint, limits, &NoFiles)
}

/// As [`read`]; external buffers of a glTF come from `resolver`.
///
/// # Errors
/// As [`read`], and [`IoError::External`] for a buffer that the resolver refuses.
pub fn read_with(
    bytes: impl Into<Vec<u8>>,
    hint: Option<Format>,
    limits: &Limits,
    resolver: &dyn Resolve,
) -> Result<Document, IoError> {
    let bytes = unpacked(bytes.into(), limits)?;
    let format = Format::from_content(&bytes).or(hint).unwrap_or(Format::Obj);
    read_as(bytes, format, limits, resolver)
}

fn unpacked(bytes: Vec<u8>, limits: &Limits) -> Result<Vec<u8>, IoError> {
    limits.check_bytes(bytes.len() as u64)?;
    if gzip::is_gzip(&bytes) {
        gzip::decompress(&bytes, limits)
    } else {
        Ok(bytes)
    }
}

fn read_as(
    bytes: Vec<u8>,
    format: Format,
    limits: &Limits,
    resolver: &dyn Resolve,
) -> Result<Document, IoError> {
    if bytes.is_empty() {
        return Err(IoError::EmptyFile);
    }
    match format {
        Format::Obj => obj::read(bytes, limits),
        Format::Ply => ply::read(bytes, limits),
        Format::Off => off::read(bytes, limits),
        Format::Stl => stl::read(bytes, limits),
        Format::Gltf | Format::Glb => gltf::read(bytes, limits, resolver),
    }
}

/// Reads a file within the default [`Limits`].
///
/// # Errors
/// [`IoError::InFile`] with the path and what is wrong.
pub fn load(path: impl AsRef<Path>) -> Result<Document, IoError> {
    load_with(path, &Limits::default(), &NoFiles)
}

/// Reads a file within `limits`. The content decides the format, then the extension; what is
/// compressed by gzip is read as what it holds.
///
/// Only this path is opened, never one that the file names: the external buffers of a glTF come
/// from `resolver`.
///
/// # Errors
/// [`IoError::InFile`] with the path and what is wrong; [`IoError::UnknownFormat`] if neither
/// content nor extension tells the format.
pub fn load_with(
    path: impl AsRef<Path>,
    limits: &Limits,
    resolver: &dyn Resolve,
) -> Result<Document, IoError> {
    let path = path.as_ref();
    let read = || {
        let bytes = unpacked(read_bytes(path, limits)?, limits)?;
        let format = Format::from_content(&bytes)
            .or_else(|| Format::from_path(path))
            .ok_or(IoError::UnknownFormat)?;
        read_as(bytes, format, limits, resolver)
    };
    read().map_err(|source| in_file(path, source))
}

fn read_bytes(path: &Path, limits: &Limits) -> Result<Vec<u8>, IoError> {
    let (file, size) = open_regular(path).map_err(IoError::Read)?;
    limits.check_bytes(size)?;
    // Room for what the file is said to hold now; the reading itself is bounded too, since the
    // file may grow meanwhile.
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

/// Writes a document to a file, in the format of the path's extension; compressed by gzip if that
/// is followed by `.gz`.
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
        let mut bytes = document.write(format)?;
        if gzip::is_gzip_path(path) {
            bytes = gzip::compress(&bytes);
        }
        replace_file(path, &bytes).map_err(IoError::Write)
    };
    write().map_err(|source| in_file(path, source))
}

fn in_file(path: &Path, source: IoError) -> IoError {
    IoError::InFile {
        path: path.to_owned(),
        source: Box::new(source),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

    #[test]
    fn the_content_decides_and_then_the_extension() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let document = read(TRIANGLE, None, &Limits::default()).unwrap();
        std::fs::write(path("misnamed.obj"), document.write(Format::Ply).unwrap()).unwrap();
        assert_eq!(
            load(path("misnamed.obj")).unwrap().format(),
            Some(Format::Ply)
        );
        std::fs::write(path("mesh.OBJ"), TRIANGLE).unwrap();
        assert_eq!(load(path("mesh.OBJ")).unwrap().format(), Some(Format::Obj));
        std::fs::write(path("mesh.xyz"), TRIANGLE).unwrap();
        let error = load(path("mesh.xyz")).unwrap_err().to_string();
        assert!(
            error.contains("mesh.xyz") && error.contains(".obj, .ply"),
            "{error}"
        );
        let error = load(path("missing.obj")).unwrap_err().to_string();
        assert!(
            error.contains("missing.obj: cannot read the file"),
            "{error}"
        );
        let error = load(folder.path()).unwrap_err();
        assert!(matches!(error, IoError::InFile { .. }), "{error}");
    }

    #[test]
    fn limits_bound_what_is_read() {
        let refused = |limits: Limits| {
            matches!(
                read(TRIANGLE, None, &limits),
                Err(IoError::OverLimit { .. })
            )
        };
        let limits = Limits {
            max_vertices: 3,
            max_faces: 1,
            max_corners: 3,
            max_bytes: 32,
            ..Limits::default()
        };
        assert!(!refused(limits));
        assert!(refused(Limits {
            max_vertices: 2,
            ..limits
        }));
        assert!(refused(Limits {
            max_faces: 0,
            ..limits
        }));
        assert!(refused(Limits {
            max_corners: 2,
            ..limits
        }));
        assert!(refused(Limits {
            max_bytes: 31,
            ..limits
        }));
    }

    #[test]
    fn a_save_replaces_the_file_and_leaves_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mesh.obj");
        std::fs::write(&path, TRIANGLE).unwrap();
        let mut document = load(&path).unwrap();
        document
            .set_position(1, Point3::new(2.0, 0.0, 0.0))
            .unwrap();
        save(&document, &path).unwrap();
        assert_eq!(
            std::fs::read_to_string(&path).unwrap(),
            TRIANGLE.replace("v 1", "v 2")
        );
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_failed_save_keeps_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let document = read(TRIANGLE, None, &Limits::default()).unwrap();
        let error = save(&document, folder.path().join("mesh.xyz")).unwrap_err();
        assert!(error.to_string().contains("mesh.xyz"), "{error}");
        save(&document, folder.path().join("missing").join("mesh.obj")).unwrap_err();

        let path = folder.path().join("kept.obj");
        std::fs::write(&path, "old").unwrap();
        let mut permissions = std::fs::metadata(&path).unwrap().permissions();
        permissions.set_readonly(true);
        std::fs::set_permissions(&path, permissions).unwrap();
        let error = save(&document, &path).unwrap_err().to_string();
        assert!(error.contains("read-only"), "{error}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link_and_permissions_stay() {
        use std::fs::Permissions;
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (
            folder.path().join("file.obj"),
            folder.path().join("link.obj"),
        );
        std::fs::write(&file, TRIANGLE).unwrap();
        std::fs::set_permissions(&file, Permissions::from_mode(0o640)).unwrap();
        std::os::unix::fs::symlink("file.obj", &link).unwrap();
        let mut document = load(&link).unwrap();
        document
            .set_position(0, Point3::new(5.0, 0.0, 0.0))
            .unwrap();
        save(&document, &link).unwrap();
        assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
        assert!(
            std::fs::read_to_string(&file)
                .unwrap()
                .starts_with("v 5 0 0")
        );
        assert_eq!(
            std::fs::metadata(&file).unwrap().permissions().mode() & 0o777,
            0o640
        );
    }
}
