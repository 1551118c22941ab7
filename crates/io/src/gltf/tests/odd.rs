//! Rare features of files: shared vertices, missing colours, attributes without bytes.

use serde_json::{Value, json};

use super::made::no_files;
use super::made::{CORNERS, FACES, Made, open, tetrahedron};
use crate::attributes::{COLOR, UV, Values};
use crate::format::Format;
use crate::gltf::GltfFile;
use crate::limits::Limits;
use crate::remap::Remap;
use crate::source::{Mesh, SourceFile};

#[test]
fn whole_texture_coordinates_become_real() {
    let mut made = Made::default();
    let positions = made.floats("VEC3", &CORNERS);
    let indices = made.indices(&FACES);
    let view = made.view(&[3, 0, 5, 0].repeat(4));
    let uvs = made.accessor(json!({
        "bufferView": view, "componentType": 5123, "count": 4, "type": "VEC2",
    }));
    let glb = made.glb(&json!({"meshes": [{"primitives": [
        {"attributes": {"POSITION": positions, "TEXCOORD_0": uvs}, "indices": indices},
    ]}]}));
    let document = open(&glb).unwrap();
    let attributes = document.attributes().unwrap();
    let values = &attributes.vertex(UV).unwrap().values;
    assert_eq!(*values, Values::F32([3.0, -4.0].repeat(4)));
}

/// Two primitives with separate vertices, the first of which has colours.
fn half_coloured() -> Vec<u8> {
    let mut made = Made::default();
    let (first, second) = (made.floats("VEC3", &CORNERS), made.floats("VEC3", &CORNERS));
    let indices = made.indices(&FACES);
    let view = made.view(&[1, 2, 3, 0].repeat(4));
    made.views[view]["byteStride"] = 4.into();
    let colors = made.accessor(json!({
        "bufferView": view, "componentType": 5121, "count": 4, "type": "VEC3", "normalized": true,
    }));
    made.glb(&json!({"meshes": [{"primitives": [
        {"attributes": {"POSITION": first, "COLOR_0": colors}, "indices": indices},
        {"attributes": {"POSITION": second}, "indices": indices},
    ]}]}))
}

#[test]
fn what_has_no_colour_is_white() {
    let document = open(&half_coloured()).unwrap();
    let attributes = document.attributes().unwrap();
    let Values::U8(values) = &attributes.vertex(COLOR).unwrap().values else {
        panic!("colours keep their type");
    };
    assert_eq!(values[..12], [1, 2, 3].repeat(4));
    assert_eq!(values[12..], [255; 12]);
}

#[test]
fn vertices_taken_over_from_another_primitive_are_white() {
    let (file, parsed) = GltfFile::read(half_coloured(), &Limits::default(), no_files()).unwrap();
    let mesh = Mesh {
        positions: &parsed.positions,
        faces: &parsed.faces,
    };
    // A face of the first primitive gets a vertex of the second.
    let mut remap = Remap::identity(8, &parsed.faces);
    let mut corners = parsed.faces.corners().to_vec();
    corners[0] = 4;
    remap.faces = corners.chunks(3).collect();
    let new = file.rebuild(&remap, mesh).unwrap();
    let attributes = new.attributes(mesh).unwrap();
    let color = attributes.vertex(COLOR).unwrap();
    assert_eq!(color.values.get(0), Some(1.0));
    assert_eq!(color.values.get(12), Some(255.0));
}

/// Many attributes with as many elements as the file has bytes, but no bytes of their own.
fn without_bytes(attributes: usize) -> Vec<u8> {
    let mut made = Made::default();
    let count = 20_000;
    let indices = made.indices(&FACES);
    let nothing = |shape: &str| json!({"componentType": 5126, "count": count, "type": shape});
    let positions = made.accessor(nothing("VEC3"));
    let normals = made.accessor(nothing("MAT4"));
    let mut named = serde_json::Map::new();
    named.insert("POSITION".to_owned(), positions.into());
    for i in 0..attributes {
        named.insert(format!("_{i}"), normals.into());
    }
    made.glb(&json!({
        "meshes": [{"primitives": [{"attributes": Value::Object(named), "indices": indices}]}],
        "extras": "x".repeat(count),
    }))
}

#[test]
fn attributes_without_bytes_are_bounded() {
    assert!(open(&without_bytes(2)).unwrap().attributes().is_ok());
    let document = open(&without_bytes(1000)).unwrap();
    let refused = document.attributes().unwrap_err().to_string();
    assert!(
        refused.starts_with("meshes: 320000000 numbers of attributes in all in a file of"),
        "{refused}"
    );
    let faces = document.faces();
    let mut remap = Remap::identity(20_000, faces);
    remap.vertices.truncate(19_999);
    let refused = document.remapped(&remap, Vec::new()).unwrap_err();
    let refused = refused.to_string();
    assert!(
        refused.starts_with("a change that adds more than 67"),
        "{refused}"
    );
}

#[test]
fn lost_digits_are_reported() {
    let is_reported = |x: f64| {
        let text = format!("v 0 0 0\nv {x} 0 0\nv 0 1 0\nf 1 2 3\n");
        let losses = open(text.as_bytes()).unwrap().losses(Format::Glb);
        losses
            .iter()
            .any(|loss| loss.starts_with("digits of coordinates"))
    };
    assert!(is_reported(0.1));
    assert!(!is_reported(0.5));
}

#[test]
fn a_rebuild_may_exceed_the_limits_of_the_read() {
    let limits = Limits {
        max_vertices: 4,
        max_faces: 4,
        ..Limits::default()
    };
    let glb = tetrahedron(&json!({"mesh": 0}));
    let (file, parsed) = GltfFile::read(glb, &limits, no_files()).unwrap();
    let mesh = Mesh {
        positions: &parsed.positions,
        faces: &parsed.faces,
    };
    let mut remap = Remap::identity(4, &parsed.faces);
    remap.vertices.push(3);
    assert!(file.rebuild(&remap, mesh).is_ok());
}
