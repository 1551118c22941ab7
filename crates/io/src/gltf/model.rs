//! The geometry-related JSON of a glTF.
//!
//! It is read with serde_json into our own types. The `gltf` crate has types for all of glTF, but
//! they silently truncate indices to 32 bits, keep every number of `min` and `max` as a JSON
//! value of 32 bytes, and have only 32-bit node transforms, and the crate's validation panics if
//! a POSITION refers to a missing accessor. Everything other than geometry (materials,
//! animations, …) is kept as text and not validated.

use std::borrow::Cow;
use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::value::RawValue;

use crate::error::{IoError, Place};
use crate::limits::Limits;

#[derive(Deserialize, Debug)]
pub(super) struct Root<'a> {
    pub(super) asset: Asset,
    #[serde(default, rename = "extensionsRequired")]
    pub(super) extensions_required: Vec<String>,
    pub(super) scene: Option<u64>,
    #[serde(default)]
    pub(super) scenes: Vec<Scene>,
    #[serde(default)]
    pub(super) nodes: Vec<Node>,
    #[serde(default)]
    pub(super) meshes: Vec<Mesh>,
    #[serde(default)]
    pub(super) accessors: Vec<Accessor>,
    #[serde(default, rename = "bufferViews")]
    pub(super) views: Vec<View>,
    #[serde(default, borrow)]
    pub(super) buffers: Vec<Buffer<'a>>,
    #[serde(default)]
    pub(super) materials: Vec<Named>,
    #[serde(default)]
    pub(super) images: Vec<Image>,
    #[serde(default)]
    pub(super) skins: Vec<Skin>,
    #[serde(default)]
    pub(super) animations: Vec<Animation>,
    #[serde(default)]
    pub(super) cameras: Vec<IgnoredAny>,
    pub(super) extras: Option<IgnoredAny>,
    pub(super) extensions: Option<IgnoredAny>,
}

#[derive(Deserialize, Debug)]
pub(super) struct Asset {
    pub(super) version: String,
    #[serde(rename = "minVersion")]
    pub(super) min_version: Option<String>,
}

#[derive(Deserialize, Debug)]
pub(super) struct Scene {
    #[serde(default)]
    pub(super) nodes: Vec<u64>,
}

#[derive(Deserialize, Debug)]
pub(super) struct Node {
    #[serde(default)]
    pub(super) children: Vec<u64>,
    pub(super) name: Option<Box<str>>,
    pub(super) mesh: Option<u64>,
    pub(super) skin: Option<u64>,
    // Boxed, so that a file of many empty nodes does not take much more memory than its own size.
    pub(super) matrix: Option<Box<[f64; 16]>>,
    pub(super) translation: Option<Box<[f64; 3]>>,
    pub(super) rotation: Option<Box<[f64; 4]>>,
    pub(super) scale: Option<Box<[f64; 3]>>,
    pub(super) extensions: Option<Box<NodeExtensions>>,
}

#[derive(Deserialize, Debug)]
pub(super) struct NodeExtensions {
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub(super) instancing: Option<Instancing>,
}

/// Transforms of the instances shown by a node.
#[derive(Deserialize, Debug)]
pub(super) struct Instancing {
    #[serde(default)]
    pub(super) attributes: BTreeMap<String, u64>,
}

#[derive(Deserialize, Debug)]
pub(super) struct Mesh {
    #[serde(default)]
    pub(super) name: String,
    pub(super) primitives: Vec<Primitive>,
}

#[derive(Deserialize, Debug)]
pub(super) struct Primitive {
    #[serde(default)]
    pub(super) attributes: BTreeMap<String, u64>,
    pub(super) indices: Option<u64>,
    pub(super) material: Option<u64>,
    #[serde(default = "triangles")]
    pub(super) mode: u64,
    #[serde(default)]
    pub(super) targets: Vec<BTreeMap<String, u64>>,
    #[serde(default)]
    pub(super) extensions: BTreeMap<String, IgnoredAny>,
}

fn triangles() -> u64 {
    4
}

#[derive(Deserialize, Debug)]
pub(super) struct Accessor {
    #[serde(rename = "bufferView")]
    pub(super) view: Option<u64>,
    #[serde(default, rename = "byteOffset")]
    pub(super) offset: u64,
    #[serde(rename = "componentType")]
    pub(super) component: u64,
    pub(super) count: u64,
    #[serde(rename = "type")]
    pub(super) shape: Cow<'static, str>,
    #[serde(default)]
    pub(super) normalized: bool,
    pub(super) sparse: Option<Box<Sparse>>,
    pub(super) min: Option<IgnoredAny>,
    pub(super) max: Option<IgnoredAny>,
}

