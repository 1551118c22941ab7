//! Opening input files, restricted to regular files.
//!
//! A pipe may block its reader forever. A device may supply bytes forever or have side effects
//! when opened. Neither is opened, not even through a link.

use std::fs::File;
use std::io::{Error, ErrorKind, Read};
use std::path::Path;

/// Opens a regular file for reading, following links, and returns it with its length.
///
/// # Errors
/// The error of the operating system; [`ErrorKind::IsADirectory`] for a folder,
/// [`ErrorKind::InvalidInput`] for a pipe or a device, which are not opened.
pub fn open_regular(path: &Path) -> Result<(File, u64), Error> {
    check_regular(&std::fs::metadata(path)?)?;
    let file = File::open(path)?;
    // Check the file that was actually opened, since the path may refer to another one by now.
    let metadata = file.metadata()?;
    check_regular(&metadata)?;
    Ok((file, metadata.len()))
}

/// Reads a regular file of at most `max_bytes`.
///
/// # Errors
/// As for [`open_regular`]; [`ErrorKind::FileTooLarge`] for a larger file.
pub fn read_regular(path: &Path, max_bytes: u64) -> Result<Vec<u8>, Error> {
    let too_large = || Error::new(ErrorKind::FileTooLarge, "it is larger than the limit");
    let (file, length) = open_regular(path)?;
    if length > max_bytes {
        return Err(too_large());
    }
    let mut bytes = Vec::new();
    let room = usize::try_from(length).unwrap_or(usize::MAX);
    bytes
        .try_reserve_exact(room)
        .map_err(|_| ErrorKind::OutOfMemory)?;
    // A file may grow while it is being read.
    file.take(max_bytes.saturating_add(1))
        .read_to_end(&mut bytes)?;
    match bytes.len() as u64 > max_bytes {
        true => Err(too_large()),
        false => Ok(bytes),
    }
}

fn check_regular(metadata: &std::fs::Metadata) -> Result<(), Error> {
    if metadata.is_file() {
        return Ok(());
    }
    Err(match metadata.is_dir() {
        true => Error::new(ErrorKind::IsADirectory, "this is a folder, not a file"),
        false => Error::new(
            ErrorKind::InvalidInput,
            "this is a pipe or a device, not a regular file; write its content to a file first",
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regular_files_are_read_within_the_limit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("four");
        std::fs::write(&path, "1234").unwrap();
        assert_eq!(read_regular(&path, 4).unwrap(), b"1234");
        let error = read_regular(&path, 3).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::FileTooLarge);
        let error = read_regular(folder.path(), 3).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::IsADirectory);
        let error = read_regular(&folder.path().join("none"), 3).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::NotFound);
    }

    #[cfg(unix)]
    #[test]
    fn pipes_and_devices_are_not_opened_behind_links_either() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.unwrap().success());
        let link = folder.path().join("link");
        std::os::unix::fs::symlink("/dev/zero", &link).unwrap();
        for path in [pipe.as_path(), &link, Path::new("/dev/zero")] {
            let error = read_regular(path, 100).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::InvalidInput, "{path:?}");
        }
    }
}
