use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use serde_json::{Value, json};

use super::made::{CORNERS, FACES, Made, json_of, open, tetrahedron};
use crate::attributes::{
    Attributes, COLOR, CornerProperty, LabelKind, Labels, NONE, NORMAL, Property, UV, Values,
};
use crate::document::Document;
use crate::faces::FaceList;
use crate::format::Format;

fn moved(glb: &[u8], vertex: usize, to: [f64; 3]) -> (Document, Document, Vec<u8>) {
    let mut document = open(glb).unwrap();
    let format = document.format().unwrap();
    assert_eq!(document.write(format).unwrap(), glb, "unmoved");
    document.set_position(vertex, to.into()).unwrap();
    let written = document.write(format).unwrap();
    let again = open(&written).unwrap();
    assert_eq!(again.faces(), document.faces());
    for (a, b) in again.positions().iter().zip(document.positions()) {
        assert!((a - b).norm() < 1e-6, "{a} {b}");
    }
    (document, again, written)
}

#[test]
fn a_moved_vertex_changes_its_bytes_and_bounds_only() {
    let glb = tetrahedron(&json!({"mesh": 0, "scale": [-2, 1, 1], "translation": [1, 0, 0]}));
    let (_, _, written) = moved(&glb, 3, [1.0, 0.0, 5.0]);
    let mut json = json_of(&written);
    assert_eq!(json["accessors"][0]["max"], json!([1, 1, 5]));
    assert_eq!(json["accessors"][0]["min"], json!([0, 0, 0]));
    let accessor = json["accessors"][0].as_object_mut().unwrap();
    accessor.remove("min");
    accessor.remove("max");
    assert_eq!(json, json_of(&glb));
    let (old, new) = (&glb[glb.len() - 72..], &written[written.len() - 72..]);
    let differing: Vec<usize> = (0..72).filter(|&i| old[i] != new[i]).collect();
    assert!(!differing.is_empty() && differing.iter().all(|i| (44..48).contains(i)));
}

#[test]
fn the_text_of_a_gltf_is_kept() {
    let mut made = Made::default();
    let positions = made.floats("VEC3", &CORNERS);
    let uri = super::super::buffers::encode(&made.data);
    let text = format!(
        "{{ \"meshes\" : [ {{\"primitives\":[{{\"attributes\":{{\"POSITION\" :{positions}}}, \
         \"mode\":5}}]\n}} ],\t\"buffers\":[{{\"uri\":\"{uri}\",\"byteLength\":48 }}],\n\
         \"bufferViews\":[{{\"buffer\":0,\"byteLength\":48}}], \"x\": 1.50e+0, \"accessors\":\
         [{{\"min\":[0.00,0,0],\"bufferView\":0,\"count\":4,\"max\": [1, 1, 1],\"type\":\"VEC3\",\
         \"componentType\":5126 }}], \"asset\":{{\"version\":\"2.0\"}}}}\n\n"
    );
    let (_, _, written) = moved(text.as_bytes(), 0, [0.0, 0.5, 0.0]);
    let mut data = made.data.clone();
    data[4..8].copy_from_slice(&0.5f32.to_le_bytes());
    // The bounds are the same, so only the data differs.
    let expected = text.replace(&uri, &super::super::buffers::encode(&data));
    assert_eq!(String::from_utf8(written).unwrap(), expected);
    let (_, _, written) = moved(text.as_bytes(), 0, [0.0, 0.5, 2.0]);
    data[8..12].copy_from_slice(&2f32.to_le_bytes());
    let expected = text
        .replace(&uri, &super::super::buffers::encode(&data))
        .replace("[1, 1, 1]", "[1,1,2]");
    assert_eq!(String::from_utf8(written).unwrap(), expected);
}

/// A tetrahedron with the positions given by `accessor`, and the data before it.
fn with_positions(made: &mut Made, accessor: Value) -> Vec<u8> {
    let positions = made.accessor(accessor);
    let indices = made.indices(&FACES);
    let primitive = json!({"attributes": {"POSITION": positions}, "indices": indices});
    made.glb(&json!({
        "extensionsUsed": ["KHR_mesh_quantization"],
        "nodes": [{"mesh": 0, "rotation": [0, 0, 1, 0]}],
        "meshes": [
            {"primitives": [primitive, {"attributes": {"POSITION": positions}, "mode": 0}]},
        ],
    }))
}

