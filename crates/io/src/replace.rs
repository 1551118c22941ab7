//! Atomic replacement of files.

use std::ffi::OsStr;
use std::fs::{File, Metadata};
use std::io::{Error, ErrorKind, Write};
use std::path::{Path, PathBuf};

use crate::unfinished::{Access, Unfinished};

/// Writes a file atomically: to a temporary file next to the old one, which is then renamed.
///
/// A reader sees either the old file or the new one, and a failure leaves the old one intact.
///
/// - Links are followed, including those whose target does not exist yet.
/// - The permissions of an existing file are kept; the temporary file has them before its first
///   byte is written. A new file gets the default permissions.
/// - Owner and group are kept if the process may set them, as the superuser may. If the group
///   cannot be kept, the new group gets no more permissions than everyone has.
/// - Other names of the old file (hard links) keep the old content; see [`num_names`].
/// - Access control lists and extended attributes are not preserved.
///
/// # Errors
/// The error of the operating system; [`ErrorKind::PermissionDenied`] for a read-only file,
/// [`ErrorKind::IsADirectory`] and [`ErrorKind::InvalidInput`] for anything that is not a regular
/// file.
pub fn replace_file(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let target = link_target(path)?;
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let old = check_replaceable(&target)?;
    let access = match old {
        Some(_) => Access::Private,
        None => Access::Usual,
    };
    let mut file = Unfinished::create(folder, OsStr::new(".cotan-"), OsStr::new(""), access)?;
    if let Some(old) = old {
        adopt(file.file(), &old)?;
    }
    file.file_mut().write_all(bytes)?;
    file.finish(&target)
}

/// Returns the path at the end of a chain of links, whether or not a file exists there.
///
/// A path that is not a link is returned unchanged.
///
/// # Errors
/// If the links form a cycle.
pub fn link_target(path: &Path) -> std::io::Result<PathBuf> {
    let mut target = path.to_owned();
    for _ in 0..MAX_LINKS {
        match std::fs::read_link(&target) {
            // An absolute path replaces the folder.
            Ok(next) => target = target.parent().unwrap_or(Path::new("")).join(next),
            Err(_) => return Ok(target),
        }
    }
    Err(Error::other("too many links, or links in a circle"))
}

/// The limit on Linux.
const MAX_LINKS: usize = 40;

/// Returns the metadata of the file at `path`, following links; `None` if there is none.
///
/// # Errors
/// Rejects files that must not be replaced, which a rename alone would not detect: see
/// [`replace_file`].
pub fn check_replaceable(path: &Path) -> std::io::Result<Option<Metadata>> {
    let metadata = match std::fs::metadata(path) {
        Ok(metadata) => metadata,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error),
    };
    if metadata.is_dir() {
        return Err(Error::new(
            ErrorKind::IsADirectory,
            "this is a folder; name a file",
        ));
    }
    if !metadata.is_file() {
        return Err(Error::new(
            ErrorKind::InvalidInput,
            "this is not a regular file but a pipe or a device",
        ));
    }
    if metadata.permissions().readonly() {
        return Err(Error::new(
            ErrorKind::PermissionDenied,
            "the file is read-only",
        ));
    }
    Ok(Some(metadata))
}

/// Returns the number of names (hard links) of a file.
///
/// If it has more than one, [`replace_file`] replaces the content of one name only; the others
/// keep the old content.
///
/// Always 1 on systems other than Unix, where it is unknown.
pub fn num_names(metadata: &Metadata) -> u64 {
    #[cfg(unix)]
    return std::os::unix::fs::MetadataExt::nlink(metadata);
    #[cfg(not(unix))]
    {
        let _ = metadata;
        1
    }
}

/// Gives a new file the owner, group and permissions of the old one, as far as possible.
#[cfg(unix)]
fn adopt(file: &File, old: &Metadata) -> std::io::Result<()> {
    use std::os::unix::fs::{MetadataExt, PermissionsExt, fchown};
    let new = file.metadata()?;
    let mut mode = old.mode() & 0o7777;
    let is_group_kept = new.gid() == old.gid() || fchown(file, None, Some(old.gid())).is_ok();
    let is_owner_kept = new.uid() == old.uid() || fchown(file, Some(old.uid()), None).is_ok();
    if !is_group_kept {
        // With a different group, grant only the permissions of everyone, not those of the old
        // group.
        let of_all = mode & 0o007;
        mode &= !0o2070 | (of_all << 3);
    }
    if !is_owner_kept {
        mode &= !0o4000;
    }
    // Must come last: changing the owner clears some of the mode bits.
    file.set_permissions(std::fs::Permissions::from_mode(mode))
}