#[derive(Deserialize, Debug)]
pub(super) struct Sparse {
    pub(super) count: u64,
    pub(super) indices: SparseIndices,
    pub(super) values: SparseValues,
}

#[derive(Deserialize, Debug)]
pub(super) struct SparseIndices {
    #[serde(rename = "bufferView")]
    pub(super) view: u64,
    #[serde(default, rename = "byteOffset")]
    pub(super) offset: u64,
    #[serde(rename = "componentType")]
    pub(super) component: u64,
}

#[derive(Deserialize, Debug)]
pub(super) struct SparseValues {
    #[serde(rename = "bufferView")]
    pub(super) view: u64,
    #[serde(default, rename = "byteOffset")]
    pub(super) offset: u64,
}

#[derive(Deserialize, Debug)]
pub(super) struct View {
    pub(super) buffer: u64,
    #[serde(default, rename = "byteOffset")]
    pub(super) offset: u64,
    #[serde(rename = "byteLength")]
    pub(super) length: u64,
    #[serde(rename = "byteStride")]
    pub(super) stride: Option<u64>,
    #[serde(default)]
    pub(super) extensions: BTreeMap<String, IgnoredAny>,
}

#[derive(Deserialize, Debug)]
pub(super) struct Buffer<'a> {
    #[serde(default, borrow)]
    pub(super) uri: Option<Cow<'a, str>>,
    #[serde(rename = "byteLength")]
    pub(super) length: u64,
}

#[derive(Deserialize, Debug)]
pub(super) struct Image {
    #[serde(rename = "bufferView")]
    pub(super) view: Option<u64>,
}

#[derive(Deserialize, Debug)]
pub(super) struct Named {
    pub(super) name: Option<String>,
}

#[derive(Deserialize, Debug)]
pub(super) struct Skin {
    #[serde(rename = "inverseBindMatrices")]
    pub(super) matrices: Option<u64>,
}

#[derive(Deserialize, Debug)]
pub(super) struct Animation {
    #[serde(default)]
    pub(super) samplers: Vec<Sampler>,
}

#[derive(Deserialize, Debug)]
pub(super) struct Sampler {
    pub(super) input: u64,
    pub(super) output: u64,
}

impl<'a> Root<'a> {
    /// Reads the JSON text that starts at byte `start` of the file.
    pub(super) fn read(text: &'a str, start: usize, limits: &Limits) -> Result<Self, IoError> {
        let num_values = scan(text.as_bytes(), limits)?;
        // Maximum memory of a JSON value in the types above, including the transform if it is a
        // node: `{},` counts twice.
        const VALUE: usize = 192;
        limits.check_memory(
            text.len().saturating_add(num_values.saturating_mul(VALUE)),
            0,
            0,
        )?;
        let root: Root<'a> = serde_json::from_str(text).map_err(|error| {
            first_version(text).unwrap_or_else(|| malformed(text, start, &error))
        })?;
        root.check_version()?;
        Ok(root)
    }

    fn check_version(&self) -> Result<(), IoError> {
        for version in [Some(&self.asset.version), self.asset.min_version.as_ref()] {
            let Some(version) = version else { continue };
            let mut parts = version.split('.');
            let major = parts.next().and_then(|part| part.parse::<u32>().ok());
            let minor = parts.next().and_then(|part| part.parse::<u32>().ok());
            // Minor versions are compatible unless the file requires one.
            let is_asked = Some(version) == self.asset.min_version.as_ref();
            if major != Some(2) || minor.is_none() || (is_asked && minor != Some(0)) {
                return Err(IoError::Unsupported {
                    feature: format!("glTF {}", crate::error::quote(version.as_bytes())),
                    remedy: "convert the file to glTF 2.0",
                });
            }
        }
        Ok(())
    }
}