#[test]
fn positions_that_cannot_be_patched_are_appended() {
    let bytes: Vec<u8> = CORNERS.iter().flat_map(|x| x.to_le_bytes()).collect();
    let base = |view: usize| json!({"bufferView": view, "componentType": 5126, "count": 4, "type": "VEC3"});
    let mut files = Vec::new();
    // Sparse.
    let mut made = Made::default();
    let (view, indices, values) = (made.view(&bytes), made.view(&[3]), made.view(&[0; 12]));
    let mut accessor = base(view);
    accessor["sparse"] = json!({
        "count": 1,
        "indices": {"bufferView": indices, "componentType": 5121},
        "values": {"bufferView": values},
    });
    files.push(with_positions(&mut made, accessor));
    // Quantized.
    let mut made = Made::default();
    let view = made.view(&[0, 0, 0, 0, 9, 0, 0, 0, 0, 9, 0, 0, 0, 0, 9, 0]);
    made.views[view]["byteStride"] = 4.into();
    files.push(with_positions(
        &mut made,
        json!({"bufferView": view, "componentType": 5121, "count": 4, "type": "VEC3"}),
    ));
    // Without bytes.
    let mut made = Made::default();
    files.push(with_positions(
        &mut made,
        json!({"componentType": 5126, "count": 4, "type": "VEC3"}),
    ));
    // The bytes are also those of another accessor, and of an image.
    let mut made = Made::default();
    let view = made.view(&bytes);
    made.accessor(base(view));
    files.push(with_positions(&mut made, base(view)));
    for glb in files {
        let (document, again, written) = moved(&glb, 1, [0.5, 0.25, 7.0]);
        let (old, new) = (json_of(&glb), json_of(&written));
        let count = |json: &Value| json["accessors"].as_array().unwrap().len();
        assert_eq!(count(&new), count(&old) + 1);
        let primitives = &new["meshes"][0]["primitives"];
        assert_eq!(primitives[0]["attributes"]["POSITION"], count(&old));
        assert_eq!(primitives[1]["attributes"]["POSITION"], count(&old));
        let z = document.positions().iter().map(|p| p.z).fold(0.0, f64::max);
        assert_eq!(new["accessors"][count(&old)]["max"][2].as_f64(), Some(z));
        for v in [0, 2, 3] {
            assert_eq!(again.positions()[v], document.positions()[v]);
        }
        // The original data is still there.
        let length = old["buffers"][0]["byteLength"].as_u64().unwrap() as usize;
        let data = |glb: &[u8]| {
            let json = u32::from_le_bytes(*glb[12..].first_chunk().unwrap()) as usize;
            glb[28 + json..][..length].to_vec()
        };
        assert_eq!(data(&glb), data(&written));
        // The second move is in place.
        let (_, _, third) = moved(&written, 2, [3.0, 3.0, 3.0]);
        assert_eq!(count(&json_of(&third)), count(&new));
    }
}

