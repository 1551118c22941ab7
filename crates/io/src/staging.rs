//! Companion files written next to a file: all or none, and never over an existing file.
//!
//! Everything is first checked and written under temporary names. Then the files are renamed, and
//! finally the mesh file is written. If that fails, they are removed again.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

use crate::companions::Companion;
use crate::error::IoError;
use crate::replace::folder_of;
use crate::unfinished::{Access, Unfinished};

/// Companions that have been checked and written under temporary names.
#[derive(Debug)]
pub(crate) struct StagedCompanions {
    waiting: Vec<(Unfinished, PathBuf)>,
    placed: Placed,
}

/// Companions under their final names; removed on drop unless [`Placed::keep`] is called.
#[derive(Debug, Default)]
pub(crate) struct Placed {
    folders: Vec<PathBuf>,
    files: Vec<PathBuf>,
}

impl StagedCompanions {
    /// Checks the companions of `out`, and writes those that do not exist yet under temporary
    /// names.
    ///
    /// In `home`, the folder of the original file, its own companions are already in place.
    /// Companions that cannot be found are noted in `left`, since they were already missing from
    /// the document.
    pub(crate) fn prepare(
        companions: &[Companion],
        out: &Path,
        home: Option<&Path>,
        left: &mut Vec<String>,
    ) -> Result<Self, IoError> {
        let folder = folder_of(out);
        let root = folder.canonicalize().map_err(IoError::Write)?;
        let is_home = home == Some(root.as_path());
        if is_home {
            // In the same folder every reference resolves as before.
            left.clear();
        }
        let mut staged = Self {
            waiting: Vec::new(),
            placed: Placed::default(),
        };
        let mut seen = BTreeSet::new();
        for companion in companions {
            if is_home && companion.is_found() || !seen.insert(companion.path()) {
                continue;
            }
            let path = folder.join(companion.path());
            let refuse = |problem: String| IoError::Companion {
                path: path.clone(),
                problem,
            };
            let bytes = match companion.bytes() {
                Ok(bytes) => bytes,
                Err(error)
                    if matches!(
                        error.kind(),
                        ErrorKind::NotFound | ErrorKind::PermissionDenied
                    ) =>
                {
                    let name = companion.path().display();
                    left.push(format!(
                        "the reference to {name} is unchanged; that file was not copied ({error})"
                    ));
                    continue;
                }
                Err(error) => return Err(refuse(format!("it cannot be read: {error}"))),
            };
            if is_same_file(&path, out) {
                return Err(refuse(
                    "that is the name of the mesh file itself; save under another name".to_owned(),
                ));
            }
            check_inside(&path, &root).map_err(refuse)?;
            if !is_there(&path, &bytes).map_err(refuse)? {
                staged
                    .wait(&path, &bytes)
                    .map_err(|error| refuse(format!("it cannot be written: {error}")))?;
            }
        }
        Ok(staged)
    }

    /// Writes a temporary file that will be renamed to `path`.
    fn wait(&mut self, path: &Path, bytes: &[u8]) -> std::io::Result<()> {
        let folder = folder_of(path);
        let missing: Vec<&Path> = folder
            .ancestors()
            .take_while(|folder| !folder.as_os_str().is_empty() && !folder.exists())
            .collect();
        for folder in missing.into_iter().rev() {
            std::fs::create_dir(folder)?;
            self.placed.folders.push(folder.to_owned());
        }
        let (prefix, suffix) = (OsStr::new(".cotan-"), OsStr::new(""));
        let mut file = Unfinished::create(folder, prefix, suffix, Access::Usual)?;
        file.file_mut().write_all(bytes)?;
        self.waiting.push((file, path.to_owned()));
        Ok(())
    }

    /// Renames the files to their final names.
    pub(crate) fn place(self) -> Result<Placed, IoError> {
        let Self {
            waiting,
            mut placed,
        } = self;
        for (temporary, path) in waiting {
            temporary
                .finish_new(&path)
                .map_err(|error| IoError::Companion {
                    path: path.clone(),
                    problem: format!("it cannot be written: {error}"),
                })?;
            placed.files.push(path);
        }
        Ok(placed)
    }
}

impl Placed {
    /// Keeps the files, and returns their paths.
    pub(crate) fn keep(mut self) -> Vec<PathBuf> {
        self.folders.clear();
        std::mem::take(&mut self.files)
    }
}

impl Drop for Placed {
    fn drop(&mut self) {
        // A file that cannot be removed is a copy that nothing refers to, so the error is
        // ignored.
        for file in &self.files {
            let _ = std::fs::remove_file(file);
        }
        for folder in self.folders.iter().rev() {
            let _ = std::fs::remove_dir(folder);
        }
    }
}

/// Returns `true` if a companion would overwrite the mesh file. Case is ignored, because some
/// file systems ignore it.
fn is_same_file(path: &Path, out: &Path) -> bool {
    let lower = |path: &Path| path.to_string_lossy().to_lowercase();
    let real = |path: &Path| path.canonicalize().ok();
    lower(path) == lower(out) || real(path).is_some_and(|path| real(out) == Some(path))
}

/// Rejects a path that leads out of `root` through a link, or whose parents are not folders.
fn check_inside(path: &Path, root: &Path) -> Result<(), String> {
    let mut folders = path.ancestors().skip(1);
    let there = folders.find(|folder| folder.symlink_metadata().is_ok());
    let there = there.unwrap_or(Path::new("."));
    let problem = |problem: &str| format!("{} {problem}", there.display());
    let real = there
        .canonicalize()
        .map_err(|error| problem(&format!("cannot be entered: {error}")))?;
    if !real.is_dir() {
        return Err(problem("is not a folder"));
    }
    if !real.starts_with(root) {
        return Err(problem("points outside the folder of the mesh"));
    }
    Ok(())
}

/// Returns `true` if the file already exists with these bytes; an error if it exists with others.
fn is_there(path: &Path, bytes: &[u8]) -> Result<bool, String> {
    if path.symlink_metadata().is_err() {
        return Ok(false);
    }
    let other = "another file of that name already exists and is not replaced; save to \
                 another folder, or embed the files in the mesh";
    let metadata = std::fs::metadata(path).map_err(|_| other.to_owned())?;
    if metadata.is_file() && metadata.len() == bytes.len() as u64 {
        let unreadable = |error| format!("a file of that name cannot be read: {error}");
        if has_bytes(path, bytes).map_err(unreadable)? {
            return Ok(true);
        }
    }
    Err(other.to_owned())
}

fn has_bytes(path: &Path, bytes: &[u8]) -> std::io::Result<bool> {
    const CHUNK: usize = 1 << 16;
    let mut file = File::open(path)?;
    let mut buffer = vec![0; CHUNK.min(bytes.len())];
    for chunk in bytes.chunks(CHUNK) {
        let Some(buffer) = buffer.get_mut(..chunk.len()) else {
            return Ok(false);
        };
        match file.read_exact(buffer) {
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => return Ok(false),
            read => read?,
        }
        if buffer != chunk {
            return Ok(false);
        }
    }
    Ok(file.read(&mut [0])? == 0)
}
