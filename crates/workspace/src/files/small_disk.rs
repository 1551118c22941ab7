//! A small disk that fills up quickly, for tests.

use std::path::Path;
use std::process::Command;

/// A mounted file system, unmounted when dropped.
pub(super) struct SmallDisk(tempfile::TempDir);

/// Mounts a disk of a few pages. Returns `None`, with a note, if the test lacks the rights.
pub(super) fn small_disk() -> Option<SmallDisk> {
    let folder = tempfile::tempdir().unwrap();
    let mount = Command::new("mount")
        .args(["-t", "tmpfs", "-o", "size=64k", "none"])
        .arg(folder.path())
        .output();
    match mount {
        Ok(output) if output.status.success() => Some(SmallDisk(folder)),
        _ => {
            cotan_testing::skip("no small disk can be mounted here");
            None
        }
    }
}

impl SmallDisk {
    pub(super) fn path(&self) -> &Path {
        self.0.path()
    }

    /// Fills the disk.
    pub(super) fn fill(&self) {
        use std::io::Write;
        let mut file = std::fs::File::create(self.path().join("filler")).unwrap();
        while file.write_all(&[0; 4096]).is_ok() {}
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.0.path()).status();
    }
}
