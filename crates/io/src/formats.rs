//! The formats: the only place that knows all of them.
//!
//! Each is a folder with a reader, a [`SourceFile`](crate::source::SourceFile) and a writer of new
//! files.

use crate::companions::{WriteOptions, Written};
use crate::contents::Contents;
use crate::error::IoError;
use crate::format::Format;
use crate::limits::Limits;
use crate::resolve::Resolve;
use crate::source::Reading;
use crate::{gltf, obj, off, ply, stl};

/// Reads a file of this format.
pub(crate) fn read(
    bytes: Vec<u8>,
    format: Format,
    limits: &Limits,
    resolver: &dyn Resolve,
) -> Result<Reading, IoError> {
    if bytes.is_empty() {
        return Err(IoError::EmptyFile);
    }
    match format {
        Format::Obj => obj::read(bytes, limits, resolver),
        Format::Ply => ply::read(bytes, limits),
        Format::Off => off::read(bytes, limits),
        Format::Stl => stl::read(bytes, limits),
        Format::Gltf | Format::Glb => gltf::read(bytes, limits, resolver),
    }
}

/// Writes a new file of this format, together with its companion files.
pub(crate) fn write_new(
    contents: &Contents<'_>,
    format: Format,
    options: &WriteOptions<'_>,
) -> Result<Written, IoError> {
    let bytes = match format {
        Format::Obj => return obj::write_new(contents, options),
        Format::Off => off::write_new(contents),
        Format::Ply => ply::write_new(contents),
        Format::Stl => stl::write_new(contents),
        Format::Gltf | Format::Glb => gltf::write_new(contents, format),
    };
    Ok(Written::from(bytes?))
}

/// Lists what a new file of this format cannot represent.
pub(crate) fn losses(contents: &Contents<'_>, format: Format) -> Vec<String> {
    match format {
        Format::Obj => obj::losses(contents),
        Format::Off => off::losses(contents),
        Format::Ply => ply::losses(contents),
        Format::Stl => stl::losses(contents),
        Format::Gltf | Format::Glb => gltf::losses(contents),
    }
}
