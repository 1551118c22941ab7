//! Documents with shared accessors, external files, instances, transforms and materials are
//! edited, repaired and converted without losing anything that `losses` does not list.
//!
//! The expected contents of a document are computed here from its construction, without the
//! reader.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]
#![allow(clippy::type_complexity, reason = "tuples of strategies")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use cotan_io::{
    Change, Companions, Document, Folder, Format, LabelKind, Limits, NONE, Repair, UV, load_with,
    save_with,
};
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use serde_json::{Value, json};

/// The construction of a document.
#[derive(Clone, Debug)]
struct Made {
    /// The size of the tetrahedron of each POSITION accessor.
    sizes: Vec<u8>,
    /// The primitives of each mesh.
    meshes: Vec<Vec<Primitive>>,
    nodes: Vec<Node>,
    /// For each of the two buffers, `true` if it is an external file.
    is_external: [bool; 2],
    extras: u32,
}

#[derive(Clone, Copy, Debug)]
struct Primitive {
    positions: usize,
    /// The index accessor; the last one has a face without area.
    indices: usize,
    material: Option<usize>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    mesh: Option<usize>,
    parent: Option<usize>,
    /// In quarters, so that all sums are exact.
    translation: [i8; 3],
    scale: f64,
    /// `true` if its mesh is shown at each corner of the first tetrahedron.
    is_instanced: bool,
}

