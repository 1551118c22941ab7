//! Stereolithography STL, text and binary: triangles, each with the coordinates of its corners.
//!
//! The vertices of the document are the distinct positions (−0 equals 0) in the order of their
//! first occurrence, so a triangle soup becomes a surface. Its faces are the facets, including
//! those with a repeated corner. A facet keeps its normal (face property
//! [`NORMAL`](crate::NORMAL), unless all are zero) and, in a binary file, its two attribute bytes
//! (face property `attribute`, unless all are zero). The solids of a text file are labels.
//!
//! The form of a file is determined by its size and content, never by the word `solid` alone,
//! which also begins the header of many binary files. Sources: 3D Systems, "StereoLithography
//! Interface Specification", 1988; M. Burns, "Automated Fabrication", 1993, section 6.5.
//!
//! The files of this folder are one concept and use each other freely; outside of it, only
//! [`formats`](crate::formats) and [`detect`](crate::detect) use them.

mod binary;
mod new;
mod rebuild;
mod soup;
mod text;

#[cfg(test)]
mod file_tests;
#[cfg(test)]
mod tests;

use crate::error::{IoError, Place};
use crate::limits::Limits;
use crate::source::Reading;

pub(crate) use new::{losses, write_new};

/// Name of the face property that holds the attribute bytes of a binary facet.
const ATTRIBUTE: &str = "attribute";

/// Returns `true` if the content is an STL: a binary file whose length matches its facet count
/// exactly, or the word `solid` followed by facets.
///
/// A binary file with extra bytes after the facets is recognized by its name only: any text with
/// a few odd bytes in the right place would match.
pub(crate) fn is_stl(bytes: &[u8]) -> bool {
    binary::count(bytes)
        .is_some_and(|count| count > 0 && binary::length(count) == bytes.len() as u64)
        || text::is_text(bytes)
}

/// Reads an STL file.
pub(crate) fn read(bytes: Vec<u8>, limits: &Limits) -> Result<Reading, IoError> {
    let is_binary = binary::count(&bytes)
        .is_some_and(|count| count > 0 && binary::length(count) <= bytes.len() as u64);
    if !is_binary && (text::is_text(&bytes) || text::starts_as_text(&bytes)) {
        return text::read(bytes, limits);
    }
    if bytes.len() < binary::HEADER {
        return Err(IoError::Malformed {
            place: Place::Byte(bytes.len()),
            problem: format!(
                "this is not an STL file: a text starts with `solid`, a binary file has at least {} bytes",
                binary::HEADER
            ),
        });
    }
    binary::read(bytes, limits)
}

/// Reads a document.
#[cfg(test)]
fn open(bytes: Vec<u8>, limits: &Limits) -> Result<crate::Document, IoError> {
    crate::Document::from_reading(read(bytes, limits)?)
}
