//! The bytes of the buffers: the binary chunk, data URIs, and files found by the resolver.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::general_purpose::GeneralPurpose;
use base64::engine::{DecodePaddingMode, GeneralPurposeConfig};

use super::container::Container;
use super::external::External;
use super::model::Root;
use crate::error::IoError;
use crate::limits::Limits;

/// The bytes of one buffer.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Buffer {
    pub(super) kind: Kind,
    pub(super) data: Data,
    /// The length stated in the JSON, which does not exceed the data.
    pub(super) length: usize,
}

/// The origin of a buffer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Kind {
    /// The binary chunk of a GLB.
    Chunk,
    /// In the JSON, as a data URI.
    Embedded,
    /// A file next to this one.
    External,
    /// Without any data.
    Absent,
}

/// The bytes of a buffer. Bytes in the file itself are not copied.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) enum Data {
    File(Range<usize>),
    Own(Arc<Vec<u8>>),
}

impl Buffer {
    /// Returns its bytes, given those of the file.
    pub(super) fn bytes<'a>(&'a self, file: &'a [u8]) -> &'a [u8] {
        let bytes = match &self.data {
            Data::File(range) => file.get(range.clone()).unwrap_or(&[]),
            Data::Own(bytes) => bytes,
        };
        &bytes[..self.length.min(bytes.len())]
    }
}

/// Loads the bytes of all buffers. Those of external files are kept in `files`, each once.
pub(super) fn load(
    root: &Root<'_>,
    container: &Container,
    file_length: usize,
    limits: &Limits,
    files: &mut External,
) -> Result<Vec<Buffer>, IoError> {
    let mut buffers = Vec::new();
    let mut embedded = file_length as u64;
    for (number, buffer) in root.buffers.iter().enumerate() {
        let chunk = container.bin.clone().filter(|_| number == 0);
        let path = |field: &str| format!("buffers[{number}].{field}");
        let (kind, data) = match (buffer.uri.as_deref(), chunk) {
            (Some(uri), _) => match data_of(uri) {
                Some(data) => {
                    let bytes = decode(data).map_err(|problem| IoError::Gltf {
                        path: path("uri"),
                        problem,
                    })?;
                    embedded = embedded.saturating_add(bytes.len() as u64);
                    (Kind::Embedded, Data::Own(Arc::new(bytes)))
                }
                None => {
                    let taken = embedded.saturating_add(files.num_bytes());
                    let rest = limits.max_bytes.saturating_sub(taken);
                    // The length stated in the JSON would do, but a file may be longer.
                    (Kind::External, Data::Own(files.read(uri, rest)?))
                }
            },
            (None, Some(chunk)) => (Kind::Chunk, Data::File(chunk)),
            (None, None) => (Kind::Absent, Data::Own(Arc::default())),
        };
        let found = match &data {
            Data::File(range) => range.len(),
            Data::Own(bytes) => bytes.len(),
        };
        let taken = embedded.saturating_add(files.num_bytes());
        limits.check_bytes(taken)?;
        limits.check_memory(usize::try_from(taken).unwrap_or(usize::MAX), 0, 0)?;
        let length = match kind {
            // An error is raised only where the buffer is used.
            Kind::Absent => 0,
            _ if buffer.length > found as u64 => {
                return Err(IoError::Gltf {
                    path: path("byteLength"),
                    problem: format!(
                        "{} bytes are promised, but there are {found}",
                        buffer.length
                    ),
                });
            }
            // At most `found`.
            _ => buffer.length as usize,
        };
        buffers.push(Buffer { kind, data, length });
    }
    Ok(buffers)
}

/// The part of a data URI after `data:`; `None` for a reference to a file.
pub(super) fn data_of(uri: &str) -> Option<&str> {
    let (scheme, data) = uri.split_at_checked(5)?;
    scheme.eq_ignore_ascii_case("data:").then_some(data)
}

/// Decodes a data URI, given the part after `data:`.
pub(super) fn decode(uri: &str) -> Result<Vec<u8>, String> {
    let Some((head, data)) = uri.split_once(',') else {
        return Err("a data URI needs a comma before its data".to_owned());
    };
    if head.contains(";;") {
        return Err("a data URI has an empty parameter before its base64 data".to_owned());
    }
    let data = unescape(data)?;
    let is_base64 = head
        .rsplit(';')
        .next()
        .is_some_and(|word| word.eq_ignore_ascii_case("base64"));
    if !is_base64 {
        return Ok(data.into_owned());
    }
    engine()
        .decode(data.as_ref())
        .map_err(|error| format!("the base64 data is wrong: {error}"))
}

/// Encodes bytes as a data URI.
pub(super) fn encode(bytes: &[u8]) -> String {
    encode_as("application/octet-stream", bytes)
}

/// Encodes bytes as a data URI with a media type.
pub(super) fn encode_as(media_type: &str, bytes: &[u8]) -> String {
    let mut uri = format!("data:{media_type};base64,");
    engine().encode_string(bytes, &mut uri);
    uri
}

/// Base64 that is written with padding, and read with or without it.
fn engine() -> GeneralPurpose {
    let config =
        GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent);
    GeneralPurpose::new(&STANDARD, config)
}

/// Decodes percent escapes.
pub(super) fn unescape(text: &str) -> Result<Cow<'_, [u8]>, String> {
    if !text.contains('%') {
        return Ok(Cow::Borrowed(text.as_bytes()));
    }
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let [first, tail @ ..] = rest {
        rest = tail;
        if *first != b'%' {
            bytes.push(*first);
            continue;
        }
        let digits = tail.first_chunk::<2>();
        let digit = |b: u8| char::from(b).to_digit(16);
        let value = digits.and_then(|&[a, b]| Some(digit(a)? * 16 + digit(b)?));
        let Some(value) = value.and_then(|value| u8::try_from(value).ok()) else {
            return Err("`%` is not followed by two hexadecimal digits".to_owned());
        };
        bytes.push(value);
        rest = &tail[2..];
    }
    Ok(Cow::Owned(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_uris_are_decoded() {
        assert_eq!(
            decode("application/octet-stream;base64,AAEC/w==").unwrap(),
            [0, 1, 2, 255]
        );
        assert_eq!(decode(";base64,AAEC%2fw").unwrap(), [0, 1, 2, 255]);
        assert_eq!(decode("text/plain,a%20b").unwrap(), b"a b");
        assert_eq!(
            decode(&encode(&[0, 1, 2, 255])[5..]).unwrap(),
            [0, 1, 2, 255]
        );
        assert!(decode("base64").unwrap_err().contains("comma"));
        assert!(
            decode(";base64,A*==")
                .unwrap_err()
                .starts_with("the base64 data is wrong")
        );
        assert!(
            decode(",%F")
                .unwrap_err()
                .starts_with("`%` is not followed")
        );
    }
}