const CORNERS: [[f32; 3]; 4] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
];
const FACES: [[u16; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
const FLAT: [u16; 3] = [1, 1, 2];
const NUM_INDICES: usize = 3;
const MATERIALS: [&str; 3] = ["red", "green", "blue"];
const PNG: &[u8] = b"\x89PNG\r\n\x1a\nno pixels";

impl Made {
    fn corner(&self, accessor: usize, v: u16) -> [f32; 3] {
        let [x, y, z] = CORNERS[usize::from(v)].map(|x| x * f32::from(self.sizes[accessor]));
        // No two tetrahedra touch.
        [x + 8.0 * accessor as f32, y, z]
    }

    fn faces(indices: usize) -> Vec<[u16; 3]> {
        let flat = (indices + 1 == NUM_INDICES).then_some(FLAT);
        FACES.into_iter().chain(flat).collect()
    }

    /// The texture coordinate of a vertex; it differs between accessors.
    fn uv(accessor: usize, v: u16) -> [f32; 2] {
        [f32::from(v) / 4.0, accessor as f32 / 4.0]
    }

    /// Writes `m.gltf` and its files.
    fn write(&self, folder: &Path) {
        let mut data = [Vec::new(), Vec::new()];
        let (mut views, mut accessors) = (Vec::new(), Vec::new());
        let mut push = |buffer: usize, bytes: Vec<u8>, mut accessor: Value| {
            let data: &mut Vec<u8> = &mut data[buffer];
            accessor["bufferView"] = views.len().into();
            views.push(json!({
                "buffer": buffer, "byteOffset": data.len(), "byteLength": bytes.len(),
            }));
            data.extend(bytes);
            data.resize(data.len().next_multiple_of(4), 0);
            accessors.push(accessor);
        };
        let floats = |x: Vec<f32>| {
            x.into_iter()
                .flat_map(f32::to_le_bytes)
                .collect::<Vec<u8>>()
        };
        for accessor in 0..self.sizes.len() {
            let values = (0..4).flat_map(|v| self.corner(accessor, v)).collect();
            let json = json!({"componentType": 5126, "count": 4, "type": "VEC3"});
            push(0, floats(values), json);
            let values = (0..4).flat_map(|v| Self::uv(accessor, v)).collect();
            let json = json!({"componentType": 5126, "count": 4, "type": "VEC2"});
            push(1, floats(values), json);
        }
        for indices in 0..NUM_INDICES {
            let faces = Self::faces(indices);
            let bytes = faces.as_flattened().iter().flat_map(|i| i.to_le_bytes());
            let json = json!({"componentType": 5123, "count": 3 * faces.len(), "type": "SCALAR"});
            push(1, bytes.collect(), json);
        }
        let names = ["points.bin", "sub/other.bin"];
        let buffers = data.iter().enumerate().map(|(n, bytes)| {
            let uri = if self.is_external[n] {
                fs::create_dir_all(folder.join("sub")).unwrap();
                fs::write(folder.join(names[n]), bytes).unwrap();
                names[n].to_owned()
            } else {
                let hex = bytes.iter().map(|b| format!("%{b:02x}"));
                format!("data:application/octet-stream,{}", hex.collect::<String>())
            };
            json!({"uri": uri, "byteLength": bytes.len()})
        });
        let meshes = self.meshes.iter().enumerate().map(|(m, primitives)| {
            let primitives = primitives.iter().map(|p| {
                let mut json = json!({
                    "attributes": {"POSITION": 2 * p.positions, "TEXCOORD_0": 2 * p.positions + 1},
                    "indices": 2 * self.sizes.len() + p.indices,
                });
                if let Some(material) = p.material {
                    json["material"] = material.into();
                }
                json
            });
            json!({
                "name": format!("mesh{m}"), "primitives": primitives.collect::<Vec<_>>(),
                "extras": {"mesh": m, "uri": "nothing.bin"},
            })
        });
        let nodes = self.nodes.iter().enumerate().map(|(n, node)| {
            let mut json = json!({
                "name": format!("node{n}"), "extras": {"node": self.extras},
                "translation": node.translation.map(|x| f64::from(x) / 4.0),
                "scale": [node.scale, node.scale, node.scale],
            });
            let children = self.nodes.iter().enumerate();
            let children = children.filter(|(_, child)| child.parent == Some(n));
            let children: Vec<usize> = children.map(|(child, _)| child).collect();
            if !children.is_empty() {
                json["children"] = children.into();
            }
            if let Some(mesh) = node.mesh {
                json["mesh"] = mesh.into();
            }
            if node.is_instanced {
                json["extensions"] =
                    json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}});
            }
            json
        });
        let materials = MATERIALS.map(|name| {
            json!({"name": name, "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
        });
        fs::create_dir_all(folder.join("textures")).unwrap();
        fs::write(folder.join("textures/t.png"), PNG).unwrap();
        let json = json!({
            "asset": {"version": "2.0"}, "extras": {"root": self.extras},
            "extensionsUsed": ["EXT_mesh_gpu_instancing"],
            "nodes": nodes.collect::<Vec<_>>(), "meshes": meshes.collect::<Vec<_>>(),
            "materials": materials, "textures": [{"source": 0}],
            "images": [{"uri": "textures/t.png"}],
            "accessors": accessors, "bufferViews": views,
            "buffers": buffers.collect::<Vec<_>>(),
        });
        fs::write(folder.join("m.gltf"), json.to_string()).unwrap();
    }

    /// The transform from node coordinates to scene coordinates: a factor and an offset.
    fn global(&self, node: usize) -> (f64, Vector3<f64>) {
        let own = self.nodes[node];
        let offset = Vector3::from(own.translation.map(|x| f64::from(x) / 4.0));
        match own.parent.map(|parent| self.global(parent)) {
            None => (own.scale, offset),
            Some((scale, origin)) => (scale * own.scale, origin + offset * scale),
        }
    }

    /// The places at which a mesh is shown, each once; its own coordinates if no node shows it.
    fn places(&self, mesh: usize) -> Vec<(f64, Vector3<f64>)> {
        let mut places = Vec::new();
        let mut seen = BTreeSet::new();
        for node in self.order() {
            if self.nodes[node].mesh != Some(mesh) {
                continue;
            }
            let (scale, offset) = self.global(node);
            if self.nodes[node].is_instanced {
                let corners = (0..4).map(|v| Vector3::from(self.corner(0, v).map(f64::from)));
                places.extend(corners.map(|corner| (scale, offset + corner * scale)));
                continue;
            }
            let bits = [scale, offset.x, offset.y, offset.z].map(|x| (x + 0.0).to_bits());
            if seen.insert(bits) {
                places.push((scale, offset));
            }
        }
        if places.is_empty() {
            places.push((1.0, Vector3::zeros()));
        }
        places
    }

    /// The nodes, depth first.
    fn order(&self) -> Vec<usize> {
        let roots = (0..self.nodes.len()).filter(|&n| self.nodes[n].parent.is_none());
        let mut stack: Vec<usize> = roots.collect();
        stack.reverse();
        let mut order = Vec::new();
        while let Some(node) = stack.pop() {
            order.push(node);
            let children = (0..self.nodes.len()).rev();
            stack.extend(children.filter(|&child| self.nodes[child].parent == Some(node)));
        }
        order
    }

    /// Everything that is shown, face by face.
    fn shown(&self, flat: Flat) -> BTreeMap<Shown, usize> {
        let mut shown = BTreeMap::new();
        for (mesh, primitives) in self.meshes.iter().enumerate() {
            for (scale, offset) in self.places(mesh) {
                for primitive in primitives {
                    for face in Self::faces(primitive.indices) {
                        if flat == Flat::Dropped && face == FLAT {
                            continue;
                        }
                        let at = |v: u16| {
                            let p = self.corner(primitive.positions, v).map(f64::from);
                            Point3::from(Vector3::from(p) * scale + offset)
                        };
                        let uv = |v: u16| {
                            let [u, v] = Self::uv(primitive.positions, v).map(f64::from);
                            [u, 1.0 - v]
                        };
                        let shown = shown.entry(Shown::new(
                            face.map(at),
                            Some(face.map(uv)),
                            primitive.material.map(|m| MATERIALS[m].to_owned()),
                            Some(format!("mesh{mesh}")),
                        ));
                        *shown.or_default() += 1;
                    }
                }
            }
        }
        shown
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Flat {
    Kept,
    Dropped,
}

/// A face: its corners in any order, and the attributes that are compared.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Shown {
    corners: Vec<([i64; 3], Option<[i64; 2]>)>,
    material: Option<String>,
    object: Option<String>,
}

impl Shown {
    fn new(
        corners: [Point3<f64>; 3],
        uvs: Option<[[f64; 2]; 3]>,
        material: Option<String>,
        object: Option<String>,
    ) -> Self {
        // All coordinates are multiples of a small power of two, so this does not round.
        let whole = |x: f64| {
            let scaled = x * 4096.0;
            assert_eq!(scaled.fract(), 0.0, "{x}");
            scaled as i64
        };
        let corner = |k: usize| {
            let uv = uvs.map(|uvs| uvs[k].map(whole));
            (corners[k].coords.map(whole).into(), uv)
        };
        let mut corners = vec![corner(0), corner(1), corner(2)];
        corners.sort();
        Self {
            corners,
            material,
            object,
        }
    }
}

/// The attributes of a file that are compared.
#[derive(Clone, Copy, Debug)]
struct Compared {
    uvs: bool,
    labels: bool,
}

fn shown_by(document: &Document, compared: Compared) -> BTreeMap<Shown, usize> {
    let attributes = document.attributes().unwrap();
    let mut shown = BTreeMap::new();
    for (number, face) in document.faces().iter().enumerate() {
        let label = |kind: LabelKind| {
            let labels = attributes.label(kind).filter(|_| compared.labels)?;
            let name = labels.faces[number];
            (name != NONE).then(|| labels.names[name as usize].clone())
        };
        let uv = |k: usize| {
            let (values, at) = match attributes.vertex(UV) {
                Some(uvs) => (&uvs.values, 2 * face[k] as usize),
                None => {
                    let uvs = attributes.corner(UV)?;
                    let corner = document.faces().corner_range(number).start + k;
                    (&uvs.values, 2 * uvs.indices[corner] as usize)
                }
            };
            Some([values.get(at)?, values.get(at + 1)?])
        };
        let uvs = compared.uvs.then(|| [0, 1, 2].map(|k| uv(k).unwrap()));
        let corners = [0, 1, 2].map(|k| document.positions()[face[k] as usize]);
        let face = Shown::new(
            corners,
            uvs,
            label(LabelKind::Material),
            label(LabelKind::Object),
        );
        *shown.entry(face).or_default() += 1;
    }
    shown
}

/// Reduces the faces to the attributes that are compared.
fn only(shown: BTreeMap<Shown, usize>, compared: Compared) -> BTreeMap<Shown, usize> {
    let mut out = BTreeMap::new();
    for (mut face, count) in shown {
        if !compared.uvs {
            face.corners.iter_mut().for_each(|(_, uv)| *uv = None);
        }
        face.corners.sort();
        if !compared.labels {
            (face.material, face.object) = (None, None);
        }
        *out.entry(face).or_default() += count;
    }
    out
}

fn made() -> impl Strategy<Value = Made> {
    let sizes = prop::collection::vec(1u8..4, 1..4);
    let primitive = (
        0usize..3,
        0..NUM_INDICES,
        prop::option::of(0..MATERIALS.len()),
    );
    let meshes = prop::collection::vec(prop::collection::vec(primitive, 1..4), 1..4);
    let node = (
        prop::option::weighted(0.8, 0usize..4),
        any::<prop::sample::Index>(),
        any::<[i8; 3]>(),
        prop::sample::select(&[1.0, 2.0, 0.5, -1.0][..]),
        prop::bool::weighted(0.15),
    );
    let nodes = prop::collection::vec(node, 0..6);
    let rest = (any::<[bool; 2]>(), any::<u32>());
    (sizes, meshes, nodes, rest).prop_map(|(sizes, meshes, nodes, (is_external, extras))| {
        let (num_positions, num_meshes) = (sizes.len(), meshes.len());
        let primitive = |(positions, indices, material): (usize, usize, Option<usize>)| Primitive {
            positions: positions % num_positions,
            indices,
            material,
        };
        let meshes = meshes.into_iter();
        let node = |(n, (mesh, parent, translation, scale, is_instanced)): (
            usize,
            (Option<usize>, prop::sample::Index, [i8; 3], f64, bool),
        )| Node {
            mesh: mesh.map(|mesh| mesh % num_meshes),
            // One of the previous nodes, or none.
            parent: parent.index(n + 1).checked_sub(1),
            translation,
            scale,
            is_instanced: is_instanced && mesh.is_some(),
        };
        Made {
            meshes: meshes
                .map(|primitives| primitives.into_iter().map(primitive).collect())
                .collect(),
            nodes: nodes.into_iter().enumerate().map(node).collect(),
            sizes,
            is_external,
            extras,
        }
    })
}

fn open(path: &Path) -> Document {
    load_with(path, &Limits::default(), &Folder::of(path)).unwrap()
}

/// Saves a document to another folder and checks the result.
fn check_saved(
    document: &Document,
    original: &Value,
    format: Format,
    companions: Companions,
) -> Result<(), TestCaseError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder
        .path()
        .join("saved")
        .with_extension(format.extension());
    let saved = save_with(document, &path, companions).unwrap();
    prop_assert!(saved.left.is_empty(), "{saved:?}");
    prop_assert!(document.losses(format).is_empty());
    let again = open(&path);
    prop_assert_eq!(again.positions(), document.positions());
    prop_assert_eq!(again.faces(), document.faces());
    prop_assert_eq!(again.attributes().unwrap(), document.attributes().unwrap());
    let bytes = fs::read(&path).unwrap();
    let json: Value = match format {
        Format::Glb => {
            let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
            serde_json::from_slice(&bytes[20..20 + length]).unwrap()
        }
        _ => serde_json::from_slice(&bytes).unwrap(),
    };
    for key in [
        "nodes",
        "materials",
        "textures",
        "extras",
        "asset",
        "extensionsUsed",
    ] {
        prop_assert_eq!(&json[key], &original[key], "{}", key);
    }
    for (mesh, old) in json["meshes"]
        .as_array()
        .unwrap()
        .iter()
        .zip(original["meshes"].as_array().unwrap())
    {
        prop_assert_eq!(&mesh["name"], &old["name"]);
        prop_assert_eq!(&mesh["extras"], &old["extras"]);
        let count = |mesh: &Value| mesh["primitives"].as_array().unwrap().len();
        prop_assert_eq!(count(mesh), count(old));
    }
    if companions == Companions::Embedded {
        prop_assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    } else {
        prop_assert_eq!(fs::read(folder.path().join("textures/t.png")).unwrap(), PNG);
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn nothing_is_lost_that_is_not_named(
        made in made(),
        moves in prop::collection::vec((any::<prop::sample::Index>(), any::<[i8; 3]>()), 0..4),
    ) {
        let folder = tempfile::tempdir().unwrap();
        made.write(folder.path());
        let path = folder.path().join("m.gltf");
        let original: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        let mut document = open(&path);

        // After conversion, every instance has its faces, with the data that the format can
        // represent.
        let all = made.shown(Flat::Kept);
        for (format, compared) in [
            (Format::Obj, Compared { uvs: true, labels: true }),
            (Format::Ply, Compared { uvs: true, labels: false }),
            (Format::Off, Compared { uvs: false, labels: false }),
            (Format::Stl, Compared { uvs: false, labels: false }),
        ] {
            let converted = cotan_io::read(document.write(format).unwrap(), None, &Limits::default());
            let converted = shown_by(&converted.unwrap(), compared);
            prop_assert_eq!(&converted, &only(all.clone(), compared), "{}", format);
            let losses = document.losses(format).join("\n");
            prop_assert!(compared.labels || losses.contains("material"), "{}", losses);
            // An OBJ has its material library and the images next to it.
            prop_assert!(format == Format::Obj || losses.contains("image"), "{}", losses);
        }

        // A repair drops exactly the faces without area.
        let repaired = Repair::default().apply(&document).unwrap();
        let is_drop = |change: &Change| matches!(change, Change::DroppedDegenerate { .. });
        prop_assert!(repaired.changes.iter().all(is_drop), "{:?}", repaired.changes);
        let repaired = repaired.document;
        repaired.surface().unwrap();
        let obj = cotan_io::read(repaired.write(Format::Obj).unwrap(), None, &Limits::default());
        let compared = Compared { uvs: true, labels: true };
        prop_assert_eq!(shown_by(&obj.unwrap(), compared), made.shown(Flat::Dropped));

        // Edited, repaired, or unchanged: in another folder it is the same, with all its files.
        let mut edited = repaired.clone();
        for document in [&mut document, &mut edited] {
            for (vertex, by) in &moves {
                let vertex = vertex.index(document.positions().len());
                let by = Vector3::from(by.map(|x| f64::from(x) / 4.0));
                let to = document.positions()[vertex] + by;
                document.set_position(vertex, to).unwrap();
            }
        }
        for document in [&document, &repaired, &edited] {
            for format in [Format::Gltf, Format::Glb] {
                for companions in [Companions::Separate, Companions::Embedded] {
                    check_saved(document, &original, format, companions)?;
                }
            }
        }
    }
}
