//! A new glTF of a document that was not read from one.

use crate::attributes::Attributes;
use crate::error::IoError;
use crate::format::Format;
use crate::writer::Contents;

/// What a new glTF cannot hold, in words.
pub(crate) fn losses(_attributes: &Attributes) -> Vec<String> {
    Vec::new()
}

/// A new glTF or GLB file.
pub(crate) fn write_new(_contents: &Contents<'_>, _format: Format) -> Result<Vec<u8>, IoError> {
    Err(IoError::UnknownFormat)
}
