//! The two containers of glTF 2.0: a JSON file, and the chunks of a GLB.
//!
//! Source: glTF 2.0 specification, section 4, "GLB File Format Specification".

use std::ops::Range;

use crate::error::{IoError, Place, Warning};
use crate::text;

/// The magic number of a GLB.
pub(super) const MAGIC: &[u8; 4] = b"glTF";
const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;
const JSON: u32 = 0x4E4F_534A;
const BIN: u32 = 0x004E_4942;

/// The locations of the parts of a file.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Container {
    /// The JSON text, without a byte order mark and without padding.
    pub(super) json: Range<usize>,
    /// The binary chunk of a GLB.
    pub(super) bin: Option<Range<usize>>,
    /// Additional chunks of a GLB with their headers, and any bytes after its end.
    pub(super) others: Vec<Range<usize>>,
    pub(super) is_binary: bool,
}

impl Container {
    /// Splits a file into its parts.
    pub(super) fn read(bytes: &[u8], warnings: &mut Vec<Warning>) -> Result<Self, IoError> {
        if bytes.starts_with(MAGIC) {
            return Self::read_binary(bytes, warnings);
        }
        let start = text::after_bom(bytes);
        if start > 0 {
            warnings.push(Warning {
                place: Some(Place::Byte(0)),
                message:
                    "a byte order mark stands before the JSON, against the rules of glTF; it is \
                          skipped"
                        .to_owned(),
            });
        }
        Ok(Self {
            json: trimmed(bytes, start..bytes.len()),
            bin: None,
            others: Vec::new(),
            is_binary: false,
        })
    }

    fn read_binary(bytes: &[u8], warnings: &mut Vec<Warning>) -> Result<Self, IoError> {
        let (Some(version), Some(length)) = (word(bytes, 4), word(bytes, 8)) else {
            return Err(problem(
                bytes.len(),
                "the file ends within the 12 bytes of the GLB header".to_owned(),
            ));
        };
        if version != 2 {
            return Err(IoError::Unsupported {
                feature: match version {
                    1 => "glTF 1.0 (a GLB of version 1)".to_owned(),
                    _ => format!("version {version} of GLB"),
                },
                remedy: "convert the file to glTF 2.0",
            });
        }
        let length = length as usize;
        if length > bytes.len() {
            return Err(problem(
                8,
                format!(
                    "the header promises {length} bytes and the file has {}; it was cut short",
                    bytes.len()
                ),
            ));
        }
        if length < HEADER + CHUNK_HEADER {
            return Err(problem(
                8,
                format!("the header promises {length} bytes, too few for a JSON chunk"),
            ));
        }
        let (mut json, mut bin, mut others) = (None, None, Vec::new());
        let mut at = HEADER;
        while at < length {
            let (Some(size), Some(kind)) = (word(bytes, at), word(bytes, at + 4)) else {
                return Err(cut(at, CHUNK_HEADER, bytes.len() - at));
            };
            if length - at < CHUNK_HEADER {
                return Err(cut(at, CHUNK_HEADER, length - at));
            }
            let start = at + CHUNK_HEADER;
            let size = size as usize;
            if size > length - start {
                return Err(cut(at, size, length - start));
            }
            let end = start + size;
            match kind {
                JSON if json.is_none() && at == HEADER => json = Some(start..end),
                _ if json.is_none() => {
                    let message = "the first chunk of a GLB must be its JSON".to_owned();
                    return Err(problem(at + 4, message));
                }
                BIN if bin.is_none() => {
                    if !others.is_empty() {
                        let message = "the BIN chunk of a GLB must come second, right after \
                                       its JSON";
                        return Err(problem(at + 4, message.to_owned()));
                    }
                    bin = Some(start..end);
                }
                _ => others.push(at..end),
            }
            at = end;
        }
        if length < bytes.len() {
            warnings.push(Warning {
                place: Some(Place::Byte(length)),
                message: format!(
                    "{} bytes follow the end of the GLB; they are not read",
                    bytes.len() - length
                ),
            });
            others.push(length..bytes.len());
        }
        let json = json.unwrap_or(HEADER..HEADER);
        Ok(Self {
            json: trimmed(bytes, json),
            bin,
            others,
            is_binary: true,
        })
    }
}

impl Container {
    /// The chunks of a GLB that are neither JSON nor data, and the bytes after its end.
    pub(super) fn further<'a>(
        &'a self,
        file: &'a [u8],
    ) -> (impl Iterator<Item = &'a [u8]> + Clone, &'a [u8]) {
        // The end of the GLB as stated in its header; every chunk lies before it.
        let end = word(file, 8).map_or(0, |length| length as usize);
        let is_chunk = move |range: &&Range<usize>| range.start < end;
        let chunks = self.others.iter().filter(is_chunk);
        let trailing = if self.is_binary { end } else { file.len() };
        (
            chunks.map(|range| &file[range.clone()]),
            file.get(trailing..).unwrap_or(&[]),
        )
    }
}

