//! File formats.

use std::fmt;

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
