//! File formats and their detection.

use std::fmt;
use std::path::Path;

use crate::{gltf, gzip, stl, text};

/// A file format that can be read and written.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[non_exhaustive]
pub enum Format {
    /// Wavefront OBJ (`.obj`), text.
    Obj,
    /// Stanford PLY (`.ply`), text or binary.
    Ply,
    /// Geomview OFF (`.off`), text.
    Off,
    /// Stereolithography STL (`.stl`), text or binary.
    Stl,
    /// glTF 2.0 as JSON (`.gltf`).
    Gltf,
    /// glTF 2.0 in one binary file (`.glb`).
    Glb,
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 6] = [
        Self::Obj,
        Self::Ply,
        Self::Off,
        Self::Stl,
        Self::Gltf,
        Self::Glb,
    ];

    /// Returns the format for the extension of a file name, ignoring case.
    ///
    /// For `mesh.obj.gz` this is the format of `mesh.obj`.
    pub fn from_path(path: impl AsRef<Path>) -> Option<Self> {
        let mut path = path.as_ref();
        if gzip::is_gzip_path(path) {
            path = Path::new(path.file_stem()?);
        }
        let extension = path.extension()?.to_str()?;
        Self::ALL
            .into_iter()
            .find(|format| extension.eq_ignore_ascii_case(format.extension()))
    }

    /// Detects the format from the content: the word `ply`, the magic number of a GLB, a JSON
    /// object, a binary STL whose facet count matches its size, the word `solid` followed by
    /// facets, or a header word that ends in `OFF`.
    ///
    /// OBJ has no signature, so an OBJ file yields `None`. Compressed files are not decompressed.
    pub fn from_content(bytes: &[u8]) -> Option<Self> {
        let start = text::after_bom(bytes);
        let body = &bytes[start..];
        if body.starts_with(b"ply") && matches!(body.get(3), None | Some(b'\n' | b'\r' | b' ')) {
            return Some(Self::Ply);
        }
        if gltf::is_glb(bytes) {
            return Some(Self::Glb);
        }
        if body.trim_ascii_start().starts_with(b"{") {
            return Some(Self::Gltf);
        }
        if stl::is_stl(bytes) {
            return Some(Self::Stl);
        }
        // Comments may precede the OFF header word, but many OBJ files start with comments too.
        let first = text::Lines::new(bytes, start)
            .map(|line| text::before_comment(line.text))
            .find_map(|line| text::Tokens::new(line).next())?;
        crate::off::is_header_word(first.text).then_some(Self::Off)
    }

    /// The usual extension, without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Obj => "obj",
            Self::Ply => "ply",
            Self::Off => "off",
            Self::Stl => "stl",
            Self::Gltf => "gltf",
            Self::Glb => "glb",
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
            Self::Off => "OFF",
            Self::Stl => "STL",
            Self::Gltf => "glTF",
            Self::Glb => "GLB",
        })
    }
}
