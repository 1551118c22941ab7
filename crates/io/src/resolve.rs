//! Files that a file refers to, opened only by whom the caller trusts with it.

use std::io::{Error, ErrorKind};
use std::path::{Component, Path, PathBuf};

use crate::regular::read_regular;

/// Finds the external buffers of a glTF.
///
/// A reader never opens a path by itself; it asks the resolver that the caller gave it.
pub trait Resolve {
    /// The bytes of the file that `uri` names, at most `max_bytes` of them.
    ///
    /// `uri` is what the file says, with percent escapes decoded.
    ///
    /// # Errors
    /// Why the file cannot be had; [`ErrorKind::FileTooLarge`] if it is larger than `max_bytes`.
    fn resolve(&self, uri: &str, max_bytes: u64) -> Result<Vec<u8>, Error>;
}

/// The resolver that finds nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoFiles;

impl Resolve for NoFiles {
    fn resolve(&self, _uri: &str, _max_bytes: u64) -> Result<Vec<u8>, Error> {
        Err(Error::new(
            ErrorKind::Unsupported,
            "other files are not opened here; read the file with a resolver, such as its folder",
        ))
    }
}

/// The resolver that finds the regular files in one folder and the folders below, and nothing
/// outside of it: no absolute paths, no `..`, no links that lead out, no network.
#[derive(Clone, Debug)]
pub struct Folder {
    root: PathBuf,
}

impl Folder {
    /// The folder `root`.
    pub fn new(root: impl Into<PathBuf>) -> Self {
        Self { root: root.into() }
    }

    /// The folder that a file lies in.
    pub fn of(file: impl AsRef<Path>) -> Self {
        match file.as_ref().parent() {
            Some(folder) if !folder.as_os_str().is_empty() => Self::new(folder),
            _ => Self::new("."),
        }
    }
}

impl Resolve for Folder {
    fn resolve(&self, uri: &str, max_bytes: u64) -> Result<Vec<u8>, Error> {
        let refuse = |problem| Err(Error::new(ErrorKind::PermissionDenied, problem));
        // A colon makes a scheme, a drive or a stream of it; a backslash is a separator elsewhere.
        if uri.contains([':', '\\', '\0']) || uri.starts_with('/') {
            return refuse("only files in the folder of the mesh are opened");
        }
        let path = Path::new(uri);
        if !path
            .components()
            .all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
        {
            return refuse("it leads out of the folder of the mesh");
        }
        let root = self.root.canonicalize()?;
        let path = root.join(path).canonicalize()?;
        if !path.starts_with(&root) {
            return refuse("it leads out of the folder of the mesh");
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