/// The error for a glTF 1.0 file, whose lists are objects keyed by name.
fn first_version(text: &str) -> Option<IoError> {
    #[derive(Deserialize)]
    struct Probe<'a> {
        #[serde(borrow)]
        meshes: Option<&'a RawValue>,
        #[serde(borrow)]
        accessors: Option<&'a RawValue>,
        #[serde(borrow)]
        asset: Option<&'a RawValue>,
    }
    #[derive(Deserialize)]
    struct Versioned<'a> {
        #[serde(borrow)]
        version: Option<&'a RawValue>,
    }
    let probe: Probe<'_> = serde_json::from_str(text).ok()?;
    let lists = [probe.meshes, probe.accessors];
    let is_object = |value: &RawValue| value.get().starts_with('{');
    let asset = probe.asset.map(RawValue::get);
    let asset = asset.and_then(|text| serde_json::from_str::<Versioned<'_>>(text).ok());
    let version = asset.and_then(|asset| asset.version).map(RawValue::get);
    let is_first = version.is_some_and(|v| matches!(v.trim_matches('"'), "1" | "1.0" | "1.1"));
    let is_first = is_first || lists.into_iter().flatten().any(is_object);
    is_first.then(|| IoError::Unsupported {
        feature: "glTF 1.0".to_owned(),
        remedy: "convert the file to glTF 2.0, for example with `gltf-pipeline -i IN -o OUT`",
    })
}

/// Checks the nesting depth of the JSON and counts its values approximately.
fn scan(text: &[u8], limits: &Limits) -> Result<usize, IoError> {
    let (mut depth, mut count, mut at) = (0usize, 1, 0);
    while let Some(&byte) = text.get(at) {
        at += 1;
        match byte {
            b'"' => {
                while let Some(&byte) = text.get(at) {
                    at += 1;
                    match byte {
                        b'"' => break,
                        b'\\' => at += 1,
                        _ => {}
                    }
                }
            }
            b'{' | b'[' => {
                depth += 1;
                count += 1;
                limits.check_depth(depth)?;
            }
            b'}' | b']' => depth = depth.saturating_sub(1),
            b',' => count += 1,
            _ => {}
        }
    }
    Ok(count)
}

/// Converts a serde_json error to a byte position in the file.
fn malformed(text: &str, start: usize, error: &serde_json::Error) -> IoError {
    // The line and the column (in bytes) are 1-based.
    let line: usize = text
        .split_inclusive('\n')
        .take(error.line().saturating_sub(1))
        .map(str::len)
        .sum();
    let message = error.to_string();
    // The byte position replaces the one in the message.
    let message = message.split(" at line ").next().unwrap_or(&message);
    IoError::Malformed {
        place: Place::Byte(start + line + error.column().saturating_sub(1)),
        problem: format!("the JSON is wrong: {message}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<(), String> {
        Root::read(text, 0, &Limits::default())
            .map(|_| ())
            .map_err(|error| error.to_string())
    }

    #[test]
    fn versions_are_checked() {
        read(r#"{"asset":{"version":"2.0"}}"#).unwrap();
        read(r#"{"asset":{"version":"2.1"}}"#).unwrap();
        for asset in [
            r#""version":"1.0""#,
            r#""version":"1""#,
            r#""version":"two""#,
            r#""version":"2.1","minVersion":"2.1""#,
        ] {
            let error = read(&format!("{{\"asset\":{{{asset}}}}}")).unwrap_err();
            assert!(
                error.starts_with("glTF ") && error.contains(" is not supported"),
                "{error}"
            );
        }
    }

    #[test]
    fn errors_name_the_byte() {
        let error = read("{\"asset\":\n {\"version\":2}}").unwrap_err();
        assert_eq!(
            error,
            "byte 22: the JSON is wrong: invalid type: integer `2`, expected a string"
        );
        let error = read(r#"{"asset":{"version":"2.0"},"buffers":[{"byteLength":1e300}]}"#);
        assert!(error.unwrap_err().contains("expected u64"));
        let error =
            read(r#"{"asset":{"version":"2.0"},"bufferViews":[{"buffer":-1,"byteLength":1}]}"#);
        assert!(error.unwrap_err().contains("`-1`"));
        assert!(read("{").unwrap_err().starts_with("byte "));
        assert!(read("{}").unwrap_err().contains("missing field `asset`"));
    }

    #[test]
    fn deep_nesting_is_refused() {
        let deep = |depth: usize| {
            let (open, close) = ("[".repeat(depth), "]".repeat(depth));
            format!(r#"{{"asset":{{"version":"2.0"}},"extras":{open}{close}}}"#)
        };
        read(&deep(100)).unwrap();
        let error = read(&deep(128)).unwrap_err();
        assert!(
            error.starts_with("more than 128 levels of nesting"),
            "{error}"
        );
        read(&deep(1_000_000)).unwrap_err();
        // Brackets in strings do not count.
        let text = format!(
            r#"{{"asset":{{"version":"2.0","x":"\"{}"}}}}"#,
            "[".repeat(500)
        );
        read(&text).unwrap();
    }
}
