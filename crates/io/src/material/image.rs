//! The image of a texture: the bytes of its file, which are never decoded.

use std::fmt;
use std::sync::Arc;

/// An image in one of the formats that every texture reader supports.
#[derive(Clone, PartialEq, Eq)]
pub struct Image {
    /// A name without folder and extension; may be empty.
    pub name: String,
    kind: ImageKind,
    bytes: Arc<Vec<u8>>,
}

/// The format of an image.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[non_exhaustive]
pub enum ImageKind {
    /// Portable network graphics.
    Png,
    /// JPEG.
    Jpeg,
}

impl Image {
    /// Creates an image from these bytes; `None` if they start neither as a PNG nor as a JPEG.
    pub fn new(name: impl Into<String>, bytes: impl Into<Arc<Vec<u8>>>) -> Option<Self> {
        let bytes = bytes.into();
        let kind = ImageKind::of(&bytes)?;
        Some(Self {
            name: name.into(),
            kind,
            bytes,
        })
    }

    /// The bytes of the file.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    pub(crate) fn shared_bytes(&self) -> Arc<Vec<u8>> {
        Arc::clone(&self.bytes)
    }

    /// The format.
    pub fn kind(&self) -> ImageKind {
        self.kind
    }
}

impl ImageKind {
    /// Detects the format from the first bytes.
    fn of(bytes: &[u8]) -> Option<Self> {
        if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
            Some(Self::Png)
        } else if bytes.starts_with(b"\xff\xd8\xff") {
            Some(Self::Jpeg)
        } else {
            None
        }
    }

    /// The extension of a file, without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Jpeg => "jpg",
        }
    }

    /// The media type, as in `data:image/png`.
    pub fn media_type(self) -> &'static str {
        match self {
            Self::Png => "image/png",
            Self::Jpeg => "image/jpeg",
        }
    }
}

impl fmt::Debug for Image {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Image")
            .field("name", &self.name)
            .field("kind", &self.kind)
            .field("bytes", &self.bytes.len())
            .finish()
    }
}

/// Returns the image name for a file path: without folder and extension.
pub(crate) fn stem(path: &str) -> &str {
    let name = path.rsplit(['/', '\\']).next().unwrap_or(path);
    match name.rsplit_once('.') {
        Some((stem, _)) if !stem.is_empty() => stem,
        _ => name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_bytes_decide_and_not_the_name() {
        let kind = |bytes: &[u8]| Image::new("a.jpg", bytes.to_vec()).map(|image| image.kind());
        assert_eq!(kind(b"\x89PNG\r\n\x1a\nrest"), Some(ImageKind::Png));
        assert_eq!(kind(b"\xff\xd8\xff\xe0"), Some(ImageKind::Jpeg));
        for other in [&b""[..], b"\x89PNG", b"GIF89a", b"RIFF....WEBP", b"<svg/>"] {
            assert_eq!(kind(other), None);
        }
    }

    #[test]
    fn names_have_neither_folder_nor_extension() {
        for (path, name) in [
            ("a/b c.png", "b c"),
            ("a\\b.tar.jpg", "b.tar"),
            (".png", ".png"),
            ("plain", "plain"),
            ("", ""),
        ] {
            assert_eq!(stem(path), name);
        }
    }
}