/// Assembles a GLB from its parts; `others` are chunks with their headers.
pub(super) fn write_binary<'a>(
    json: &str,
    bin: Option<&[u8]>,
    others: impl Iterator<Item = &'a [u8]> + Clone,
    trailing: &[u8],
) -> Result<Vec<u8>, IoError> {
    let padded = |length: usize| length.next_multiple_of(4);
    let mut length = HEADER + CHUNK_HEADER + padded(json.len());
    length += bin.map_or(0, |bin| CHUNK_HEADER + padded(bin.len()));
    length += others.clone().map(<[u8]>::len).sum::<usize>();
    let length_word = u32::try_from(length).map_err(|_| IoError::Unsupported {
        feature: "a GLB of 4 GiB or more".to_owned(),
        remedy: "write a .gltf",
    })?;
    let mut out = Vec::with_capacity(length + trailing.len());
    out.extend_from_slice(MAGIC);
    out.extend_from_slice(&2u32.to_le_bytes());
    out.extend_from_slice(&length_word.to_le_bytes());
    // The total fits 32 bits, so each part does.
    let mut chunk = |kind: u32, bytes: &[u8], padding: u8| {
        out.extend_from_slice(&(padded(bytes.len()) as u32).to_le_bytes());
        out.extend_from_slice(&kind.to_le_bytes());
        out.extend_from_slice(bytes);
        out.resize(out.len().next_multiple_of(4), padding);
    };
    chunk(JSON, json.as_bytes(), b' ');
    if let Some(bin) = bin {
        chunk(BIN, bin, 0);
    }
    others.for_each(|chunk| out.extend_from_slice(chunk));
    out.extend_from_slice(trailing);
    Ok(out)
}

/// The 32-bit number at an offset.
fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let bytes = bytes.get(at..)?.first_chunk::<4>()?;
    Some(u32::from_le_bytes(*bytes))
}

/// Removes surrounding whitespace and zeros: some writers pad JSON with zeros.
fn trimmed(bytes: &[u8], span: Range<usize>) -> Range<usize> {
    let is_padding = |b: &u8| b.is_ascii_whitespace() || *b == 0;
    let end = bytes[span.clone()]
        .iter()
        .rposition(|b| !is_padding(b))
        .map_or(span.start, |last| span.start + last + 1);
    span.start..end
}

fn cut(at: usize, promised: usize, found: usize) -> IoError {
    problem(
        at,
        format!("a chunk of {promised} bytes is promised, but {found} are left; it was cut short"),
    )
}

fn problem(byte: usize, problem: String) -> IoError {
    IoError::Malformed {
        place: Place::Byte(byte),
        problem,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> Result<Container, String> {
        let mut warnings = Vec::new();
        Container::read(bytes, &mut warnings).map_err(|error| error.to_string())
    }

    #[test]
    fn chunks_are_found_and_put_together_again() {
        let extra = [4, 0, 0, 0, b'X', b'Y', b'Z', b'W', 1, 2, 3, 4];
        let glb = write_binary("{}", Some(&[7; 5]), [&extra[..]].into_iter(), b"end").unwrap();
        let container = read(&glb).unwrap();
        assert_eq!(&glb[container.json.clone()], b"{}");
        assert_eq!(
            &glb[container.bin.clone().unwrap()],
            &[7, 7, 7, 7, 7, 0, 0, 0]
        );
        let others: Vec<_> = container.others.iter().map(|r| &glb[r.clone()]).collect();
        assert_eq!(others, [&extra[..], b"end"]);
        assert!(container.is_binary);
    }

    #[test]
    fn data_behind_another_chunk_is_refused() {
        let extra = [0, 0, 0, 0, b'X', b'Y', b'Z', b'W'];
        let data = [4, 0, 0, 0, b'B', b'I', b'N', 0, 1, 2, 3, 4];
        let glb = write_binary("{}", None, [&extra[..], &data].into_iter(), b"").unwrap();
        assert_eq!(
            read(&glb).unwrap_err(),
            "byte 36: the BIN chunk of a GLB must come second, right after its JSON"
        );
    }

    #[test]
    fn lengths_are_checked_against_what_is_there() {
        let glb = write_binary("{\"a\":1}", Some(&[7; 8]), [].into_iter(), b"").unwrap();
        for end in 4..glb.len() {
            let error = read(&glb[..end]).unwrap_err();
            assert!(
                error.contains("cut short") || error.contains("ends within"),
                "{error}"
            );
        }
        let mut promised = glb.clone();
        promised[8..12].copy_from_slice(&u32::MAX.to_le_bytes());
        let error = read(&promised).unwrap_err();
        assert!(
            error.starts_with("byte 8: the header promises 4294967295 bytes"),
            "{error}"
        );
        let mut chunk = glb.clone();
        chunk[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
        let error = read(&chunk).unwrap_err();
        assert!(
            error.starts_with("byte 12: a chunk of 4294967295 bytes"),
            "{error}"
        );
        let mut short = glb.clone();
        short[8..12].copy_from_slice(&11u32.to_le_bytes());
        assert!(
            read(&short)
                .unwrap_err()
                .contains("too few for a JSON chunk")
        );
        let mut version = glb.clone();
        version[4] = 1;
        assert!(
            read(&version)
                .unwrap_err()
                .starts_with("glTF 1.0 (a GLB of version 1) is not supported")
        );
        let mut kind = glb;
        kind[16] = b'X';
        assert!(
            read(&kind)
                .unwrap_err()
                .contains("the first chunk of a GLB must be its JSON")
        );
    }
}
