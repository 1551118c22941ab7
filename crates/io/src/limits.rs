//! How much of an untrusted file is read before it is refused.

use crate::error::IoError;

/// Upper bounds on what a reader accepts.
///
/// Memory is never reserved from a count that a file states, only from bytes that are there, so
/// these bounds decide what is refused, not what is safe. The defaults admit every mesh that the
/// half-edge structure can hold on a workstation; a server that reads strangers' files sets them
/// lower.
///
/// ```
/// use cotan_io::{Limits, read};
/// let small = Limits { max_vertices: 2, ..Limits::default() };
/// let error = read(&b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"[..], None, &small).unwrap_err();
/// assert!(error.to_string().contains("2 vertices"));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Limits {
    /// Largest file, in bytes (default 2 GiB).
    pub max_bytes: u64,
    /// Most vertices (default 2^28, about 268 million).
    pub max_vertices: usize,
    /// Most faces (default 2^29: twice the vertices, as in a closed triangle mesh).
    pub max_faces: usize,
    /// Most face corners in all (default 2^31 − 2, what a half-edge mesh can number).
    pub max_corners: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_bytes: 2 << 30,
            max_vertices: 1 << 28,
            max_faces: 1 << 29,
            max_corners: (1 << 31) - 2,
        }
    }
}

impl Limits {
    pub(crate) fn check_bytes(&self, count: u64) -> Result<(), IoError> {
        check("bytes", count, self.max_bytes)
    }

    pub(crate) fn check_vertices(&self, count: usize) -> Result<(), IoError> {
        check("vertices", count as u64, self.max_vertices as u64)
    }

    pub(crate) fn check_faces(&self, count: usize) -> Result<(), IoError> {
        check("faces", count as u64, self.max_faces as u64)
    }

    pub(crate) fn check_corners(&self, count: usize) -> Result<(), IoError> {
        // Offsets into the corner list are 32-bit whatever the caller allows.
        check(
            "face corners",
            count as u64,
            (self.max_corners as u64).min(u64::from(u32::MAX)),
        )
    }
}

fn check(what: &'static str, count: u64, limit: u64) -> Result<(), IoError> {
    if count > limit {
        Err(IoError::OverLimit { what, limit })
    } else {
        Ok(())
    }
}
