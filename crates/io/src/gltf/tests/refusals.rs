use serde_json::{Value, json};

use super::made::{CORNERS, FACES, Made, refused, tetrahedron};
use crate::file::read;
use crate::limits::Limits;

/// A tetrahedron with modified JSON.
fn changed(change: impl Fn(&mut Value)) -> String {
    let mut made = Made::default();
    let positions = made.floats("VEC3", &CORNERS);
    let indices = made.indices(&FACES);
    let mut json = made.json(&json!({"meshes": [
        {"primitives": [{"attributes": {"POSITION": positions}, "indices": indices}]},
    ]}));
    change(&mut json);
    let data = Some(made.data.as_slice());
    refused(
        &super::super::container::write_binary(&json.to_string(), data, [].into_iter(), &[])
            .unwrap(),
    )
}

#[test]
fn accessors_that_do_not_fit_are_refused() {
    let refused = |change: fn(&mut Value), start: &str| {
        let message = changed(change);
        assert!(message.starts_with(start), "{message}");
    };
    refused(
        |json| json["accessors"][1]["componentType"] = 5126.into(),
        "accessors[1].bufferView: 12 elements of 4 bytes",
    );
    refused(
        |json| {
            json["accessors"][1]["componentType"] = 5126.into();
            json["accessors"][1]["count"] = 6.into();
        },
        "accessors[1].componentType: indices must be unsigned integers",
    );
    refused(
        |json| json["bufferViews"][0]["byteStride"] = 4.into(),
        "bufferViews[0].byteStride: 4 bytes from element to element do not fit elements of 12",
    );
    refused(
        |json| {
            json["accessors"][0]["componentType"] = 5121.into();
            json["accessors"][0]["type"] = "SCALAR".into();
        },
        "accessors[0].type: positions must be VEC3",
    );
    refused(
        |json| json["accessors"][0]["componentType"] = 5125.into(),
        "accessors[0].componentType: positions are numbers",
    );
    refused(
        |json| json["accessors"][0]["componentType"] = (5126u64 + (1 << 32)).into(),
        "accessors[0].componentType: 4294972422 is not a component type",
    );
    refused(
        |json| json["accessors"][0]["type"] = "VEC5".into(),
        "accessors[0].type: VEC5 is not an accessor type",
    );
    refused(
        |json| json["accessors"][0]["count"] = 0.into(),
        "meshes[0].primitives[0].indices: index 0 (face 0) refers to vertex 0, but there are 0",
    );
    refused(
        |json| json["accessors"][0]["count"] = u64::MAX.into(),
        "accessors[0].bufferView: 18446744073709551615 elements of 12 bytes",
    );
    refused(
        |json| json["accessors"][0]["byteOffset"] = u64::MAX.into(),
        "accessors[0].bufferView: 4 elements of 12 bytes at 18446744073709551615 exceed",
    );
    refused(
        |json| json["bufferViews"][0]["byteOffset"] = u64::MAX.into(),
        "bufferViews[0]: 48 bytes at 18446744073709551615 exceed the 72 bytes of buffer 0",
    );
    refused(
        |json| json["bufferViews"][0]["buffer"] = 1.into(),
        "bufferViews[0].buffer: there is no buffer 1; there are 1",
    );
    refused(
        |json| json["accessors"][0]["bufferView"] = 7.into(),
        "accessors[0].bufferView: there is no bufferView 7; there are 2",
    );
    refused(
        |json| json["buffers"][0]["byteLength"] = 73.into(),
        "buffers[0].byteLength: 73 bytes are promised, but there are 72",
    );
    refused(
        |json| json["buffers"][0]["uri"] = "data:;base64,?".into(),
        "buffers[0].uri: the base64 data is wrong",
    );
    refused(
        |json| json["buffers"][0]["uri"] = "%FF".into(),
        "the file refers to `%FF`, which cannot be read: its percent escapes are not UTF-8",
    );
}