#[test]
fn normals_turn_where_they_stand() {
    // Interleaved positions and normals of one triangle, and the same normals in 8 bits.
    let positions = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    for is_small in [false, true] {
        let mut made = Made::default();
        let mut bytes = Vec::new();
        for p in positions {
            bytes.extend(p.iter().flat_map(|x| x.to_le_bytes()));
            if is_small {
                bytes.extend([0, 0, 127, 99]);
            } else {
                bytes.extend([0.0f32, 0.0, 1.0].iter().flat_map(|x| x.to_le_bytes()));
            }
        }
        let view = made.view(&bytes);
        made.views[view]["byteStride"] = (bytes.len() / 3).into();
        let p = made.accessor(
            json!({"bufferView": view, "componentType": 5126, "count": 3, "type": "VEC3"}),
        );
        let code = if is_small { 5120 } else { 5126 };
        let n = made.accessor(json!({
            "bufferView": view, "byteOffset": 12, "componentType": code, "count": 3,
            "type": "VEC3", "normalized": is_small, "max": [0, 0, 1],
        }));
        let glb = made.glb(&json!({
            "nodes": [{"mesh": 0, "scale": [1, 1, -3]}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": p, "NORMAL": n}}]}],
        }));
        // Mirrored: the normal points down, and the face turns in the opposite direction.
        let (document, again, written) = moved(&glb, 1, [0.0, 0.0, -1.0]);
        let normal = |document: &Document| {
            let attributes = document.attributes().unwrap();
            [0, 1, 2].map(|k| attributes.vertex(NORMAL).unwrap().values.get(k).unwrap())
        };
        let (a, b) = (normal(&document), normal(&again));
        for k in 0..3 {
            assert!(
                (a[k] - b[k]).abs() < 1e-2 && (a[k] - [-1.0, 0.0, 0.0][k]).abs() < 1e-2,
                "{a:?} {b:?}"
            );
        }
        let json = json_of(&written);
        assert_eq!(json["accessors"].as_array().unwrap().len(), 2);
        assert_ne!(json["accessors"][1]["max"], json!([0, 0, 1]));
        assert_eq!(written.len() % 4, 0);
        if is_small {
            assert_eq!(written[written.len() - 48 + 15], 99);
        }
    }
}

#[test]
fn a_compressed_copy_does_not_stay_behind() {
    let glb = tetrahedron(&json!({"mesh": 0}));
    let mut json = json_of(&glb);
    json["meshes"][0]["primitives"][0]["extensions"] =
        json!({"KHR_draco_mesh_compression": {"bufferView": 0}, "OTHER": 1});
    let data = &glb[glb.len() - 72..];
    let glb =
        super::super::container::write_binary(&json.to_string(), Some(data), [].into_iter(), &[]);
    let (_, _, written) = moved(&glb.unwrap(), 0, [-1.0, 0.0, 0.0]);
    assert_eq!(
        json_of(&written)["meshes"][0]["primitives"][0]["extensions"],
        json!({"OTHER": 1})
    );
}

#[test]
fn what_f32_cannot_hold_is_refused() {
    let mut document = open(&tetrahedron(&json!({"mesh": 0}))).unwrap();
    document
        .set_position(2, Point3::new(0.0, 1e39, 0.0))
        .unwrap();
    let error = document.write(Format::Glb).unwrap_err().to_string();
    assert!(
        error.starts_with("vertex 2: 1e39") || error.starts_with("vertex 2: 1000000"),
        "{error}"
    );
    let new = Document::new(document.positions().to_vec(), document.faces().clone()).unwrap();
    assert!(new.write(Format::Glb).is_err());
}

#[test]
fn containers_are_converted_without_loss() {
    let glb = tetrahedron(&json!({"mesh": 0, "extras": {"a": [1, "\"{"]}}));
    let text = open(&glb).unwrap().write(Format::Gltf).unwrap();
    let mut json: Value = serde_json::from_slice(&text).unwrap();
    let buffer = json["buffers"][0].as_object_mut().unwrap();
    assert!(
        buffer
            .remove("uri")
            .unwrap()
            .as_str()
            .unwrap()
            .starts_with("data:")
    );
    assert_eq!(json, json_of(&glb));
    assert_eq!(open(&text).unwrap().write(Format::Glb).unwrap(), glb);
}

fn attributes(num_vertices: usize, faces: &FaceList, seed: u64) -> Attributes {
    // Numbers that are exact in 32 bits, also as 1 − v.
    let number = |i: usize| ((seed >> (i % 48)) % 16) as f32 / 16.0;
    let corners = faces.num_corners();
    Attributes {
        vertices: vec![Property {
            name: COLOR.into(),
            components: 3,
            values: Values::U8(
                (0..3 * num_vertices)
                    .map(|i| (number(i) * 255.0) as u8)
                    .collect(),
            ),
        }],
        corners: vec![
            CornerProperty {
                name: UV.into(),
                components: 2,
                values: Values::F32((0..16).map(number).collect()),
                indices: (0..corners)
                    .map(|c| (c as u32 * 5 + seed as u32 % 8) % 8)
                    .collect(),
            },
            CornerProperty {
                name: NORMAL.into(),
                components: 3,
                values: Values::F32(vec![0.0, 0.0, 1.0, 0.6, 0.8, 0.0, 0.0, -1.0, 0.0]),
                indices: (0..corners)
                    .map(|c| (c as u32 + seed as u32 % 3) % 3)
                    .collect(),
            },
        ],
        labels: vec![Labels {
            kind: LabelKind::Material,
            names: vec!["first".into(), "second \"quoted\"".into()],
            // In ascending order, as they are written.
            faces: (0..faces.len())
                .map(|f| [0, 1, NONE][(3 * f / faces.len()).min(2)])
                .collect(),
        }],
        ..Attributes::default()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn new_files_hold_what_they_can(
        points in prop::collection::vec(prop::array::uniform3(-100i8..100), 3..20),
        picks in prop::collection::vec(prop::array::uniform4(0usize..1000), 1..30),
        seed: u64,
        is_binary: bool,
    ) {
        let mut positions: Vec<Point3<f64>> =
            points.iter().map(|p| Point3::from(p.map(f64::from))).collect();
        // Vertices at one position would be welded when the file is read.
        positions.sort_by(|a, b| a.coords.as_slice().partial_cmp(b.coords.as_slice()).unwrap());
        positions.dedup();
        prop_assume!(positions.len() >= 3);
        let n = positions.len();
        // The same face in two materials would be read as a separate layer.
        let mut seen = std::collections::BTreeSet::new();
        let faces: FaceList = picks
            .iter()
            .map(|&[a, b, c, _]| [a % n, b % n, c % n].map(|v| v as u32))
            .filter(|face| {
                let mut sorted = *face;
                sorted.sort_unstable();
                seen.insert(sorted)
            })
            .collect();
        let attributes = attributes(n, &faces, seed);
        let document = Document::new(positions, faces).unwrap().with_attributes(attributes).unwrap();
        let format = if is_binary { Format::Glb } else { Format::Gltf };
        let bytes = document.write(format).unwrap();
        if is_binary {
            let second = gltf::Gltf::from_slice(&bytes).unwrap();
            prop_assert_eq!(second.blob.as_deref().map(<[u8]>::len), second.buffers().next().map(|b| b.length()));
        }
        let again = open(&bytes).unwrap();
        prop_assert_eq!(again.faces().len(), document.faces().len());
        for (a, b) in again.faces().corners().iter().zip(document.faces().corners()) {
            prop_assert_eq!(again.positions()[*a as usize], document.positions()[*b as usize]);
        }
        let (old, new) = (document.attributes().unwrap(), again.attributes().unwrap());
        prop_assert_eq!(new.misfit(again.positions().len(), again.faces().len(), again.faces().num_corners()), None);
        for name in [UV, NORMAL] {
            let (table, column) = (old.corner(name).unwrap(), new.vertex(name).unwrap());
            for (corner, &v) in again.faces().corners().iter().enumerate() {
                for k in 0..table.components {
                    let a = table.values.get(table.indices[corner] as usize * table.components + k);
                    prop_assert_eq!(a, column.values.get(v as usize * table.components + k));
                }
            }
        }
        let (a, b) = (old.vertex(COLOR).unwrap(), new.vertex(COLOR).unwrap());
        for (&new, &old) in again.faces().corners().iter().zip(document.faces().corners()) {
            for k in 0..3 {
                prop_assert_eq!(b.values.get(3 * new as usize + k), a.values.get(3 * old as usize + k));
            }
        }
        let (a, b) = (old.label(LabelKind::Material).unwrap(), new.label(LabelKind::Material));
        let name = |l: &Labels, f: usize| l.names.get(l.faces[f] as usize).cloned();
        for f in 0..again.faces().len() {
            prop_assert_eq!(name(a, f), b.and_then(|b| name(b, f)));
        }
        // After writing to another format and reading back, the welded vertices are the old ones.
        let places = again.places(crate::Weld::AsFormat).unwrap();
        let num_places = (0..again.positions().len()).filter(|&v| places[v] as usize == v).count();
        prop_assert_eq!(num_places, document.positions().len());
    }

    #[test]
    fn broken_bytes_never_panic(
        changes in prop::collection::vec((0usize..4000, any::<u8>()), 1..6),
        end in 0usize..4000,
    ) {
        let glb = kitchen_sink();
        let text = open(&glb).unwrap().write(Format::Gltf).unwrap();
        for file in [glb, text] {
            let mut bytes = file;
            bytes.truncate(bytes.len() - end.saturating_sub(3000) % bytes.len());
            let length = bytes.len();
            for &(at, byte) in &changes {
                bytes[at % length] = byte;
            }
            if let Ok(mut document) = open(&bytes) {
                let _ = document.attributes();
                let _ = document.losses(Format::Obj);
                let _ = document.set_position(0, Point3::new(9.0, 9.0, 9.0));
                for format in [Format::Glb, Format::Gltf] {
                    if let Ok(bytes) = document.write(format) {
                        let again = open(&bytes);
                        prop_assert!(again.is_ok(), "{:?}", again.map(|_| ()));
                    }
                }
            }
        }
    }
}

#[test]
fn digits_of_the_json_may_be_anything() {
    let glb = kitchen_sink();
    let text = open(&glb).unwrap().write(Format::Gltf).unwrap();
    let end = text.windows(4).position(|w| w == b"data").unwrap();
    for at in (0..text.len()).filter(|&at| at < end || at > end + 900) {
        if !text[at].is_ascii_digit() {
            continue;
        }
        for digits in ["9", "0", "18446744073709551615", "-1", "4294967296", "1e9"] {
            let bytes = [&text[..at], digits.as_bytes(), &text[at + 1..]].concat();
            if let Ok(mut document) = open(&bytes) {
                let _ = document.attributes();
                let _ = document.set_position(0, Point3::new(9.0, 9.0, 9.0));
                let _ = document
                    .write(Format::Glb)
                    .map(|bytes| open(&bytes).unwrap());
            }
        }
    }
}

/// A file with nearly every feature.
pub(super) fn kitchen_sink() -> Vec<u8> {
    let mut made = Made::default();
    let positions = made.floats("VEC3", &CORNERS);
    let normals = made.floats("VEC3", &[0.0, 0.6, 0.8].repeat(4));
    let uvs = made.floats("VEC2", &[0.25, 0.75].repeat(4));
    let weights = made.floats("VEC4", &[0.25; 16]);
    let (indices, values) = (made.view(&[1, 3]), made.view(&[0; 24]));
    let view = made.view(&[1; 48]);
    let sparse = made.accessor(json!({
        "bufferView": view, "componentType": 5126, "count": 4, "type": "VEC3",
        "sparse": {
            "count": 2,
            "indices": {"bufferView": indices, "componentType": 5121},
            "values": {"bufferView": values},
        },
    }));
    let faces = made.indices(&FACES);
    let image = made.view(b"not an image");
    made.glb(&json!({
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {"children": [1, 2], "matrix": [1,0,0,0, 0,0,-1,0, 0,2,0,0, 5,0,0,1]},
            {"mesh": 0, "scale": [1, -1, 1]},
            {"mesh": 1, "translation": [0, 0, 9]},
        ],
        "images": [{"bufferView": image, "mimeType": "image/png"}],
        "materials": [{"name": "skin"}],
        "meshes": [
            {"name": "a", "primitives": [
                {"attributes": {"POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs,
                    "WEIGHTS_0": weights}, "indices": faces, "material": 0,
                 "targets": [{"POSITION": sparse}]},
                {"attributes": {"POSITION": positions}, "mode": 5},
            ]},
            {"primitives": [{"attributes": {"POSITION": sparse, "TEXCOORD_0": uvs}, "mode": 6}]},
        ],
    }))
}

#[test]
fn an_edit_far_from_the_origin_without_a_node_is_warned_of() {
    let far = CORNERS.map(|x| x + 4e6);
    let mut made = Made::default();
    let positions = made.floats("VEC3", &far);
    let indices = made.indices(&FACES);
    let primitive = json!({"attributes": {"POSITION": positions}, "indices": indices});
    let glb = made.glb(&json!({"meshes": [{"primitives": [primitive]}]}));
    let mut document = open(&glb).unwrap();
    assert_eq!(document.losses(Format::Glb), Vec::<String>::new());
    let p = document.positions()[3] + Vector3::new(0.1, 0.0, 0.2);
    document.set_position(3, p).unwrap();
    let losses = document.losses(Format::Glb).join("\n");
    assert!(
        losses.contains(
            "single precision, too little so far from its origin: vertices move by 0.1 at most"
        ),
        "{losses}"
    );
}
