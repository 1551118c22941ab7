//! Detection of the format of a file.

use std::path::Path;

use crate::format::Format;
use crate::{gltf, gzip, off, stl, text};

impl Format {
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
        off::is_header_word(first.text).then_some(Self::Off)
    }
}
