use nalgebra::Point3;
use serde_json::{Value, json};

use super::made::{CORNERS, FACES, Made, One, open, open_with, tetrahedron, volume};
use crate::attributes::{COLOR, LabelKind, NONE, NORMAL, UV, Values};
use crate::format::Format;

fn polygons(document: &crate::Document) -> Vec<Vec<u32>> {
    document.faces().iter().map(<[u32]>::to_vec).collect()
}

fn primitive(mode: u64, indices: Option<&[u16]>, count: usize) -> Vec<Vec<u32>> {
    let mut made = Made::default();
    let values: Vec<f32> = (0..3 * count).map(|i| i as f32).collect();
    let positions = made.floats("VEC3", &values);
    let mut primitive = json!({"attributes": {"POSITION": positions}, "mode": mode});
    if let Some(indices) = indices {
        primitive["indices"] = made.indices(indices).into();
    }
    polygons(&open(&made.glb(&json!({"meshes": [{"primitives": [primitive]}]}))).unwrap())
}

#[test]
fn triangles_strips_and_fans_with_and_without_indices() {
    let strip = [[0, 1, 2], [1, 3, 2], [2, 3, 4]];
    assert_eq!(primitive(5, None, 5), strip);
    assert_eq!(primitive(5, Some(&[4, 3, 2, 1]), 5), [[4, 3, 2], [3, 1, 2]]);
    assert_eq!(primitive(6, None, 5), [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    assert_eq!(primitive(6, Some(&[4, 3, 2, 1]), 5), [[4, 3, 2], [4, 2, 1]]);
    assert_eq!(primitive(4, None, 7), [[0, 1, 2], [3, 4, 5]]);
    assert_eq!(primitive(4, Some(&[4, 3, 2, 1]), 5), [[4, 3, 2]]);
}

#[test]
fn indices_of_all_types() {
    for (code, size) in [(5121, 1), (5123, 2), (5125, 4)] {
        let mut made = Made::default();
        let positions = made.floats("VEC3", &CORNERS);
        let bytes: Vec<u8> = FACES
            .iter()
            .flat_map(|&i| u32::from(i).to_le_bytes()[..size].to_vec())
            .collect();
        let view = made.view(&bytes);
        let indices = made.accessor(
            json!({"bufferView": view, "componentType": code, "count": 12, "type": "SCALAR"}),
        );
        let glb = made.glb(&json!({"meshes": [
            {"primitives": [{"attributes": {"POSITION": positions}, "indices": indices}]},
        ]}));
        let document = open(&glb).unwrap();
        assert_eq!(document.faces().corners(), FACES.map(u32::from));
    }
}

#[test]
fn transforms_mirrors_and_skins() {
    let of = |node: Value| open(&tetrahedron(&node)).unwrap();
    assert_eq!(volume(&of(json!({"mesh": 0}))), 1.0 / 6.0);
    assert_eq!(
        volume(&of(json!({"mesh": 0, "scale": [-2, 1, 1]}))),
        2.0 / 6.0
    );
    let document = of(json!({"mesh": 0, "translation": [1, 2, 3]}));
    assert_eq!(document.positions()[0], Point3::new(1.0, 2.0, 3.0));
    let document = of(json!({"mesh": 0, "scale": [0, 1, 1]}));
    assert_eq!(volume(&document), 1.0 / 6.0);
    assert!(document.warnings()[0].message.contains("is not invertible"));
}

#[test]
fn meshes_that_share_vertices_have_them_once() {
    let mut made = Made::default();
    let positions = made.floats("VEC3", &CORNERS);
    let (a, b) = (made.indices(&FACES[..6]), made.indices(&FACES[6..]));
    let primitive = |i: usize| json!({"attributes": {"POSITION": positions}, "indices": i});
    let glb = made.glb(&json!({"meshes": [
        {"name": "one", "primitives": [primitive(a), {"attributes": {"POSITION": positions}, "mode": 0}]},
        {"name": "two", "primitives": [primitive(b)]},
    ]}));
    let document = open(&glb).unwrap();
    assert_eq!(document.positions().len(), 4);
    assert_eq!(document.faces().corners(), FACES.map(u32::from));
    let parts = document.parts();
    assert_eq!(
        (parts[0].name.as_str(), &parts[0].vertices),
        ("one", &(0..4))
    );
    assert_eq!((parts[1].name.as_str(), &parts[1].faces), ("two", &(2..4)));
    assert!(
        document.warnings()[0]
            .message
            .starts_with("1 primitives of points")
    );
    let attributes = document.attributes().unwrap();
    let objects = attributes.label(LabelKind::Object).unwrap();
    assert_eq!(objects.names, ["one", "two"]);
    assert_eq!(objects.faces, [0, 0, 1, 1]);
}

#[test]
fn sparse_and_quantized_positions() {
    // Two of four elements are replaced, with a base of zeros and one with numbers.
    for has_base in [false, true] {
        let mut made = Made::default();
        let values: Vec<u8> = [9.0f32; 6].iter().flat_map(|x| x.to_le_bytes()).collect();
        let (indices, values) = (made.view(&[1, 3]), made.view(&values));
        let mut accessor = json!({
            "componentType": 5126, "count": 4, "type": "VEC3",
            "sparse": {
                "count": 2,
                "indices": {"bufferView": indices, "componentType": 5121},
                "values": {"bufferView": values},
            },
        });
        if has_base {
            let bytes: Vec<u8> = CORNERS.iter().flat_map(|x| x.to_le_bytes()).collect();
            accessor["bufferView"] = made.view(&bytes).into();
        }
        let positions = made.accessor(accessor);
        let glb = made.glb(&json!({"meshes": [
            {"primitives": [{"attributes": {"POSITION": positions}, "mode": 5}]},
        ]}));
        let document = open(&glb).unwrap();
        let p = document.positions();
        assert_eq!(
            [p[1].x, p[3].z, p[2].y],
            [9.0, 9.0, f64::from(u8::from(has_base))]
        );
    }
    let quantized = |code: u64, normalized: bool, bytes: &[u8]| {
        let mut made = Made::default();
        let view = made.view(bytes);
        made.views[view]["byteStride"] = (bytes.len() / 3).into();
        let positions = made.accessor(json!({
            "bufferView": view, "componentType": code, "count": 3, "type": "VEC3",
            "normalized": normalized,
        }));
        let glb = made.glb(&json!({
            "extensionsRequired": ["KHR_mesh_quantization"],
            "extensionsUsed": ["KHR_mesh_quantization"],
            "meshes": [{"primitives": [{"attributes": {"POSITION": positions}}]}],
        }));
        open(&glb).unwrap().positions()[1]
    };
    let bytes = [0, 0, 0, 0, 127, 0x81, 0x80, 0, 0, 1, 0, 0];
    assert_eq!(quantized(5120, true, &bytes), Point3::new(1.0, -1.0, -1.0));
    assert_eq!(
        quantized(5121, false, &bytes),
        Point3::new(127.0, 129.0, 128.0)
    );
    let words: Vec<u8> = [0i16, 0, 0, 0, 32767, -32768, 5, 0, 0, 0, 9, 0]
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let p = quantized(5122, true, &words);
    assert_eq!((p.x, p.y), (1.0, -1.0));
    assert_eq!(
        quantized(5122, false, &words),
        Point3::new(32767.0, -32768.0, 5.0)
    );
    assert_eq!(quantized(5123, false, &words).y, 32768.0);
}

#[test]
fn attributes_have_the_names_and_directions_of_all_formats() {
    let mut made = Made::default();
    let positions = made.floats("VEC3", &CORNERS);
    let normals = made.floats("VEC3", &[0.6, 0.8, 0.0].repeat(4));
    let uvs = made.floats("VEC2", &[0.25, 0.75].repeat(4));
    let view = made.view(&[10, 20, 30, 40].repeat(4));
    let colors = made.accessor(json!({
        "bufferView": view, "componentType": 5121, "count": 4, "type": "VEC4", "normalized": true,
    }));
    let foo = made.floats("SCALAR", &[1.0, 2.0, 3.0, 4.0]);
    let second = made.floats("VEC3", &CORNERS);
    let indices = made.indices(&FACES);
    let glb = made.glb(&json!({
        "nodes": [{"mesh": 0, "scale": [2, 1, 1]}],
        "materials": [{}, {"name": "skin"}],
        "meshes": [{"primitives": [
            {"attributes": {"POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs,
                "COLOR_0": colors, "_FOO": foo}, "indices": indices, "material": 1},
            {"attributes": {"POSITION": second}, "indices": indices, "material": 0},
            {"attributes": {"POSITION": second}, "indices": indices},
        ]}],
    }));
    let document = open(&glb).unwrap();
    let attributes = document.attributes().unwrap();
    // The last two primitives have the same faces but separate vertices.
    assert_eq!(attributes.misfit(12, 12, 36), None);
    let normal = &attributes.vertex(NORMAL).unwrap().values;
    let n = [0, 1, 2].map(|k| normal.get(k).unwrap());
    // (0.3, 0.8, 0), normalized.
    assert!((n[0] / n[1] - 0.375).abs() < 1e-6 && (n[0].hypot(n[1]) - 1.0).abs() < 1e-6);
    assert_eq!(attributes.vertex(UV).unwrap().values.get(1), Some(0.25));
    assert_eq!(attributes.vertex(UV).unwrap().values.get(9), Some(0.0));
    let color = attributes.vertex(COLOR).unwrap();
    assert_eq!(color.components, 4);
    assert!(matches!(&color.values, Values::U8(v) if v[..4] == [10, 20, 30, 40]));
    assert_eq!(attributes.vertex("_foo").unwrap().values.get(3), Some(4.0));
    let materials = attributes.label(LabelKind::Material).unwrap();
    assert_eq!(materials.names, ["skin", "material 0"]);
    assert_eq!(
        [materials.faces[0], materials.faces[4], materials.faces[8]],
        [0, 1, NONE]
    );
    let losses = document.losses(Format::Obj);
    assert!(losses.iter().any(|l| l.contains("1 node")), "{losses:?}");
}

#[test]
fn buffers_beside_the_file_come_from_the_resolver() {
    let mut made = Made::default();
    let positions = made.floats("VEC3", &CORNERS);
    let indices = made.indices(&FACES);
    let mut json = made.json(&json!({"meshes": [
        {"primitives": [{"attributes": {"POSITION": positions}, "indices": indices}]},
    ]}));
    json["buffers"][0]["uri"] = "a%20b.bin".into();
    let file = format!("\u{feff}{json}\n");
    let resolver = One("a b.bin", made.data.clone());
    let mut document = open_with(file.as_bytes(), &resolver).unwrap();
    assert!(document.warnings()[0].message.contains("byte order mark"));
    assert_eq!(document.write(Format::Gltf).unwrap(), file.as_bytes());
    assert!(
        open(file.as_bytes())
            .unwrap_err()
            .to_string()
            .contains("`a%20b.bin`")
    );
    let short = One("a b.bin", made.data[1..].to_vec());
    let error = open_with(file.as_bytes(), &short).unwrap_err().to_string();
    assert_eq!(
        error,
        "buffers[0].byteLength: 72 bytes are promised, but there are 71"
    );
    // A GLB of it has the data in its chunk. After a move, the buffer is in the file.
    let glb = document.write(Format::Glb).unwrap();
    assert_eq!(open(&glb).unwrap().positions(), document.positions());
    document
        .set_position(3, Point3::new(0.0, 0.0, 2.0))
        .unwrap();
    let text = String::from_utf8(document.write(Format::Gltf).unwrap()).unwrap();
    assert!(text.starts_with('\u{feff}') && text.ends_with('\n'));
    assert!(text.contains("data:application/octet-stream;base64,"));
    assert_eq!(
        open(text.as_bytes()).unwrap().positions(),
        document.positions()
    );
}