#[cfg(not(unix))]
fn adopt(file: &File, old: &Metadata) -> std::io::Result<()> {
    file.set_permissions(old.permissions())
}

/// Returns the folder that contains a file.
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_regular_file_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let error = replace_file(folder.path(), b"").unwrap_err();
        assert_eq!(error.kind(), ErrorKind::IsADirectory);
        #[cfg(unix)]
        {
            let link = folder.path().join("link");
            std::os::unix::fs::symlink("/dev/null", &link).unwrap();
            let error = replace_file(&link, b"").unwrap_err();
            assert_eq!(error.kind(), ErrorKind::InvalidInput);
        }
    }

    #[cfg(unix)]
    mod unix {
        use super::super::*;
        use std::fs::{Permissions, metadata, set_permissions, symlink_metadata, write};
        use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};

        #[test]
        fn a_dangling_link_is_followed() {
            let folder = tempfile::tempdir().unwrap();
            let path = |name: &str| folder.path().join(name);
            std::fs::create_dir(path("sub")).unwrap();
            symlink("sub/second", path("first")).unwrap();
            symlink("../third", path("sub/second")).unwrap();
            replace_file(&path("first"), b"new").unwrap();
            assert_eq!(std::fs::read(path("third")).unwrap(), b"new");
            assert!(symlink_metadata(path("first")).unwrap().is_symlink());
            assert!(symlink_metadata(path("sub/second")).unwrap().is_symlink());
            // Now the chain ends at an existing file.
            replace_file(&path("first"), b"newer").unwrap();
            assert_eq!(std::fs::read(path("third")).unwrap(), b"newer");
        }

        #[test]
        fn links_in_a_circle_are_refused() {
            let folder = tempfile::tempdir().unwrap();
            let path = |name: &str| folder.path().join(name);
            symlink("b", path("a")).unwrap();
            symlink("a", path("b")).unwrap();
            replace_file(&path("a"), b"").unwrap_err();
            assert!(symlink_metadata(path("a")).unwrap().is_symlink());
        }

        #[test]
        fn the_rights_are_those_of_the_old_file_from_the_start() {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("mesh");
            for mode in [0o600, 0o640, 0o666, 0o755, 0o200] {
                write(&path, "old").unwrap();
                set_permissions(&path, Permissions::from_mode(mode)).unwrap();
                let old = check_replaceable(&path).unwrap().unwrap();
                let (prefix, suffix) = (OsStr::new("."), OsStr::new(""));
                let file =
                    Unfinished::create(folder.path(), prefix, suffix, Access::Private).unwrap();
                let before = file.file().metadata().unwrap();
                assert_eq!(before.mode() & 0o777, 0o600);
                adopt(file.file(), &old).unwrap();
                let after = file.file().metadata().unwrap();
                assert_eq!((after.mode() & 0o777, after.len()), (mode, 0));
                replace_file(&path, b"new").unwrap();
                assert_eq!(metadata(&path).unwrap().mode() & 0o777, mode);
                std::fs::remove_file(&path).unwrap();
            }
        }

        #[test]
        fn the_superuser_keeps_owner_and_group() {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("mesh");
            write(&path, "old").unwrap();
            if std::os::unix::fs::chown(&path, Some(1234), Some(2345)).is_err() {
                cotan_testing::skip("only the superuser may give a file away");
                return;
            }
            set_permissions(&path, Permissions::from_mode(0o4750)).unwrap();
            replace_file(&path, b"new").unwrap();
            let new = metadata(&path).unwrap();
            assert_eq!((new.uid(), new.gid()), (1234, 2345));
            assert_eq!(new.mode() & 0o7777, 0o4750);
            assert_eq!(std::fs::read(&path).unwrap(), b"new");
        }

        #[test]
        fn other_names_keep_the_old_content() {
            let folder = tempfile::tempdir().unwrap();
            let path = |name: &str| folder.path().join(name);
            write(path("one"), "old").unwrap();
            assert_eq!(num_names(&metadata(path("one")).unwrap()), 1);
            std::fs::hard_link(path("one"), path("two")).unwrap();
            assert_eq!(num_names(&metadata(path("one")).unwrap()), 2);
            replace_file(&path("one"), b"new").unwrap();
            assert_eq!(std::fs::read(path("one")).unwrap(), b"new");
            assert_eq!(std::fs::read(path("two")).unwrap(), b"old");
        }
    }
}
