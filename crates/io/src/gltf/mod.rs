//! glTF 2.0, as JSON and in one binary file.

use crate::attributes::Attributes;
use crate::document::Document;
use crate::error::IoError;
use crate::format::Format;
use crate::limits::Limits;
use crate::resolve::Resolve;
use crate::writer::Contents;

/// Whether the content starts as a GLB does.
pub(crate) fn is_glb(bytes: &[u8]) -> bool {
    bytes.starts_with(b"glTF")
}

/// Reads a glTF or GLB file.
pub(crate) fn read(
    _bytes: Vec<u8>,
    _limits: &Limits,
    _resolver: &dyn Resolve,
) -> Result<Document, IoError> {
    Err(IoError::UnknownFormat)
}

/// What a new glTF cannot hold, in words.
pub(crate) fn losses(_attributes: &Attributes) -> Vec<String> {
    Vec::new()
}

/// A new glTF or GLB file.
pub(crate) fn write_new(_contents: &Contents<'_>, _format: Format) -> Result<Vec<u8>, IoError> {
    Err(IoError::UnknownFormat)
}
