//! Gzip-compressed files (RFC 1952).

use std::io::{ErrorKind, Read, Write};
use std::path::Path;

use flate2::bufread::GzDecoder;
use flate2::{Compression, GzBuilder};

use crate::error::{IoError, Place};
use crate::limits::Limits;
use crate::room;

/// Returns `true` if the content starts with the gzip signature.
pub(crate) fn is_gzip(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\x1f\x8b")
}

/// Returns `true` if a path ends in `.gz`.
pub(crate) fn is_gzip_path(path: &Path) -> bool {
    path.extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("gz"))
}

/// Decompresses all members of a gzip file, concatenated, within the limits.
///
/// Zero padding after the last member, as left by tapes and block devices, is ignored.
pub(crate) fn decompress(bytes: &[u8], limits: &Limits) -> Result<Vec<u8>, IoError> {
    let mut content = Vec::new();
    let mut chunk = vec![0; CHUNK];
    let mut rest = bytes;
    for _ in 0..MAX_MEMBERS {
        let mut member = GzDecoder::new(rest);
        loop {
            let length = match member.read(&mut chunk) {
                Ok(0) => break,
                Ok(length) => length,
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(error) => {
                    return Err(malformed(bytes.len() - member.get_ref().len(), &error));
                }
            };
            let total = content.len() + length;
            limits.check_bytes(total as u64)?;
            limits.check_memory(bytes.len().saturating_add(total), 0, 0)?;
            room::reserve(&mut content, length)?;
            content.extend_from_slice(&chunk[..length]);
        }
        rest = member.into_inner();
        if rest.iter().all(|&b| b == 0) {
            return Ok(content);
        }
    }
    Err(IoError::OverLimit {
        what: "members of a gzip file",
        limit: MAX_MEMBERS,
    })
}

/// More than any program writes (bgzip starts a member every 64 KiB of content). Each member
/// costs a few microseconds, even an empty one.
const MAX_MEMBERS: u64 = 1 << 18;

/// Number of bytes inflated between checks of the limits.
const CHUNK: usize = 1 << 16;

fn malformed(at: usize, error: &std::io::Error) -> IoError {
    let problem = match error.kind() {
        ErrorKind::UnexpectedEof => {
            "the gzip file ends before its content does; it was cut short".to_owned()
        }
        _ => format!("the gzip file is damaged here or before ({error})"),
    };
    IoError::Malformed {
        place: Place::Byte(at),
        problem,
    }
}

/// Compresses the content to a gzip file, with the same bytes on every machine and at any time.
pub(crate) fn compress(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzBuilder::new()
        .mtime(0)
        .operating_system(UNKNOWN_SYSTEM)
        .write(Vec::new(), Compression::default());
    // Writing to memory cannot fail.
    let _ = encoder.write_all(bytes);
    encoder.finish().unwrap_or_default()
}

