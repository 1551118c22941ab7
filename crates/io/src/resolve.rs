//! Resolution of files that a mesh file refers to, controlled by the caller.

use std::fmt::Debug;
use std::io::{Error, ErrorKind};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use crate::regular::read_regular;

/// Provides the files that a mesh file refers to, such as the buffers and images of a glTF.
///
/// A reader never opens a path by itself; it asks the resolver passed by the caller.
pub trait Resolve: Debug + Send + Sync {
    /// Returns the bytes of the file that `uri` names, at most `max_bytes` of them.
    ///
    /// `uri` is the reference in the file, with percent escapes decoded.
    ///
    /// # Errors
    /// The reason why the file is not available: [`ErrorKind::NotFound`] if it does not exist,
    /// [`ErrorKind::PermissionDenied`] if the resolver refuses to open it,
    /// [`ErrorKind::FileTooLarge`] if it is larger than `max_bytes`.
    fn resolve(&self, uri: &str, max_bytes: u64) -> Result<Vec<u8>, Error>;

    /// Returns the same resolver for the document to keep: images are read only when the document
    /// is saved to another folder.
    fn shared(&self) -> Arc<dyn Resolve>;
}

/// A resolver that finds no files.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoFiles;

impl Resolve for NoFiles {
    fn resolve(&self, _uri: &str, _max_bytes: u64) -> Result<Vec<u8>, Error> {
        Err(Error::new(
            ErrorKind::Unsupported,
            "other files are opened only by a resolver; read the file with one, such as its folder",
        ))
    }

    fn shared(&self) -> Arc<dyn Resolve> {
        Arc::new(*self)
    }
}

/// A resolver that finds the regular files in one folder and its subfolders, and nothing outside:
/// no absolute paths, no `..`, no links that lead out, no network.
#[derive(Clone, Debug)]
pub struct Folder {
    root: PathBuf,
}

impl Folder {
    /// Creates a resolver for the folder `root`.
    pub fn new(root: impl Into<PathBuf>) -> Self {
        Self { root: root.into() }
    }

    /// Creates a resolver for the folder that contains `file`.
    pub fn of(file: impl AsRef<Path>) -> Self {
        match file.as_ref().parent() {
            Some(folder) if !folder.as_os_str().is_empty() => Self::new(folder),
            _ => Self::new("."),
        }
    }
}

/// Returns the normalized path inside a folder that a reference (with percent escapes decoded)
/// names, or the reason why it is not allowed.
pub(crate) fn inside(uri: &str) -> Result<PathBuf, &'static str> {
    // A colon would make it a scheme, a drive or a stream. A backslash is a separator on some
    // systems.
    if uri.contains([':', '\\', '\0']) || uri.starts_with('/') {
        return Err("only files in the folder of the mesh are opened");
    }
    let mut path = PathBuf::new();
    for part in Path::new(uri).components() {
        match part {
            Component::Normal(name) => path.push(name),
            Component::CurDir => {}
            _ => return Err("it points outside the folder of the mesh"),
        }
    }
    Ok(path)
}

impl Resolve for Folder {
    fn shared(&self) -> Arc<dyn Resolve> {
        Arc::new(self.clone())
    }

    fn resolve(&self, uri: &str, max_bytes: u64) -> Result<Vec<u8>, Error> {
        let refuse = |problem| Err(Error::new(ErrorKind::PermissionDenied, problem));
        let path = match inside(uri) {
            Ok(path) => path,
            Err(problem) => return refuse(problem),
        };
        let root = self.root.canonicalize()?;
        let path = root.join(path).canonicalize()?;
        if !path.starts_with(&root) {
            return refuse("it points outside the folder of the mesh");
        }
        if !std::fs::metadata(&path)?.is_file() {
            return refuse("it is not a regular file");
        }
        read_regular(&path, max_bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_lies_in_the_folder_is_found() {
        let outer = tempfile::tempdir().unwrap();
        let inner = outer.path().join("inner");
        std::fs::create_dir_all(inner.join("sub")).unwrap();
        std::fs::write(outer.path().join("secret"), "secret").unwrap();
        std::fs::write(inner.join("a b.bin"), "1234").unwrap();
        std::fs::write(inner.join("sub/c.bin"), "5").unwrap();
        let folder = Folder::of(inner.join("mesh.gltf"));
        assert_eq!(folder.resolve("a b.bin", 4).unwrap(), b"1234");
        assert_eq!(folder.resolve("./sub/c.bin", 4).unwrap(), b"5");
        assert_eq!(
            folder.resolve("a b.bin", 3).unwrap_err().kind(),
            ErrorKind::FileTooLarge
        );
        assert_eq!(
            folder.resolve("none", 3).unwrap_err().kind(),
            ErrorKind::NotFound
        );
        let absolute = outer.path().join("secret");
        for uri in [
            "../secret",
            "sub/../../secret",
            "..\\secret",
            "file:///etc/passwd",
            "sub",
            "",
            "http://example.org/a",
            absolute.to_str().unwrap(),
        ] {
            let error = folder.resolve(uri, 100).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::PermissionDenied, "{uri}: {error}");
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("../secret", inner.join("link")).unwrap();
            let error = folder.resolve("link", 100).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::PermissionDenied);
        }
        assert!(NoFiles.resolve("a b.bin", 4).is_err());
    }
}