#[test]
fn counts_without_bytes_are_refused_before_memory_is_taken() {
    let sparse = |count: u64, sparse_count: u64| {
        changed(move |json| {
            json["accessors"][0] = json!({
                "componentType": 5126, "count": count, "type": "VEC3",
                "sparse": {
                    "count": sparse_count,
                    "indices": {"bufferView": 1, "componentType": 5123},
                    "values": {"bufferView": 0},
                },
            });
        })
    };
    let message = sparse(1_000_000_000_000, 1);
    assert!(
        message.starts_with("accessors[0].count: 1000000000000 elements without"),
        "{message}"
    );
    let message = sparse(1_000_000_000_000, 1_000_000_000_000);
    assert!(
        message.starts_with("accessors[0].sparse.indices.bufferView: 1000000000000"),
        "{message}"
    );
    let message = sparse(4, 5);
    assert!(
        message.starts_with("accessors[0].sparse.count: 5 of 4 elements"),
        "{message}"
    );
    // The indices are those of the faces: 0, 2, 1.
    let message = sparse(9, 3);
    assert!(
        message.starts_with("accessors[0].sparse.indices: 1 does not ascend"),
        "{message}"
    );
    let message = sparse(2, 2);
    assert!(
        message.starts_with("accessors[0].sparse.indices: element 2 of 2"),
        "{message}"
    );
    // Many primitives of the same few bytes do not make a large mesh.
    let mut made = Made::default();
    let positions = made.floats("VEC3", &CORNERS);
    let view = made.view(&[0; 10_000]);
    let indices = made.accessor(
        json!({"bufferView": view, "componentType": 5121, "count": 10_000, "type": "SCALAR"}),
    );
    let primitive = json!({"attributes": {"POSITION": positions}, "indices": indices, "mode": 5});
    let message = refused(&made.glb(&json!({"meshes": [{"primitives": vec![primitive; 1000]}]})));
    assert!(
        message.contains("face corners in all in a file of"),
        "{message}"
    );
}

#[test]
fn primitives_that_do_not_fit_are_refused() {
    let refused = |change: fn(&mut Value), part: &str| {
        let message = changed(change);
        assert!(message.contains(part), "{message}");
    };
    refused(
        |json| json["meshes"][0]["primitives"][0]["mode"] = 7.into(),
        "meshes[0].primitives[0].mode: 7 is not a primitive mode",
    );
    refused(
        |json| json["meshes"][0]["primitives"][0]["mode"] = (4u64 + (1 << 32)).into(),
        "4294967300 is not a primitive mode",
    );
    refused(
        |json| json["meshes"][0]["primitives"][0]["attributes"] = json!({"NORMAL": 0}),
        "meshes[0].primitives[0].attributes: there is no POSITION",
    );
    refused(
        |json| json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = (1u64 << 32).into(),
        "there is no accessor 4294967296",
    );
    refused(
        |json| json["meshes"][0]["primitives"][0]["indices"] = 9.into(),
        "there is no accessor 9",
    );
    refused(
        |json| json["meshes"][0]["primitives"][0]["mode"] = 1.into(),
        "meshes: no primitive consists of triangles",
    );
    refused(
        |json| json["meshes"] = json!([]),
        "meshes: the file has no mesh",
    );
    refused(
        |json| json["accessors"][0]["count"] = 3.into(),
        "index 5 (face 1) refers to vertex 3, but there are 3, numbered from 0",
    );
}

#[test]
fn a_restart_is_named() {
    let mut made = Made::default();
    let positions = made.floats("VEC3", &CORNERS);
    let indices = made.indices(&[0, 1, 2, u16::MAX]);
    let message = refused(&made.glb(&json!({"meshes": [{"primitives": [
        {"attributes": {"POSITION": positions}, "indices": indices, "mode": 5},
    ]}]})));
    assert!(
        message.contains("index 3 (face 1) is 65535, which would start a primitive anew"),
        "{message}"
    );
}

