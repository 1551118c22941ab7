//! Limits on what is read from untrusted files.

use crate::error::IoError;
use crate::room;

/// Upper bounds on the input that a reader accepts.
///
/// Memory is never reserved from a count stated in a file, only from bytes that are present, so
/// these bounds determine what is rejected, not what is safe. The defaults admit every mesh that
/// the half-edge structure can hold on a workstation. A server that reads untrusted files should
/// set lower values.
///
/// ```
/// use cotan_io::{Limits, read};
/// let small = Limits { max_vertices: 2, ..Limits::default() };
/// let error = read(&b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"[..], None, &small).unwrap_err();
/// assert!(error.to_string().contains("2 vertices"));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Limits {
    /// Maximum file size, in bytes (default 2 GiB).
    pub max_bytes: u64,
    /// Maximum number of vertices (default 2^28, about 268 million).
    pub max_vertices: usize,
    /// Maximum number of faces (default 2^29: twice the vertices, as in a closed triangle mesh).
    pub max_faces: usize,
    /// Maximum total number of face corners (default 2^31 − 2, the index range of a half-edge
    /// mesh).
    pub max_corners: usize,
    /// Maximum number of corners per face (default 2^20).
    pub max_degree: usize,
    /// Maximum nesting depth of JSON, and of the nodes of a glTF (default 128).
    pub max_depth: usize,
    /// Maximum length of a text line in bytes, including its continuation lines (default 64 MiB).
    pub max_line: usize,
    /// Maximum memory of a document after reading, in bytes, including the bytes of its file
    /// (default 16 GiB).
    pub max_memory: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_bytes: 2 << 30,
            max_vertices: 1 << 28,
            max_faces: 1 << 29,
            max_corners: (1 << 31) - 2,
            max_degree: 1 << 20,
            max_depth: 128,
            max_line: 64 << 20,
            max_memory: 16 << 30,
        }
    }
}

impl Limits {
    /// No bounds, for trusted data such as a file that the program has just written.
    pub const NONE: Self = Self {
        max_bytes: u64::MAX,
        max_vertices: usize::MAX,
        max_faces: usize::MAX,
        max_corners: usize::MAX,
        max_degree: usize::MAX,
        max_depth: usize::MAX,
        max_line: usize::MAX,
        max_memory: u64::MAX,
    };

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
        // Offsets into the corner list are 32-bit regardless of the limits.
        check(
            "face corners",
            count as u64,
            (self.max_corners as u64).min(u64::from(u32::MAX)),
        )
    }

    /// Checks the number of corners of one face.
    pub(crate) fn check_degree(&self, degree: usize) -> Result<(), IoError> {
        check("corners of a face", degree as u64, self.max_degree as u64)
    }

    /// Checks the length of one text line.
    pub(crate) fn check_line(&self, length: usize) -> Result<(), IoError> {
        check("bytes in a line", length as u64, self.max_line as u64)
    }

    pub(crate) fn check_depth(&self, depth: usize) -> Result<(), IoError> {
        check("levels of nesting", depth as u64, self.max_depth as u64)
    }

    /// Checks the memory of a document with a file of `num_bytes` and the given numbers of
    /// vertices and corners.
    ///
    /// Called before they are stored, or while they are stored if the counts are not known in
    /// advance.
    pub(crate) fn check_memory(
        &self,
        num_bytes: usize,
        num_vertices: usize,
        num_corners: usize,
    ) -> Result<(), IoError> {
        let memory = (num_bytes as u64)
            .saturating_add((num_vertices as u64).saturating_mul(VERTEX))
            .saturating_add((num_corners as u64).saturating_mul(CORNER));
        check("bytes of memory", memory, self.max_memory)
    }
}

impl Limits {
    /// Like [`Self::check_memory`], and also checks that the system can provide memory for the
    /// vertices and corners.
    pub(crate) fn check_room(
        &self,
        num_bytes: usize,
        num_vertices: usize,
        num_corners: usize,
    ) -> Result<(), IoError> {
        self.check_memory(num_bytes, num_vertices, num_corners)?;
        let bytes_of = |count: usize, each: u64| (count as u64).saturating_mul(each);
        room::check(bytes_of(num_vertices, VERTEX).saturating_add(bytes_of(num_corners, CORNER)))
    }
}

/// Bytes per vertex (a position and its offset in the file) and per corner (including its share
/// of the face end offsets).
const VERTEX: u64 = 32;
const CORNER: u64 = 6;

fn check(what: &'static str, count: u64, limit: u64) -> Result<(), IoError> {
    if count > limit {
        Err(IoError::OverLimit { what, limit })
    } else {
        Ok(())
    }
}
