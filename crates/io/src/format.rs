//! The file formats, and how they are told apart.

use std::fmt;
use std::path::Path;

use crate::text;

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
}

impl Format {
    /// The format that a file name's extension stands for, in any case of letters.
    pub fn from_path(path: impl AsRef<Path>) -> Option<Self> {
        let extension = path.as_ref().extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "obj" => Some(Self::Obj),
            "ply" => Some(Self::Ply),
            "off" => Some(Self::Off),
            _ => None,
        }
    }

    /// The format that the first bytes announce: `ply`, or a header word that ends in `OFF`.
    ///
    /// OBJ announces nothing, so an OBJ file gives `None`.
    pub fn from_content(bytes: &[u8]) -> Option<Self> {
        let start = text::after_bom(bytes);
        let body = &bytes[start..];
        if body.starts_with(b"ply") && matches!(body.get(3), None | Some(b'\n' | b'\r' | b' ')) {
            return Some(Self::Ply);
        }
        // Comments may precede the header word of OFF; an OBJ often starts with comments too.
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
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
            Self::Off => "OFF",
        })
    }
}