#[test]
fn numbers_that_are_not_finite_are_named() {
    let mut made = Made::default();
    let positions = made.floats("VEC3", &[0.0, 1.0, f32::NAN]);
    let message = refused(&made.glb(&json!({"meshes": [
        {"primitives": [{"attributes": {"POSITION": positions}}]},
    ]})));
    assert_eq!(
        message,
        "accessors[0]: element 0 has the coordinate NaN, which is not a finite number"
    );
}

#[test]
fn required_extensions_are_named() {
    let requires =
        |name: &'static str| changed(move |json| json["extensionsRequired"] = json!([name]));
    let message = requires("EXT_meshopt_compression");
    assert!(message.starts_with("the extension EXT_meshopt_compression is not supported; write"));
    assert!(requires("KHR_draco_mesh_compression").contains("without compression"));
    assert!(requires("VENDOR_shape").starts_with("the extension VENDOR_shape is not supported"));
}

#[test]
fn an_image_out_of_range_is_no_matter() {
    let glb = tetrahedron(&json!({"mesh": 0}));
    let mut json = super::made::json_of(&glb);
    json["images"] = json!([{"bufferView": 1000, "mimeType": "image/png"}]);
    let data = &glb[glb.len() - 72..];
    let glb =
        super::super::container::write_binary(&json.to_string(), Some(data), [].into_iter(), &[]);
    let mut document = super::made::open(&glb.unwrap()).unwrap();
    document.set_position(0, [-1.0; 3].into()).unwrap();
    document.write(crate::Format::Glb).unwrap();
}

#[test]
fn limits_are_kept() {
    let glb = tetrahedron(&json!({"mesh": 0}));
    let limits = Limits::default();
    for (limits, part) in [
        (
            Limits {
                max_vertices: 3,
                ..limits
            },
            "3 vertices",
        ),
        (
            Limits {
                max_faces: 3,
                ..limits
            },
            "3 faces",
        ),
        (
            Limits {
                max_corners: 11,
                ..limits
            },
            "11 face corners",
        ),
        (
            Limits {
                max_depth: 3,
                ..limits
            },
            "3 levels of nesting",
        ),
        (
            Limits {
                max_memory: 1000,
                ..limits
            },
            "1000 bytes of memory",
        ),
    ] {
        let error = read(glb.as_slice(), None, &limits).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn many_names_of_little_end_soon() {
    // Each of many primitives has its own attribute at the same few vertices.
    let mut made = Made::default();
    let corners: Vec<f32> = (0..3 * 28u8).map(f32::from).collect();
    let positions = made.floats("VEC3", &corners);
    let other = made.floats("SCALAR", &[1.0; 28]);
    let triples = (0..28).flat_map(|a| (0..a).flat_map(move |b| (0..b).map(move |c| [a, b, c])));
    let primitives: Vec<Value> = triples
        .take(3000)
        .enumerate()
        .map(|(i, face)| {
            let attributes = json!({"POSITION": positions, format!("_{i}"): other});
            json!({"attributes": attributes, "indices": made.indices(&face)})
        })
        .collect();
    let glb = made.glb(&json!({"meshes": [{"primitives": primitives}]}));
    let clock = std::time::Instant::now();
    let mut document = super::made::open(&glb).unwrap();
    assert_eq!(document.attributes().unwrap().vertices.len(), 3000);
    document.set_position(0, [-1.0; 3].into()).unwrap();
    document.write(crate::Format::Glb).unwrap();
    assert!(clock.elapsed().as_secs() < 5);
    // The memory of thousands of empty nodes is counted before it is reserved.
    let nodes = vec![json!({}); 100_000];
    let glb = made.glb(&json!({"nodes": nodes}));
    let limits = Limits {
        max_memory: 10 << 20,
        ..Limits::default()
    };
    let error = read(glb, None, &limits).unwrap_err().to_string();
    assert!(error.contains("bytes of memory"), "{error}");
}
