//! Stereolithography STL, text and binary.

use crate::attributes::Attributes;
use crate::document::Document;
use crate::error::IoError;
use crate::limits::Limits;
use crate::writer::Contents;

/// Whether the content is an STL.
pub(crate) fn is_stl(_bytes: &[u8]) -> bool {
    false
}

/// Reads an STL file.
pub(crate) fn read(_bytes: Vec<u8>, _limits: &Limits) -> Result<Document, IoError> {
    Err(IoError::UnknownFormat)
}

/// What a new STL file cannot hold, in words.
pub(crate) fn losses(_attributes: &Attributes) -> Vec<String> {
    Vec::new()
}

/// A new STL file.
pub(crate) fn write_new(_contents: &Contents<'_>) -> Result<Vec<u8>, IoError> {
    Err(IoError::UnknownFormat)
}
