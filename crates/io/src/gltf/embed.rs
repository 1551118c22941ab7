//! Embedding of external buffers and images into the file.
//!
//! In a `.gltf` they become data URIs. In a `.glb`, images are appended to the binary chunk, each
//! with its own view; the first buffer is already there, and additional ones become data URIs.
//! References of extensions to other files are left unchanged.

use std::ops::Range;
use std::sync::Arc;

use super::buffers::{data_of, encode_as};
use super::container::{Container, write_binary};
use super::external::External;
use super::json::{Editor, member};
use crate::error::IoError;
use crate::limits::Limits;

/// Embeds these files into a file that refers to them.
pub(super) fn embed(
    written: Vec<u8>,
    files: &External,
    limits: &Limits,
) -> Result<Vec<u8>, IoError> {
    let container = Container::read(&written, &mut Vec::new())?;
    let json = written.get(container.json.clone()).unwrap_or(&[]);
    let mut embed = Embed {
        editor: Editor::new(str::from_utf8(json).unwrap_or_default()),
        files,
        written: written.len() as u64,
        limits,
    };
    let root = embed.editor.root();
    let buffers = embed.editor.list(&root, "buffers")?;
    for object in &buffers {
        if let Some(bytes) = embed.file_of(object)? {
            let uri = encode_as("application/octet-stream", &bytes);
            embed.editor.set(object, "uri", format!("\"{uri}\""))?;
        }
    }
    let mut chunk = embed.chunk(&container, &buffers, &written)?;
    let first_view = embed.editor.list(&root, "bufferViews")?.len();
    let mut views = Vec::new();
    for object in embed.editor.list(&root, "images")? {
        let Some(bytes) = embed.file_of(&object)? else {
            continue;
        };
        let media_type = media_type(&bytes);
        let (Some(bin), Some(media_type)) = (chunk.as_mut(), media_type) else {
            let media_type = media_type.unwrap_or("application/octet-stream");
            let uri = encode_as(media_type, &bytes);
            embed.editor.set(&object, "uri", format!("\"{uri}\""))?;
            continue;
        };
        let start = bin.len().next_multiple_of(4);
        bin.resize(start, 0);
        bin.extend_from_slice(&bytes);
        views.push(format!(
            "{{\"buffer\":0,\"byteOffset\":{start},\"byteLength\":{}}}",
            bytes.len()
        ));
        embed.point(&object, first_view + views.len() - 1, media_type)?;
    }
    if let (Some(bin), false) = (&chunk, views.is_empty()) {
        embed.editor.append(&root, "bufferViews", &views)?;
        match buffers.first() {
            Some(first) => {
                let length = bin.len().to_string();
                embed.editor.set(first, "byteLength", length)?;
            }
            None => {
                let buffer = format!("{{\"byteLength\":{}}}", bin.len());
                embed.editor.append(&root, "buffers", &[buffer])?;
            }
        }
    }
    let json = embed.editor.finish();
    if !container.is_binary {
        let before = written.get(..container.json.start).unwrap_or(&[]);
        let after = written.get(container.json.end..).unwrap_or(&[]);
        return Ok([before, json.as_bytes(), after].concat());
    }
    let old = container.bin.clone().and_then(|range| written.get(range));
    let bin = chunk.as_deref().filter(|_| !views.is_empty()).or(old);
    let (chunks, trailing) = container.further(&written);
    write_binary(&json, bin, chunks, trailing)
}

struct Embed<'a> {
    editor: Editor<'a>,
    files: &'a External,
    /// Number of bytes of the file so far, limited like those of a file that is read.
    written: u64,
    limits: &'a Limits,
}

impl Embed<'_> {
    /// The bytes of the external file of a buffer or an image; `None` if it has none or the file
    /// is missing.
    fn file_of(&mut self, object: &Range<usize>) -> Result<Option<Arc<Vec<u8>>>, IoError> {
        let members = self.editor.members(object)?;
        let uri = member(&members, "uri").map(|span| self.editor.text(span));
        let uri = uri.and_then(|text| serde_json::from_str::<String>(text).ok());
        let Some(uri) = uri.filter(|uri| data_of(uri).is_none()) else {
            return Ok(None);
        };
        let rest = self.limits.max_bytes.saturating_sub(self.written);
        let bytes = self.files.bytes(&uri, rest)?;
        if let Some(bytes) = &bytes {
            // The maximum length in base64.
            let length = (bytes.len() as u64).div_ceil(3).saturating_mul(4);
            self.written = self.written.saturating_add(length);
            self.limits.check_bytes(self.written)?;
        }
        Ok(bytes)
    }

    /// The binary chunk to which image data may be appended: that of the first buffer, or a new
    /// one for a GLB without buffers.
    fn chunk(
        &self,
        container: &Container,
        buffers: &[Range<usize>],
        written: &[u8],
    ) -> Result<Option<Vec<u8>>, IoError> {
        let chunk = match (&container.bin, buffers.first()) {
            (Some(range), Some(first)) => {
                let members = self.editor.members(first)?;
                let bytes = written.get(range.clone()).unwrap_or(&[]);
                member(&members, "uri").is_none().then(|| bytes.to_vec())
            }
            (None, None) if container.is_binary => Some(Vec::new()),
            _ => None,
        };
        Ok(chunk)
    }

    /// Makes an image refer to a view instead of a file.
    fn point(
        &mut self,
        object: &Range<usize>,
        view: usize,
        media_type: &str,
    ) -> Result<(), IoError> {
        let members = self.editor.members(object)?;
        let kept = members
            .iter()
            .filter(|(key, _)| !matches!(key.as_str(), "uri" | "mimeType" | "bufferView"));
        let kept = kept.map(|(key, value)| {
            let key = serde_json::Value::from(key.as_str());
            format!(",{key}:{}", self.editor.text(value))
        });
        let kept: String = kept.collect();
        let text = format!("{{\"bufferView\":{view},\"mimeType\":\"{media_type}\"{kept}}}");
        self.editor.replace(object.clone(), text);
        Ok(())
    }
}

/// Detects the media type of an image from its first bytes.
fn media_type(bytes: &[u8]) -> Option<&'static str> {
    const TYPES: [(&[u8], &str); 3] = [
        (b"\x89PNG\r\n\x1a\n", "image/png"),
        (b"\xff\xd8\xff", "image/jpeg"),
        (b"\xabKTX 20\xbb\r\n\x1a\n", "image/ktx2"),
    ];
    let known = TYPES.iter().find(|(start, _)| bytes.starts_with(start));
    let is_webp = bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP");
    known
        .map(|&(_, media_type)| media_type)
        .or(is_webp.then_some("image/webp"))
}
