//! Loading files within limits and replacing them atomically.

use std::io::Read;
use std::path::Path;

use crate::companions::{Companions, Saved, WriteOptions, Written};
use crate::document::Document;
use crate::error::IoError;
use crate::format::Format;
use crate::limits::Limits;
use crate::regular::open_regular;
use crate::replace::{folder_of, link_target, replace_file};
use crate::resolve::{NoFiles, Resolve};
use crate::staging::StagedCompanions;
use crate::{formats, gzip, room, stl, text};

/// Reads a document from bytes.
///
/// The format is detected from the content (see [`Format::from_content`]). Content without a
/// signature is read as `hint`, or as OBJ if there is no hint. Gzip-compressed content is
/// decompressed first.
///
/// # Errors
/// [`IoError`] with the line or byte, the element and the problem. No input panics.
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

/// Like [`read`], but fetches the files that the content refers to from `resolver`.
///
/// # Errors
/// As for [`read`], and [`IoError::External`] for a buffer that the resolver refuses.
pub fn read_with(
    bytes: impl Into<Vec<u8>>,
    hint: Option<Format>,
    limits: &Limits,
    resolver: &dyn Resolve,
) -> Result<Document, IoError> {
    let bytes = unpacked(bytes.into(), limits)?;
    check_encoding(&bytes)?;
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

/// Rejects UTF-16 and UTF-32 text. A binary STL is exempt, since it may begin with any bytes.
fn check_encoding(bytes: &[u8]) -> Result<(), IoError> {
    match text::wide_encoding(bytes) {
        Some(encoding) if !stl::is_stl(bytes) => Err(IoError::Unsupported {
            feature: format!("text in {encoding}"),
            remedy: "save the file as UTF-8",
        }),
        _ => Ok(()),
    }
}

fn read_as(
    bytes: Vec<u8>,
    format: Format,
    limits: &Limits,
    resolver: &dyn Resolve,
) -> Result<Document, IoError> {
    Document::from_reading(formats::read(bytes, format, limits, resolver)?)
}

/// Reads a file within the default [`Limits`].
///
/// # Errors
/// [`IoError::InFile`] with the path and the problem.
pub fn load(path: impl AsRef<Path>) -> Result<Document, IoError> {
    load_with(path, &Limits::default(), &NoFiles)
}

/// Reads a file within `limits`.
///
/// The format is detected from the content, then from the extension. Gzip-compressed content is
/// decompressed first.
///
/// Only this path is opened, never one that is named inside the file. External buffers and images
/// of a glTF come from `resolver`, either now or when the document is saved.
///
/// # Errors
/// [`IoError::InFile`] with the path and the problem; [`IoError::UnknownFormat`] if neither
/// content nor extension determines the format.
pub fn load_with(
    path: impl AsRef<Path>,
    limits: &Limits,
    resolver: &dyn Resolve,
) -> Result<Document, IoError> {
    let path = path.as_ref();
    let read = || {
        let bytes = unpacked(read_bytes(path, limits)?, limits)?;
        check_encoding(&bytes)?;
        let format = Format::from_content(&bytes)
            .or_else(|| Format::from_path(path))
            .ok_or(IoError::UnknownFormat)?;
        read_as(bytes, format, limits, resolver)
    };
    let document = read().map_err(|source| in_file(path, source))?;
    Ok(document.at_home(folder_of(path).canonicalize().ok()))
}

fn read_bytes(path: &Path, limits: &Limits) -> Result<Vec<u8>, IoError> {
    let (file, size) = open_regular(path).map_err(IoError::Read)?;
    limits.check_bytes(size)?;
    // Reserve the reported file size. The read itself is bounded too, since the file may grow in
    // the meantime.
    let mut bytes = Vec::new();
    let length = usize::try_from(size).unwrap_or(usize::MAX);
    limits.check_memory(length, 0, 0)?;
    room::reserve_exact(&mut bytes, length)?;
    file.take(limits.max_bytes.saturating_add(1))
        .read_to_end(&mut bytes)
        .map_err(IoError::Read)?;
    limits.check_bytes(bytes.len() as u64)?;
    Ok(bytes)
}

/// Writes a document to a file in the format of the path's extension, compressed with gzip if the
/// path ends in `.gz`.
///
/// See [`Document::write`] for what is preserved. The new file is written next to the old one and
/// replaces it atomically, so that a failure leaves the old file intact. Files that the document
/// refers to are copied next to the new file first; see [`Companions::Separate`].
///
/// # Errors
/// [`IoError::InFile`] with the path and the problem; [`IoError::UnknownFormat`] if the extension
/// is not known; [`IoError::Companion`] if a companion file cannot be placed next to the output.
/// Nothing is changed in these cases.
pub fn save(document: &Document, path: impl AsRef<Path>) -> Result<Saved, IoError> {
    save_with(document, path, Companions::Separate)
}

/// Like [`save`], with a choice of where the files that the document refers to are placed.
///
/// # Errors
/// As for [`save`].
pub fn save_with(
    document: &Document,
    path: impl AsRef<Path>,
    companions: Companions,
) -> Result<Saved, IoError> {
    let path = path.as_ref();
    let write = || {
        let format = Format::from_path(path).ok_or(IoError::UnknownFormat)?;
        let options = WriteOptions {
            companions,
            name: stem(path),
        };
        let mut written = document.write_with(format, &options)?;
        if gzip::is_gzip_path(path) {
            written.bytes = gzip::compress(&written.bytes);
        }
        let Written {
            bytes,
            companions,
            mut left,
        } = written;
        // Companions are placed next to the file itself, not next to a symbolic link to it.
        let target = link_target(path).map_err(IoError::Write)?;
        let home = document.home();
        let placed = StagedCompanions::prepare(&companions, &target, home, &mut left)?.place()?;
        replace_file(path, &bytes).map_err(IoError::Write)?;
        Ok(Saved {
            copied: placed.keep(),
            left,
        })
    };
    write().map_err(|source| in_file(path, source))
}

/// Returns the file name without its extensions: `mesh` for `mesh.obj` and `mesh.obj.gz`.
fn stem(path: &Path) -> &str {
    let packed = path.file_stem().filter(|_| gzip::is_gzip_path(path));
    let inner = packed.map_or(path, Path::new);
    let stem = inner.file_stem().and_then(|stem| stem.to_str());
    stem.unwrap_or("mesh")
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
    fn text_in_utf_16_is_named_for_what_it_is() {
        let off = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
        let ply = "ply\nformat ascii 1.0\nelement vertex 0\nend_header\n";
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in [
            ("a.obj", TRIANGLE),
            ("a.off", off),
            ("a.ply", ply),
            ("a.stl", "solid a\nendsolid a\n"),
            ("a.gltf", "{\"asset\": {\"version\": \"2.0\"}}"),
        ] {
            for mark in ["", "\u{feff}"] {
                let text = format!("{mark}{text}");
                for convert in [u16::to_le_bytes, u16::to_be_bytes] {
                    let bytes: Vec<u8> = text.encode_utf16().flat_map(convert).collect();
                    let path = folder.path().join(name);
                    std::fs::write(&path, &bytes).unwrap();
                    for error in [
                        read(bytes, None, &Limits::default()).unwrap_err(),
                        load(&path).unwrap_err(),
                    ] {
                        let error = error.to_string();
                        assert!(
                            error.ends_with(
                                "text in UTF-16 is not supported; save the file as UTF-8"
                            ),
                            "{name}: {error}"
                        );
                    }
                }
            }
        }
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
