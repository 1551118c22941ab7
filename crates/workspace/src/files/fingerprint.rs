//! Detects whether a file is still the one that was read.

use std::fs::Metadata;
use std::io;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

/// The length and modification time of a file.
///
/// Different files may have the same fingerprint, but a file whose fingerprint has changed was
/// written in between. The external buffers of a glTF are not checked. The default is that of no
/// file.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default, Serialize, Deserialize)]
pub struct Fingerprint {
    length: u64,
    /// `None` if the file system does not record it.
    modified: Option<Stamp>,
}

/// A point in time: whole seconds since 1970, rounded down, and nanoseconds.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Serialize, Deserialize)]
struct Stamp {
    seconds: i64,
    nanoseconds: u32,
}

impl Fingerprint {
    /// Returns the fingerprint of the file at `path`, following links.
    ///
    /// # Errors
    /// Returns the error of the system.
    pub fn of(path: &Path) -> io::Result<Self> {
        Ok(Self::from_metadata(&std::fs::metadata(path)?))
    }

    pub(super) fn from_metadata(metadata: &Metadata) -> Self {
        Self {
            length: metadata.len(),
            modified: metadata.modified().ok().map(Stamp::of),
        }
    }
}

impl Stamp {
    fn of(time: SystemTime) -> Self {
        match time.duration_since(UNIX_EPOCH) {
            Ok(since) => Self {
                seconds: i64::try_from(since.as_secs()).unwrap_or(i64::MAX),
                nanoseconds: since.subsec_nanos(),
            },
            Err(before) => {
                let before = before.duration();
                let seconds = i64::try_from(before.as_secs()).unwrap_or(i64::MAX);
                Self {
                    seconds: -seconds - i64::from(before.subsec_nanos() > 0),
                    nanoseconds: (1_000_000_000 - before.subsec_nanos()) % 1_000_000_000,
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn length_and_time_tell_files_apart() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        std::fs::write(&path, "12").unwrap();
        let first = Fingerprint::of(&path).unwrap();
        assert_eq!(Fingerprint::of(&path).unwrap(), first);
        std::fs::write(&path, "123").unwrap();
        let longer = Fingerprint::of(&path).unwrap();
        assert_ne!(longer, first);
        let file = std::fs::File::options().write(true).open(&path).unwrap();
        file.set_modified(UNIX_EPOCH - Duration::from_millis(1500))
            .unwrap();
        let old = Fingerprint::of(&path).unwrap();
        assert_ne!(old, longer);
        let text = serde_json::to_string(&old).unwrap();
        assert_eq!(serde_json::from_str::<Fingerprint>(&text).unwrap(), old);
        assert!(Fingerprint::of(&folder.path().join("b")).is_err());
    }

    #[test]
    fn moments_before_1970_count_on() {
        let stamp = |millis| Stamp::of(UNIX_EPOCH - Duration::from_millis(millis));
        let expected = |seconds, nanoseconds| Stamp {
            seconds,
            nanoseconds,
        };
        assert_eq!(stamp(1500), expected(-2, 500_000_000));
        assert_eq!(stamp(1000), expected(-1, 0));
    }
}