/// The RFC 1952 value for an unknown operating system.
const UNKNOWN_SYSTEM: u8 = 255;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::Format;
    use crate::{load, load_with, read, save};
    use proptest::prelude::*;

    const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

    #[test]
    fn what_is_compressed_is_read_and_written_as_what_it_holds() {
        let folder = tempfile::tempdir().unwrap();
        let document = read(TRIANGLE, None, &Limits::default()).unwrap();
        for name in ["m.obj.gz", "m.ply.gz", "m.off.GZ", "m.stl.gz"] {
            let path = folder.path().join(name);
            save(&document, &path).unwrap();
            let written = std::fs::read(&path).unwrap();
            assert!(is_gzip(&written), "{name}");
            let again = load(&path).unwrap();
            assert_eq!(again.positions(), document.positions(), "{name}");
            assert_eq!(again.faces(), document.faces(), "{name}");
            assert_eq!(again.format(), Format::from_path(&path), "{name}");
            save(&again, &path).unwrap();
            assert_eq!(std::fs::read(&path).unwrap(), written, "{name}");
        }
        // The file name may be wrong about the compression in either direction.
        let path = folder.path().join("plain.obj.gz");
        std::fs::write(&path, TRIANGLE).unwrap();
        assert!(load(&path).is_ok());
        let path = folder.path().join("packed.obj");
        std::fs::write(&path, compress(TRIANGLE.as_bytes())).unwrap();
        assert!(load(&path).is_ok());
    }

    #[test]
    fn a_bomb_ends_at_the_limit() {
        let bomb = compress(&vec![b'\n'; 8 << 20]);
        assert!(bomb.len() < 20_000);
        let limits = Limits {
            max_bytes: 1 << 20,
            ..Limits::default()
        };
        let error = read(bomb.clone(), None, &limits).unwrap_err().to_string();
        assert!(error.starts_with("more than 1048576 bytes"), "{error}");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bomb.obj.gz");
        std::fs::write(&path, &bomb).unwrap();
        let error = load_with(&path, &limits, &crate::NoFiles).unwrap_err();
        assert!(error.to_string().contains("more than 1048576 bytes"));
        let limits = Limits {
            max_memory: 1 << 20,
            ..Limits::default()
        };
        let error = decompress(&bomb, &limits).unwrap_err().to_string();
        assert!(error.contains("bytes of memory"), "{error}");
        // Exactly at the limit.
        let limits = Limits {
            max_bytes: 8 << 20,
            ..Limits::default()
        };
        assert_eq!(decompress(&bomb, &limits).unwrap().len(), 8 << 20);
    }

    #[test]
    fn members_follow_each_other_and_padding_is_passed_over() {
        let mut bytes = compress(&TRIANGLE.as_bytes()[..10]);
        bytes.extend(compress(b""));
        bytes.extend(compress(&TRIANGLE.as_bytes()[10..]));
        for padding in [0, 1, 4, 600] {
            let mut padded = bytes.clone();
            padded.resize(bytes.len() + padding, 0);
            let content = decompress(&padded, &Limits::default()).unwrap();
            assert_eq!(content, TRIANGLE.as_bytes(), "{padding}");
        }
    }

    #[test]
    fn members_without_end_are_refused() {
        let empty = compress(b"");
        let bytes = empty.repeat(MAX_MEMBERS as usize);
        assert!(decompress(&bytes, &Limits::default()).unwrap().is_empty());
        let bytes = empty.repeat(MAX_MEMBERS as usize + 1);
        let error = decompress(&bytes, &Limits::default())
            .unwrap_err()
            .to_string();
        assert!(error.starts_with("more than 262144 members"), "{error}");
    }

    #[test]
    fn damage_is_named() {
        let whole = compress(TRIANGLE.as_bytes());
        let refusal = |bytes: &[u8]| {
            decompress(bytes, &Limits::default())
                .unwrap_err()
                .to_string()
        };
        for length in [2, 9, 12, whole.len() - 9, whole.len() - 1] {
            let error = refusal(&whole[..length]);
            assert!(error.contains("it was cut short"), "{length}: {error}");
        }
        let mut sum = whole.clone();
        sum[whole.len() - 8] ^= 1;
        let error = refusal(&sum);
        assert!(
            error.starts_with("byte ") && error.contains("the gzip file is damaged here or before"),
            "{error}"
        );
        let mut trailing = whole;
        trailing.extend(b"text");
        assert!(refusal(&trailing).contains("gzip file"));
    }

    proptest! {
        #[test]
        fn contents_come_back(content in prop::collection::vec(any::<u8>(), 0..2000)) {
            let packed = compress(&content);
            prop_assert_eq!(&compress(&content), &packed);
            prop_assert_eq!(&packed[4..8], [0; 4]);
            prop_assert_eq!(decompress(&packed, &Limits::default()).unwrap(), content);
        }

        #[test]
        fn damaged_files_are_read_or_refused(
            content in prop::collection::vec(any::<u8>(), 0..500),
            at in any::<prop::sample::Index>(), b: u8, length in any::<prop::sample::Index>(),
        ) {
            let mut packed = compress(&content);
            let at = at.index(packed.len());
            packed[at] = b;
            let _ = decompress(&packed, &Limits::default());
            let _ = decompress(&packed[..length.index(packed.len())], &Limits::default());
        }
    }
}
