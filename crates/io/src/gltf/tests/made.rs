//! Small generated files of all kinds.

use std::sync::Arc;

use serde_json::{Value, json};

use crate::document::Document;
use crate::error::IoError;
use crate::file::{read, read_with};
use crate::gltf::container::write_binary;
use crate::gltf::external::External;
use crate::limits::Limits;
use crate::resolve::{NoFiles, Resolve};

/// Growing data, with a view for each piece.
#[derive(Default)]
pub(super) struct Made {
    pub(super) data: Vec<u8>,
    pub(super) views: Vec<Value>,
    pub(super) accessors: Vec<Value>,
}

impl Made {
    pub(super) fn view(&mut self, bytes: &[u8]) -> usize {
        let start = self.data.len();
        self.data.extend_from_slice(bytes);
        self.views
            .push(json!({"buffer": 0, "byteOffset": start, "byteLength": bytes.len()}));
        self.data.resize(self.data.len().next_multiple_of(4), 0);
        self.views.len() - 1
    }

    pub(super) fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    pub(super) fn floats(&mut self, shape: &str, values: &[f32]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let size = match shape {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            _ => 4,
        };
        self.accessor(json!({
            "bufferView": view, "componentType": 5126, "count": values.len() / size, "type": shape,
        }))
    }

    pub(super) fn indices(&mut self, indices: &[u16]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|x| x.to_le_bytes()).collect();
        let view = self.view(&bytes);
        self.accessor(json!({
            "bufferView": view, "componentType": 5123, "count": indices.len(), "type": "SCALAR",
        }))
    }

    /// The JSON with these additional members.
    pub(super) fn json(&self, more: &Value) -> Value {
        let mut root = json!({
            "asset": {"version": "2.0"},
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{"byteLength": self.data.len()}],
        });
        for (key, value) in more.as_object().unwrap() {
            root[key] = value.clone();
        }
        root
    }

    pub(super) fn glb(&self, more: &Value) -> Vec<u8> {
        let json = self.json(more).to_string();
        write_binary(&json, Some(&self.data), [].into_iter(), &[]).unwrap()
    }
}

/// A tetrahedron: its corners and its faces.
pub(super) const CORNERS: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
pub(super) const FACES: [u16; 12] = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];

/// A tetrahedron with these additional members, shown by `node`.
pub(super) fn tetrahedron(node: &Value) -> Vec<u8> {
    let mut made = Made::default();
    let positions = made.floats("VEC3", &CORNERS);
    let indices = made.indices(&FACES);
    made.glb(&json!({
        "nodes": [node],
        "meshes": [{"primitives": [{"attributes": {"POSITION": positions}, "indices": indices}]}],
    }))
}

pub(super) fn open(bytes: &[u8]) -> Result<Document, IoError> {
    read(bytes, None, &Limits::default())
}

pub(super) fn refused(bytes: &[u8]) -> String {
    open(bytes).map(|_| ()).unwrap_err().to_string()
}

pub(super) fn volume(document: &Document) -> f64 {
    let p = |v: u32| document.positions()[v as usize].coords;
    let triple = |f: &[u32]| p(f[0]).dot(&p(f[1]).cross(&p(f[2])));
    document.faces().iter().map(triple).sum::<f64>() / 6.0
}

/// The files of a glTF without external files.
pub(super) fn no_files() -> External {
    External::new(NoFiles.shared())
}

/// A resolver for a single file.
#[derive(Clone, Debug)]
pub(super) struct One(pub(super) &'static str, pub(super) Vec<u8>);

impl Resolve for One {
    fn resolve(&self, uri: &str, _max_bytes: u64) -> Result<Vec<u8>, std::io::Error> {
        if uri == self.0 {
            Ok(self.1.clone())
        } else {
            Err(std::io::ErrorKind::NotFound.into())
        }
    }

    fn shared(&self) -> Arc<dyn Resolve> {
        Arc::new(self.clone())
    }
}

pub(super) fn open_with(bytes: &[u8], resolver: &One) -> Result<Document, IoError> {
    read_with(bytes, None, &Limits::default(), resolver)
}

/// The JSON of a GLB.
pub(super) fn json_of(glb: &[u8]) -> Value {
    let length = u32::from_le_bytes(*glb[12..].first_chunk().unwrap()) as usize;
    serde_json::from_slice(&glb[20..20 + length]).unwrap()
}
