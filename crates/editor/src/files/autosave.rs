//! What a crash must not take: positions, handles and the editor's state, put aside while one
//! works.
//!
//! Each open mesh of each process has two files in the folder of autosaves: `NAME.autosave`, always
//! whole, and `NAME.lock`, which the process holds locked as long as it lives. The system takes
//! that lock away from a process that ends, however it ends; what is then left is found by
//! [`list`].

mod error;
mod format;
mod left;

use std::ffi::OsString;
use std::fs::{File, TryLockError};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

use cotan_io::{Access, Unfinished};

pub use error::AutosaveError;
pub use format::{Record, Recovered};
pub use left::{LeftBehind, Listing, list};

/// The folder of the user's autosaves: below what the environment variable `COTAN_EDITOR_DATA`
/// names, or where programs of this system keep the user's data.
///
/// # Errors
/// [`AutosaveError::NoFolder`] if the system names no place for it.
pub fn folder() -> Result<PathBuf, AutosaveError> {
    let data = match std::env::var_os(DATA_VARIABLE) {
        Some(data) if !data.is_empty() => PathBuf::from(data),
        _ => directories::ProjectDirs::from("", "", "cotan-editor")
            .ok_or(AutosaveError::NoFolder)?
            .data_local_dir()
            .to_owned(),
    };
    Ok(data.join("autosaves"))
}

const DATA_VARIABLE: &str = "COTAN_EDITOR_DATA";

/// The place where one open mesh of this process is put aside.
#[derive(Debug)]
pub struct Autosave {
    path: PathBuf,
    lock_path: PathBuf,
    /// Held locked until this is dropped, or the process ends.
    _lock: File,
}

impl Autosave {
    /// Takes a place of its own in `folder` (see [`folder`]), which is made if it is not there, for
    /// its owner alone. Nothing is put aside yet.
    ///
    /// # Errors
    /// [`AutosaveError::Write`] if the folder cannot be made or a file in it not locked.
    pub fn start(folder: &Path) -> Result<Self, AutosaveError> {
        let failed = |source| AutosaveError::write(folder, source);
        make_private(folder).map_err(failed)?;
        // Another process may take a lock file for one that was left, before it is locked.
        for _ in 0..ATTEMPTS {
            let name = fresh_name();
            let lock_path = folder.join(format!("{name}.{LOCK}"));
            let lock = match create_private(&lock_path) {
                Ok(lock) => lock,
                Err(error) if error.kind() == ErrorKind::AlreadyExists => continue,
                Err(error) => return Err(failed(error)),
            };
            match lock.try_lock() {
                Ok(()) if lock_path.exists() => {
                    return Ok(Self {
                        path: folder.join(format!("{name}.{DATA}")),
                        lock_path,
                        _lock: lock,
                    });
                }
                Ok(()) | Err(TryLockError::WouldBlock) => {}
                Err(TryLockError::Error(error)) => return Err(failed(error)),
            }
        }
        Err(failed(ErrorKind::ResourceBusy.into()))
    }

    /// Puts a record aside in the place of the one before, in one step.
    ///
    /// Needs nothing but the record, so that it may be called while the program is going down, and
    /// from several threads: the last one wins.
    ///
    /// # Errors
    /// [`AutosaveError::Full`] or [`AutosaveError::Write`]; the record before is whole then.
    pub fn write(&self, record: &Record<'_>) -> Result<(), AutosaveError> {
        let write = || -> io::Result<()> {
            let folder = self.path.parent().unwrap_or(Path::new("."));
            let name = self.path.file_stem().unwrap_or_default();
            let mut prefix = name.to_owned();
            prefix.push(".");
            let suffix = OsString::from(format!(".{PART}"));
            let mut file = Unfinished::create(folder, &prefix, &suffix, Access::Private)?;
            let mut buffered = BufWriter::new(file.file_mut());
            format::encode(record, &mut buffered)?;
            buffered.flush()?;
            drop(buffered);
            let length = file.file().metadata()?.len();
            if length > MOST_BYTES {
                return Err(ErrorKind::FileTooLarge.into());
            }
            file.finish(&self.path)
        };
        write().map_err(|source| AutosaveError::write(&self.path, source))
    }

    /// Removes what was put aside, as after a save or where a person wants to lose it.
    ///
    /// # Errors
    /// [`AutosaveError::Write`] if the system refuses.
    pub fn remove(&self) -> Result<(), AutosaveError> {
        remove_if_there(&self.path).map_err(|source| AutosaveError::write(&self.path, source))
    }

    /// Where the record is put.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Autosave {
    /// Gives the place back, but for what is put aside there: a panic ends here, too.
    fn drop(&mut self) {
        if !self.path.exists() {
            let _ = std::fs::remove_file(&self.lock_path);
        }
    }
}

/// Extensions: of a record, of a lock, and of a record that is being written.
const DATA: &str = "autosave";
const LOCK: &str = "lock";
const PART: &str = "part";

/// The largest autosave that is written or read: 2 GiB, as for a mesh file.
const MOST_BYTES: u64 = 2 << 30;

const ATTEMPTS: usize = 16;

/// A name that no other process has, nor this one had: its number may have been another's.
fn fresh_name() -> String {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    let millis = since.map_or(0, |since| since.as_millis());
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    format!("{}-{millis}-{count}", std::process::id())
}

fn make_private(folder: &Path) -> io::Result<()> {
    let mut builder = std::fs::DirBuilder::new();
    builder.recursive(true);
    #[cfg(unix)]
    {
        use std::os::unix::fs::{DirBuilderExt, PermissionsExt};
        builder.mode(0o700).create(folder)?;
        // It may have been there before, for others to read.
        if std::fs::metadata(folder)?.permissions().mode() & 0o077 != 0 {
            std::fs::set_permissions(folder, std::fs::Permissions::from_mode(0o700))?;
        }
        Ok(())
    }
    #[cfg(not(unix))]
    builder.create(folder)
}

fn create_private(path: &Path) -> io::Result<File> {
    let mut options = File::options();
    options.read(true).write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    options.open(path)
}

fn remove_if_there(path: &Path) -> io::Result<()> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests;
