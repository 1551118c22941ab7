//! Autosaves: a scene and the commands after it, kept on disk in case of a crash.
//!
//! Each open model of each process has two files in the folder of autosaves. `NAME.autosave` is
//! complete but for its last line, and `NAME.lock` is held locked as long as the process lives. The
//! system releases the lock when the process ends, however it ends; [`list`] then finds the files
//! that were left.

mod error;
mod format;
mod left;

use std::ffi::OsString;
use std::fs::{File, TryLockError};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

use cotan_io::{Access, Unfinished};

use crate::command::Command;

pub use error::AutosaveError;
pub use format::{Record, Recovered};
pub use left::{LeftBehind, Listing, list};

/// Returns the folder of the user's autosaves.
///
/// It lies below the path in the environment variable `COTAN_EDITOR_DATA`, or where programs on
/// this system keep the user's data.
///
/// # Errors
/// [`AutosaveError::NoFolder`] if the system names no such place.
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

/// The autosave of one open mesh of this process.
#[derive(Debug)]
pub struct Autosave {
    path: PathBuf,
    lock_path: PathBuf,
    /// Held locked until this value is dropped or the process ends.
    _lock: File,
}

impl Autosave {
    /// Reserves a new name in `folder` (see [`folder`]) without writing an autosave yet.
    ///
    /// The folder is created if it does not exist, accessible to its owner only.
    ///
    /// # Errors
    /// [`AutosaveError::Write`] if the folder cannot be created or a file in it cannot be locked.
    pub fn start(folder: &Path) -> Result<Self, AutosaveError> {
        let failed = |source| AutosaveError::write(folder, source);
        make_private(folder).map_err(failed)?;
        // Before the lock is taken, another process may mistake the lock file for an abandoned
        // one.
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

    /// Begins the autosave anew with a scene, in one step. Returns the length of the file.
    ///
    /// # Errors
    /// [`AutosaveError::Full`] or [`AutosaveError::Write`]. The previous autosave is kept.
    pub fn begin(&self, record: &Record<'_>) -> Result<u64, AutosaveError> {
        let write = || -> io::Result<u64> {
            let folder = self.path.parent().unwrap_or(Path::new("."));
            let name = self.path.file_stem().unwrap_or_default();
            let mut prefix = name.to_owned();
            prefix.push(".");
            let suffix = OsString::from(format!(".{PART}"));
            let bytes = format::begin(record)?;
            if bytes.len() as u64 > MOST_BYTES {
                return Err(ErrorKind::FileTooLarge.into());
            }
            let mut file = Unfinished::create(folder, &prefix, &suffix, Access::Private)?;
            file.file_mut().write_all(&bytes)?;
            file.finish(&self.path)?;
            Ok(bytes.len() as u64)
        };
        write().map_err(|source| AutosaveError::write(&self.path, source))
    }

    /// Appends a command. Returns the number of bytes.
    ///
    /// Needs nothing but the command, so it can be called while the program is crashing.
    ///
    /// # Errors
    /// [`AutosaveError::Full`] or [`AutosaveError::Write`]; the commands before are kept.
    pub fn append(&self, command: &Command) -> Result<u64, AutosaveError> {
        let write = || -> io::Result<u64> {
            let bytes = format::command(command)?;
            let mut file = File::options().append(true).open(&self.path)?;
            file.write_all(&bytes)?;
            Ok(bytes.len() as u64)
        };
        write().map_err(|source| AutosaveError::write(&self.path, source))
    }

    /// Removes the autosave, for example after a save or when the user discards the work.
    ///
    /// # Errors
    /// [`AutosaveError::Write`] if the system refuses.
    pub fn remove(&self) -> Result<(), AutosaveError> {
        remove_if_there(&self.path).map_err(|source| AutosaveError::write(&self.path, source))
    }

    /// The path of the record.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Autosave {
    /// Removes the lock file unless there is an autosave. A panic ends here, too.
    fn drop(&mut self) {
        if !self.path.exists() {
            let _ = std::fs::remove_file(&self.lock_path);
        }
    }
}

/// Extensions of a record, of a lock, and of a partly written record.
const DATA: &str = "autosave";
const LOCK: &str = "lock";
const PART: &str = "part";

/// The largest autosave that is begun or read: 2 GiB, as for a mesh file.
const MOST_BYTES: u64 = 2 << 30;

const ATTEMPTS: usize = 16;

/// Returns a unique name. The process id alone would not do, because the system reuses it.
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
        // The folder may have existed before, readable for others.
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
